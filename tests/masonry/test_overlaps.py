"""Outlines that overlap: how deep, where, and between which blocks it matters."""

import numpy as np
import pytest

import archfem as af
from archfem.masonry.block import check_overlaps, check_simple

NAMES = ["a", "b"]


def box(x, y, width=1.0, height=1.0):
    return np.array([[x, y], [x + width, y], [x + width, y + height], [x, y + height]])


@pytest.mark.parametrize(("share", "apart"), [(0.98, True), (1.02, False)])
def test_an_overlap_is_none_up_to_a_millionth_of_all_outlines(share, apart):
    """A strip d by 1 m has 2 A / P = d / (1 + d); all outlines are 2 m by 1 m large."""
    deep = share * 1e-6 * np.hypot(2.0, 1.0)
    outlines = [box(0.0, 0.0), box(1.0 - deep, 0.0)]
    if apart:
        check_overlaps(outlines, NAMES)
    else:
        with pytest.raises(af.errors.InvalidStructure, match="'a' and 'b' overlap by"):
            check_overlaps(outlines, NAMES)


def test_an_overlap_is_reported_with_its_depth_and_its_place():
    """A strip of 2 cm by 1 m, 2 A / P = 0.0196 m deep, a third of the way up the other block."""
    outlines = [box(0.0, 0.0), box(0.98, 0.0), box(5.0, 0.0)]
    check_overlaps(outlines, [*NAMES, "c"], deep=0.0197)
    with pytest.raises(af.errors.InvalidStructure) as caught:
        check_overlaps(outlines, [*NAMES, "c"], deep=0.0195)
    words = "overlap by 200 cm², about 19.6 mm deep at (0.990, 0.500): correct their outlines"
    assert str(caught.value).endswith(words)


def test_the_deepest_of_several_overlaps_is_reported_and_most_of_a_block_may_be_drawn_twice():
    outlines = [box(0.0, 0.0), box(0.98, 0.0), box(1.3, 0.0)]
    words = "'b' and 'c' overlap .* at .1.640, 0.500., the deepest of 2 .* one drawn twice$"
    with pytest.raises(af.errors.InvalidStructure, match=words):
        check_overlaps(outlines, [*NAMES, "c"])


def test_each_kind_of_overlap_has_its_remedy():
    """Two pairs, of which the deepest is one drawn twice, or is no such pair."""
    twice, crossed = [box(0.0, 0.0)] * 2, [box(5.0, 0.0), box(5.98, 0.0)]
    larger = [box(5.0, 0.0, 9.0, 9.0), box(12.0, 0.0, 9.0, 9.0)]  # by 2 m
    for outlines, words in (
        (twice + [box(each, 3.0) for each in (0.0, 0.0)], "overlaps .*: leave one out$"),
        (twice + crossed, ": leave one out; correct the outlines of those that only overlap$"),
        (twice + larger, ": correct their outlines, or leave out the one drawn twice$"),
    ):
        with pytest.raises(af.errors.InvalidStructure, match=words):
            check_overlaps(outlines, [*NAMES, "c", "d"])


def test_overlaps_of_small_blocks_are_refused_too():
    """Centimetres of one and a half: the overlap is 1 mm by 1 cm, 2 A / P = 0.909 mm deep."""
    with pytest.raises(af.errors.InvalidStructure, match=r"by 0.1 cm², about 0.909 mm deep"):
        check_overlaps([box(0.0, 0.0, 0.015, 0.01), box(0.014, 0.0, 0.015, 0.01)], NAMES)


@pytest.mark.parametrize(("share", "same"), [(1.0 - 0.5e-6, True), (1.0 - 2e-6, False)])
def test_outlines_are_the_same_to_a_millionth_of_their_area(share, same):
    words = "are the same: leave one out" if same else "overlap by"
    with pytest.raises(af.errors.InvalidStructure, match=words):
        check_overlaps([box(0.0, 0.0), box(0.0, 0.0, share)], NAMES)


@pytest.mark.parametrize(
    ("body", "refused"),
    [(np.array([-1, -1]), False), (np.array([-1, 1]), True), (None, True)],
)
def test_overlaps_are_refused_unless_between_supports(body, refused):
    outlines = [box(0.0, 0.0), box(0.5, 0.0)]
    if refused:
        with pytest.raises(af.errors.InvalidStructure, match="overlap"):
            check_overlaps(outlines, NAMES, body=body)
    else:
        check_overlaps(outlines, NAMES, body=body)


def test_outlines_that_cross_themselves_are_refused_either_way_round():
    bow = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    for outline in (bow, bow[::-1]):
        with pytest.raises(af.errors.InvalidStructure, match=r"'a' crosses or touches itself"):
            check_simple(outline, "a")
    check_simple(box(0.0, 0.0)[::-1], "a")
