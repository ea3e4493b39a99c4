"""Modes against closed forms, against dense LAPACK, and against each other.

Chain of n equal masses m and springs k, fixed at its foot: ω_j² = 4 (k/m) sin²(α_j / 2) with shapes
sin(i α_j), i = 1..n, and α_j = (2j - 1) π / (2n + 1) (Clough and Penzien, 1993).
"""

import re
import subprocess
import sys

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from archfem.cases.case import Case
from archfem.cases.cli import main
from archfem.cases.run import damping_of, expected_damping
from archfem.dynamics import damping as modal_damping
from archfem.dynamics.damping import effective_damping, effective_range
from archfem.dynamics.ladder import build
from archfem.dynamics.schemes import EffectiveRayleigh, Rayleigh
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.actions import BodyForce
from archfem.masonry.materials import Contact, Material
from archfem.masonry.shapes import circular_arch, column
from archfem.statics import eigen
from archfem.statics.equilibrium import Equilibrium, dead_load, equilibrium, self_weight
from archfem.statics.modes import modes
from archfem.view.films.modes import FRAMES, film_modes
from archfem.view.modes import REACH, draw_modes

GRAVITY = 9.81
DENSITY = 2000.0
STONE = Material(30e9, 0.2, DENSITY * GRAVITY)
NORMAL, SHEAR = 1e9, 4e8
JOINT = Contact(NORMAL, SHEAR, 0.6)
BREADTH, HEIGHT = 0.6, 2.4

SAME = 1e-9
"""Two ways to the same numbers: rounding of a stiffness whose ω² span eight decades."""


def block(**given):
    shape = column(breadth=BREADTH, heights=[HEIGHT], contact=JOINT, material=STONE)
    return build(shape, fidelity="rigid", **given)


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
    model = block(quadrature="exact")
    normal = 1e6
    pressed = equilibrium(model, np.array([0.0, -normal, -normal * BREADTH / 3.0]))
    found = modes(model, 3, about=pressed)
    # The edge of contact is found to the tolerance of the equilibrium.
    assert found.frequencies == pytest.approx(hertz(squares_on_strip(0.0, 0.3)), rel=1e-7)
    assert found.frequencies[0] < 0.8 * modes(model, 1).frequencies[0]


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
def test_column_against_a_chain_of_springs(fidelity):
    count, height = 5, 0.8
    hard = Material(1e13, 0.0, STONE.unit_weight)
    shape = column(breadth=BREADTH, heights=[height] * count, contact=JOINT, material=hard)
    model = build(shape, fidelity=fidelity)
    found = modes(model, model.size)
    upright = found.mass_ratios[:, 1] > 1e-6
    mass, spring = DENSITY * BREADTH * height, NORMAL * BREADTH
    angle = (2 * np.arange(count) + 1) * np.pi / (2 * count + 1)
    squares = 4.0 * spring / mass * np.sin(0.5 * angle) ** 2
    shapes = np.sin(np.arange(1, count + 1) * angle[:, None])
    effective = mass * shapes.sum(axis=1) ** 2 / (shapes**2).sum(axis=1)
    # "faces" blocks yield E / (L k_n), 1/12500, of what their joints do.
    near = SAME if fidelity == "rigid" else 1e-4
    assert found.frequencies[upright][:count] == pytest.approx(hertz(squares), rel=near)
    assert found.effective_masses[upright, 1][:count] == pytest.approx(effective, rel=10.0 * near)


@pytest.mark.parametrize("fidelity", ["rigid", "faces", "condensed", "full"])
def test_effective_masses_add_up_to_all_that_moves(fidelity):
    shape = column(breadth=1.0, heights=[1.0, 0.5, 0.7])
    model = build(shape, fidelity=fidelity, cells=(2, 2))
    found = modes(model, model.size)
    assert found.effective_masses.sum(axis=0) == pytest.approx(of_blocks(shape), rel=1e-10)
    assert found.masses == pytest.approx(of_blocks(shape), rel=1e-10)


