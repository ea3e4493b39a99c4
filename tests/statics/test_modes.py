"""Modes against closed forms, against dense LAPACK, and against each other.

Chain of n equal masses m and springs k, fixed at its foot: ω_j² = 4 (k/m) sin²(α_j / 2) with shapes
sin(i α_j), i = 1..n, and α_j = (2j - 1) π / (2n + 1) (Clough and Penzien, 1993).
"""

import re

import numpy as np
import pytest
from glued import glued
from scipy.linalg import eigh

import archfem as af
from archfem import modes
from archfem.statics.modes import _shape_signs

GRAVITY = 9.81
DENSITY = 2000.0
HARD = af.Material(30e9, 0.2, DENSITY * GRAVITY)
NORMAL, SHEAR = 1e9, 4e8
JOINT = af.Contact(NORMAL, SHEAR, 0.6)
BREADTH, HEIGHT = 0.6, 2.4
SAME = 1e-9
"""Two ways to the same numbers: rounding of a stiffness whose ω² span eight decades."""


def block(**given):
    shape = af.column(breadth=BREADTH, heights=[HEIGHT], contact=JOINT, material=HARD)
    return af.build(shape, fidelity="rigid", **given)


def squares_on_strip(low, high):
    """ω² of the block on the part of its joint from low to high, by hand (3,).

    With u, v, θ of the centroid the joint opens by v + x θ and slips by u + θ H/2 over its whole
    breadth: shear has no gap to open.
    """
    length, middle = high - low, 0.5 * (low + high)
    second = length**3 / 12.0 + length * middle**2
    arm = HEIGHT / 2.0
    stiffness = NORMAL * np.array(
        [[0, 0, 0], [0, length, length * middle], [0, length * middle, second]]
    ) + SHEAR * BREADTH * np.array([[1, 0, arm], [0, 0, 0], [arm, 0, arm**2]])
    mass = DENSITY * BREADTH * HEIGHT
    inertia = mass * (BREADTH**2 + HEIGHT**2) / 12.0
    return eigh(stiffness, np.diag([mass, mass, inertia]), eigvals_only=True)


def hertz(squares):
    return np.sqrt(squares) / (2.0 * np.pi)


def of_blocks(structure):
    """Mass of the blocks that can move [kg]."""
    free = [structure.blocks[number] for number in structure.free]
    return sum(structure.density(each) * each.area * structure.width for each in free)


def test_block_on_a_closed_joint():
    found = modes(block(), 3)
    assert found.frequencies == pytest.approx(hertz(squares_on_strip(-0.3, 0.3)), rel=SAME)
    assert found.frequencies == pytest.approx([8.884, 72.644, 91.118], rel=1e-4)
    assert found.periods == pytest.approx(1.0 / found.frequencies)
    # It bounces without swaying: one mode has the whole mass along y, the others all of it along x.
    assert found.mass_ratios[1] == pytest.approx([0.0, 1.0], abs=1e-9)
    assert found.mass_ratios[[0, 2], 0].sum() == pytest.approx(1.0, abs=1e-9)


def test_block_on_a_joint_half_of_which_is_open():
    """e = 1/3 leaves the outer half of the joint in contact."""
    model = af.build(glued(block().structure), fidelity="rigid", quadrature="exact")
    normal = 1e6
    pressed = af.statics.equilibrium_under(model, np.array([0.0, -normal, -normal * BREADTH / 3.0]))
    found = modes(model, 3, start=pressed)
    # The edge of contact is found to the tolerance of the equilibrium.
    assert found.frequencies == pytest.approx(hertz(squares_on_strip(0.0, 0.3)), rel=1e-7)
    assert found.frequencies[0] < 0.8 * modes(model, 1, "closed").frequencies[0]


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
def test_column_against_a_chain_of_springs(fidelity):
    count, height = 5, 0.8
    hard = af.Material(1e13, 0.0, HARD.unit_weight)
    shape = af.column(breadth=BREADTH, heights=[height] * count, contact=JOINT, material=hard)
    model = af.build(shape, fidelity=fidelity)
    found = modes(model, model.size)
    upright = found.mass_ratios[:, 1] > 1e-6
    mass, spring = DENSITY * BREADTH * height, NORMAL * BREADTH
    angle = (2 * np.arange(count) + 1) * np.pi / (2 * count + 1)
    squares = 4.0 * spring / mass * np.sin(0.5 * angle) ** 2
    shapes = np.sin(np.arange(1, count + 1) * angle[:, None])
    effective = mass * shapes.sum(axis=1) ** 2 / (shapes**2).sum(axis=1)
    # "faces" blocks yield E / (L k_n), 1/12500, of the compliance of their joints.
    near = SAME if fidelity == "rigid" else 1e-4
    assert found.frequencies[upright][:count] == pytest.approx(hertz(squares), rel=near)
    assert found.effective_masses[upright, 1][:count] == pytest.approx(effective, rel=10.0 * near)


