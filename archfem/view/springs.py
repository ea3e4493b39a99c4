"""Figures of the mesh of a model and the springs in its joints, and of their forces on a block."""

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from archfem._typing import Array, Numbers
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.quadrature import JointPoints
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium
from archfem.units import kN
from archfem.view import style
from archfem.view.statics import draw_block, draw_force, set_square_limits
from archfem.view.structure import block_colours
from archfem.view.style import Colour, Size


@validate_arguments
def draw_mesh(model: Model, block: int | str | None = None) -> Figure:
    """Draw the cells of all blocks, with the springs in joints that are drawn open.

    Above, the whole structure; below, a block and its neighbours at a larger scale. Each spring
    acts across and along its joint; exact joints are integrated between these points. The gaps are
    drawn alone: joints of the model have none.

    Args:
        model: a model of small displacements, of any fidelity but "monolithic".
        block: number or name of the block below; by default one in the middle of those assessed.

    Returns:
        The figure, with two panels.

    Raises:
        InvalidInput: the joints of the model have no springs at points.
        InvalidStructure: there is no such block.
    """
    points, structure = _joint_points(model), model.structure
    assessed = np.flatnonzero(structure.judged)
    middle = structure.joints[assessed[len(assessed) // 2]].lower
    number = middle if block is None else structure.block_number(block)
    wide, high = style.structure_figure(structure).get_size_inches()
    figure = style.new_figure(wide, high + 3.2)
    above, below = figure.subplots(2, 1, height_ratios=[high, 3.0])
    # at least 1.2 points on the page
    least = 1.2 / 72.0 / style.drawing_scale(structure)
    gap = max(least, 0.08 * float(np.median(structure.depths)))
    _draw_cells(above, model, _part_at_joints(model, gap))
    above.autoscale_view()
    count = len(model.cells.polygons)
    style.set_title(above, f"{structure.name}: {count} cells, {len(points.joint)} points in joints")
    joints = [k for k, joint in enumerate(structure.joints) if number in joint.blocks]
    outline = structure.blocks[number].drawn()
    gap = 0.1 * float(np.ptp(outline, axis=0).max())
    shifts = _part_at_joints(model, gap)
    _draw_cells(below, model, shifts)
    springs = _spring_lines(model, np.flatnonzero(np.isin(points.joint, joints)), shifts)
    look = {"colors": Colour.HINGE, "linewidths": 0.8, "zorder": 4, "gid": "springs"}
    look["label"] = "spring at a point of a joint"
    below.add_collection(LineCollection(list(springs), **look))
    (left, low), (right, top) = outline.min(axis=0), outline.max(axis=0)
    margin = 0.5 * max(right - left, top - low)
    below.set(xlim=(left - 2.5 * margin, right + 2.5 * margin), ylim=(low - margin, top + margin))
    name = structure.blocks[number].name
    style.set_title(below, f"{name}, joints drawn open by {1e3 * gap:.0f} mm")
    style.add_legend_below(figure)
    return figure


def _joint_points(model: Model) -> JointPoints:
    """Return the points of the joints of a model."""
    if model.operator is None:
        raise InvalidInput(
            f"joints of a model '{model.fidelity}' have no springs at points to draw: build it "
            'with another fidelity and displacements="small"'
        )
    return model.operator.points


def _part_at_joints(model: Model, gap: float) -> Array:
    """Return the displacements of the points of cells that open each joint by a gap (m, 2) [m]."""
    cells, structure, shifts = model.cells, model.structure, np.zeros_like(model.cells.places)
    # the normal points to the higher block
    for joint, normal in zip(structure.joints, structure.normals, strict=True):
        for number, sign in ((joint.lower, -1.0), (joint.higher, 1.0)):
            own = np.flatnonzero(cells.block == number)
            along = (cells.places[own] - joint.ends[0]) @ joint.tangent
            across = (cells.places[own] - joint.ends[0]) @ normal
            # relative to the depth: coordinates of meshes are rounded
            near = 1e-6 * joint.depth
            on = (np.abs(across) < near) & (along > -near) & (along < joint.depth + near)
            shifts[own[on]] += 0.5 * sign * gap * normal
    return shifts


def _draw_cells(axes: Axes, model: Model, shifts: Array) -> None:
    """Draw cells whose points are shifted (m, 2) [m], and supports."""
    style.style_length_axes(axes)
    cells, structure, places = model.cells, model.structure, model.cells.places + shifts
    colours = np.array(block_colours(structure))[cells.owner].tolist()
    corners = [places[polygon] for polygon in cells.polygons]
    style.add_polygons(axes, corners, colours, width=0.35, zorder=2, gid="cells")
    fixed = [block.drawn() for block in structure.blocks if block.fixed]
    look = {"hatch": "////", "label": "fixed support", "gid": "supports"}
    style.add_polygons(axes, fixed, Colour.SUPPORT, width=0.5, **look)


def _spring_places(model: Model, chosen: Numbers) -> Array:
    """Return places of some springs (k, 2) [m]."""
    points, structure = _joint_points(model), model.structure
    joint = points.joint[chosen]
    return structure.middles[joint] + points.offset[chosen, None] * structure.tangents[joint]


def _spring_lines(model: Model, chosen: Numbers, shifts: Array) -> Array:
    """Return the zigzag of each spring between its blocks, of shifted points (k, 8, 2) [m]."""
    cells, structure = model.cells, model.structure
    ends = np.repeat(_spring_places(model, chosen)[:, None], 2, axis=1)
    for number, joint in enumerate(_joint_points(model).joint[chosen]):
        for side, block in enumerate(structure.pairs[joint]):
            own = np.flatnonzero(cells.block == block)
            if len(own):  # supports have no cells, and stay in place
                away = np.linalg.norm(cells.places[own] - ends[number, side], axis=1)
                ends[number, side] += shifts[own[away.argmin()]]
    axis = ends[:, 1:] - ends[:, :1]
    across = np.stack([-axis[..., 1], axis[..., 0]], axis=-1)
    zigzag = 0.22 * np.array([0.0, 0.0, 1.0, -1.0, 1.0, -1.0, 0.0, 0.0])[:, None]
    return ends[:, :1] + np.linspace(0.0, 1.0, 8)[:, None] * axis + zigzag * across


@validate_arguments
def draw_spring_forces(dead: Equilibrium, block: int | str) -> Figure:
    """Draw the normal force of each spring around a block, as an arrow that ends at the spring.

    All arrows have one scale. Shear forces and the weight are left out, as in Figure 12 of
    Demirel and Aldemir (2021); `draw_free_body` has them. Open springs have no arrow.

    Args:
        dead: equilibrium of a model of small displacements, such as dead load.
        block: number or name of the block.

    Returns:
        The figure; its legend has the sum and the range of each joint.

    Raises:
        InvalidInput: the joints of the model have no springs at points, or none carries a force.
        InvalidStructure: there is no such block.
    """
    points, structure = _joint_points(dead.model), dead.model.structure
    assert dead.model.operator is not None  # checked with its points
    # tractions are positive in tension
    forces = 0.0 - dead.model.operator.point_forces(dead.q)[0]
    number = structure.block_number(block)
    joints = [k for k, joint in enumerate(structure.joints) if number in joint.blocks]
    largest = float(np.abs(forces[np.isin(points.joint, joints)]).max(initial=0.0))
    if largest == 0.0:
        raise InvalidInput(f"no spring at '{structure.blocks[number].name}' carries a force")
    figure = style.new_figure(Size.COLUMN, 3.6 + 0.18 * len(joints))
    axes = figure.add_subplot()
    drawn = [draw_block(axes, structure, number, joints)]
    # the largest force is drawn half as long as the block
    length = 0.5 * float(np.ptp(drawn[0], axis=0).max()) / largest
    for colour, k in zip(cycle(Colour.LINES), joints):
        own, joint = np.flatnonzero(points.joint == k), structure.joints[k]
        # a joint pushes its higher block along the normal, its lower one against it
        push = structure.normals[k] if joint.higher == number else -structure.normals[k]
        heads, springs = _spring_places(dead.model, own), forces[own]
        tails = heads - length * springs[:, None] * push
        for place in np.flatnonzero(springs):
            draw_force(axes, tails[place], heads[place], colour)
        low, high = np.sort(springs)[[0, -1]] / kN
        text = f"{springs.sum() / kN:.1f} kN by {len(own)} springs of {low:.1f} to {high:.1f} kN"
        axes.plot([], [], color=colour, lw=1.4, label=f"{joint.name}: {text}")
        drawn.append(tails)
    set_square_limits(axes, np.concatenate(drawn))
    style.add_legend_below(figure, 1)
    return figure