@pytest.mark.parametrize("fidelity", ["rigid", "faces", "condensed", "full"])
def test_as_dense_lapack_about_dead_load(ring, fidelity):
    model = build(ring, fidelity=fidelity, cells=(2, 2))
    dead = dead_load(model)
    found = modes(model, 12, about=dead)
    stiffness, mass = model.tangent(dead.q).toarray(), model.mass.toarray()
    squares, shapes = eigh(stiffness, mass, subset_by_index=[0, 11])
    assert found.frequencies == pytest.approx(hertz(squares), rel=SAME)
    assert found.shapes.T @ mass @ found.shapes == pytest.approx(np.eye(12), abs=1e-8)
    assert np.abs(np.diag(shapes.T @ mass @ found.shapes)) == pytest.approx(1.0, abs=1e-7)


def test_open_joints_lower_the_first_frequency(ring):
    model = build(ring, fidelity="rigid")
    pushed = equilibrium(model, self_weight(model) + model.load(BodyForce(0.35)))
    closed = modes(model, 1).frequencies[0]
    dead = modes(model, 1, about=dead_load(model)).frequencies[0]
    hinging = modes(model, 1, about=pushed).frequencies[0]
    assert hinging < 0.9 * dead
    assert dead < closed


def test_monolithic_as_full(ring):
    both = [build(ring, fidelity=rung, cells=(2, 2)) for rung in ("full", "monolithic")]
    full, slow = (modes(model, 6, about=dead_load(model)) for model in both)
    assert slow.frequencies == pytest.approx(full.frequencies, rel=SAME)
    assert slow.mass_ratios == pytest.approx(full.mass_ratios, abs=1e-7)
    assert slow.shapes == pytest.approx(full.shapes, abs=1e-6 * np.abs(full.shapes).max())


def test_shapes_have_a_sense():
    shape = circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    found = modes(build(shape, fidelity="rigid"), 51)
    along_x, along_y = (found.mass_ratios > 1e-3).T
    assert np.all(found.participation[along_x, 0] > 0.0)
    assert np.all(found.participation[~along_x & along_y, 1] > 0.0)
    for column_ in found.shapes[:, ~along_x & ~along_y].T:
        assert column_[np.abs(column_) >= 0.5 * np.abs(column_).max()][0] > 0.0


def test_equal_frequencies_are_all_found():
    model = block()
    thrice = [sparse.block_diag([each] * 3, format="csr") for each in (model.closed(), model.mass)]
    squares, _ = eigen.lowest(*thrice, 7)
    assert squares == pytest.approx(np.repeat(squares_on_strip(-0.3, 0.3), 3)[:7], rel=SAME)


def test_negative_pivots_count_modes(ring):
    model = build(ring, fidelity="rigid")
    squares = eigh(model.closed().toarray(), model.mass.toarray(), eigvals_only=True)
    operators = eigen._matrix(model.closed()), eigen._matrix(model.mass)
    for count in (0, 1, 20, 50):
        assert eigen._below(operators, 0.999 * squares[count]) == count


def test_a_mode_that_was_stepped_over_is_noticed(monkeypatch):
    monkeypatch.setattr(eigen, "_below", lambda *_: 2)
    with pytest.raises(DidNotConverge, match=r"1 modes below .* where there are 2"):
        modes(block(), 2)


def test_modes_that_are_not_found(ring, monkeypatch):
    monkeypatch.setattr(eigen, "ACCURACY", 1e-40)
    monkeypatch.setattr(eigen, "ITERATIONS", 1)
    with pytest.raises(DidNotConverge, match="of 3 modes in 1 iterations"):
        modes(build(ring, fidelity="full", cells=(2, 2)), 3)


def test_a_mechanism_does_not_vibrate():
    """A block lifted off its joint has nothing to hold it up."""
    model = block()
    lifted = Equilibrium(model, np.array([0.0, 0.01, 0.0]), 0, 0)
    with pytest.raises(DidNotConverge, match=r"about the given state: .* a mechanism") as caught:
        modes(model, 1, about=lifted)
    assert caught.value.last is lifted


def test_negative_stiffness_is_no_frequency():
    stiffness = sparse.diags([-1e6, 2.0, 3.0]).tocsr()
    with pytest.raises(DidNotConverge, match="singular or negative"):
        eigen.lowest(stiffness, sparse.identity(3, format="csr"), 2)


