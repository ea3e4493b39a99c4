"""The command line: `archfem run CASE.toml --out DIR`."""

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from archfem.case import Case
from archfem.errors import ArchfemError, DidNotConverge

if TYPE_CHECKING:
    import xarray as xr

    from archfem.history import History
    from archfem.statics import Equilibrium


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; 0 is success, 1 an error of the case, 2 of the command itself."""
    given = _parser().parse_args(arguments)
    logging.basicConfig(format="%(levelname)s: %(message)s", level=logging.WARNING)
    try:
        given.command(given)
    except ArchfemError as error:
        print(f"archfem: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="archfem", description="Does a dry-stone arch or bridge survive an earthquake?"
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def case_command(name: str, about: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=about, description=about)
        command.add_argument("case", metavar="CASE.toml", help="the case file")
        command.add_argument(
            "--set",
            action="append",
            default=[],
            metavar="SECTION.KEY=VALUE",
            dest="changes",
            help="use this value instead of the file's; may be given again",
        )
        return command

    run = case_command("run", "dead load, time history, tables and pictures")
    run.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
    run.set_defaults(command=_run)
    check = case_command("check", "read a case, build its model and find its dead load")
    check.set_defaults(command=_check)
    mesh = case_command("mesh", "write the mesh of a case as a gmsh file")
    mesh.add_argument("--out", required=True, metavar="FILE.msh", help="the mesh file")
    mesh.set_defaults(command=_mesh)
    return parser


def _check(given: argparse.Namespace) -> None:
    case = Case.read(given.case, given.changes)
    dead = _dead_load(case)
    motion = case.ground_motion() if case.motion is not None else None
    if motion is not None:
        print(f"motion: {motion.name}, {motion.duration:.2f} s, peak {motion.pga:.3f} m/s²")
    print(f"{given.case}: ready; dead load in {dead.iterations} iterations")


def _mesh(given: argparse.Namespace) -> None:
    from archfem.mesh import Meshing, write_mesh

    case = Case.read(given.case, given.changes)
    through, along = case.model.get("cells", [4, 4])
    meshing = Meshing(through, along, case.model.get("cell", "quadrilateral"))
    write_mesh(case.structure, given.out, meshing)
    print(f"wrote {given.out}")


def _run(given: argparse.Namespace) -> None:
    case, folder = Case.read(given.case, given.changes), Path(given.out)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text(case.text(), encoding="utf-8")
    dead = _dead_load(case)
    _draw_dead(dead, folder)
    if case.motion is None:
        return
    try:
        run = _shake(case, dead)
    except DidNotConverge as error:
        if error.history is not None:
            error.history.save(folder / "history.nc")
            print(f"what was computed is kept in {folder / 'history.nc'}", file=sys.stderr)
        raise
    run.dataset.attrs["case"] = case.text()
    print(f"wrote {run.save(folder / 'history.nc')}")
    _tell(run, dead, folder)
    _draw_run(case, run, dead, folder)


def _dead_load(case: Case) -> "Equilibrium":
    from archfem.models.build import build
    from archfem.statics import dead_load

    print(case.title)
    start = perf_counter()
    model = build(case.structure, **case.model)
    print(
        f"model: {model.fidelity}, {len(case.structure.free)} blocks, "
        f"{len(case.structure.joints)} joints, {model.size} coordinates "
        f"({perf_counter() - start:.2f} s)"
    )
    dead = dead_load(model)
    worst = abs(dead.joints["eccentricity"])
    print(
        f"dead load: |e| ≤ {float(worst.max()):.3f}, "
        f"V/N ≤ {float(dead.joints['friction'].max()):.3f}, "
        f"N ≥ {float(dead.joints['N'].min()) / 1e3:.2f} kN"
    )
    return dead


def _shake(case: Case, dead: "Equilibrium") -> "History":
    from archfem.runs import CountedMechanism, Record, time_history

    motion, output = case.ground_motion(), case.output
    animated = 10 if output.get("animation", False) else None
    start = perf_counter()
    run = time_history(
        dead.model,
        motion,
        dt=case.analysis.get("dt", 0.005),
        start=dead,
        damping=case.damping,
        scheme=case.scheme,
        record=Record(
            every=output.get("every", 1), fields_every=output.get("fields_every", animated)
        ),
        until=CountedMechanism() if case.analysis.get("halt", False) else None,
    )
    taken = perf_counter() - start
    print(
        f"time history: {motion.name}, peak {motion.pga:.2f} m/s², "
        f"{float(run.time[-1]):.2f} s in {taken:.1f} s; {run.outcome}"
    )
    return run


def _tell(run: "History", dead: "Equilibrium", folder: Path) -> None:
    """Print the table of joints and the mechanism, and keep them as text."""
    from archfem.summary import joint_table

    found = run.mechanism
    lines = [joint_table(run.joints, dead.joints), ""]
    if found is None:
        lines.append("no mechanism: never four failed joints at once in one part")
    else:
        lines.append(
            f"{found.kind} mechanism by count at {found.time:.3f} s: "
            f"joints {', '.join(map(str, found.joints))} of {found.part}"
        )
    text = "\n".join(lines)
    (folder / "summary.txt").write_text(text + "\n", encoding="utf-8")
    print(text)


def _draw_dead(dead: "Equilibrium", folder: Path) -> None:
    from archfem.view.plots import draw_structure
    from archfem.view.style import save

    print(f"wrote {save(draw_structure(dead.model.structure, dead.joints), folder / 'dead.png')}")


def _draw_run(case: Case, run: "History", dead: "Equilibrium", folder: Path) -> None:
    """The pictures of a run: its gravest instant, envelopes, joint histories, animation."""
    from archfem.view.plots import draw_envelope, draw_joint_histories, draw_structure
    from archfem.view.style import save

    gravest = _gravest(run)
    worst = abs(run.joints["eccentricity"]).max("time").fillna(0.5)
    chosen = case.output.get("joints", [int(j) for j in worst.argsort()[::-1][:2]])
    figures = {
        "gravest.png": draw_structure(case.structure, gravest),
        "envelope.png": draw_envelope({case.title: run}, dead=dead.joints),
        "joints.png": draw_joint_histories(run, chosen),
    }
    for name, figure in figures.items():
        print(f"wrote {save(figure, folder / name)}")
    if case.output.get("animation", False):
        from archfem.view.scenes import animate

        print(f"wrote {animate(dead.model, run, folder / 'hinges.mp4')}")


def _gravest(run: "History") -> "xr.Dataset":
    """Joints at the instant of the first mechanism, or of the largest eccentricity."""
    if run.mechanism is not None:
        return run.joints.sel(time=run.mechanism.time, method="nearest")
    worst = abs(run.joints["eccentricity"]).max("joint")
    return run.joints.isel(time=int(worst.argmax("time")))