@pytest.mark.parametrize(
    "fidelity", ["rigid", pytest.param("faces", marks=pytest.mark.slow), "condensed", "full"]
)
def test_effective_masses_add_up_to_all_that_moves(fidelity, verified):
    shape = af.column(breadth=1.0, heights=[1.0, 0.5, 0.7])
    model = af.build(shape, fidelity=fidelity, cells=(2, 2))
    found = modes(model, model.size)
    assert found.effective_masses.sum(axis=0) == pytest.approx(of_blocks(shape), rel=1e-10)
    assert found.masses == pytest.approx(of_blocks(shape), rel=1e-10)
    total = found.effective_masses.sum(axis=0)
    case = "effective masses of all modes, each fidelity [kg]"
    verified(case, of_blocks(shape), "mass that can move", total[0])


@pytest.mark.parametrize(
    "fidelity",
    [
        "rigid",
        *(pytest.param(each, marks=pytest.mark.slow) for each in ("faces", "condensed", "full")),
    ],
)
def test_as_dense_lapack_about_dead_load(ring, fidelity, verified):
    model = af.build(ring, fidelity=fidelity, cells=(2, 2))
    dead = af.dead_load(model)
    found = modes(model, 12, start=dead)
    stiffness, mass = dead.model.tangent(dead.q).toarray(), model.mass.toarray()
    assert stiffness == pytest.approx(stiffness.T, abs=1e-12 * stiffness.max())
    squares, shapes = eigh(stiffness, mass, subset_by_index=[0, 11])
    assert found.frequencies == pytest.approx(hertz(squares), rel=SAME)
    off = np.abs(found.frequencies / hertz(squares) - 1.0).max()
    case = "twelve modes of the ring about the dead load, each fidelity"
    verified(case, "equal", "dense LAPACK", "equal", difference=off)
    assert found.shapes.T @ mass @ found.shapes == pytest.approx(np.eye(12), abs=1e-8)
    assert np.abs(np.diag(shapes.T @ mass @ found.shapes)) == pytest.approx(1.0, abs=1e-7)


def test_open_joints_lower_the_first_frequency(ring):
    model = af.build(ring, fidelity="rigid")
    pushed = af.statics.equilibrium_under(
        model, af.statics.self_weight(model) + model.load(af.BodyForce(0.35))
    )
    closed = modes(model, 1, "closed").frequencies[0]
    dead = modes(model, 1, start=af.dead_load(model)).frequencies[0]
    hinging = modes(model, 1, start=pushed).frequencies[0]
    assert hinging < 0.9 * dead
    assert dead < closed


def test_monolithic_as_full(ring):
    both = [
        af.build(ring, fidelity=fidelity, cells=(2, 2), quadrature="lobatto")
        for fidelity in ("full", "monolithic")
    ]
    full, slow = (modes(model, 6, start=af.dead_load(model)) for model in both)
    assert slow.frequencies == pytest.approx(full.frequencies, rel=SAME)
    assert slow.mass_ratios == pytest.approx(full.mass_ratios, abs=1e-7)
    assert slow.shapes == pytest.approx(full.shapes, abs=1e-6 * np.abs(full.shapes).max())


def test_shapes_have_a_sense():
    shape = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    found = modes(af.build(shape, fidelity="rigid"), 51)
    along_x, along_y = (found.mass_ratios > 1e-3).T
    assert np.all(found.participation[along_x, 0] > 0.0)
    assert np.all(found.participation[~along_x & along_y, 1] > 0.0)
    for column_ in found.shapes[:, ~along_x & ~along_y].T:
        assert column_[np.abs(column_) >= 0.5 * np.abs(column_).max()][0] > 0.0


def test_a_mechanism_does_not_vibrate():
    """A block lifted off its joint has nothing to hold it up."""
    model = block()
    lifted = af.statics.Equilibrium(model, np.array([0.0, 0.01, 0.0]), 0, 0)
    with pytest.raises(af.DidNotConverge, match=r"about the given state: .* a mechanism") as caught:
        modes(model, 1, start=lifted)
    assert caught.value.last is lifted


