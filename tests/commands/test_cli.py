"""Command line: arguments, exit codes, signals and full disks."""

import argparse
import errno
import io
import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem import _files
from archfem.commands.cli import exit_code
from archfem.dynamics import fall
from archfem.dynamics.rigid_body import simulation

COLUMN = (
    '[structure]\nshape = "column"\nbreadth = 1.0\nheights = [1.0]\n[model]\nfidelity = "rigid"\n'
)

RING = Path(__file__).parents[2] / "meshes" / "ring_paper.toml"


def test_an_output_that_is_no_folder_is_an_error_of_one_line(tmp_path, capsys):
    (tmp_path / "out").write_text("a file")
    given = ["run", str(RING), "--set", "model.fidelity=rigid", "--out", str(tmp_path / "out")]
    assert af.commands.main(given) == 1
    assert "out is a file, and results go into a folder: name another" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("out", "says"),
    [
        ("link", "link is a link to nowhere, which does not exist: make that folder, or name an"),
        ("link/results", "link is a link to nowhere, which does not exist"),
        ("file/results", "cannot be made (Not a directory): name another with --out"),
        ("/proc/results", "cannot be made (No such file or directory): name another with --out"),
    ],
)
@pytest.mark.parametrize("command", ["run", "modes", "accuracy", "verdict"])
def test_a_folder_that_cannot_be_made_is_refused_at_once(command, out, says, tmp_path, capsys):
    (tmp_path / "link").symlink_to("nowhere")
    (tmp_path / "file").write_text("")
    given = [command, str(RING), "--set", "model.fidelity=rigid", "--out", str(tmp_path / out)]
    assert af.commands.main(given) == 1
    said = capsys.readouterr()
    assert says in said.err
    assert said.err.count("\n") == 1
    assert "Errno" not in said.err
    assert said.out == ""


def test_a_file_system_that_is_read_only_is_refused_before_the_run(tmp_path, capsys, monkeypatch):
    def refuse(**_):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(_files.tempfile, "TemporaryFile", refuse)
    assert af.commands.main(["run", str(RING), "--out", str(tmp_path)]) == 1
    said = f"archfem: '{tmp_path}' cannot be written: read-only file system; name another place\n"
    assert capsys.readouterr().err == said


@pytest.mark.parametrize(
    ("title", "says"),
    [
        (
            r"a \u001b[31mred\u001b[0m ring",
            "has '\\x1b', which cannot be printed: write it without",
        ),
        (r"two\nlines", "has '\\n', which cannot be printed"),
    ],
)
def test_a_title_that_moves_the_cursor_is_refused(title, says, tmp_path, capsys):
    (tmp_path / "case.toml").write_text(f'title = "{title}"\n{COLUMN}')
    assert af.commands.main(["check", str(tmp_path / "case.toml")]) == 1
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_title_is_printed_as_far_as_the_terminal_has_letters(encoding, tmp_path, monkeypatch):
    (tmp_path / "case.toml").write_text(f'title = "Brücke Ω"\n{COLUMN}', encoding="utf-8")
    terminal = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", terminal)
    assert af.commands.main(["check", str(tmp_path / "case.toml")]) == 0
    printed = terminal.buffer.getvalue().decode(encoding)
    expected = {"ascii": r"Br\xfccke \u03a9", "latin-1": r"Brücke \u03a9", "utf-8": "Brücke Ω"}
    assert printed.startswith(expected[encoding])


def test_check_leaves_a_search_of_minutes_to_limit(capsys):
    """A linear programme is solved at once; a search without dilatancy takes minutes in walls."""
    given = ["check", str(RING), "--set", "model.fidelity=rigid", "--set", "limit.horizontal=1.0"]
    for friction, says in (
        ("coulomb", "mechanism, at "),
        ("nonassociated", "archfem limit` search"),
    ):
        assert af.commands.main([*given, "--set", f"limit.friction={friction}"]) == 0
        said = capsys.readouterr().out
        assert [says in line for line in said.splitlines() if "limit analysis: " in line] == [True]


def test_check_command(capsys):
    assert af.commands.main(["check", str(RING), "--set", "model.fidelity=rigid"]) == 0
    said = capsys.readouterr().out
    assert "dead load: stands under its own weight: |e| ≤ " in said
    assert "ready" in said
    assert af.commands.main(["check", str(RING), "--set", "structure.radus=3"]) == 1
    assert "did you mean 'radius'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ('structure = "arch"', "structure"),
        (
            "structure = {shape = 'outlines', file = 'a.dxf', layers = {a = 'arch'}}",
            "structure.layers.a",
        ),
    ],
)
def test_a_word_in_place_of_a_table_is_refused(words, name, tmp_path, capsys):
    """The drawing of a refused case is looked for: that meets the word again."""
    (tmp_path / "case.toml").write_text(words)
    assert af.commands.main(["check", str(tmp_path / "case.toml")]) == 1
    assert f"{name} = 'arch' is not a table" in capsys.readouterr().err


