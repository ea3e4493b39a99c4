"""A picture in which each joint has its name."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import archfem as af
from archfem.view import draw_names
from archfem.view.structure import short_name


def test_short_names():
    assert short_name("main arch, joint 5", "main arch") == "5"
    assert short_name("north pier, base", "north pier") == "base"
    assert short_name("joint 5", "arch") == "5"
    assert short_name("left bed", "pier") == "left bed"


def written(figure):
    """Words of a picture of names, with the boxes that they take on the page."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return [(note.get_text(), note) for note in figure.axes[0].texts]


def test_every_second_judged_joint_of_a_bridge_is_named(bridge):
    """Those to the soil are not; each name stands near the intrados end of its own joint.

    The bridge is 30 m long: on a page there is no room for all.
    """
    notes = written(draw_names(bridge))
    judged = [joint for joint, own in zip(bridge.joints, bridge.judged, strict=True) if own]
    words = [word for word, _ in notes]
    parts = dict.fromkeys(joint.part for joint in judged)
    named = [j for part in parts for j in [j for j in judged if j.part == part][::2]]
    assert sorted(words) == sorted([*parts, *(short_name(j.name, j.part) for j in named)])
    places = np.array([note.xy for word, note in notes if word not in parts])
    assert places == pytest.approx(np.array([joint.intrados for joint in named]))


@pytest.mark.parametrize("voussoirs", [9, pytest.param(17, marks=pytest.mark.slow), 60])
def test_names_of_a_ring_are_legible(voussoirs):
    """Each is turned with its joint, so that it takes a line; none is smaller than 7 points."""
    ring = af.circular_arch(radius=2.95, thickness=0.3, embrace=159.0, voussoirs=voussoirs)
    figure = draw_names(ring)
    notes = [note for _, note in written(figure)]
    # 60 stones are too near to one another: every second joint
    assert len(notes) == (31 if voussoirs == 60 else voussoirs + 1)
    assert min(note.get_fontsize() for note in notes) >= 7.0
    transform = figure.axes[0].transData
    places = transform.transform([note.xy for note in notes]) * 72.0 / figure.dpi
    lines = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert lines.min() > 1.2 * max(note.get_fontsize() for note in notes)
    assert all(-91.0 <= (note.get_rotation() + 180.0) % 360.0 - 180.0 <= 91.0 for note in notes)
