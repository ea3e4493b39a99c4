"""When a run first meets a mechanism, by each definition."""

from dataclasses import replace

import archfem as af
from archfem.dynamics.verdicts import first_mechanisms


def test_definitions_obey_the_criteria_of_the_run(run):
    loose = run.judged_by(af.Criteria(hinge=0.3, failures=5))
    found = first_mechanisms(loose)
    assert found == first_mechanisms(run, loose.criteria)
    assert found["any four joints"] == replace(loose.mechanism, blocks=())
