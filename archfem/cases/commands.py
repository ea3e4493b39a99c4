"""The commands of the command line: each takes what was given and prints what it finds."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from archfem.cases.case import Case
from archfem.dynamics.schemes import Rayleigh
from archfem.errors import DidNotConverge
from archfem.joints.criteria import judged
from archfem.motion.motion import Motion

if TYPE_CHECKING:
    from archfem.dynamics.history import History
    from archfem.motion.suite import Suite
    from archfem.statics.equilibrium import Equilibrium


def check(given: argparse.Namespace) -> None:
    """Read a case, build its model, find its dead load, read its motions."""
    case = Case.read(given.case, given.changes)
    dead = _dead_load(case)
    if case.suite is not None:
        _tell_motions(case.ground_suite())
    elif case.motion is not None:
        motion = case.ground_motion()
        print(f"motion: {motion.name}, {motion.duration:.2f} s, peak {motion.pga:.3f} m/s²")
    print(f"{given.case}: ready; dead load in {dead.iterations} iterations")


def motion(given: argparse.Namespace) -> None:
    """Print the measures of records and draw them."""
    from archfem.cases.report import named_apart, write_motions
    from archfem.cases.summary import motion_table

    options = {"column": given.column, "units": given.units, "dt": given.dt}
    motions = named_apart(
        [Motion.read(path, **options) for path in given.files],
        [Path(path).name for path in given.files],
    )
    print(motion_table(motions))
    _tell_written(write_motions(motions, Path(given.out)))


def accuracy(given: argparse.Namespace) -> None:
    """Run a case over rungs, meshes, rules and steps: table and picture."""
    from archfem.cases.run import expected_damping
    from archfem.dynamics.tradeoff import accuracy as compared
    from archfem.view.accuracy import draw_accuracy
    from archfem.view.style import save

    case, folder = Case.read(given.case, given.changes), Path(given.out)
    found = compared(
        case.structure,
        case.ground_motion(),
        damping=expected_damping(case),
        tolerance=case.model.get("tolerance", 0.005),
    )
    chosen = found.chosen.setting.label if found.chosen else "none: a finer model is needed"
    lines = [
        found.table(),
        "",
        f"reference: {found.reference.label}, in doubt by {found.doubt:.2g}",
        f"chosen for an error of {found.tolerance:g}: {chosen}",
    ]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "accuracy.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))
    _tell_written([folder / "accuracy.txt", save(draw_accuracy(found), folder / "accuracy.png")])


def study(given: argparse.Namespace) -> None:
    """Carry out a study: its tables, and a picture of the factors at first mechanism."""
    from archfem.cases.findings import study_table
    from archfem.cases.study import Study, carried_out
    from archfem.view.studies import draw_study
    from archfem.view.style import save

    asked, folder = Study.read(given.case, given.changes), Path(given.out)
    print(asked.title)
    found = {}
    for name, finding in carried_out(asked, folder):
        found[name] = finding
        print(f"{name}: {len(finding.runs)} pairs")
    table = study_table(found)
    (folder / "study.txt").write_text(f"{asked.title}\n\n{table}\n", encoding="utf-8")
    print(table)
    written = [folder / "study.txt"]
    if asked.scales is not None:
        factors = {name: each.factors for name, each in found.items()}
        written.append(save(draw_study(factors, asked.reduction), folder / "study.png"))
    _tell_written(written)


def mesh(given: argparse.Namespace) -> None:
    """Write the mesh of a case as a gmsh file."""
    from archfem.models.fem.mesh import write_mesh

    case = Case.read(given.case, given.changes)
    write_mesh(case.structure, given.out, case.discretisation)
    print(f"wrote {given.out}")


def modes(given: argparse.Namespace) -> None:
    """Find the modes of a case about its dead load: table, picture, film of the first two."""
    from archfem.cases.run import damping_of
    from archfem.statics.modes import modes as lowest
    from archfem.view.films.modes import film_modes
    from archfem.view.modes import draw_modes
    from archfem.view.style import save

    case, folder = Case.read(given.case, given.changes), Path(given.out)
    dead = _dead_load(case)
    found = lowest(dead.model, given.count, about=dead)
    text = f"{found.table()}\n\n{damping_of(case, dead)[1]}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "modes.txt").write_text(text + "\n", encoding="utf-8")
    print(text)
    film = film_modes(found, folder / "modes.gif", range(1, min(given.count, 2) + 1))
    _tell_written([folder / "modes.txt", save(draw_modes(found), folder / "modes.png"), film])


def run(given: argparse.Namespace) -> None:
    """Find the dead load of a case and run its time histories: tables and pictures."""
    from archfem.cases.report import write_dead, write_run
    from archfem.cases.run import damping_of

    case, folder = Case.read(given.case, given.changes), Path(given.out)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text(case.text(), encoding="utf-8")
    dead = _dead_load(case)
    _tell_written(write_dead(case, dead, folder))
    damping, how = damping_of(case, dead)
    print(how)
    if case.suite is not None:
        _run_suite(case, dead, damping, folder)
    elif case.motion is not None:
        run = _shake(case, case.ground_motion(), dead, damping, folder=folder)
        _tell(run, dead, folder)
        _tell_written(write_run(case, run, dead, folder))


def _run_suite(case: Case, dead: "Equilibrium", damping: Rayleigh | None, folder: Path) -> None:
    """Run all pairs of a suite, each to its own folder; those finished before are kept."""
    from archfem.cases.report import write_envelopes, write_suite
    from archfem.cases.summary import pair_table
    from archfem.dynamics.history import Ending

    suite = case.ground_suite()
    _tell_motions(suite)
    _tell_written(write_suite(suite, case.target, folder))
    runs: dict[str, History] = {}
    for motion in suite.motions:
        alone, own = case.alone(motion.name), folder / motion.name
        run = _run_pair(alone, motion, dead, damping, folder=own)
        runs[motion.name] = run
        if run.ended is Ending.INTERRUPTED:
            break
    table = pair_table(runs)
    (folder / "suite.txt").write_text(table + "\n", encoding="utf-8")
    print(f"{suite.name}, scale {suite.scale:g}, R = {suite.reduction:g}\n{table}")
    _tell_written(write_envelopes(runs, dead, folder))
    if run.ended is Ending.INTERRUPTED:
        print("run the same command again to go on with the pairs that are left", file=sys.stderr)
        raise KeyboardInterrupt
    broken = [name for name, run in runs.items() if not run.ended.by_itself]
    if broken:
        raise DidNotConverge(
            f"{len(broken)} of {len(runs)} pairs have no equilibrium at some step: "
            f"{', '.join(broken)}; what was computed is kept"
        )


def _run_pair(
    case: Case, motion: Motion, dead: "Equilibrium", damping: Rayleigh | None, *, folder: Path
) -> "History":
    """Run one pair, or take what an earlier command left of it; a failed step ends the pair only.

    Raises:
        DidNotConverge: not even the first step could be made.
    """
    from archfem.cases.report import write_motion, write_run
    from archfem.cases.run import finished

    summary = folder / "summary.txt"  # written last
    run = finished(folder / "history.nc", case, motion)
    if run is not None:
        print(f"{motion.name}: finished before, kept {folder / 'history.nc'}")
        if summary.is_file():
            return run
    else:
        summary.unlink(missing_ok=True)
        try:
            run = _shake(case, motion, dead, damping, folder=folder)
        except DidNotConverge as error:
            if error.history is None:
                raise
            print(f"archfem: {motion.name}: {error}", file=sys.stderr)
            run = error.history
    _tell_written([*write_motion(motion, folder), *write_run(case, run, dead, folder)])
    _tell(run, dead, folder)
    return run


def _dead_load(case: Case) -> "Equilibrium":
    from archfem.cases.run import at_rest
    from archfem.statics.strength import strength_use, use_sentence

    print(case.title)
    start = perf_counter()
    dead = at_rest(case)
    model, joints = dead.model, judged(dead.joints)
    print(
        f"model: {model.fidelity}, {len(case.structure.free)} blocks, "
        f"{len(case.structure.joints)} joints, {model.size} coordinates "
        f"({perf_counter() - start:.2f} s with the dead load)"
    )
    print(
        f"dead load: |e| ≤ {float(abs(joints['eccentricity']).max()):.3f}, "
        f"V/N ≤ {float(joints['friction'].max()):.3f}, "
        f"N ≥ {float(joints['N'].min()) / 1e3:.2f} kN"
    )
    if model.cells.stress is not None:
        print(f"dead load: {use_sentence(strength_use(model, dead.q))}")
    return dead


def _shake(
    case: Case, motion: Motion, dead: "Equilibrium", damping: Rayleigh | None, *, folder: Path
) -> "History":
    """Run a time history and keep it in its folder, also where it fails."""
    from archfem.cases.run import shaken

    start = perf_counter()
    try:
        run = shaken(case, motion, dead, damping)
    except DidNotConverge as error:
        if error.history is not None:
            error.history.save(folder / "history.nc")
            print(f"what was computed is kept in {folder / 'history.nc'}", file=sys.stderr)
        raise
    taken = perf_counter() - start
    print(
        f"time history: {motion.name}, peak {motion.pga:.2f} m/s², "
        f"{float(run.time[-1]):.2f} s in {taken:.1f} s; {run.outcome}"
    )
    _tell_written([run.save(folder / "history.nc")])
    return run


def _tell(run: "History", dead: "Equilibrium", folder: Path) -> None:
    """Print the table of joints and the mechanisms, and keep them as text."""
    from archfem.cases.summary import joint_table, verdict
    from archfem.statics.strength import utilisation_sentence

    strength = utilisation_sentence(dead.model.structure, run.joints)
    text = f"{joint_table(run.joints, dead.joints)}\n\n{strength}\n{verdict(run)}"
    (folder / "summary.txt").write_text(text + "\n", encoding="utf-8")
    print(text)


def _tell_motions(suite: "Suite") -> None:
    """Print what matching did, or how strong the motions are."""
    from archfem.cases.summary import match_table, motion_table

    print(match_table(suite.matches) if suite.matches else motion_table(suite.motions))


def _tell_written(files: Sequence[Path]) -> None:
    for path in files:
        print(f"wrote {path}")
