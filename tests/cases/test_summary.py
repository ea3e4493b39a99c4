"""What is said of a run in words and tables."""

import pytest

import archfem as af
from archfem.cases.summary import collapse_words, joint_table, pair_table, verdict


@pytest.fixture(scope="module")
def run(ring):
    """The ring, under a motion that makes it a mechanism."""
    model = af.build(ring, fidelity="rigid")
    motion = af.Motion.synthetic(duration=3.0, pga=6.0, seed=2)
    return af.time_history(model, motion, damping=af.Rayleigh(0.05, (8.0, 16.0)))


def test_verdict_tells_count_and_motion(run, tmp_path):
    counted, moved = verdict(run).splitlines()
    assert f"by count: local mechanism of arch at {run.mechanism.time:.3f} s" in counted
    assert "rings and piers cannot move then" in counted
    assert f"verified: local mechanism of arch at {run.verified.moved.time:.3f} s" in moved
    names = [run.structure.blocks[k].name for k in run.verified.moved.blocks]
    assert f"moving: {names[0]}; " in moved
    assert len(names) <= 8 or f"({len(names)} in all)" in moved
    alone = verdict(af.History.read(run.save(tmp_path / "run.nc")))
    assert alone == counted.removesuffix("; rings and piers cannot move then")


def test_pair_table_tells_both(run, tmp_path):
    row = pair_table({"pair": run}).splitlines()[1]
    joints = " ".join(map(str, run.mechanism.joints))
    assert f"local  {run.mechanism.time:.3f} s  {joints}" in row
    assert f"local  {run.verified.moved.time:.3f} s" in row.split(joints)[1]
    alone = pair_table({"pair": af.History.read(run.save(tmp_path / "run.nc"))})
    assert "unknown" in alone


def test_words_and_tables_obey_the_criteria_of_the_run(run):
    loose = run.judged_by(af.Criteria(hinge=0.3, failures=5))
    assert joint_table(loose.joints) != joint_table(run.joints)
    calm = loose.judged_by(af.Criteria(failures=18))
    assert verdict(calm).startswith("no mechanism by count: never 18 failed joints at once")


def test_limit_analysis_in_words(ring):
    pushed = af.collapse_factor(ring, live=af.BodyForce(1.0))
    outcome, hinges = collapse_words(ring, pushed).splitlines()
    assert outcome.endswith(f"into a mechanism, at a factor of {pushed.factor:.4g} on the load")
    assert hinges.startswith("hinges, by the face in contact: joint 0 at the intrados, joint 6 at")
    slab = af.column(breadth=4.0, heights=[1.0])  # slides before it turns
    assert collapse_words(slab, af.collapse_factor(slab, live=af.BodyForce(1.0))).endswith(
        f"\nsliding: {slab.joints[0].name}"
    )
    lifted = af.collapse_factor(slab, live=af.BodyForce(0.0, -1.0))
    assert collapse_words(slab, lifted) == "limit analysis: this load never overturns it"
