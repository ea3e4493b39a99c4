"""Stress against closed forms, a finer mesh, and the resultants it must agree with."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy import sparse
from scipy.integrate import trapezoid

from archfem.cases.case import Case
from archfem.dynamics.ladder import build
from archfem.errors import InvalidInput
from archfem.joints.resultants import joint_dataset
from archfem.masonry.actions import BodyForce
from archfem.masonry.materials import BACKFILL, STONE
from archfem.masonry.shapes import column
from archfem.models.cells import Cells
from archfem.statics.equilibrium import dead_load, equilibrium
from archfem.statics.strength import (
    joint_stress,
    strength_use,
    strength_use_over,
    use_sentence,
    use_table,
    utilisation,
    utilisation_sentence,
)
from archfem.statics.stress import at_corners, principal
from archfem.units import MPa
from archfem.view.stress import draw_stress

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


@pytest.fixture(scope="module")
def dead(ring_model):
    return dead_load(ring_model)


def one_cell(stack, stress):
    """A model of one square cell, whose only coordinate is a factor on a stress."""
    block = np.full(4, stack.free[0])
    column = sparse.csr_matrix(np.reshape(stress, (3, 1)))
    cells = Cells(np.array(SQUARE), block, (np.arange(4),), sparse.csr_matrix((8, 1)), column)
    return SimpleNamespace(structure=stack, size=1, cells=cells)


@pytest.mark.parametrize("angle", [-80.0, -30.0, 0.0, 20.0, 65.0])
def test_principal_stresses_are_those_that_were_turned(stack, angle):
    """σ = R diag(s1, s2) Rᵀ must give s1, s2 and the turn back."""
    turn = np.radians(angle)
    first, second = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    stress = 0.3 * MPa * np.outer(first, first) - 2.0 * MPa * np.outer(second, second)
    found = principal(one_cell(stack, stress[[0, 1, 0], [0, 1, 1]]), np.ones(1))
    assert found["s1"].values == pytest.approx([0.3 * MPa])
    assert found["s2"].values == pytest.approx([-2.0 * MPa])
    assert found["angle"].values == pytest.approx([turn])
    assert [*found["x"].values, *found["y"].values] == [0.5, 0.5]
    assert found["name"].values.tolist() == ["block 1"]


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_a_linear_stress_is_recovered_exactly_at_corners(ring, cell):
    """Any plane through the centres, on distorted cells, and never across a joint."""
    cells = build(ring, fidelity="full", cells=(4, 3), cell=cell).cells
    centre = np.array([cells.places[c].mean(axis=0) for c in cells.polygons])
    slope = np.array([[1.0, 2.0], [-3.0, 0.5], [0.7, -1.1]])
    step = np.sin(cells.block)[:, None]  # a jump from each block to the next
    own = replace(cells, stress=sparse.identity(3 * len(centre), format="csr"))
    at_centres = centre @ slope.T + np.sin(cells.owner)[:, None]
    found = (at_corners(own) @ at_centres.ravel()).reshape(-1, 3)
    assert found == pytest.approx(cells.places @ slope.T + step, abs=1e-9)


def test_a_column_presses_with_the_weight_above():
    """Without lateral strain the exact stress is γ z: at centres, and at the base of each block."""
    pillar = column(
        breadth=1.0, heights=[1.0, 1.0], material=replace(STONE, poisson=0.0), width=2.0
    )
    model = build(pillar, fidelity="full", cells=(4, 4))
    q = dead_load(model).q
    found = principal(model, q)
    exact = -STONE.unit_weight * (2.0 - found["y"].values)
    assert found["s2"].values == pytest.approx(exact, rel=1e-6)
    assert np.abs(found["s1"].values).max() < 1e-6 * np.abs(exact).max()
    use = strength_use(model, q)
    assert use["compression"].values == pytest.approx(STONE.unit_weight * np.array([2.0, 1.0]))
    assert use["use"].values == pytest.approx(use["compression"].values / (56.0 * MPa))


def test_corners_tell_the_peak_where_centres_miss_it(ring, ring_model, dead):
    """Against 16 × 16 cells, 4 × 4 centres are 13 % short of the peak, corners 3 %."""
    fine = build(ring, fidelity="full", cells=(16, 16))
    exact = float(strength_use(fine, dead_load(fine).q)["compression"].max())
    corners = float(strength_use(ring_model, dead.q)["compression"].max())
    centres = -float(principal(ring_model, dead.q)["s2"].min())
    assert abs(corners / exact - 1.0) < 0.04
    assert abs(centres / exact - 1.0) > 0.12


@pytest.mark.parametrize("rung", ["faces", "condensed"])
def test_reduced_models_recover_stress(ring, ring_model, dead, rung):
    """Their peak is within 4 % of that with all nodes; a block's peak within 13 %."""
    model = build(ring, fidelity=rung, cells=(4, 4))
    found = strength_use(model, dead_load(model).q)["compression"]
    whole = strength_use(ring_model, dead.q)["compression"]
    assert float(found.max()) == pytest.approx(float(whole.max()), rel=0.04)
    assert found.values == pytest.approx(whole.values, rel=0.13)


