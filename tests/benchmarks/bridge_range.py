"""The verdict on the three-span bridge as a range over open modelling choices, row by row.

    python tests/benchmarks/bridge_range.py [--restored] [--pair pair-2] [--only "exact" …]

At R = 3, under the made pairs of meshes/prusias.toml, or with `--records FOLDER` the records that
its sibling names: the rows of `EVERYWHERE` under all pairs; then those of `BESIDE`, each of which
changes one thing, under the pair whose hinges open widest by the law of Demirel and Aldemir (2021),
or under `--pair` alone. The fill has all its nodes, and stones are rigid unless a row says
otherwise; runs go on to the end of the motion.

Openings and slips, the latter with their elastic part, are of joints of rings and piers; what is
left at the end is of their stones. A joint that never slides counts as sliding from |V| / N = 0.60
on, as in the paper. A mechanism has its class, when it begins, how long its joints stay failed, and
how far they open meanwhile.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path

from setting import plain_options, quick_motion
from timing import table

import archfem as af
from archfem.dynamics import History
from archfem.joints import assessed_joints
from archfem.joints.criteria import find_failed_joints
from archfem.limit import Mechanism
from archfem.limit.mechanism_count import duration_text
from archfem.models.builder import build
from archfem.units import mm

DT = 0.005
"""Time step, as the case has it; half of it adds one mechanism in a ring, of one step [s]."""

MESHES = Path(__file__).parents[2] / "meshes"

RIGID = "model.fidelity={ backfill = 'full', rest = 'rigid' }"
FULL = "model.fidelity='full'"
PIECES = "model.fidelity='rigid'"
SPRINGS = "model.quadrature='nodal'"
EXACT = "model.quadrature='exact'"


@dataclass(frozen=True)
class Setting:
    """The changes of a row of the table.

    Attributes:
        changes: of the case.
        mass: factor on the mass part of Rayleigh damping [-].
        stiffness: factor on its stiffness part [-].
        friction: coefficient of all joints [-]; None where they never slide.
    """

    changes: tuple[str, ...] = ()
    mass: float = 1.0
    stiffness: float = 1.0
    friction: float | None = 0.60


def shear(value: float) -> str:
    """Say that joints between stones have a shear stiffness [MPa/mm]."""
    return f"contacts.stone to stone.shear_stiffness={value} MPa/mm"


FILL = "structure.fill={ law = 'jointed', size = 0.8, friction_angle = 35, cohesion = '15 kPa' }"

EVERYWHERE = {
    "exact": Setting((RIGID, EXACT)),
    "five springs": Setting((RIGID, SPRINGS)),
    "five springs, never sliding": Setting((RIGID, SPRINGS), friction=None),
    "five springs, never sliding, elastic stones": Setting((FULL, SPRINGS), friction=None),
}

PAPER = "five springs, never sliding"
"""The row of the paper's own law."""

CHANGES = {
    "no mass damping": Setting(mass=1e-9),
    "stiffness damping halved": Setting(stiffness=0.5),
    "k_s 0.05 MPa/mm": Setting((shear(0.05),)),
    "k_s 0.97 MPa/mm": Setting((shear(0.97),)),
    "friction 0.5": Setting(friction=0.50),
}

BESIDE = {
    f"{rule}, {words}": replace(
        setting,
        changes=(*base.changes, *setting.changes),
        friction=setting.friction if base.friction else None,
    )
    for rule, base in list(EVERYWHERE.items())[:3]
    for words, setting in CHANGES.items()
    if base.friction or not words.startswith("friction")
} | {
    "exact, never sliding": Setting((RIGID, EXACT), friction=None),
    "exact, jointed fill": Setting((PIECES, EXACT, FILL)),
    "five springs, jointed fill": Setting((PIECES, SPRINGS, FILL)),
}


def damped(damping: af.Rayleigh, mass: float, stiffness: float) -> af.Rayleigh:
    """Return Rayleigh damping with factors on its two parts, at the same ratio."""
    total = sum(damping.frequencies) / stiffness
    product = damping.frequencies[0] * damping.frequencies[1] * mass / stiffness
    high = 0.5 * (total + sqrt(total**2 - 4.0 * product))
    return replace(damping, frequencies=(product / high, high))


def rubbed(structure: af.Structure, friction: float | None) -> af.Structure:
    """Return a structure with another friction in the joints of its stones and to its fill."""
    joints = (
        joint
        if all(structure.blocks[number].grain for number in joint.blocks)
        else replace(joint, contact=replace(joint.contact, friction=friction))
        for joint in structure.joints
    )
    return replace(structure, joints=tuple(joints))


