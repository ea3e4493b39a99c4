"""Parametric structures: give a few lengths, get blocks and joints."""

from archfem.shapes.bridges import bridge as bridge
from archfem.shapes.parts import Arch as Arch
from archfem.shapes.parts import Backfill as Backfill
from archfem.shapes.parts import Paving as Paving
from archfem.shapes.parts import Pier as Pier
from archfem.shapes.parts import Sidewall as Sidewall
from archfem.shapes.rings import arch_on_piers as arch_on_piers
from archfem.shapes.rings import circular_arch as circular_arch
from archfem.shapes.rings import column as column