def test_slepc_is_needed_for_modes_only():
    script = """
import sys
sys.modules["slepc4py"] = None
import archfem as af
from archfem.cases import run as analysis
model = af.build(af.column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
assert af.dead_load(model).iterations > 0
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def test_what_cannot_be_asked_for():
    model, other = block(), build(column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
    for count in (0, 4):
        with pytest.raises(InvalidInput, match=f"{count} modes of a model with 3 coordinates"):
            modes(model, count)
    with pytest.raises(InvalidInput, match="with 6 coordinates, the modes of 'rigid' with 3"):
        modes(model, 1, about=dead_load(other))


def test_table():
    head, _, second, _ = modes(block(), 3).table().splitlines()
    assert head.split("  ")[0] == "mode"
    cells = ["2", "72.64 Hz", "0.01377 s", "0.0%", "100.0%", "75.3%", "100.0%"]
    assert re.split(r"\s{2,}", second) == cells


def test_effective_modes_are_those_of_all_modes(ring):
    model = build(ring, fidelity="rigid")
    dead = dead_load(model)
    everything = modes(model, 51, about=dead)
    for share in (0.8, 0.9, 0.999):
        found = effective_range(model, dead, share=share)
        reached = [everything.mass_ratios[:number, 0].sum() for number in range(52)]
        assert reached[found.first - 1] < 0.05 <= reached[found.first]
        assert reached[found.last - 1] < share <= reached[found.last]
        assert found.share == pytest.approx(reached[found.last], abs=1e-9)
        ends = everything.frequencies[[found.first - 1, found.last - 1]]
        assert found.frequencies == pytest.approx(ends, rel=SAME)
    text = effective_range(model, dead, share=0.8).text
    assert text.startswith("modes 1 and 4, the first and the last effective along x; up to the ")
    assert "89.1 % of the mass, most of it 1 (8.04 Hz, 71.5 %), 2 (" in text


@pytest.mark.parametrize("cells", [(2, 2), (3, 3)])
def test_the_mesh_hardly_moves_the_last_effective_mode(ring, cells):
    """The third mode along x, near 41 Hz, whose mass is 8 % on one mesh and 4 % on the other."""
    model = build(ring, fidelity="full", cells=cells)
    assert effective_range(model, dead_load(model)).frequencies[1] == pytest.approx(40.8, rel=0.02)


def test_search_goes_on_until_the_share_is_reached(ring, monkeypatch):
    model = build(ring, fidelity="rigid")
    whole = effective_range(model)
    monkeypatch.setattr(modal_damping, "FEW", 1)
    assert effective_range(model).frequencies == pytest.approx(whole.frequencies, rel=SAME)


def test_a_search_that_is_cut_short_says_so(ring, monkeypatch, caplog):
    model = build(ring, fidelity="rigid")
    monkeypatch.setattr(modal_damping, "FEW", 2)
    monkeypatch.setattr(modal_damping, "MOST", 4)
    found = effective_range(model, share=0.95)
    assert (found.first, found.last) == (1, 4)
    assert "4 modes, up to 29.7 Hz, have only 90.1 % of the mass along x, not 95 %" in caplog.text


def test_effective_damping_has_its_ratio_at_both_ends(ring):
    model = build(ring, fidelity="rigid")
    damping = effective_damping(model, 0.05, joints="none")
    first, last = effective_range(model).frequencies
    for frequency in (first, last):
        omega = 2.0 * np.pi * frequency
        ratio = 0.5 * (damping.mass / omega + damping.stiffness * omega)
        assert ratio == pytest.approx(0.05, rel=1e-12)
    assert damping == Rayleigh(0.05, (first, last), "none")


def test_too_few_effective_modes():
    with pytest.raises(InvalidInput, match=r"mode 1 alone has 75\.3 % of the mass along x"):
        effective_range(block(), share=0.5)
    with pytest.raises(InvalidInput, match=r"share 5\.0 of the mass"):
        effective_range(block(), share=5.0)


SMALL_CASE = """
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0, 1.0]

[model]
fidelity = "rigid"

[analysis]
damping = { ratio = 0.05, modes = "effective" }
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL_CASE, encoding="utf-8")
    return path


