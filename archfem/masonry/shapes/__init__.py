"""Parametric structures: give a few lengths, get blocks and joints."""

from archfem.masonry.shapes.bridges import bridge as bridge
from archfem.masonry.shapes.parts import Arch as Arch
from archfem.masonry.shapes.parts import Backfill as Backfill
from archfem.masonry.shapes.parts import Paving as Paving
from archfem.masonry.shapes.parts import Pier as Pier
from archfem.masonry.shapes.parts import Sidewall as Sidewall
from archfem.masonry.shapes.rings import arch_on_piers as arch_on_piers
from archfem.masonry.shapes.rings import circular_arch as circular_arch
from archfem.masonry.shapes.rings import column as column
