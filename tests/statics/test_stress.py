"""Stress and use of strength against closed forms, finer meshes and joint resultants."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from cells import one_cell
from glued import glued
from scipy import sparse
from scipy.integrate import trapezoid

import archfem as af
from archfem.statics import (
    joint_stress,
    principal_stresses,
    strength_use,
    strength_use_over,
    strength_use_table,
    utilisation,
)
from archfem.statics.stress import (
    _fit_planes,
    corner_stress_operator,
    observe_fill_tension,
    strength_use_text,
    utilisation_text,
)


@pytest.mark.parametrize("angle", [-80.0, -30.0, 0.0, 20.0, 65.0])
def test_principal_stresses_are_those_that_were_turned(stack, angle):
    """σ = R diag(s1, s2) Rᵀ must give s1, s2 and the turn back."""
    turn = np.radians(angle)
    first, second = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    stress = 0.3 * af.units.MPa * np.outer(first, first) - 2.0 * af.units.MPa * np.outer(
        second, second
    )
    found = principal_stresses(one_cell(stack, stress[[0, 1, 0], [0, 1, 1]]), np.ones(1))
    assert found["s1"].values == pytest.approx([0.3 * af.units.MPa])
    assert found["s2"].values == pytest.approx([-2.0 * af.units.MPa])
    assert found["angle"].values == pytest.approx([turn])
    assert [*found["x"].values, *found["y"].values] == [0.5, 0.5]
    assert found["name"].values.tolist() == ["block 1"]


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_a_linear_stress_is_recovered_exactly_at_corners(ring, cell):
    """Any plane through the centres, on distorted cells, and never across a joint."""
    cells = af.build(ring, fidelity="full", cells=(4, 3), cell=cell).cells
    centre = np.array([cells.places[c].mean(axis=0) for c in cells.polygons])
    slope = np.array([[1.0, 2.0], [-3.0, 0.5], [0.7, -1.1]])
    step = np.sin(cells.block)[:, None]  # a jump from each block to the next
    own = replace(cells, stress=sparse.identity(3 * len(centre), format="csr"))
    at_centres = centre @ slope.T + np.sin(cells.owner)[:, None]
    found = (corner_stress_operator(own) @ at_centres.ravel()).reshape(-1, 3)
    assert found == pytest.approx(cells.places @ slope.T + step, abs=1e-9)


def test_a_corner_takes_in_neighbours_where_fewer_than_four_cells_meet():
    """Inside a stone of 4 by 4 cells exactly four do; at its faces two, at its corners one."""
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="full", cells=(4, 4))
    cells, fit = model.cells, _fit_planes(model.cells)
    meet = np.bincount(np.concatenate(cells.polygons), minlength=len(cells.places))
    taken = np.diff(fit.indptr)
    assert sorted(set(meet.tolist())) == [1, 2, 4]
    assert (taken[meet == 4] == 4).all()
    assert set(taken[meet == 2].tolist()) == {6, 8}  # less beside a corner
    assert (taken[meet == 1] == 4).all()


@pytest.fixture(scope="module")
def dead(ring_model):
    return af.dead_load(ring_model)


def test_a_column_presses_with_the_weight_above():
    """Without lateral strain the exact stress is γ z: at centres, and at the base of each block."""
    pillar = af.column(
        breadth=1.0, heights=[1.0, 1.0], material=replace(af.STONE, poisson=0.0), width=2.0
    )
    model = af.build(pillar, fidelity="full", cells=(4, 4))
    q = af.dead_load(model).q
    found = af.statics.principal_stresses(model, q)
    exact = -af.STONE.unit_weight * (2.0 - found["y"].values)
    assert found["s2"].values == pytest.approx(exact, rel=1e-6)
    assert np.abs(found["s1"].values).max() < 1e-6 * np.abs(exact).max()
    use = strength_use(model, q)
    assert use["compression"].values == pytest.approx(af.STONE.unit_weight * np.array([2.0, 1.0]))
    assert use["use"].values == pytest.approx(use["compression"].values / (56.0 * af.units.MPa))


@pytest.mark.slow
def test_corners_have_the_peak_where_centres_miss_it(ring, ring_model, dead):
    """Against 16 × 16 cells, 4 × 4 centres are 13 % short of the peak, corners 3 %."""
    fine = af.build(ring, fidelity="full", cells=(16, 16))
    exact = float(strength_use(fine, af.dead_load(fine).q)["compression"].max())
    corners = float(strength_use(ring_model, dead.q)["compression"].max())
    centres = -float(af.statics.principal_stresses(ring_model, dead.q)["s2"].min())
    assert abs(corners / exact - 1.0) < 0.04
    assert abs(centres / exact - 1.0) > 0.12


@pytest.mark.parametrize("fidelity", [pytest.param("faces", marks=pytest.mark.slow), "condensed"])
def test_reduced_models_recover_stress(ring, ring_model, dead, fidelity):
    """Their peak is within 4 % of that with all nodes; a block's peak within 13 %."""
    model = af.build(ring, fidelity=fidelity, cells=(4, 4))
    found = strength_use(model, af.dead_load(model).q)["compression"]
    whole = strength_use(ring_model, dead.q)["compression"]
    assert float(found.max()) == pytest.approx(float(whole.max()), rel=0.04)
    assert found.values == pytest.approx(whole.values, rel=0.13)


