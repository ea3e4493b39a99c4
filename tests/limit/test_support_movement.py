"""Movement of a support at which its structure falls, in the moved geometry."""

from dataclasses import replace
from functools import cache
from itertools import combinations, product

import numpy as np
import pytest

import archfem as af
from archfem.limit import End, largest_movement, support_movement
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.support_movement import DisplacedBlocks

TOLERANCE = 1e-4
"""Width of the last step, as a share of the given movement: the default."""

SPREAD = af.Settlement("left abutment", (-1.0, 0.0, 0.0))
SINK = af.Settlement("left abutment", (0.0, -1.0, 0.0))


def rough(friction):
    return replace(af.masonry.STONE_TO_STONE, friction=friction)


def semicircle(thickness, voussoirs, **given):
    shape = {"radius": 1.0, "embrace": 180.0}
    return af.circular_arch(**shape, thickness=thickness, voussoirs=voussoirs, **given)


@cache
def rough_movement(thickness, voussoirs, settlement):
    """The largest movement of a semicircle that never slides, which several tests look at."""
    return largest_movement(semicircle(thickness, voussoirs), settlement, friction=None)


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def turned(points, about, to, angle):
    c, s = np.cos(angle), np.sin(angle)
    return to + (points - about) @ np.array([[c, s], [-s, c]])


class ThreeHinges:
    """A ring in three-hinged states, by plane geometry and moments alone.

    Joints and faces of the hinges are given from the left. What lies left of the first moves with
    the left abutment.
    """

    def __init__(self, ring):
        self.ends = np.array([joint.ends for joint in ring.joints])
        self.stones = np.array([block.centroid for block in ring.blocks[1:-1]])
        self.weights = np.array([block.area for block in ring.blocks[1:-1]])

    def admissible(self, joints, faces, shift):
        """Whether the thrust line through three hinges stays within the displaced ring."""
        a, b, c = joints
        pivots = [self.ends[joint, face] for joint, face in zip(joints, faces, strict=True)]
        start = pivots[0] + shift
        reach = pivots[2] - start
        sides = [np.linalg.norm(pivots[1] - pivots[0]), np.linalg.norm(pivots[2] - pivots[1])]
        span = np.linalg.norm(reach)
        along = (sides[0] ** 2 - sides[1] ** 2 + span**2) / (2.0 * span)
        if along**2 >= sides[0] ** 2:
            return False
        up = np.array([-reach[1], reach[0]]) / span
        sense = np.sign(cross(pivots[2] - pivots[0], pivots[1] - pivots[0]))
        top = start + along * reach / span + sense * np.sqrt(sides[0] ** 2 - along**2) * up
        first = angle(pivots[1] - pivots[0], top - start)
        second = angle(pivots[2] - pivots[1], pivots[2] - top)
        turns = -first, first - second, second  # of the left on the right part: opens the extrados
        if any((turn < 0.0) != (face == 1) for turn, face in zip(turns, faces, strict=True)):
            return False
        k = np.arange(len(self.ends))
        ends = np.where((k < a)[:, None, None], self.ends + shift, self.ends)
        ends[a:b] = turned(self.ends[a:b], pivots[0], start, first)
        ends[b:c] = turned(self.ends[b:c], pivots[1], top, second)
        stones = np.where((k[:-1] < a)[:, None], self.stones + shift, self.stones)
        stones[a:b] = turned(self.stones[a:b], pivots[0], start, first)
        stones[b:c] = turned(self.stones[b:c], pivots[1], top, second)
        hinges = [start, top, pivots[2]]
        force = self.reaction(stones, joints, hinges)
        return self.inside(stones, ends, joints, start, force)

    def reaction(self, stones, joints, hinges):
        """Force of the part left of the first hinge on the rest, by moments about the other two."""
        rows, known = [], []
        for pivot, last in zip(hinges[1:], joints[1:], strict=True):
            arm = hinges[0] - pivot
            rows.append([-arm[1], arm[0]])
            part = slice(joints[0], last)
            known.append(self.weights[part] @ (stones[part] - pivot)[:, 0])
        return np.linalg.solve(rows, known)

    def inside(self, stones, ends, joints, start, force):
        """Whether the resultant passes every other joint between its ends, in compression."""
        for k in sorted(set(range(len(ends))) - set(joints)):
            part, sign = (
                (slice(joints[0], k), 1.0) if k > joints[0] else (slice(k, joints[0]), -1.0)
            )
            through = force - sign * np.array([0.0, self.weights[part].sum()])
            about = [
                cross(start - p, force) - sign * self.weights[part] @ (stones[part] - p)[:, 0]
                for p in ends[k]
            ]
            across = ends[k, 1] - ends[k, 0]
            if about[0] * about[1] > 1e-9 or cross(through, across) < 0.0:
                return False
        return True

    def stands(self, shift):
        size = len(self.ends)
        return any(
            self.admissible(joints, faces, shift)
            for joints in combinations(range(size), 3)
            for faces in product((0, 1), repeat=3)
        )


