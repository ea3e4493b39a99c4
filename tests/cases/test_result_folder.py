"""Files of result folders."""

import pytest

import archfem as af
from archfem.cases import result_folder as results


def test_more_pairs_than_colours_share_several_pictures(small, tmp_path):
    rest, _, run = af.cases.run_case(af.Case.read(small), pairs=["first"])
    runs = {str(number): run.history for number in range(7)}
    files = results.write_pairs(runs, rest, "a table", tmp_path)
    assert [path.name for path in files] == ["suite.txt", "envelope.png", "envelope_2.png"]


@pytest.mark.slow
def test_a_case_may_ask_for_a_free_body(tmp_path):
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    tables = {"structure": {**ring, "voussoirs": 9}, "output": {"free_body": "voussoir 3"}}
    for cells, more in (({"fidelity": "rigid"}, []), ({"cells": [2, 2]}, ["png", "txt"])):
        rest = af.cases.DeadLoadResult.of(af.Case.of({**tables, "model": cells}))
        files = [path.name for path in results.write_dead_load(rest, tmp_path)]
        drawn = [f"dead_stress.{kind}" for kind in more]
        assert files == ["dead.png", "names.png", *drawn, "free_body.png"]
    assert (tmp_path / "dead_stress.txt").read_text().splitlines()[1].startswith("arch ")