def test_joints_and_fields_agree_on_the_strength_used(ring):
    """Away from the corners at the springings, where the linear traction is not all: 5 %."""
    model = af.build(ring, fidelity="full", cells=(8, 8))
    dead = af.dead_load(model)
    by_field = strength_use(model, dead.q)["use"].values
    by_joint = utilisation(ring, dead.joints).values
    worse = np.maximum(by_joint[:-1], by_joint[1:])  # of the two joints of each voussoir
    assert by_field[1:-1] == pytest.approx(worse[1:-1], rel=0.05)
    assert by_field == pytest.approx(worse, rel=0.08)


def of_eccentricity(structure, e, normal=2.0e5):
    """The same in all joints."""
    moment = [normal * e * joint.depth for joint in structure.joints]
    rows = np.column_stack([np.full(len(moment), normal), np.zeros(len(moment)), moment])
    return af.joints.joint_dataset(structure, rows)


@pytest.mark.parametrize("e", [0.0, 0.05, -0.1, 0.16, 1.0 / 6.0, -0.175, 0.2, -0.3, 0.45])
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
    light = joint_stress(stack, of_eccentricity(stack, 0.0, normal=0.05))
    assert light.values == pytest.approx(0.05)


def test_utilisation_follows_time_and_the_weaker_block(stack):
    weak = replace(af.STONE, strength=1.0 * af.units.MPa)
    blocks = (*stack.blocks[:2], replace(stack.blocks[2], material=weak))
    mixed = replace(stack, blocks=blocks)
    rows = np.zeros((3, 2, 3))
    rows[..., 0] = np.array([1.0, 2.0, 0.0])[:, None] * 1e5
    found = utilisation(mixed, af.joints.joint_dataset(mixed, rows, np.arange(3.0)))
    assert found.dims == ("time", "joint")
    assert found.values[:, 0] == pytest.approx(np.array([0.1, 0.2, 0.0]) / 56.0)
    assert found.values[:, 1] == pytest.approx([0.1, 0.2, 0.0])


def of_strength(structure, strength):
    """The structure with stones of another strength [Pa]."""
    blocks = (
        replace(each, material=replace(each.material, strength=strength))
        for each in structure.blocks
    )
    return replace(structure, blocks=tuple(blocks))


