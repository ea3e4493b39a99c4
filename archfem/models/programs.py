"""Structures as input of other programs: OpenSees in Python, and geometry of 3DEC and UDEC."""

from pathlib import Path

import numpy as np

from archfem._files import atomic_write
from archfem._typing import Array
from archfem._validation import check_choice, check_integer, validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.quadrature import Quadrature
from archfem.masonry.block import Block
from archfem.masonry.structure import Structure
from archfem.units import G

# A corner of a polyhedron [m]
Corner = tuple[float, float, float]

# The script of OpenSees
OPENSEES = Path(__file__).with_name("templates") / "opensees.template"


@validate_arguments
def write_model(structure: Structure, path: str | Path, *, points: int = 5) -> Path:
    """Write a structure as input of another program, by the suffix of the file.

    *.py is a script of OpenSeesPy: rigid blocks, joints without tension and with Coulomb friction,
    self-weight. Its `build` and `load_dead` can be imported, to be followed by a motion. *.3ddat
    has the commands of 3DEC 7 for the geometry: blocks of the width, with z upwards, in groups by
    their parts, supports fixed; arcs become chords. *.dat has those of UDEC 7: blocks in the plane,
    1 m thick. Supports of UDEC, densities, stiffness and friction are there in comments.

    Args:
        structure: dry, with joints that close linearly.
        path: path of the file, .py, .3ddat or .dat.
        points: springs of each joint for OpenSees, at Lobatto's points, 2 to 16.

    Returns:
        The file.

    Raises:
        InvalidInput: the suffix is another; joints have cohesion, tension, dilatancy, closure or a
            law of the user; or 3DEC or UDEC would get a block that is not convex.
    """
    path = Path(path)
    writers = {
        ".py": lambda: _write_opensees(structure, points),
        ".3ddat": lambda: _write_3dec(structure),
        ".dat": lambda: _write_udec(structure),
    }
    check_choice(path.suffix, "suffix of the file", list(writers))
    check_integer(points, "points", minimum=2, maximum=16)
    for joint in structure.joints:
        for key in ("cohesion", "dilatancy", "tension", "closure", "law"):
            if value := getattr(joint.contact, key):
                raise InvalidInput(
                    f"joint '{joint.name}' has {key} = {value!r}, which files for other programs "
                    "do not carry: give a dry joint that closes linearly"
                )
    text = writers[path.suffix]()
    with atomic_write(path) as draft:
        draft.write_text(text, encoding="utf-8")
    return path


def _write_opensees(structure: Structure, points: int) -> str:
    """Return the script of OpenSees."""
    springs = []
    places, weights = Quadrature("lobatto", points).on_facet(1)
    for joint, normal in zip(structure.joints, structure.normals, strict=True):
        contact = joint.contact
        friction = contact.friction if contact.slides else None
        for place, weight in zip(places, weights, strict=True):
            x, y = joint.middle + (place - 0.5) * joint.depth * joint.tangent
            area = float(weight) * joint.depth * structure.width
            stiffness = contact.normal_stiffness * area, contact.shear_stiffness * area
            ends = joint.lower + 1, joint.higher + 1
            springs.append((*ends, *map(float, (x, y, *normal, *stiffness)), friction))
    blocks = []
    for block in structure.blocks:
        density = structure.density(block) * structure.width
        numbers = *block.centroid, density * block.area, density * block.polar_moment
        blocks.append((*map(float, numbers), block.fixed))
    return OPENSEES.read_text(encoding="utf-8").format(
        # of the docstring of the script
        name=structure.name.replace("\\", "/").replace('"', "'"),
        blocks=len(blocks),
        joints=len(structure.joints),
        block_rows="\n".join(f"    {row!r}," for row in blocks),
        spring_rows="\n".join(f"    {row!r}," for row in springs),
        gravity=G,
    )


def _write_3dec(structure: Structure) -> str:
    """Return the commands of 3DEC."""
    lines = _begin_commands(structure, "elevation in x and z, width along y")
    for block in structure.blocks:
        group = "supports" if block.fixed else block.part or "blocks"
        lines.append(f"; {block.name}: {block.material.name}, {structure.density(block):g} kg/m3")
        faces = _polyhedron(block, structure.width)
        vertices = (" ".join(",".join(f"{v:.9g}" for v in p) for p in face) for face in faces)
        command = "block create polyhedron group '{}' ...\n{}"
        body = " ...\n".join(f"  face {each}" for each in vertices)
        lines.append(command.format(group.replace("'", ""), body))
    lines.append("block fix range group 'supports'")
    return "\n".join(lines) + "\n"


def _write_udec(structure: Structure) -> str:
    """Return the commands of UDEC."""
    lines = _begin_commands(structure, "1 m thick")
    outlines = [_convex_outline(block) for block in structure.blocks]
    edges = [np.diff(points, axis=0, append=points[:1]) for points in outlines]
    # the manual recommends one per cent of an edge; the default of 0.5 m rounds stones off
    length = 0.01 * min(float(np.linalg.norm(each, axis=1).min()) for each in edges)
    lines.append(f"block tolerance corner-round-length {length:.6g}")
    for block, points in zip(structure.blocks, outlines, strict=True):
        support = ", a support: fix it" if block.fixed else ""
        density = f"{structure.density(block):g} kg/m3{support}"
        lines.append(f"; {block.name}: {block.material.name}, {density}")
        # clockwise
        corners = " ".join(f"{x:.9g},{y:.9g}" for x, y in points[::-1])
        lines.append(f"block create polygon {corners}")
    return "\n".join(lines) + "\n"


def _begin_commands(structure: Structure, axes: str) -> list[str]:
    """Return the first lines of commands of Itasca's programs."""
    contacts = {joint.contact for joint in structure.joints}
    return [
        f"; {structure.name}: written by archfem, in m; {axes}",
        *sorted(
            f"; contact '{each.name}': normal {each.normal_stiffness:g} Pa/m, shear "
            f"{each.shear_stiffness:g} Pa/m, friction coefficient {each.friction:g}"
            for each in contacts
        ),
        "model new",
    ]


def _convex_outline(block: Block) -> Array:
    """Return the corners of a block (n, 2), anticlockwise, if it is convex."""
    points: Array = block.points
    edges = np.roll(points, -1, axis=0) - points
    after = np.roll(edges, -1, axis=0)
    if np.any(edges[:, 0] * after[:, 1] < edges[:, 1] * after[:, 0] - 1e-9 * block.area):
        raise InvalidInput(
            f"block '{block.name}' is not convex, and blocks of 3DEC and UDEC are: divide it"
        )
    return points


def _polyhedron(block: Block, width: float) -> list[list[Corner]]:
    """Return the faces of a block, each clockwise as it is seen from outside."""
    points = _convex_outline(block)
    front, back = ([(float(x), y, float(z)) for x, z in points] for y in (0.0, width))
    pairs = list(zip(front, back, strict=True))
    sides = zip(pairs, [*pairs[1:], pairs[0]], strict=True)
    # the elevation is seen from y < 0, where its outline is anticlockwise
    return [front[::-1], back, *([a, b, d, c] for (a, c), (b, d) in sides)]