def test_joints_and_fields_agree_on_the_strength_used(ring):
    """Away from the corners at the springings, where the linear traction is not all: 5 %."""
    model = build(ring, fidelity="full", cells=(8, 8))
    dead = dead_load(model)
    by_field = strength_use(model, dead.q)["use"].values
    by_joint = utilisation(ring, dead.joints).values
    worse = np.maximum(by_joint[:-1], by_joint[1:])  # of the two joints of each voussoir
    assert by_field[1:-1] == pytest.approx(worse[1:-1], rel=0.05)
    assert by_field == pytest.approx(worse, rel=0.08)


def of_eccentricity(structure, e, normal=2.0e5):
    """All joints alike."""
    moment = [normal * e * joint.depth for joint in structure.joints]
    rows = np.column_stack([np.full(len(moment), normal), np.zeros(len(moment)), moment])
    return joint_dataset(structure, rows)


@pytest.mark.parametrize("e", [0.0, 0.05, -0.1, 1.0 / 6.0, 0.2, -0.3, 0.45])
def test_edge_stress_is_that_of_a_linear_traction_with_the_same_resultant(stack, e):
    """Integrate the trapezium or triangle with this edge stress: N and N e h must come back."""
    edge = float(joint_stress(stack, of_eccentricity(stack, e))[0])
    reach = min(3.0 * (0.5 - abs(e)), 1.0)  # of the joint, 1 m deep, that is pressed
    low = 0.0 if reach < 1.0 else edge * (1.0 - 6.0 * abs(e)) / (1.0 + 6.0 * abs(e))
    r = np.linspace(0.5 - reach, 0.5, 20001)
    traction = np.interp(r, [0.5 - reach, 0.5], [low, edge])
    assert trapezoid(traction, r) == pytest.approx(2.0e5, rel=1e-6)
    assert trapezoid(traction * r, r) == pytest.approx(2.0e5 * abs(e), rel=1e-6, abs=1e-3)


def test_an_open_joint_has_no_stress_and_a_line_contact_no_bound(stack):
    assert joint_stress(stack, of_eccentricity(stack, 0.0, normal=0.0)).values.tolist() == [0.0] * 2
    assert np.isinf(joint_stress(stack, of_eccentricity(stack, 0.5)).values).all()


def test_utilisation_follows_time_and_the_weaker_block(stack):
    weak = replace(STONE, strength=1.0 * MPa)
    blocks = (*stack.blocks[:2], replace(stack.blocks[2], material=weak))
    mixed = replace(stack, blocks=blocks)
    rows = np.zeros((3, 2, 3))
    rows[..., 0] = np.array([1.0, 2.0, 0.0])[:, None] * 1e5
    found = utilisation(mixed, joint_dataset(mixed, rows, np.arange(3.0)))
    assert found.dims == ("time", "joint")
    assert found.values[:, 0] == pytest.approx(np.array([0.1, 0.2, 0.0]) / 56.0)
    assert found.values[:, 1] == pytest.approx([0.1, 0.2, 0.0])


def test_the_gravest_joint_of_a_run_is_named_but_not_a_hinge(stack):
    """Joint 1 peaks at 0.5 s; joint 0 presses harder at 1 s, but hinges then."""
    rows = np.zeros((3, 2, 3))
    rows[..., 0] = [[1e5, 1e5], [1e5, 5.6e5], [9e5, 1e5]]
    rows[2, 0, 2] = 0.47 * 9e5
    joints = joint_dataset(stack, rows, np.array([0.0, 0.5, 1.0]))
    assert utilisation_sentence(stack, joints) == (
        "largest compression at the edge of a joint that does not hinge: 0.560 MPa, "
        "1.00% of strength, in joint 1 at 0.500 s"
    )
    still = joint_dataset(stack, 0.0 * rows, np.array([0.0, 0.5, 1.0]))
    assert utilisation_sentence(stack, still).startswith("no use of strength is known")


def test_near_a_hinge_the_edge_stress_is_nearer_than_a_coarse_field(ring, ring_model):
    """Pushed sideways to |e| = 0.40: 5 % above 16 × 16 cells, where 4 × 4 are 18 % below."""
    fields, edges = [], []
    for model in (ring_model, build(ring, fidelity="full", cells=(16, 16))):
        state = equilibrium(model, model.load(BodyForce(0.27, -1.0)))
        assert abs(state.joints["eccentricity"]).max() == pytest.approx(0.395, abs=0.002)
        fields.append(float(strength_use(model, state.q)["compression"].max()))
        edges.append(float(joint_stress(ring, state.joints).max()))
    assert np.array(edges) / fields[1] == pytest.approx(1.05, abs=0.015)
    assert fields[0] / fields[1] == pytest.approx(0.82, abs=0.02)