def test_the_most_loaded_joint_of_a_run_is_named_but_not_a_hinge(stack):
    """Joint 1 peaks at 0.5 s; joint 0 presses harder at 1 s, but hinges then."""
    rows = np.zeros((3, 2, 3))
    rows[..., 0] = [[1e5, 1e5], [1e5, 5.6e5], [9e5, 1e5]]
    rows[2, 0, 2] = 0.47 * 9e5
    joints = af.joints.joint_dataset(stack, rows, np.array([0.0, 0.5, 1.0]))
    begin = "largest compression at the edge of a joint that does not hinge: 0.560 MPa, "
    end = "in joint 1 at 0.500 s; at hinges it is not computed"
    # that of the preset is nobody's
    assert utilisation_text(stack, joints) == begin + end
    given = f"{begin}2.00% of the stones' strength, 28 MPa, {end}"
    assert utilisation_text(of_strength(stack, 28e6), joints) == given
    rows[2, 0, 2] = 0.0
    flat = af.joints.joint_dataset(stack, rows, np.array([0.0, 0.5, 1.0]))
    assert utilisation_text(stack, flat).endswith("in joint 0 at 1.000 s")
    still = af.joints.joint_dataset(stack, 0.0 * rows, np.array([0.0, 0.5, 1.0]))
    assert utilisation_text(stack, still).startswith("no use of strength is known")


@pytest.mark.parametrize(("step", "again"), [(0, 8300), (8300, 0)])
def test_the_most_loaded_joint_of_a_long_run_is_found(stack, step, again):
    """Records are looked at 8192 at a time; joint 1 is pressed hardest once, and joint 0 is not."""
    rows = np.zeros((8301, 2, 3))
    rows[..., 0] = 1e5
    rows[again, 0, 0], rows[step, 1, 0] = 4e5, 5.6e5
    joints = af.joints.joint_dataset(stack, rows, 0.01 * np.arange(8301))
    assert utilisation_text(of_strength(stack, 28e6), joints).endswith(
        f"0.560 MPa, 2.00% of the stones' strength, 28 MPa, in joint 1 at {0.01 * step:.3f} s"
    )


def pushed_sideways(structure, cells, eccentricity):
    """Largest compression in a ring near a hinge, of the field and at the joints' edges [Pa]."""
    model = af.build(structure, fidelity="full", cells=(cells, cells))
    state = af.statics.equilibrium_under(model, model.load(af.BodyForce(0.27, -1.0)))
    assert abs(state.joints["eccentricity"]).max() == pytest.approx(eccentricity, abs=0.002)
    field = float(strength_use(model, state.q)["compression"].max())
    return field, float(joint_stress(structure, state.joints).max())


@pytest.mark.slow
def test_near_a_hinge_the_edge_stress_is_nearer_than_a_coarse_field(ring):
    """Pushed to |e| = 0.40: 5 % above 16 × 16 cells, where 4 × 4 are 18 % below."""
    fields, edges = zip(*(pushed_sideways(glued(ring), n, 0.395) for n in (4, 16)), strict=True)
    assert np.array(edges) / fields[1] == pytest.approx(1.05, abs=0.015)
    assert fields[0] / fields[1] == pytest.approx(0.82, abs=0.02)


@pytest.mark.slow
def test_where_edges_of_joints_slide_the_field_tends_to_the_same_share_of_the_edge_stress(ring):
    """It converges by the first order of the cells' size only: 4 × 4 are 21 % below."""
    coarse, field, fine = (pushed_sideways(ring, n, 0.399) for n in (4, 8, 16))
    assert (fine[0] - field[0]) / (field[0] - coarse[0]) == pytest.approx(0.5, abs=0.03)
    converged = 2.0 * fine[0] - field[0]
    assert fine[1] / converged == pytest.approx(1.05, abs=0.015)
    assert coarse[0] / converged == pytest.approx(0.79, abs=0.02)


def test_the_use_of_an_unknown_strength_is_no_number(stack):
    soil = replace(
        stack, blocks=tuple(replace(b, material=af.masonry.BACKFILL) for b in stack.blocks)
    )
    assert np.isnan(utilisation(soil, of_eccentricity(soil, 0.0)).values).all()
    use = strength_use(one_cell(soil, [-3e4, 2e4, 0.0]), np.ones(1))
    assert np.isnan(use["use"].values).all()
    assert "strength" not in strength_use_text(use)
    assert "-" in strength_use_table(use).splitlines()[1]


