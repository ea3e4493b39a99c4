"""Runs of Arch-Bench: archfem against stored answers, other programs, and runs that go wrong."""

import json
import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from archbench import figures, run, table
from archbench.programs import Program, programs, read_manifest
from archbench.scene import BenchError, read_references, read_scene, scene_names
from archbench.worker import load

SCENE = read_scene("S04")
PROGRAMS = {program.name: program for program in programs()}

GOOD = """
def version():
    return "toy 1"

def run(scene, settings):
    return {"values": {"factor": 0.5}, "said": "as stated"}
"""

MANIFEST = 'needs = []\npython = "bench"\nsettings = {"sideways": [{"n": 1}, {"n": 2}]}\n'


@pytest.fixture(scope="module")
def rows():
    """Rows of the table of stored answers."""
    return table.rows()


def toy(tmp_path, code, manifest=MANIFEST):
    """A program of a few lines."""
    path = tmp_path / "toy.py"
    path.write_text(manifest + code, encoding="utf-8")
    return read_manifest(path)


def answer(program, settings, limit=60.0):
    """The answer of a program to the scene."""
    with run.Process(program, SCENE, limit) as process:
        return process.ask(settings)


def test_a_run_returns_the_answer_with_version_settings_and_cost(tmp_path):
    found = answer(toy(tmp_path, GOOD), {"n": 1})
    assert found["values"] == {"factor": 0.5}
    assert found["settings"] == {"n": 1}
    assert found["version"] == "toy 1"
    assert found["cpu_s"] >= 0.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'return {"values"',
            'import time; time.sleep(60)\n    return {"values"',
            "no answer within 0.3 s",
        ),
        ('return {"values"', 'import os; os.abort()\n    return {"values"', "died of signal 6"),
        ('return {"values"', 'raise ValueError("no way")\n    return {"values"', "no way"),
        ("0.5", "float('nan')", "no number for factor"),
        ('"factor": 0.5', '"other": 0.5', "no number for factor"),
    ],
)
def test_a_failed_run_reports_its_error(tmp_path, old, new, message):
    limit = 0.3 if "sleep" in new else 60.0
    found = answer(toy(tmp_path, GOOD.replace(old, new)), {"n": 1}, limit)
    assert message in found["failed"]
    assert run.failures("toy", {"S04": {"runs": [found]}}) == [f"toy S04: {found['failed']}"]
    assert found["failed"] in run.summary({"runs": [found]})


def test_a_program_that_died_answers_the_next_settings(tmp_path):
    code = GOOD.replace(
        "    return {", '    if settings["n"] == 1:\n        import os; os.abort()\n    return {'
    )
    with run.Process(toy(tmp_path, code), SCENE) as process:
        assert "died" in process.ask({"n": 1})["failed"]
        assert process.ask({"n": 2})["values"] == {"factor": 0.5}
    assert not process.folder.exists()


def test_archfem_runs_in_turn_with_every_other_program(tmp_path, monkeypatch):
    log = tmp_path / "log"
    code = f"""
def run(scene, settings):
    with open({str(log)!r}, "a") as file:
        file.write(f"NAME {{settings['n']}}\\n")
    return {{"values": {{"factor": 0.5}}}}

def version():
    return "toy 1"
"""
    both = []
    for name in ("archfem", "other"):
        path = tmp_path / f"{name}.py"
        path.write_text(MANIFEST + code.replace("NAME", name), encoding="utf-8")
        both.append(read_manifest(path))
    monkeypatch.setattr(run, "programs", lambda: both)
    found = run.run_scene(both, "S04")
    # the first answer of a process is a repetition, after modules are loaded
    calls = ["archfem 1"] * 2 + ["archfem 2"] + ["other 1"] * 2
    calls += ["other 1", "archfem 1"] * 3 + ["other 2"]
    assert log.read_text(encoding="utf-8").split("\n")[:-1] == calls
    cost = found["other"]["cost"]
    assert len(cost["own"]) == len(cost["archfem"]) == 3
    assert "cost" not in found["archfem"]
    assert [len(each["runs"]) for each in found.values()] == [2, 2]


def test_a_long_run_is_timed_once():
    class TimedAnswer:
        def __init__(self, cost):
            self.cost, self.count = cost, 0

        def ask(self, _):
            self.count += 1
            return {"cpu_s": self.cost}

    program, archfem = TimedAnswer(4.0), TimedAnswer(0.1)
    cost = run.times_in_turn((program, {}, {"cpu_s": 4.0}), (archfem, {}), long=3.0)
    assert cost == {"own": [4.0], "archfem": [0.1]}
    assert (program.count, archfem.count) == (0, 1)