def test_a_case_takes_its_damping_from_the_modes(small):
    case = Case.read(small)
    assert case.damping == EffectiveRayleigh(0.05)
    dead = dead_load(build(case.structure, fidelity="rigid"))
    damping, how = damping_of(case, dead)
    assert damping == effective_damping(dead.model, 0.05, dead)
    assert re.match(r"damping: 5 % at \d+\.\d\d and \d+\.\d\d Hz; modes 1 and ", how)
    # Before a model is chosen it comes from one of elastic blocks, lower by what these yield.
    elastic = build(case.structure, fidelity="condensed")
    expected = expected_damping(case)(elastic).frequencies
    assert expected == damping_of(case, dead_load(elastic))[0].frequencies
    assert expected == pytest.approx(damping.frequencies, rel=0.05)


@pytest.mark.parametrize(
    "damping",
    [
        '{ ratio = 0.05, modes = "all" }',
        '{ ratio = 0.05, modes = "effective", frequencies = [1, 2] }',
        "{ ratio = 0.05, frequencies = [1, 2], share = 0.1 }",
        '{ modes = "effective" }',
    ],
)
def test_damping_that_cannot_be_meant(small, damping):
    with pytest.raises(InvalidInput, match='or modes = "effective" for them'):
        Case.read(small, [f"analysis.damping={damping}"])


def test_share_of_a_case_is_checked_when_it_is_read(small):
    with pytest.raises(InvalidInput, match=r"share 2\.0 of the mass"):
        Case.read(small, ['analysis.damping={ ratio = 0.05, modes = "effective", share = 2.0 }'])


def test_command(small, capsys):
    out = small.parent / "out"
    assert main(["modes", str(small), "--out", str(out), "--count", "3"]) == 0
    said = capsys.readouterr().out
    assert (out / "modes.txt").read_text(encoding="utf-8") in said
    assert "damping: 5 % at" in said
    assert {path.name for path in out.iterdir()} == {"modes.txt", "modes.png", "modes.gif"}


def drawn(axes):
    """Corners of the blocks that move, as drawn."""
    return [path.vertices[:-1] for path in axes.collections[-1].get_paths()]


def test_picture_of_shapes(ring_model):
    found = modes(ring_model, 3)
    axes = draw_modes(found, [1, 3]).axes
    assert axes[0].get_title() == "mode 1: 8.08 Hz, 72 % of the mass along x, 0 % along y"
    assert axes[1].get_title().startswith("mode 3: 27.75 Hz")
    blocks = drawn(axes[0])
    assert len(blocks) == 17
    cells, size = ring_model.cells, ring_model.structure.size
    moves = cells.displacement(found.shapes[:, 0])
    moved = cells.places + REACH * size * moves / np.linalg.norm(moves, axis=1).max()
    for corner in np.concatenate(blocks):
        assert np.linalg.norm(moved - corner, axis=1).min() < 1e-9 * size
    for numbers in ([], [0], [4]):
        with pytest.raises(InvalidInput, match="cannot be drawn: there are 1 to 3"):
            draw_modes(found, numbers)


def test_rims_run_once_around_each_block(ring_model):
    cells = ring_model.cells
    start, end = cells.places[cells.rims].transpose(1, 0, 2)
    twice = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    for number in ring_model.structure.free:
        own = cells.block[cells.rims[:, 0]] == number
        block_ = ring_model.structure.blocks[number]
        # The mesh has four chords where the block has arcs: 0.02 % of its area.
        assert abs(twice[own].sum()) / 2.0 == pytest.approx(block_.area, rel=5e-4)


def test_film_of_shapes(tmp_path):
    import imageio.v2 as imageio

    model = build(column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
    path = film_modes(modes(model, 2), tmp_path / "film.gif", [1])
    frames = imageio.mimread(path)
    assert len(frames) == FRAMES
    moved = [np.mean(frames[0] != frame) for frame in frames]
    assert moved[FRAMES // 4] > 0.005  # at the end of its swing
    assert moved[FRAMES // 2] < 0.2 * moved[FRAMES // 4]  # back at rest
    with pytest.raises(InvalidInput, match=r"film\.avi has suffix"):
        film_modes(modes(model, 2), tmp_path / "film.avi")