def test_run_of_a_ring_that_falls(tmp_path, capsys):
    given = ["--set", "structure.thickness=0.15", "--set", "model.fidelity=rigid"]
    assert af.commands.main(["run", str(RING), "--out", str(tmp_path), *given]) == 1
    assert "joints hinge" in capsys.readouterr().err
    assert not (tmp_path / "case.toml").exists()  # nor would it replace that of an earlier run


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (None, 0, ""),
        (af.InvalidInput("no such key"), 1, "archfem: no such key"),
        (OSError("disk full"), 1, "archfem: disk full"),
        (KeyboardInterrupt(), 130, "archfem: interrupted"),
    ],
)
def test_exit_codes_state_how_a_command_ended(error, code, says, capsys):
    def command():
        if error is not None:
            raise error

    assert exit_code(command) == code
    assert capsys.readouterr().err.strip() == says
    assert 130 == 130


def test_words_that_are_no_command_end_with_two(capsys):
    with pytest.raises(SystemExit, match="2"):
        af.commands.main(["rum", "ring.toml"])
    assert "invalid choice: 'rum'" in capsys.readouterr().err


def test_no_command_ends_with_two_and_lists_the_commands(capsys):
    with pytest.raises(SystemExit, match="2"):
        af.commands.main([])
    said = capsys.readouterr().err
    assert re.search(r"^ +limit +collapse factor", said, re.MULTILINE)
    assert re.search(r"^ +report ", said, re.MULTILINE)


GIB = 2**30


@pytest.mark.parametrize("limit", [0.5, 1.49, 1.5, 4.0, None])
def test_too_little_memory_for_libraries_is_refused(limit, monkeypatch, capsys):
    allowed = resource.RLIM_INFINITY if limit is None else int(limit * GIB)
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (allowed, resource.RLIM_INFINITY))
    short = limit is not None and limit < 1.5
    assert af.commands.main(["examples"]) == int(short)
    said = (
        f"memory is limited to {limit:.2f} GiB, and libraries alone take 1.50 GiB" if short else ""
    )
    assert said in capsys.readouterr().err


def test_an_option_that_is_left_out_has_the_value_in_its_help(monkeypatch):
    """Numbers in parentheses at the end of the help, such as "(6)"; ranges have two."""
    stated = {}

    def note(parser, *flags, **given):
        if numbers := re.search(r"\(([\d. ]+)\)$", given.get("help", "")):
            default = given.get("default")
            values = [float(each) for each in numbers[1].split()]
            stated[f"{parser.prog} {flags[0]}"] = values, default
        return add(parser, *flags, **given)

    add = argparse.ArgumentParser.add_argument
    monkeypatch.setattr(argparse.ArgumentParser, "add_argument", note)
    with pytest.raises(SystemExit):
        af.commands.main(["--version"])
    own = {name: each for name, each in stated.items() if each[1] is not None}
    assert set(stated) - set(own) == {"archfem rate --dead", "archfem animate --fps"}
    assert len(own) == 8
    for numbers, default in own.values():
        # help has three digits
        assert numbers == pytest.approx(np.atleast_1d(default).tolist(), rel=1e-2)


def test_a_quoted_name_may_be_changed(capsys):
    given = ["--set", 'contacts."stone to stone".friction=0.1', "--set", "model.fidelity=rigid"]
    assert af.commands.main(["check", str(RING), *given]) == 1
    assert "joints slide" in capsys.readouterr().err


def test_a_missing_record_is_reported_before_anything_is_computed(tmp_path, capsys):
    (tmp_path / "case.toml").write_text(
        f'base = "{RING}"\nremove = ["motion"]\n[motion]\nfile = "missing.at2"\n'
    )
    for command in (["check"], ["run", "--out", str(tmp_path / "out")]):
        assert af.commands.main([command[0], str(tmp_path / "case.toml"), *command[1:]]) == 1
        out, error = capsys.readouterr()
        assert "there is no record" in error
        assert "dead load" not in out


