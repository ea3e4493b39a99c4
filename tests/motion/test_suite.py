"""Suites of motions that share verticals, a scale and a spectrum."""

import numpy as np
import pytest

import archfem as af

CASE_STUDY = af.Tbec2018(ss=1.140, s1=0.315, site="ZD")


def motions(count, **options):
    return [af.Motion.synthetic(duration=6.0, seed=seed, **options) for seed in range(count)]


def test_six_horizontals_share_three_verticals():
    levels, uprights = motions(6), motions(3, vertical_ratio=0.0)
    suite = af.Suite.paired("case", levels, uprights, scale=1.5, reduction=3.0)
    assert len(suite.pairs) == 6
    assert suite.pairs[3].vertical == pytest.approx(uprights[1].horizontal)
    assert suite.motions[3].horizontal == pytest.approx(0.5 * levels[3].horizontal)
    assert suite.motions[3].vertical == pytest.approx(0.5 * uprights[1].horizontal)
    spectra = suite.spectra(np.array([0.0, 0.2]))
    # At zero period the spectrum is the peak, scaled but not reduced.
    assert spectra[:, 0] == pytest.approx([1.5 * level.pga for level in levels])


@pytest.mark.slow
def test_synthetic_suite_is_matched_and_repeats():
    build = {"horizontals": 2, "verticals": 1, "duration": 8.0, "reduction": 3.0}
    suite = af.Suite.synthetic(CASE_STUDY, seed=11, **build)
    assert len(suite.matches) == 2
    assert max(max(match.misfit.values()) for match in suite.matches) < 0.05
    again = af.Suite.synthetic(CASE_STUDY, seed=11, **build)
    assert np.array_equal(suite.motions[1].horizontal, again.motions[1].horizontal)
    assert suite.motions[0].pga == pytest.approx(suite.pairs[0].pga / 3.0)


def test_invalid_suites_are_refused():
    with pytest.raises(af.errors.InvalidInput, match="has no motion"):
        af.Suite("empty", ())
    with pytest.raises(af.errors.InvalidInput, match="cannot share 2 verticals"):
        af.Suite.paired("odd", motions(3), motions(2))
    with pytest.raises(af.errors.InvalidInput, match="are > 0"):
        af.Suite("none", motions(1), reduction=0.0)


def test_reversed_suite_turns_every_pair():
    suite = af.Suite("two", motions(2))
    for before, after in zip(suite.pairs, suite.reversed().pairs, strict=True):
        assert np.array_equal(after.horizontal, -before.horizontal)
        assert np.array_equal(after.vertical, before.vertical)


def test_a_synthetic_suite_counts_its_seeds_up(monkeypatch):
    """Before it is matched: horizontals of one seed after another, shared verticals the first."""
    monkeypatch.setattr(af.Suite, "matched", lambda suite, spectrum: suite)
    build = {"horizontals": 4, "verticals": 2, "duration": 2.0, "reduction": 3.0}
    suite = af.Suite.synthetic(CASE_STUDY, seed=11, **build)
    known = [af.Motion.synthetic(seed=seed, duration=2.0) for seed in (11, 12, 13, 14)]
    levels = [
        np.flatnonzero([np.array_equal(p.horizontal, k.horizontal) for k in known]).tolist()
        for p in suite.pairs
    ]
    uprights = [
        np.flatnonzero([np.array_equal(p.vertical, k.vertical) for k in known]).tolist()
        for p in suite.pairs
    ]
    assert levels == [[0], [1], [2], [3]]
    assert uprights == [[0], [0], [1], [1]]
    assert (suite.reduction, suite.scale) == (3.0, 1.0)