def angle(a, b):
    return np.arctan2(cross(a, b), a @ b)


def hinges_of(stage):
    joints, faces = zip(*stage.hinges, strict=True)
    return joints, [("intrados", "extrados").index(face) for face in faces]


@pytest.mark.parametrize(
    ("thickness", "voussoirs", "settlement", "jumps"),
    [
        (0.15, 8, SPREAD, 0),
        pytest.param(0.12, 60, SPREAD, 1, marks=pytest.mark.slow),
        pytest.param(0.2, 8, SINK, 0, marks=pytest.mark.slow),
        pytest.param(0.15, 13, SINK, 1, marks=pytest.mark.slow),
    ],
)
def test_every_state_is_one_of_three_hinges_and_the_last_one_is_the_last(
    thickness, voussoirs, settlement, jumps
):
    ring = semicircle(thickness, voussoirs)
    found = rough_movement(thickness, voussoirs, settlement)
    assert found.end is End.FALLS
    hinged, shift = ThreeHinges(ring), np.array(settlement.motion[:2])
    for stage in found.stages[1:]:
        assert hinged.admissible(*hinges_of(stage), stage.share * shift)
    last = hinges_of(found.stages[-1])
    assert not hinged.admissible(*last, (found.largest + 3.0 * TOLERANCE) * shift)
    assert len(found.sequence) == 2 + jumps


@pytest.mark.parametrize(
    ("thickness", "settlement"),
    [(0.15, SPREAD), pytest.param(0.2, SINK, marks=pytest.mark.slow)],
)
def test_a_ring_falls_where_no_three_hinges_hold_the_thrust_line(thickness, settlement, verified):
    ring = semicircle(thickness, 8)
    found = rough_movement(thickness, 8, settlement)
    hinged, shift = ThreeHinges(ring), np.array(settlement.motion[:2])
    assert hinged.stands((found.largest - TOLERANCE) * shift)
    assert not hinged.stands((found.largest + 3.0 * TOLERANCE) * shift)
    way = "spread" if settlement is SPREAD else "sink"
    case = f"semicircle, t/R = {thickness:g}, largest {way} of a support over R"
    verified(
        case, "the same", "three hinges by plane geometry", f"{found.largest:.4f}", difference=3e-4
    )


@pytest.mark.slow
def test_a_ring_leaps_where_only_far_hinges_would_hold():
    ring = semicircle(0.2, 10)
    found = largest_movement(ring, SINK, friction=None)
    assert found.end is End.LEAPS
    hinged, shift = ThreeHinges(ring), np.array(SINK.motion[:2])
    beyond = (found.largest + 3.0 * TOLERANCE) * shift
    assert hinges_of(found.stages[-1]) == ((0, 5, 8), [1, 1, 0])
    assert not hinged.admissible((0, 5, 8), (1, 1, 0), beyond)
    assert hinged.admissible((0, 6, 9), (1, 1, 0), beyond)


@pytest.mark.slow
def test_the_work_of_the_thrust_is_that_of_the_weights():
    ring = semicircle(0.2, 8)
    found = largest_movement(ring, SPREAD, friction=None)
    shares, works = np.array([(stage.share, stage.work) for stage in found.stages]).T
    works[0] = 2.0 * works[1] - works[2]  # at rest the thrust is any of many
    fallen = -found.displacement[:, 1] * [block.area * 20e3 for block in ring.blocks]
    done = np.diff(shares) @ (works[1:] + works[:-1]) / 2.0
    assert done == pytest.approx(fallen[1:-1].sum(), rel=1e-3)