def test_a_refused_record_leaves_the_others(tmp_path, unplotted, capsys):
    (tmp_path / "bad.txt").write_text("words")
    rows = "".join(f"{0.01 * (k % 5 - 2):.4f}\n" for k in range(200))
    (tmp_path / "good.txt").write_text("# units g, dt 0.01\n" + rows)
    files = [str(tmp_path / name) for name in ("bad.txt", "good.txt")]
    assert af.commands.main(["motion", *files, "--out", str(tmp_path)]) == 1
    out, error = capsys.readouterr()
    assert "no line of numbers" in error
    assert "1 of 2 files were refused" in error
    assert "good" in out
    assert {"bad.txt", "good.txt"} < {path.name for path in tmp_path.iterdir()}  # and its pictures


COLUMN = """
[structure]
shape = "column"
breadth = 1.0
heights = [1.0]
[model]
fidelity = "rigid"
[motion]
synthetic = { seed = 1, duration = 3.0, pga = 1.0 }
"""


@pytest.fixture
def column(tmp_path):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN)
    return path


@pytest.mark.parametrize(
    ("number", "code"),
    [pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow), (signal.SIGTERM, 143)],
)
def test_a_signal_ends_a_motion_and_keeps_its_steps(
    column, tmp_path, unplotted, monkeypatch, capsys, number, code
):
    def cut_short(case, motion, dead, damping):
        def press(structure, resultants):
            if len(seen) == 300:
                os.kill(os.getpid(), number)
            seen.append(resultants)

        seen = []
        return af.time_history(dead.model, motion, dt=0.005, start=dead, until=press)

    def fail(*_):
        raise AssertionError("it does not end within seconds")

    # of a wall mechanisms take minutes to verify
    monkeypatch.setattr("archfem.dynamics.verdict.first_verified_mechanism", fail)
    monkeypatch.setattr("archfem.cases.run.run_time_history", cut_short)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # may be ignored here
    try:
        assert af.commands.main(["run", str(column), "--out", str(tmp_path / "out")]) == code
    finally:
        signal.signal(signal.SIGINT, before)
    run = af.History.read(tmp_path / "out" / "history.nc", af.Case.read(column).structure)
    assert run.ending is af.dynamics.Ending.INTERRUPTED
    assert 0.5 < run.time[-1] < 2.9
    summary = (tmp_path / "out" / "summary.txt").read_text()
    assert "outcome: interrupted at" in summary
    assert "s, and no mechanism was verified" in summary
    assert not (tmp_path / "out" / "envelope.png").exists()  # nor other pictures of the run
    assert "interrupted" in capsys.readouterr().err


def test_sigterm_in_a_fall_keeps_dead_load_and_history(tmp_path, unplotted, monkeypatch):
    """`timeout` sends it to the process and to its group, so twice; kept are the frames so far."""
    check = simulation._Run._check

    def stop(run, time):
        check(run, time)
        if time > 0.9:
            os.kill(os.getpid(), signal.SIGTERM)

    def write_twice(*given):
        os.kill(os.getpid(), signal.SIGTERM)
        return keep(*given)

    keep = fall.mark_interrupted
    monkeypatch.setattr(simulation._Run, "_check", stop)
    monkeypatch.setattr(fall, "mark_interrupted", write_twice)
    path, out = tmp_path / "column.toml", tmp_path / "out"
    path.write_text(
        COLUMN.replace("breadth = 1.0", "breadth = 0.6")
        .replace("[1.0]", "[2.4]")
        .replace("synthetic = { seed = 1, duration = 3.0, pga = 1.0 }", 'file = "push.csv"')
        .replace('"rigid"', '"rigid"\ndisplacements = "large"')
        + "[analysis]\ndt = 2e-3\n"
    )
    rows = "\n".join(f"{0.01 * k:.2f},3.924" for k in range(100))
    (tmp_path / "push.csv").write_text(f"Time (s),Acceleration (m/s2)\n{rows}\n")
    assert af.commands.main(["run", str(path), "--out", str(out)]) == 143
    assert (out / "dead.png").is_file()
    run = af.History.read(out / "history.nc", af.Case.read(path).structure)
    assert run.ending is af.dynamics.Ending.INTERRUPTED
    assert 0.88 < run.dataset["fall_time"].values[-1] <= 0.9
    assert "outcome: interrupted at 0.896 s, in a fall" in (out / "summary.txt").read_text()