def test_invalid_requests_are_refused():
    model, other = block(), af.build(af.column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
    for count in (0, 4):
        with pytest.raises(af.InvalidInput, match=f"{count} modes of a model with 3 coordinates"):
            modes(model, count)
    with pytest.raises(af.InvalidInput, match="with 6 coordinates, the modes of 'rigid' with 3"):
        modes(model, 1, start=af.dead_load(other))


def test_table():
    head, _, second, _ = modes(block(), 3).table().splitlines()
    assert head.split("  ")[0] == "mode"
    cells = ["2", "72.64 Hz", "0.01377 s", "0.0%", "100.0%", "75.3%", "100.0%"]
    assert re.split(r"\s{2,}", second) == cells


def test_frequencies_of_blocks_on_stiff_joints_are_upper_bounds():
    """A bar on a stiff joint, without ν, vibrates along its length at √(E/ρ) / 4 L, by hand."""
    material, found = af.Material(5e9, 0.0, DENSITY * GRAVITY), {}
    bar = np.sqrt(5e9 / DENSITY) / 8.0
    for stiffness in (5e8, 1e12):
        contact = af.Contact(stiffness, 0.4 * stiffness, friction=None)
        shape = af.column(breadth=1.0, heights=[2.0], material=material, contact=contact)
        for fidelity in ("full", "faces", "condensed"):
            found[stiffness, fidelity] = modes(af.build(shape, fidelity=fidelity), 3, "closed")
    # a mesh of 0.4 % for the bar; both others have a massless spring in its place
    assert found[1e12, "full"].frequencies[1] == pytest.approx(bar, rel=0.005)
    for fidelity in ("faces", "condensed"):
        stiff, soft = found[1e12, fidelity], found[5e8, fidelity]
        assert stiff.frequencies[1] > 5.0 * bar
        (doubt,) = stiff.doubts
        assert stiff.table().endswith(f"in doubt: {doubt}")
        assert stiff.table().count("≤") == 3
        # on the softer joint the first mode is that of "full" within 5 %, and not in doubt
        exact = found[5e8, "full"].frequencies[0]
        assert soft.frequencies[0] == pytest.approx(exact, rel=0.05)
        assert ["≤" in line for line in soft.table().splitlines()[1:4]] == [False, True, True]
    assert not found[1e12, "full"].doubts
    assert not modes(block(), 3).doubts  # of a block that is 25 times as stiff as its joint


def test_modes_in_a_line():
    """Sway of the block has no mass along y, and the two lowest modes have all of it."""
    found = modes(block(), 2)
    structure = found.model.structure
    share = f"{found.effective_masses[:, 0].sum() / of_blocks(structure):.0%}"
    said = f"2 from 8.88 to 72.64 Hz, with {share} of the mass along x and 100% along y"
    assert repr(found) == f"Modes of '{structure.name}': {said}"


@pytest.mark.parametrize(
    ("along", "sense"),
    [
        ((0.05, -1.0), 1.0),  # 0.0025 of the mass along x
        ((-0.05, 1.0), -1.0),
        ((0.03, -0.05), -1.0),  # 0.0009 along x: the sense along y
        ((0.03, 0.05), 1.0),
        ((-0.03, -0.03), -1.0),  # neither: the first component of half the largest size
    ],
)
def test_shapes_have_the_sense_in_which_they_follow_the_ground(along, sense):
    """From a thousandth of the mass on, along x before y."""
    shape = np.array([[0.49], [-0.51], [1.0]])
    assert _shape_signs(shape, np.array([along]), np.ones(2)).tolist() == [sense]
    assert _shape_signs(-shape, np.array([[0.0, 0.0]]), np.ones(2)).tolist() == [1.0]


def test_the_command_ends_in_doubt_where_blocks_vibrate_by_themselves(tmp_path, monkeypatch):
    monkeypatch.setattr("archfem.commands.run.can_film", lambda: False)
    for stiffness, code in (("1 MPa/mm", 0), ("1000 MPa/mm", 3)):
        (tmp_path / "case.toml").write_text(
            '[structure]\nshape = "column"\nbreadth = 0.6\nheights = [1.2]\n'
            f'[contacts."stone to stone"]\nnormal_stiffness = "{stiffness}"\n'
            f'shear_stiffness = "{stiffness}"\n[model]\nfidelity = "rigid"\n'
        )
        given = ["modes", str(tmp_path / "case.toml"), "--out", str(tmp_path / stiffness[:4])]
        assert af.commands.main([*given, "--count", "2"]) == code
