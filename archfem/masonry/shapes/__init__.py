"""Parametric structures: arches, columns, walls, arcades and bridges from a few lengths.

bridge_parts  Arch, Pier, Sidewall, Backfill, Paving
bridges       bridges and arcades, and their stonework
rings         rings, columns, arch on piers, polycentric curves
walls         walls in running bond, with openings and floors
"""

from archfem.masonry.shapes.bridge_parts import Arch as Arch
from archfem.masonry.shapes.bridge_parts import Backfill as Backfill
from archfem.masonry.shapes.bridge_parts import Paving as Paving
from archfem.masonry.shapes.bridge_parts import Pier as Pier
from archfem.masonry.shapes.bridge_parts import Sidewall as Sidewall
from archfem.masonry.shapes.bridges import arcade as arcade
from archfem.masonry.shapes.bridges import bridge as bridge
from archfem.masonry.shapes.bridges import buttressed_arch as buttressed_arch
from archfem.masonry.shapes.rings import arch_along as arch_along
from archfem.masonry.shapes.rings import arch_on_piers as arch_on_piers
from archfem.masonry.shapes.rings import circular_arch as circular_arch
from archfem.masonry.shapes.rings import column as column
from archfem.masonry.shapes.rings import elliptical_arch as elliptical_arch
from archfem.masonry.shapes.rings import flat_arch as flat_arch
from archfem.masonry.shapes.rings import pointed_arch as pointed_arch
from archfem.masonry.shapes.walls import Floor as Floor
from archfem.masonry.shapes.walls import Opening as Opening
from archfem.masonry.shapes.walls import wall as wall
