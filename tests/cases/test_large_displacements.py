"""Cases whose displacements may be large: refused settings, and all files of a run."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from pages import head_of

import archfem as af
from archfem.cases.report.conclusion import build_conclusion, list_facts
from archfem.cases.report.outcomes import describe_ends
from archfem.cases.report.report_data import ReportData
from archfem.cases.report.response import _build_mechanism, summarise_outcome
from archfem.cases.result_text import tabulate_runs
from archfem.commands.run import run as run_command
from archfem.dynamics.history import with_fall
from archfem.view.pages.document import FigureBlock

CASE = """
title = "a column that falls"
[structure]
shape = "column"
breadth = 0.4
heights = [0.8, 0.8]
[model]
fidelity = "rigid"
displacements = "large"
[motion]
synthetic = { seed = 4, duration = 1.5, pga = 30.0 }
[analysis]
dt = 0.005
[output]
animation = false
"""


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "falls.toml"
    file.write_text(CASE)
    return file


def test_displacements_reach_the_model(path):
    case = af.Case.read(path)
    assert case.analysis.discretisation.displacements == "large"
    assert af.Case.read(path, ["model.displacements=small"]).analysis.displacements == "small"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("model.fidelity=monolithic", "do not exist with fidelity 'monolithic': use 'full'"),
        ("model.displacements=far", "displacements = 'far' is not known"),
        ("analysis.scheme=newmark", r"does not keep the energy of blocks that turn far.*Conserv"),
        ("model.quadrature=exact", None),
        ("model.quadrature=nodal", None),
    ],
)
def test_settings_without_large_displacements_are_refused(path, change, says):
    if says is None:
        rule = af.Case.read(path, [change]).analysis.discretisation.rule
        assert rule.rule == change.split("=")[1]
        return
    with pytest.raises(af.InvalidInput, match=says):
        af.Case.read(path, [change])


def test_schemes_without_memory_are_refused_in_python_too(path):
    model = af.build(af.Case.read(path).structure, fidelity="rigid", displacements="large")
    motion = af.Motion.synthetic(duration=1.0, pga=1.0, seed=1)
    with pytest.raises(af.InvalidInput, match="blocks that turn far"):
        af.time_history(model, motion, scheme=af.dynamics.Newmark())


@pytest.mark.slow
def test_a_run_writes_all_its_files_and_begins_with_the_verdict(path, tmp_path, undrawn):
    class Given:
        case, changes, out, workers = path, (), tmp_path / "out", 1

    run_command(Given)
    names = {file.name for file in Given.out.iterdir()}
    written = {f"{name}.png" for name in ("dead", "names", "critical_instant", "envelope")}
    written |= {"joints.png", "fall.png"}
    assert written | {"history.nc"} <= names
    summary = (Given.out / "summary.txt").read_text(encoding="utf-8")
    assert summary.startswith("fallen, first at ")
    assert summary.splitlines()[0].endswith(
        "; one motion, one set of properties: range not computed"
    )
    history = af.dynamics.History.read(Given.out / "history.nc", af.Case.read(path).structure)
    assert history.fall.kind == "fallen"
    # blocks that came loose and stand are on no way to the ground
    stood = replace(history, dataset=history.dataset.assign_attrs(fall="dislocated"))
    data = ReportData(af.Case.read(path), {"shake": history})
    drawn = [
        any(isinstance(piece, FigureBlock) for piece in _build_mechanism(data, run))
        for run in (history, stood)
    ]
    assert drawn == [True, False]
    assert tabulate_runs({"pair": history}).rows[0][1] == "fallen"


@pytest.fixture
def held(path):
    """The history of a run that holds."""
    *_, done = af.cases.run_case(af.Case.read(path, ["motion.scale=0.01", "motion.end=0.5"]))
    return done.history


def test_a_run_that_stands_is_reported_so(held):
    assert held.verdict.headline.startswith("stands")
    assert "largest displacement of a corner " in str(held.verdict)
    data = ReportData(af.Case.of(tomllib.loads(CASE)), {"shake": held})
    assert summarise_outcome(data, held) == "stands"


def sentences_of(data):
    """The paragraphs of a conclusion but that across the plane."""
    words = [piece for piece in build_conclusion(data).pieces if piece.kind == "words"]
    return [piece.text for piece in words if piece.lead != "Across its plane?"]


def test_a_range_in_the_folder_stands_in_place_of_what_a_run_cannot_know(held):
    """The run says that no range was computed; a command after it computed one."""
    count = 4
    columns = {"k_n": np.linspace(0.5, 2.0, count), "dt": ["as given", "half"] * 2}
    columns |= {"outcome": ["fallen", "stands", "stands", "stands"], "error": [""] * count}
    columns |= {"residual": np.zeros(count), "sampled": np.ones(count, bool)}
    columns |= {"displacement": [2.0, 0.001, 0.002, 0.003]}
    rows = {name: ("run", np.asarray(values)) for name, values in columns.items()}
    attrs = {"properties": ["k_n", "dt"], "k_n": 1e9, "k_s": 1e9}
    data = ReportData(af.Case.of(tomllib.loads(CASE)), {"shake": held})
    without = sentences_of(data)
    varied = "motion, lengths, stiffness, friction, damping, size of the motions, time step"
    assert (
        f" M{varied[1:]} and fidelity were not varied; displacements have no range." in without[-1]
    )
    data = ReportData(data.case, data.runs)
    vars(data)["verdict_ranges"] = (af.dynamics.VerdictRange(xr.Dataset(rows, attrs=attrs)),)
    assert summarise_outcome(data, held) == "stands; falls in 1 of 4 variations"
    head = head_of(list_facts(data))
    assert head.startswith(
        "It survives: it stands under the motion 'shake' of PGA 0.03 g, and moves by 0.102 mm. "
        "From which acceleration on it falls was not computed. One motion was run, and others of "
        "its size may do otherwise. With other plausible properties it falls in 1 of 4 variations. "
    )
    moved = "1 mm to 3 mm, in 95 % of 3 runs 3 mm or less"
    unvaried = "Motion, lengths, size of the motions and fidelity were not varied."
    assert sentences_of(data)[-1] == f"The checks of the numbers raise no doubt. {unvaried}"
    words = [piece.text for piece in _build_mechanism(data, held) if hasattr(piece, "text")]
    assert words[0].startswith("Outcome: stands; falls in 1 of 4 variations. Mechanism: ")
    assert not any("not varied" in line for line in words)
    doubted = ReportData(data.case, data.runs)
    reason = json.dumps([("fill is rigid", "cut it")])
    range_ = af.dynamics.VerdictRange(xr.Dataset(rows, attrs=attrs | {"doubts": reason}))
    vars(doubted)["verdict_ranges"] = (range_,)
    pieces = build_conclusion(doubted).pieces
    assert "In doubt, variations: Fill is rigid." in [getattr(x, "text", "") for x in pieces]
    (table,) = (each for each in pieces[:-1] if each.kind == "grid")
    outcome = f"falls in 1 of 4 variations; largest displacements {moved} (in doubt)"
    assert ("variations", "the same motion", outcome, "-") in table.rows
    # of several motions it is that of one alone
    both = ReportData(data.case, {"shake": held, "other": held})
    for motion, own in ((held.dataset.attrs["motion"], True), ("another", False), (None, False)):
        named = {} if motion is None else {"motion": motion}
        computed = af.dynamics.VerdictRange(xr.Dataset(rows, attrs=attrs | named))
        vars(both)["verdict_ranges"] = (computed,)
        assert ("1 of 4 variations" in summarise_outcome(both, held)) == own


def test_a_report_has_the_number_of_lost_stones_of_each_part(held):
    tables = tomllib.loads(CASE)
    tables["structure"]["heights"] = [0.2] * 13
    case = af.Case.of(tables)
    names = [case.structure.blocks[number].name for number in case.structure.free[1:]]
    fall = af.dynamics.CollapseState("fallen", 1.25, tuple(names), 2.0, 2.0, True)
    run = with_fall(held, fall)
    data = ReportData(case, {"shake": run})
    words = "fallen"
    assert summarise_outcome(data, run) == words
    text = " ".join(sentences_of(data))
    short = f"12 of 13 of {case.structure.blocks[1].part}"
    head = head_of(list_facts(data))
    assert head.startswith("It does not survive: it falls under the motion 'shake' of PGA 0.03 g.")
    assert f"Under 'shake' it loses 12 blocks, the first at 1.25 s: {short}." in text
    stated, *_ = [b.text for b in _build_mechanism(data, run) if hasattr(b, "text")]
    lost = f"Lost: 12 blocks, the first at 1.25 s: {short}. Mechanism: "
    assert stated.startswith(f"Outcome: {words}. {lost}")
    run = with_fall(held, fall)
    vars(run)["fall"] = replace(
        fall, mechanism="by hinges (base) at 1.000 s, when blocks come loose"
    )
    (ends,) = describe_ends(ReportData(case, {"shake": run}))
    assert ends.endswith(f": {short}; it falls by hinges (base) at 1.000 s, when blocks come loose")
    assert "\nit falls by hinges (base) at 1.000 s" in str(run.verdict)
