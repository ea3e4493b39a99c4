"""Pairs on processes: the results that `carried_out` reads are those of one process."""

import numpy as np
import pytest

import archfem as af
from archfem.studies import run_pairs


def histories(case, folder):
    """Runs of a case by pair."""
    found = af.cases.run_case(case, folder)
    return {run.motion.name: run for run in found if isinstance(run, af.cases.Run)}


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_pairs_are_kept_where_they_are_looked_for(small, tmp_path, undoubted, workers):
    case = af.Case.read(small)
    assert run_pairs(case, tmp_path / "out", workers=workers) == ["finished", "finished"]
    there, alone = histories(case, tmp_path / "out"), histories(case, tmp_path / "alone")
    assert [run.reused for run in there.values()] == [True, True]
    for name, run in alone.items():
        ours, theirs = (each.history.joints["N"].values for each in (there[name], run))
        assert np.abs(ours - theirs).max() <= 1e-6 * np.abs(theirs).max()


def test_a_model_chosen_for_all_pairs_is_not_chosen_pair_by_pair(small, small_ring, tmp_path):
    for case in (af.Case.read(small, ["model.fidelity=auto"]), small_ring):
        with pytest.raises(af.InvalidInput, match="pairs run in parallel only if"):
            run_pairs(case, tmp_path)
