"""Results as text and tables."""

import re

import pytest

import archfem as af
from archfem.cases.result_text import (
    describe_collapse,
    describe_run,
    describe_run_quality,
    tabulate_joints,
    tabulate_runs,
)
from archfem.limit.mechanism_count import episode


@pytest.fixture(scope="module")
def run(ring):
    """The ring, under a motion that makes it a mechanism."""
    model = af.build(ring, fidelity="rigid")
    motion = af.Motion.synthetic(duration=3.0, pga=6.0, seed=2)
    return af.time_history(model, motion, dt=0.005, damping=af.Rayleigh(0.05, (8.0, 16.0)))


def test_the_verdict_comes_first(run, ring):
    text = describe_run(ring, run, run.joints.isel(time=0))
    found = describe_run_quality(run)
    assert text.startswith(f"{run.verdict}\n\n{found}\n\njoint ")
    assert f"outcome: reached the end of the motion; {len(run.time) - 1} steps" in found
    assert "of the largest exchanged at most" in found


def test_pair_table_tells_all_three(run, tmp_path):
    """By count, by the words of the paper, and verified; joints by name, and how far they open."""
    row = tabulate_runs({"pair": run}).text.splitlines()[1]
    found, moved = run.mechanism, run.verified.moved
    met = episode(run.joints, found)
    words = f"{1e3 * met.duration:.3g} ms  {1e3 * met.opening:.3g} mm"
    joints = f"joints {', '.join(map(str, found.joints[:-1]))} and {found.joints[-1]}"
    assert found.names == tuple(f"joint {number}" for number in found.joints)
    assert re.search(rf"local +{found.time:.3f} s +{re.sub('  ', ' +', words)} +{joints}", row)
    assert re.search(rf"local +{found.time:.3f} s +local +{moved.time:.3f} s", row.split(joints)[1])
    assert re.search(r" joint \d+ ", row.split(joints)[0])  # the gravest, by name
    alone = tabulate_runs({"pair": af.History.read(run.save(tmp_path / "run.nc"))}).text
    assert re.search(r"unknown +- +- +- ", alone)


def test_words_and_tables_obey_the_criteria_of_the_run(run):
    loose = run.with_criteria(af.Criteria(hinge=0.3, failures=5))
    assert tabulate_joints(loose.joints) != tabulate_joints(run.joints)
    calm = loose.with_criteria(af.Criteria(failures=18))
    assert calm.verdict.outcome == "no mechanism"


def test_limit_analysis_in_words(ring):
    pushed = af.collapse_factor(ring, live=af.BodyForce(1.0))
    outcome, hinges = describe_collapse(ring, pushed).splitlines()
    assert outcome.endswith(f"into a mechanism, at a factor of {pushed.factor:.4g} on the load")
    assert hinges.startswith("hinges, by the face in contact: joint 0 at the intrados, joint 6 at")
    slab = af.column(breadth=4.0, heights=[1.0])  # slides before it turns
    assert describe_collapse(slab, af.collapse_factor(slab, live=af.BodyForce(1.0))).endswith(
        f"\nsliding: {slab.joints[0].name}"
    )
    lifted = af.collapse_factor(slab, live=af.BodyForce(0.0, -1.0))
    assert describe_collapse(slab, lifted) == "limit analysis: this load never overturns it"
