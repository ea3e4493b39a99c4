"""What is tried, and said, where no equilibrium is found by steps."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.statics import ends
from archfem.statics.path import LoadPath

STOP = af.statics.Stop(displacement=0.25)


class Slow(LoadPath):
    """A path whose joints slide, and that creeps on where it is told to."""

    displacements = np.array([0.0, 2.0])

    def __init__(self, creeps, states=2, factor=0.4, grain=False):
        self.creeps, self.asked = list(creeps), []
        self.states, self.factors, self.unit = [0] * states, [0.0, factor], (1.0, 0.1)
        blocks = (SimpleNamespace(grain=grain),)
        self.model = SimpleNamespace(structure=SimpleNamespace(size=8.0, blocks=blocks))

    def creep(self, grown, farthest):
        self.asked.append((grown, farthest))
        if not self.creeps.pop(0):
            return False
        self.factors.append(self.factors[-1] + grown)
        self.displacements = np.append(self.displacements, self.displacements[-1] + 0.5)
        return True


@pytest.fixture
def slides(monkeypatch):
    """Names of the joints that slide."""
    names = ["bed 3", "bed 4"]
    monkeypatch.setattr(ends, "sliding", lambda path, criteria: names)
    return names


def test_loads_grow_by_a_twentieth_and_less_while_the_structure_creeps(slides, monkeypatch):
    """Halved where it does not come to rest, down to a 25th of that; so far as the rules let it."""
    moved = []

    def finished(path, stop, criteria, step):
        moved.append(step)

    monkeypatch.setattr(ends, "finished", finished)
    path = Slow([True, False, True, *[False] * 9])
    assert ends.crept(path, STOP, af.Criteria()) is None
    grown = [each for each, _ in path.asked]
    first, second = 0.05 * 0.4, 0.05 * 0.42
    rest = 0.42 + 0.5 * second
    assert grown == pytest.approx(
        [first, second, 0.5 * second, *(0.025 * rest / 2.0**k for k in range(4))]
    )
    assert {farthest for _, farthest in path.asked} == {2.0}
    assert moved[0] == pytest.approx([0.5, first / 0.1])
    assert len(moved) == 2


def test_a_path_has_ended_once_its_slope_is_small_enough():
    """In units of the first step: a twentieth of its load at ten times its way."""
    stop, moved = af.statics.Stop(slope=0.01), np.array([10.0, 0.05])
    assert ends.finished(Slow([]), stop, af.Criteria(), moved) == (
        "the slope fell to 0.005 of the initial one"
    )


def test_a_rule_ends_the_creep(slides, monkeypatch):
    monkeypatch.setattr(ends, "finished", lambda path, stop, criteria, step: "it is enough")
    assert ends.crept(Slow([False, True]), STOP, af.Criteria()) == "it is enough"


def test_only_what_slides_after_a_first_step_creeps(slides):
    assert ends.crept(Slow([True], states=1), STOP, af.Criteria()) is None
    slides.clear()
    assert ends.crept(Slow([True]), STOP, af.Criteria()) is None
    assert ends.crept(SimpleNamespace(states=[0, 0]), STOP, af.Criteria()) is None


@pytest.mark.parametrize(
    ("control", "grain", "words"),
    [
        ("force", False, "the load cannot grow beyond a factor of 0.4, at which 2 joints slide"),
        ("displacement", False, "the load cannot grow beyond a factor of 0.4"),
        ("path", True, "no equilibrium was found past a factor of 0.4"),
    ],
)
def test_what_slides_is_told_where_nothing_more_is_found(slides, control, grain, words):
    said = ends.stuck(Slow([], grain=grain), control, af.Criteria())
    assert said.startswith(words)
    assert "such as 'bed 3'" in said
    assert ("pieces of fill flow" in said) is grain
    slides.clear()
    said = ends.stuck(Slow([]), "displacement", af.Criteria())
    assert said == "no equilibrium was found past a factor of 0.4"
    with pytest.raises(af.DidNotConverge, match="just after the dead load"):
        ends.stuck(Slow([], states=1), control, af.Criteria())