def test_a_program_that_is_not_installed_is_skipped(tmp_path):
    absent = toy(tmp_path, "import a_package_that_is_not_there\n" + GOOD)
    assert not absent.is_installed()
    assert "cannot import" in absent.install()
    assert not replace(absent, python="/no/such/python").is_installed()


def test_a_scene_that_a_program_cannot_answer_is_not_run(tmp_path):
    program = toy(tmp_path, GOOD)
    assert program.refusal(SCENE) == ""
    assert "no action 'load'" in program.refusal(read_scene("S20"))
    assert replace(program, cannot={"S0": "too old"}).refusal(SCENE) == "too old"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("needs = []\n", "settings"),
        ("needs = []\nsettings = {'prayer': []}\n", "prayer"),
        ("needs = list()\nsettings = {}\n", "literal"),
    ],
)
def test_a_wrong_manifest_is_refused(tmp_path, text, message):
    with pytest.raises(BenchError, match=message):
        toy(tmp_path, GOOD, text)


def test_settings_that_are_not_physics_take_two_values_at_least():
    exact = {("archfem", "sideways")}  # by a linear programme
    for program in PROGRAMS.values():
        for action, settings in program.settings.items():
            count = len([each for each in settings if "variant" not in each])
            assert count >= (1 if (program.name, action) in exact else 2), (program.name, action)


def test_wrong_inputs_are_listed(monkeypatch):
    def refuse(name):
        raise BenchError(f"reference {name} is wrong")

    monkeypatch.setattr(run, "read_references", refuse)
    assert run.check_inputs(["S03", "S04"]) == ["reference S03 is wrong", "reference S04 is wrong"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PROGRAMS if name != "archfem"])
def test_every_program_answers_one_scene_where_it_is_installed(name):
    program: Program = PROGRAMS[name]
    if not program.is_installed():
        pytest.skip(f"{name} is not installed")
    settings = program.settings["sideways"][0]
    found = answer(program, settings)
    (reference,) = read_references("S04")
    assert "failed" not in found
    # impulses of Siconos do not converge within its sweeps; the others are within a per cent
    tolerance = 0.06 if name == "siconos" else 0.015
    assert found["values"]["factor"] == pytest.approx(reference.number, rel=tolerance)


@pytest.mark.parametrize(
    ("cost", "tolerance", "least"),
    [
        # every scene that takes less than 0.05 s, by some of its settings
        (0.05, 1e-3, 15),
        # amplitudes of falls are searched to 1 %, and depend on the rounding of the processor
        pytest.param(60.0, 1e-2, 140, marks=pytest.mark.slow),
    ],
    ids=["cheap", "all"],
)
def test_archfem_answers_as_it_is_stored(cost, tolerance, least):
    """As `make archbench-quick`, for stored runs of less processor time, at all their settings."""
    differences, count = run.compare_with_stored(cost, tolerance)
    assert differences == []
    assert count >= least


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("S07", "S08_020", "S12_2r")]


@pytest.mark.parametrize("name", ["S05", *SLOW])
def test_a_history_of_each_kind_answers_as_it_is_stored(name, monkeypatch):
    """Pulse, record, fall and rocking, which take too long for all settings: by the cheapest."""
    runs = run.results_of("archfem")[name]["runs"]
    cheapest = {name: {"runs": [min(runs, key=lambda each: each["cpu_s"])]}}
    monkeypatch.setattr(run, "results_of", lambda program: cheapest)
    assert run.compare_with_stored(cost=10.0, tolerance=1e-2) == ([], 1)


def test_a_stored_answer_that_is_no_longer_true_is_reported(tmp_path, monkeypatch):
    """Also one by other settings than the first."""
    stored = run.results_of("archfem")["S27"]
    stored["runs"][1]["values"]["load"] *= 1.002
    run.store("archfem", {"S27": stored}, tmp_path)
    monkeypatch.setattr(run, "results_of", partial(run.results_of, folder=tmp_path))
    (difference,), count = run.compare_with_stored()
    assert difference.startswith("S27, {'mobilisation': 0.0, 'cohesion': 0.0}, load: ")
    assert count == len(stored["runs"])


def test_pages_show_the_stored_answers(rows):
    made = table.sections(rows)
    for page in table.PAGES:
        text = page.read_text(encoding="utf-8")
        assert text == table.with_sections(text, made), page