@pytest.mark.slow
def test_either_abutment_may_move():
    ring = semicircle(0.2, 12)
    left = largest_movement(ring, SPREAD, friction=None)
    right = largest_movement(ring, af.Settlement("right abutment", (1.0, 0.0, 0.0)), friction=None)
    assert right.largest == pytest.approx(left.largest, abs=TOLERANCE)
    assert [stage.work for stage in right.stages[1:9]] == pytest.approx(
        [stage.work for stage in left.stages[1:9]], rel=1e-6
    )


@pytest.mark.slow
def test_a_column_on_ground_that_tilts():
    """It falls where its centre passes the corner, and slides before where that is beyond μ."""
    stocky = af.column(breadth=1.0, heights=[0.5, 1.0], contact=rough(0.6))
    tilt = af.Settlement("base", (0.0, 0.0, 1.0))
    tall = largest_movement(stocky, tilt, friction=None)
    assert (tall.end, stocky.blocks[0].name) == (End.FALLS, "base")
    assert tall.largest == pytest.approx(np.arctan(1.0 / 1.5), abs=2.0 * TOLERANCE)
    slid = largest_movement(stocky, tilt)
    assert slid.end is End.SLIDES
    assert slid.largest == pytest.approx(np.arctan(0.6), abs=2.0 * TOLERANCE)
    assert slid.settlement.motion == pytest.approx((0.0, 0.0, slid.largest))


@pytest.mark.slow
def test_a_small_movement_is_held_and_a_strut_locks():
    held = largest_movement(semicircle(0.2, 12), af.Settlement(0, (-0.01, 0.0, 0.0)))
    assert (held.end, held.largest) == (End.HOLDS, pytest.approx(1.0))
    flat = af.circular_arch(span=4.0, rise=0.2, thickness=1.0, voussoirs=9)
    stuck = largest_movement(flat, af.Settlement("left abutment", (1.0, 0.0, 0.0)))
    assert (stuck.end, stuck.largest) == (End.LOCKS, 0.0)


LEG = np.array([(0.0, 0.0), (0.5, 0.0), (1.0, 1.5), (1.0, 2.0)])
"""Left one of two stones that lean against each other at x = 1 m."""


def leaning(friction):
    """Two stones that lean against each other, on a base each."""
    legs = LEG, (LEG * [-1.0, 1.0] + [2.0, 0.0])[::-1]
    bases = (
        [(left, -1.0), (right, -1.0), (right, 0.0), (left, 0.0)]
        for left, right in ((-1.0, 0.9), (1.1, 3.0))
    )
    names = ("left base", "right base", "left", "right")
    blocks = [
        af.Block(tuple(map(tuple, points)), af.STONE, name, fixed=name.endswith("base"))
        for name, points in zip(names, (*bases, *legs), strict=True)
    ]
    return af.masonry.assembled(blocks, rough(friction))


def centroid_along(start, end):
    """Centroid of the left stone along and across the line between its hinges, and its length."""
    block = leaning(0.5).blocks[2]
    line = np.subtract(end, start)
    length = np.hypot(*line)
    arm = block.centroid - start
    return line @ arm / length, cross(line, arm) / length, length


@pytest.mark.slow
@pytest.mark.parametrize(
    ("friction", "slides"),
    [
        (0.05, ("left base to left", "right base to right")),
        (0.1, None),
    ],
)
def test_leaning_stones_that_part_slide_where_their_thrust_is_beyond_friction(
    friction, slides, caplog
):
    """At their feet, or at the top where its face, of the left stone, has turned by arctan μ.

    Hinges are at the inner feet and at the top; the thrust over the weight is that of their arms.
    """
    along, across, length = centroid_along(LEG[1], LEG[3])
    # arms (along * reach - across * height) / length and height, of hinges reach apart sideways
    slope = (friction * length + across) / along
    feet = length * slope / np.hypot(1.0, slope)
    top = length * np.cos(np.arctan2(*(LEG[3] - LEG[1])[::-1]) - np.arctan(friction))
    found = largest_movement(leaning(friction), af.Settlement("left base", (-1.0, 0.0, 0.0)))
    assert found.largest == pytest.approx(2.0 * (min(feet, top) - 0.5), abs=3.0 * TOLERANCE)
    assert found.end is End.SLIDES
    assert found.sliding == (slides or ("left to right",))
    assert (feet < top) == bool(slides)
    assert "it may survive more than this movement, sliding" in caplog.text