@pytest.mark.parametrize(
    ("part", "label"), [("", "block 1"), ("block", "block 1"), ("pier", "pier, block 1")]
)
def test_a_block_is_named_with_its_part(stack, part, label):
    """Unless its name begins with that."""
    use = strength_use(one_cell(of_strength(stack, 28e6), [-3e6, 2e4, 0.0]), np.ones(1))
    text = strength_use_text(use.assign_coords(part=("block", [part, part])))
    assert text.startswith(f"largest compression 3.000 MPa in {label} (")
    assert text.endswith(f"largest tension 0.020 MPa in {label}")


def test_tension_and_compression_are_reported_by_part(stack):
    state = [-2.8 * af.units.MPa, 0.014 * af.units.MPa, 0.0]
    use = strength_use(one_cell(of_strength(stack, 28e6), state), np.ones(1))
    nan = np.nan  # of the block without a cell
    assert use["compression"].values == pytest.approx([2.8 * af.units.MPa, nan], nan_ok=True)
    assert use["tension"].values == pytest.approx([0.014 * af.units.MPa, nan], nan_ok=True)
    assert strength_use_text(use) == (
        "largest compression 2.800 MPa in column, block 1 (10.00% of the stones' strength, 28 "
        "MPa), largest tension 0.014 MPa in column, block 1"
    )
    line = strength_use_table(use).splitlines()[1].split("  ")
    assert [cell.strip() for cell in line if cell.strip()] == [
        "column", "2.800 MPa", "block 1", "10.00%", "0.014 MPa", "block 1",
    ]  # fmt: skip
    # of the preset's strength, which nobody gave, there is no share
    use = strength_use(one_cell(stack, state), np.ones(1))
    assert strength_use_text(use).startswith("largest compression 2.800 MPa in column, block 1, ")
    assert "%" not in strength_use_table(use)


def test_the_tension_of_a_fill_is_that_of_its_corners():
    """As by `strength_use` of that block; None where it is rigid."""
    arch = af.shapes.Arch(span=5.0, rise=1.2, thickness=0.4, voussoirs=9)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3), width=3.0)
    model = af.build(bridge, fidelity={"backfill": "full", "rest": "rigid"}, cells=(2, 2))
    observe = observe_fill_tension(model)
    q = np.zeros(model.size)
    assert observe is not None
    assert observe(q) == 0.0
    rest = af.dead_load(model)
    use = strength_use(rest.model, rest.q)
    (fill,) = np.flatnonzero(use["part"].values == "backfill")
    assert observe(rest.q) == pytest.approx(float(use["tension"][fill]), rel=1e-9)
    assert observe(2.0 * rest.q) == pytest.approx(2.0 * observe(rest.q), rel=1e-9)
    assert observe_fill_tension(af.build(bridge, fidelity="rigid")) is None


def test_rigid_stones_beside_a_meshed_fill_have_no_stress():
    """None was computed for them, which is not zero."""
    arch = af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=5)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3), width=3.0)
    model = af.build(bridge, fidelity={"backfill": "full", "rest": "rigid"}, cells=(2, 2))
    use = strength_use(model, af.dead_load(model).q)
    stone = use["part"].values != "backfill"
    assert use["compression"].isnull().values.tolist() == stone.tolist()
    ring, fill = (line.split("  ") for line in strength_use_table(use).splitlines()[1:])
    assert [cell.strip() for cell in ring if cell][:2] == ["arch", "not computed (rigid)"]
    assert "MPa" in " ".join(fill)
    assert "in backfill" in strength_use_text(use)


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


def test_models_and_runs_without_a_field_are_refused(ring, ring_model, dead):
    rigid = af.build(ring, fidelity="rigid")
    for evaluate in (af.statics.principal_stresses, strength_use):
        with pytest.raises(af.InvalidInput, match=r"rigid blocks .*fidelity='faces'.*joint_stress"):
            evaluate(rigid, np.zeros(rigid.size))
        with pytest.raises(af.InvalidInput, match=r"shape \(3,\), the model 850 coordinates"):
            evaluate(ring_model, np.zeros(3))
    with pytest.raises(af.InvalidInput, match=r"no fields.*fields_every.*utilisation"):
        strength_use_over(ring_model, dead.joints)