def test_the_page_of_five_programs_has_their_stored_factors():
    page = (table.ROOT / "docs/verification.md").read_text(encoding="utf-8")
    shown = {}
    for program, row in (
        *(("archfem", "archfem"), ("opensees", "OpenSees"), ("hybridfem", "HybriDFEM")),
        *(("rbe", "RBE (compas_cra)"), ("lmgc90", "LMGC90"), ("siconos", "Siconos")),
    ):
        runs = run.results_of(program)["S04"]["runs"]
        factors = {each["values"]["factor"] for each in runs if "failed" not in each}
        (line,) = (line for line in page.splitlines() if line.startswith(f"| {row} | "))
        cell = line.split("|")[3]
        shown[program] = factors
        assert set(re.findall(r"0\.\d{5}", cell)) == {f"{factor:.5f}" for factor in factors}
    assert max(shown["archfem"]) == pytest.approx(max(shown["opensees"]), rel=1e-4)


def test_no_value_from_memory_is_shown_without_its_mark(rows):
    for row in rows:
        shown = table.markdown([row], ["archfem"]).splitlines()[-1]
        assert ("**m**" in shown) == (row.grade == "m")


def test_no_length_from_memory_is_shown_without_its_mark(rows):
    for row in rows:
        shown = table.markdown([row], ["archfem"]).splitlines()[-1]
        memory = read_scene(row.scene).get("from_memory")
        assert ("**g**" in shown) == bool(memory)
        if (row.scene, row.quantity) in table.HEAD:
            assert ("**g**" in table.head([row]).splitlines()[-1]) == bool(memory)
        if memory:
            assert f"From memory: {row.scene}: {', '.join(memory)}." in table.sources([row])
    measured = [row for row in rows if row.kind == "E"]
    labels = [text.get_text() for text in figures.measured(measured).axes[0].get_yticklabels()]
    for row, label in zip(measured, labels, strict=True):
        assert ("from memory" in label) == bool(row.from_memory or row.grade == "m")


def test_a_row_counts_answers_inside_the_uncertainty(rows):
    (row,) = (row for row in rows if row.scene == "S03")
    row_of_run = {"settings": {}, "values": {"factor": 0.37}, "cpu_s": 1.0}
    for value, inside in ((row.reference[0], True), (1.1 * row.reference[0], False)):
        runs = [
            {**row_of_run, "values": {"factor": value}},
            {**row_of_run, "values": {"factor": 0.5}},
        ]
        cost = {"own": [3.0, 2.0, 9.0], "archfem": [1.0, 2.0, 0.5]}
        answered = replace(row, answers={"toy": {"runs": runs, "cost": cost}})
        assert answered.is_inside("toy") is inside
        assert answered.cost("toy") == 3.0  # of medians
        assert "◦" in table.cell(answered, "toy") or inside
    failed = replace(row, answers={"toy": {"runs": [{"settings": {}, "failed": "it died"}]}})
    assert table.cell(failed, "toy") == "failed"
    assert "it died" in table.refusals([failed], ["toy"])
    assert table.cell(replace(row, answers={"toy": {"cannot": "no"}}), "toy") == "cannot"


def test_stored_answers_are_of_scenes_that_are_there():
    for path in run.RESULTS.glob("*.json"):
        assert set(json.loads(path.read_text(encoding="utf-8"))) <= set(scene_names())


def test_an_answer_on_a_bridge_is_a_range_that_meets_that_of_the_test(rows):
    (row,) = (row for row in rows if row.scene == "S20")
    middle, half = row.reference
    for low, high, inside in (
        (0.5 * middle, middle - 1.01 * half, False),
        (0.5 * middle, middle - 0.99 * half, True),
        (middle + 0.99 * half, 2.0 * middle, True),
        (middle + 1.01 * half, 2.0 * middle, False),
    ):
        runs = [{"settings": {}, "values": {"load": load}} for load in (low, high)]
        assert replace(row, answers={"toy": {"runs": runs}}).is_inside("toy") is inside


def test_a_ring_of_other_lengths_keeps_its_intrados_and_its_cover():
    scene = read_scene("S20")
    adapter = load(run.HERE / "adapters" / "archfem.py")
    assert adapter.with_lengths(scene, 1.0, 0.0) == scene
    thin = adapter.with_lengths(scene, 0.9, -0.1)
    for joint, other in zip(scene["joints"], thin["joints"], strict=True):
        (start, end), (same, moved) = np.array(joint["ends"]), np.array(other["ends"])
        assert (same == start).all()
        assert moved - same == pytest.approx(0.9 * (end - start))
    covers = [
        each["action"]["fill"]["surface"] - max(joint["ends"][1][1] for joint in each["joints"])
        for each in (scene, thin)
    ]
    assert covers[1] == pytest.approx(covers[0] - 0.1, abs=1e-6)
