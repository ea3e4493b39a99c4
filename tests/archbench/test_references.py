"""References of Arch-Bench that are computed: by other methods than those of the programs."""

from itertools import combinations, product

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import linprog

from archbench.scene import read_references, read_scene


def reference(name, quantity="factor"):
    """The computed value of a quantity, and its uncertainty."""
    (value,) = (v for v in read_references(name) if v.quantity == quantity and v.grade == "c")
    return value.number, value.uncertainty


def has_thrust_line(stones, ratio):
    """Whether a symmetric thrust line fits into half of a semicircle of sectors.

    Unknowns are the horizontal thrust H and its moment about the centre. The resultant at each
    joint, of H and the weights from the crown to it, passes between the ends of the joint.
    """
    angles = np.arange(stones % 2, stones + 1, 2) / stones * np.pi / 2.0  # from the crown
    inner, outer = 1.0 - ratio / 2.0, 1.0 + ratio / 2.0
    rows, limits = [], []
    for angle in angles:
        # of a sector from the crown to the angle: area, and first moment about the vertical
        area = 0.5 * (outer**2 - inner**2) * angle
        moment = (outer**3 - inner**3) / 3.0 * (1.0 - np.cos(angle))
        for r, sense in ((inner, 1.0), (outer, -1.0)):
            # moment of H and weight about the end of the joint, which keeps it in compression
            x, y = r * np.sin(angle), r * np.cos(angle)
            rows.append([sense * y, -sense])
            limits.append(-sense * (area * x - moment))
    return linprog([0.0, 0.0], rows, limits, bounds=[(0.0, None), (None, None)]).status == 0


@pytest.mark.parametrize("stones", [7, 11, 17, 27, 50])
def test_least_thickness_of_a_semicircle(stones):
    low, high = 0.05, 0.2
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if has_thrust_line(stones, middle) else (middle, high)
    number, half = reference(f"S01_{stones:02d}", "thickness")
    assert high == pytest.approx(number, abs=half)


def four_hinges(scene):
    """Least factor on horizontal forces of all four-hinge mechanisms, by virtual work."""
    outlines = [np.array(b["outline"]) for b in scene["blocks"][1:-1]]
    weights, centroids = zip(*map(measured, outlines), strict=True)
    ends = np.array([joint["ends"] for joint in scene["joints"]])
    # sums of weight, and of weight times place, over the stones left of each joint
    sums = np.vstack([np.zeros(3), np.cumsum([[w, w * x, w * y] for w, (x, y) in
                      zip(weights, centroids, strict=True)], axis=0)])  # fmt: skip
    best = np.inf
    for joints in combinations(range(len(ends)), 4):
        for first in (0, 1):
            a, b, c, d = (ends[j, (first + k) % 2] for k, j in enumerate(joints))
            if (centre := intersection(a, b, d, c)) is None:
                continue
            # rotations of the three parts: the first is 1, hinges move equally on both sides
            second = ratio(b - a, b - centre)
            third = second * ratio(c - centre, c - d)
            work = np.zeros(2)
            turning = zip((1.0, second, third), (a, centre, d), joints, joints[1:], strict=False)
            for turn, pole, left, right in turning:
                w, wx, wy = sums[right] - sums[left]
                # displacement turn × (-(y - pole), x - pole)
                work += turn * np.array([-(wy - w * pole[1]), -(wx - w * pole[0])])
            if work[0] != 0.0 and (factor := -work[1] / work[0]) > 0.0:
                opens = np.array([1.0, second - 1.0, third - second, -third])
                if admissible(opens, first) == np.sign(work[0]):
                    best = min(best, factor)
    return best


def measured(outline):
    """Area and centroid of a polygon."""
    x, y = outline.T
    u, v = np.roll(outline, -1, axis=0).T
    twice = x * v - u * y
    area = 0.5 * twice.sum()
    return area, np.array([((x + u) * twice).sum(), ((y + v) * twice).sum()]) / (6.0 * area)


def intersection(a, b, d, c):
    """Intersection of the lines ab and dc, the pole of the middle part."""
    rows = np.column_stack([b - a, c - d])
    if abs(np.linalg.det(rows)) < 1e-12:
        return None
    return a + np.linalg.solve(rows, d - a)[0] * (b - a)


def ratio(along, other):
    """Ratio of two parallel vectors."""
    return float(along @ other / (other @ other))


def admissible(opens, first):
    """Sense of the motion in which all hinges open on the side opposite to their face, or 0.

    A part that turns clockwise relative to the one on its left opens the extrados between them.
    """
    signs = np.sign(opens) * np.where((np.arange(4) + first) % 2 == 0, 1.0, -1.0)
    return -signs[0] if np.all(signs == signs[0]) else 0.0


@pytest.mark.parametrize("name", ["S03", pytest.param("S04", marks=pytest.mark.slow)])
def test_four_hinges_sideways(name):
    number, half = reference(name)
    assert four_hinges(read_scene(name)) == pytest.approx(number, abs=half)


class Rocking:
    """A block on its edge by Housner's equation, from its breadth and height."""

    def __init__(self, breadth, height):
        self.slender = np.arctan(breadth / height)
        self.pace = 0.75 * 9.81 / (0.5 * np.hypot(breadth, height))  # p², of Housner's rate
        self.ratio = 1.0 - 1.5 * np.sin(self.slender) ** 2

    def fall(self, tilt):
        """Time from rest at a tilt to the impact."""

        def slowness(root):
            # time over angle, with the angle tilt - root² to remove the singularity at rest
            angle = tilt - root**2
            energy = np.cos(self.slender - tilt) - np.cos(self.slender - angle)
            return 2.0 * root / np.sqrt(2.0 * self.pace * energy)

        return quad(slowness, 0.0, np.sqrt(tilt))[0]

    def impact(self, number, tilt, ratio):
        """Time of an impact; angular velocities after impacts are those before times a ratio."""
        time, energy = self.fall(tilt), np.cos(self.slender - tilt) - np.cos(self.slender)
        for k in range(1, number):
            cosine = np.cos(self.slender) + energy * ratio ** (2 * k)
            time += 2.0 * self.fall(self.slender - np.arccos(cosine))
        return time


def test_a_rocking_block_by_housner():
    block = Rocking(0.6, 2.4)
    assert block.ratio == pytest.approx(reference("S11", "ratio")[0], abs=1e-6)
    tilt = read_scene("S11")["action"]["tilt"]
    number, half = reference("S11", "first impact")
    assert block.fall(tilt) == pytest.approx(number, abs=half)


@pytest.mark.parametrize("name", ["S12_1", "S12_2", "S12_3", "S12_1r", "S12_2r", "S12_3r"])
def test_the_seventh_impact_of_a_rocking_block(name):
    scene = read_scene(name)
    (left, _), (right, _), (_, height) = scene["blocks"][1]["outline"][:3]
    block, action = Rocking(right - left, height), scene["action"]
    number, half = reference(name, "seventh impact")
    found = block.impact(7, action["tilt"], action["ratio"] or block.ratio)
    assert found == pytest.approx(number, abs=0.1 * half)


def test_every_computed_reference_names_a_test():
    for name, quantity in product(["S15_12", "S15_15"], ["spread"]):
        (value,) = read_references(name)
        assert value.quantity == quantity
        assert value.url.startswith("tests/")