def test_what_strength_is_unknown_is_not_used(stack):
    soil = replace(stack, blocks=tuple(replace(b, material=BACKFILL) for b in stack.blocks))
    assert np.isnan(utilisation(soil, of_eccentricity(soil, 0.0)).values).all()
    use = strength_use(one_cell(soil, [-3e4, 2e4, 0.0]), np.ones(1))
    assert np.isnan(use["use"].values).all()
    assert "strength" not in use_sentence(use)
    assert "-" in use_table(use).splitlines()[1]


def test_tension_and_compression_are_told_by_part(stack):
    use = strength_use(one_cell(stack, [-2.8 * MPa, 0.014 * MPa, 0.0]), np.ones(1))
    assert use["compression"].values.tolist() == [2.8 * MPa, 0.0]
    assert use["tension"].values == pytest.approx([0.014 * MPa, 0.0])
    assert use_sentence(use) == (
        "largest compression 2.800 MPa in column, block 1 (5.00% of strength 56 MPa), "
        "largest tension 0.014 MPa in column, block 1"
    )
    line = use_table(use).splitlines()[1].split("  ")
    assert [cell.strip() for cell in line if cell.strip()] == [
        "column", "2.800 MPa", "block 1", "5.00%", "0.014 MPa", "block 1",
    ]  # fmt: skip


def test_a_run_gives_the_largest_of_all_instants(ring_model, dead):
    """The dead load scaled in time: the peak is that of the largest factor, at its time."""
    factors = np.array([1.0, 2.5, 0.5])
    dataset = xr.Dataset(
        {"q": (("frame", "coordinate"), factors[:, None] * dead.q)},
        {"frame_time": ("frame", [0.0, 0.1, 0.2])},
    )
    found = strength_use_over(ring_model, dataset)
    still = strength_use(ring_model, dead.q)
    for key in ("compression", "tension", "use"):
        assert found[key].values == pytest.approx(2.5 * still[key].values)
    assert set(found["compression_time"].values) == {0.1}


def test_what_has_no_field_is_refused(ring, ring_model, dead):
    rigid = build(ring, fidelity="rigid")
    for ask in (principal, strength_use):
        with pytest.raises(InvalidInput, match=r"rigid blocks .*fidelity='faces'.*joint_stress"):
            ask(rigid, np.zeros(rigid.size))
        with pytest.raises(InvalidInput, match=r"shape \(3,\), the model 850 coordinates"):
            ask(ring_model, np.zeros(3))
    with pytest.raises(InvalidInput, match=r"no fields.*fields_every.*utilisation"):
        strength_use_over(ring_model, dead.joints)


def named(figure, name):
    """The one thing of a figure that is called so."""
    found = figure.findobj(lambda artist: artist.get_gid() == name)
    return found[0] if found else None


def test_the_map_shows_compression_at_corners_with_thrust_line_and_crosses(ring_model, dead):
    figure = draw_stress(ring_model, dead.q)
    shown = named(figure, "compression").get_array() * MPa
    assert shown.max() == pytest.approx(
        float(strength_use(ring_model, dead.q)["compression"].max())
    )
    assert shown.min() >= 0.0
    bar = figure.axes[0].child_axes[0]
    assert bar.get_ylabel() == "largest compression [MPa]"
    assert named(figure, "thrust").get_xydata().shape == (18, 2)
    crosses = figure.axes[0].findobj(lambda artist: artist.get_label() == "compression")[0]
    directions = np.diff(np.array(crosses.get_segments()), axis=1)[:, 0]
    middles = np.array(crosses.get_segments()).mean(axis=1)
    radial = np.abs(np.sum(directions * middles, axis=1))
    apart = np.linalg.norm(directions, axis=1) * np.linalg.norm(middles, axis=1)
    assert np.median(radial / apart) < 0.2  # compression follows the ring


def test_the_map_of_one_part_has_its_own_scale():
    """Soil is left out unless it is asked for; there stresses are kPa."""
    bridge = Case.read(Path(__file__).parents[2] / "meshes" / "prusias.toml").structure
    model = build(bridge, fidelity="full")
    q = dead_load(model).q
    labels = [
        draw_stress(model, q, parts=parts).axes[0].child_axes[0].get_ylabel()
        for parts in (None, ["backfill"])
    ]
    assert labels == ["largest compression [MPa]", "largest compression [kPa]"]
    with pytest.raises(InvalidInput, match=r"parts \['deck'\] cannot be shaded: .*'backfill'"):
        draw_stress(model, q, parts=["deck"])
