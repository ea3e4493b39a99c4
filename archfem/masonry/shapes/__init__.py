"""Parametric structures: give a few lengths, get blocks and joints."""

from archfem.masonry.shapes.arcades import arcade as arcade
from archfem.masonry.shapes.arcades import buttressed_arch as buttressed_arch
from archfem.masonry.shapes.bridges import bridge as bridge
from archfem.masonry.shapes.curves import arch_along as arch_along
from archfem.masonry.shapes.curves import elliptical_arch as elliptical_arch
from archfem.masonry.shapes.curves import flat_arch as flat_arch
from archfem.masonry.shapes.curves import pointed_arch as pointed_arch
from archfem.masonry.shapes.parts import Arch as Arch
from archfem.masonry.shapes.parts import Backfill as Backfill
from archfem.masonry.shapes.parts import Paving as Paving
from archfem.masonry.shapes.parts import Pier as Pier
from archfem.masonry.shapes.parts import Sidewall as Sidewall
from archfem.masonry.shapes.rings import arch_on_piers as arch_on_piers
from archfem.masonry.shapes.rings import circular_arch as circular_arch
from archfem.masonry.shapes.rings import column as column