@pytest.mark.slow
def test_sigterm_interrupts_where_gmsh_is_loaded():
    """gmsh sets the system's handler, upon which the signal would end the process at once."""
    pytest.importorskip("gmsh")
    script = "\n".join(
        [
            "import os, signal",
            "import archfem as af",
            "from archfem.commands.cli import exit_code, _interrupt_on_sigterm",
            "def stop():",
            "    af.build(af.column(breadth=1.0, heights=[1.0]), fidelity='faces')",
            "    os.kill(os.getpid(), signal.SIGTERM)",
            "with _interrupt_on_sigterm():",
            "    print(exit_code(stop))",
        ]
    )
    ran = subprocess.run([sys.executable, "-c", script], text=True, capture_output=True)
    # PETSc of Debian 13 says on standard error that it found two MPI libraries
    said = [x for x in ran.stderr.splitlines() if "both OpenMPI and MPICH" not in x]
    assert (ran.stdout, said) == ("130\n", ["archfem: interrupted"])


def test_a_run_without_a_result_says_that_nothing_is_kept(column, tmp_path, monkeypatch, caplog):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("archfem.cases.run.dead_load_of_case", stop)
    assert af.commands.main(["run", str(column), "--out", str(tmp_path / "out")]) == 130
    assert "interrupted before there was a result: nothing is kept" in caplog.text
    assert not list((tmp_path / "out").glob("*"))


def test_an_interrupted_search_without_dilatancy_keeps_or_says_its_bound(
    column, tmp_path, unplotted, monkeypatch, capsys
):
    """The column slides at 0.3 g; the other sense is not searched, and no assessment is kept."""

    def stop(*_):
        searched.append(1)
        raise KeyboardInterrupt

    searched, out, sliding = [], tmp_path / "out", "contacts.'stone to stone'.friction=0.3"
    monkeypatch.setattr("archfem.limit.nonassociated.find_solution", stop)
    changes = ["limit.horizontal=1", "limit.friction=nonassociated", sliding]
    changes += ["assessment.spectrum={ code = 'EC8', ag = 0.3, ground = 'B' }"]
    given = [part for change in changes for part in ("--set", change)]
    assert af.commands.main(["limit", str(column), *given, "--out", str(out)]) == 130
    text = (out / "limit.txt").read_text(encoding="utf-8")
    bound = "no state without dilatancy was found; it is at most 0.3 g, pushed to the right"
    assert text.startswith(f"limit analysis: {bound}\n")
    assert "the search was interrupted: no start has reached a solution" in text
    assert "in the other sense: not computed" in text
    assert len(searched) == 1
    capsys.readouterr()
    assert af.commands.main(["assess", str(column), *given, "--out", str(tmp_path / "no")]) == 130
    assert f"assessment: {bound}; nothing is kept\n" in capsys.readouterr().err
    assert not (tmp_path / "no").exists()


def test_an_assessment_is_kept_where_the_search_of_ties_is_cut_short(
    column, tmp_path, unplotted, monkeypatch, capsys
):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("archfem.cases.answers.note_ties", stop)
    given = ["--set", "assessment.spectrum={ code = 'EC8', ag = 0.3, ground = 'B' }"]
    assert af.commands.main(["assess", str(column), *given, "--out", str(tmp_path)]) == 130
    text = (tmp_path / "assessment.txt").read_text(encoding="utf-8")
    assert text.startswith("least margin ")
    assert "the force of ties with which all checks pass was not searched to its end" in text
    assert text.strip() in capsys.readouterr().out


def test_sigterm_in_limit_analysis_keeps_dead_load_and_motion(
    column, tmp_path, unplotted, monkeypatch, caplog
):
    def stop(*given, **options):
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr("archfem.cases.analysis_keys.collapse_factor", stop)
    out = tmp_path / "out"
    command = ["run", str(column), "--set", "limit.horizontal=1", "--out", str(out)]
    assert af.commands.main(command) == 143
    assert "reached the end of the motion" in (out / "summary.txt").read_text()
    assert (out / "dead.png").is_file()
    (run,) = af.cases.open_results(out).runs.values()
    assert run.ending is af.dynamics.Ending.FINISHED
    assert f"what was computed is kept in {out}" in caplog.text


def test_a_full_disk_is_an_error_in_words(column, tmp_path, unplotted, capsys):
    """A file may not be longer than 20 kB, which acts as a full disk does."""
    out = tmp_path / "out"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        assert af.commands.main(["run", str(column), "--out", str(out)]) == 1
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "history.nc could not be written, for the disk is full" in capsys.readouterr().err
    assert not (out / "history.nc").exists()
    assert not list(out.glob(".*.part*"))