def run_setting(
    path: Path, options: Sequence[str], setting: Setting, motions: Sequence[af.Motion]
) -> Iterator[tuple[str, History, float]]:
    """Yield of each motion in a setting its name, its run and the seconds it took."""
    case = af.Case.read(path, [*options, *setting.changes])
    structure = rubbed(case.structure, setting.friction)
    model = build(structure, case.analysis.discretisation)
    dead = af.dead_load(model)
    damping = damped(af.cases.damping_of(case, dead)[0], setting.mass, setting.stiffness)
    criteria = replace(
        case.analysis.failure_criteria, friction=0.60 if setting.friction is None else None
    )
    for motion in motions:
        begun = time.perf_counter()
        run = af.time_history(model, motion, dt=DT, start=dead, damping=damping, criteria=criteria)
        yield motion.name, run, time.perf_counter() - begun


def mechanism_text(found: Mechanism | None) -> str:
    """Write a mechanism: class, time, duration and largest opening."""
    if found is None:
        return "none"
    wide = f"{found.opening / mm:.2g} mm"
    return f"{found.kind}, {found.time:.3f} s, {duration_text(found.duration)}, {wide}"


def widest(run: History) -> float:
    """Largest opening of a hinge in rings and piers [m]."""
    joints = assessed_joints(run.joints)
    return float(joints["opening"].where(joints["hinge"] != 0, 0.0).max())


HEAD = ["setting", "pair", "largest e", "failed at once", "hinge opens [mm]", "slip [mm]"]
HEAD += ["left [mm]", "any joints at once", "four in one ring", "verified", "wall [s]"]


def row(name: str, pair: str, run: History, seconds: float) -> list[object]:
    """Write the row of a run."""
    joints, dataset = assessed_joints(run.joints), run.dataset
    first = af.first_mechanisms(run)
    own = [n for n, block in enumerate(run.structure.blocks) if block.role != "other"]
    stones = dataset["block"].isin([run.structure.blocks[n].name for n in own])
    return [
        name,
        pair,
        f"{float(abs(joints['eccentricity']).max()):.3f}",
        int(find_failed_joints(joints).sum("joint").max()),
        f"{widest(run) / mm:.2f}",
        f"{float(abs(joints['slip']).max()) / mm:.2f}",
        f"{float(dataset['residual_displacement'].where(stones, 0.0).max()) / mm:.2f}",
        *(
            mechanism_text(first[definition])
            for definition in ("any joints at once", "Demirel and Aldemir", "verified")
        ),
        f"{seconds:.0f}",
    ]


def scene(chosen: argparse.Namespace) -> tuple[Path, list[str]]:
    """Find the requested case, and its changes."""
    if chosen.records is None:
        return MESHES / f"prusias{'_restored' if chosen.restored else ''}.toml", []
    return MESHES / "prusias_records.toml", [f"suite.folder={chosen.records.resolve()}"]


def run_rows(chosen: argparse.Namespace) -> None:
    """Run the rows that were chosen, print each when it is ready, and then the table."""
    path, options = scene(chosen)
    motions = list(af.Case.read(path, options).ground_suite().motions)
    rows: list[list[object]] = []
    widths: dict[str, float] = {}

    def add(settings: dict[str, Setting], pairs: list[af.Motion]) -> None:
        for name, setting in settings.items():
            if chosen.only and name not in chosen.only:
                continue
            for pair, run, seconds in run_setting(path, options, setting, pairs):
                rows.append(row(name, pair, run, seconds))
                if setting == EVERYWHERE[PAPER]:
                    widths[pair] = widest(run)
                print(*rows[-1], sep=" | ", flush=True)

    if chosen.pair is None:
        add(EVERYWHERE, motions)
        worst = max(widths, key=widths.__getitem__, default=motions[0].name)
        add(BESIDE, [motion for motion in motions if motion.name == worst])
    else:
        add(EVERYWHERE | BESIDE, [motion for motion in motions if motion.name == chosen.pair])
    print(f"\n{table(HEAD, rows)}")


def options() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    parser = plain_options(__doc__)
    parser.add_argument("--restored", action="store_true", help="the bridge after its restoration")
    parser.add_argument("--pair", help="the rows under this pair alone")
    parser.add_argument("--only", nargs="+", help="names of the rows to run")
    parser.add_argument("--records", type=Path, help="folder of the records to take instead")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table of the rows that were chosen."""
    chosen = options().parse_args(arguments)
    if chosen.quick:
        path, changes = scene(chosen)
        for pair, run, seconds in run_setting(
            path, changes, EVERYWHERE["exact"], [quick_motion(4.9 / 3.0)]
        ):
            print(table(HEAD, [row("exact", pair, run, seconds)]))
        return
    run_rows(chosen)


if __name__ == "__main__":
    main()
