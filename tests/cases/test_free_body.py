"""What a case writes of its dead load."""

import archfem as af
from archfem.cases.report import write_dead


def test_a_case_may_ask_for_a_free_body(tmp_path):
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    tables = {"structure": {**ring, "voussoirs": 9}, "output": {"free_body": "voussoir 3"}}
    for cells, more in (({"fidelity": "rigid"}, []), ({"cells": [2, 2]}, ["png", "txt"])):
        case = af.Case.of({**tables, "model": cells})
        dead = af.dead_load(af.build(case.structure, **case.model))
        files = [path.name for path in write_dead(case, dead, tmp_path)]
        assert files == ["dead.png", *(f"dead_stress.{kind}" for kind in more), "free_body.png"]
    assert (tmp_path / "dead_stress.txt").read_text().splitlines()[1].startswith("arch ")