@pytest.mark.parametrize(
    ("share", "end"),
    [(0.8, End.SLIDES), pytest.param(1.02, End.HOLDS, marks=pytest.mark.slow)],
)
def test_leaning_stones_pushed_together_slide_at_once_below_the_friction_of_their_thrust(
    share, end, caplog
):
    """Hinges at the outer foot and the lower end of the top: H/W is the ratio of their arms."""
    thrust = leaning(0.5).blocks[2].centroid[0] / LEG[2, 1]
    closing = af.Settlement("left base", (0.2, 0.0, 0.0))
    found = largest_movement(leaning(share * thrust), closing)
    assert found.end is end
    assert found.largest == (1.0 if end is End.HOLDS else 0.0)
    slides = ("left base to left", "right base to right") if end is End.SLIDES else ()
    assert found.sliding == slides
    assert ("slides: left base to left; right base to right" in str(found)) == bool(slides)
    assert bool(caplog.text) == bool(slides)


def test_the_last_step_ends_at_the_given_movement(monkeypatch):
    """Steps of three tenths, and one of a tenth."""
    monkeypatch.setattr(support_movement, "MAX_MOVEMENT_STEP", 0.3)
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=120.0, voussoirs=7, chords=1)
    spread = af.Settlement("right abutment", (1e-3, 0.0, 0.0))
    found = largest_movement(ring, spread)
    assert found.end is End.HOLDS
    assert [each.share for each in found.stages] == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.0])


def test_the_first_thrust_is_that_of_the_small_movement(monkeypatch):
    monkeypatch.setattr(support_movement, "MAX_MOVEMENT_STEP", 0.5)  # its first step is enough
    ring = semicircle(0.15, 30)
    small = af.collapse_factor(ring, live=SPREAD, friction=None)
    found = largest_movement(ring, af.Settlement("left abutment", (-2e-5, 0.0, 0.0)), friction=None)
    assert 5e4 * found.stages[1].work == pytest.approx(small.factor, rel=1e-3)
    assert found.stages[1].hinges == small.hinges


def test_the_words_name_the_joints():
    found = rough_movement(0.15, 8, SPREAD)
    assert "moves by -0.2269 m" in str(found)
    assert "joint 1 at the intrados; joint 4 at the extrados" in str(found)
    assert found.stages[-1].names == ("joint 1", "joint 4", "joint 7")


@pytest.mark.parametrize(("turn", "face"), [(0.002, "right"), (-0.002, "left")])
def test_a_pier_stands_on_the_side_of_a_foundation_that_rises(turn, face, monkeypatch):
    """The arches hold its head: of a foundation that turns anticlockwise that is the right one."""
    monkeypatch.setattr(support_movement, "MAX_MOVEMENT_STEP", 0.5)
    shape = {"span": 3.0, "rise": 1.0, "thickness": 0.4, "voussoirs": 7}
    arches = [af.shapes.Arch(name=name, **shape) for name in ("left", "right")]
    bridge = af.bridge(arches=arches, piers=[af.shapes.Pier(breadth=0.9, height=2.0, course=1.0)])
    foundation = af.Settlement("pier, foundation", (0.0, 0.0, turn))
    last = largest_movement(bridge, foundation, friction=None).stages[-1]
    assert f"pier, base at the {face} face; " in str(last)
    ring = {1: "extrados", -1: "intrados"}[int(np.sign(turn))]  # which the head pushes or leaves
    assert f"; left, joint 7 at the {ring}; " in str(last)
    assert {side for _, side in last.hinges} == {"intrados", "extrados"}


def test_gaps_of_displaced_blocks_are_rates_of_opening():
    ring = semicircle(0.2, 6)
    chance = np.random.default_rng(2)
    blocks = DisplacedBlocks(ring, 0.05 * chance.standard_normal((8, 3)))
    motion, small = chance.standard_normal((8, 3)), 1e-6
    ahead, back = (blocks.moved(sign * small * motion).current_gaps for sign in (1.0, -1.0))
    np.testing.assert_allclose(blocks.gaps(motion), (ahead - back) / (2 * small), atol=1e-7)
    at_rest = DisplacedBlocks(ring, np.zeros((8, 3)))
    assert np.abs(at_rest.current_gaps).max() < 1e-12
    linear = RigidBlocks(ring).gaps(motion)
    np.testing.assert_allclose(at_rest.gaps(motion), linear, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: largest_movement(semicircle(0.05, 12), SPREAD), "does not stand"),
        (lambda: largest_movement(semicircle(0.2, 12), af.Settlement(0, (0, 0, 0))), "nothing"),
        (lambda: largest_movement(semicircle(0.2, 12), af.Settlement(3, (1, 0, 0))), "supports"),
        (lambda: largest_movement(semicircle(0.2, 12), SPREAD, friction="none"), "not known"),
        (lambda: largest_movement(semicircle(0.2, 12), SPREAD, tolerance=0.5), "not between"),
        (lambda: largest_movement(semicircle(0.2, 12), af.BodyForce(1.0)), "settlement"),
    ],
)
def test_invalid_input_is_refused(call, message):
    with pytest.raises(af.InvalidInput, match=message):
        call()


def test_steps_are_a_hundredth_of_the_movement():
    """Where each of them is held."""
    found = rough_movement(0.15, 8, SPREAD)
    held = int(found.largest / 0.01) + 1
    shares = [each.share for each in found.stages[:held]]
    assert held > 20
    assert shares == pytest.approx(0.01 * np.arange(held))


@pytest.mark.slow
@pytest.mark.parametrize("settlement", [SPREAD, SINK])
def test_blocks_neither_overlap_nor_slide_at_the_end_of_a_movement(settlement):
    """To rounding, by the places of their corners, after large steps of the support."""
    ring = semicircle(0.15, 7, contact=rough(np.inf))
    found = largest_movement(ring, settlement)
    moved = DisplacedBlocks(ring, found.displacement)
    intrados, extrados, slip = moved.current_gaps
    bound = 1e-8 * ring.size
    assert min(intrados.min(), extrados.min()) >= -bound
    assert np.abs(slip).max() <= bound
    assert len(found.stages[-1].hinges) >= 3


@pytest.mark.parametrize(
    ("friction", "end", "slope"), [(0.3, End.SLIDES, 0.3), (5.0, End.FALLS, 1.0)]
)
def test_a_cube_on_ground_that_tilts_slides_or_falls(friction, end, slope):
    cube = af.column(breadth=1.0, heights=[1.0], contact=rough(friction))
    found = largest_movement(cube, af.Settlement(0, (0.0, 0.0, 4.0)), tolerance=1e-3)
    assert found.end is end
    assert 4.0 * found.largest == pytest.approx(np.arctan(slope), abs=5e-3)


def test_fill_is_refused_with_a_remedy_that_exists():
    arch = af.shapes.Arch(span=4.0, rise=1.0, thickness=0.4, voussoirs=9)
    soil = af.Material(6.25e6, 0.2, 18e3, name="fill")
    backfill = af.shapes.Backfill(cover=0.3, material=soil)
    bridge = af.bridge(arches=[arch], backfill=backfill, width=1.0)
    support = af.Settlement(bridge.blocks[bridge.joints[0].blocks[0]].name, (-0.1, 0.0, 0.0))
    with pytest.raises(af.errors.InvalidInput, match="takes no strength: leave the fill") as found:
        largest_movement(bridge, support)
    assert "fill=" not in str(found.value)  # `largest_movement` has no such argument
    bare = af.bridge(arches=[arch], width=1.0)
    assert largest_movement(bare, support).largest > 0.0
