"""Fragility and annual rates of the Roman bridge as it stands and restored, by IDA, and the cost.

    python tests/benchmarks/bridge_fragility.py --out out/fragility --workers 2

Pairs are synthetic and matched to the spectrum of the case, a horizontal motion and a vertical one
each. An interrupted run continues when it is started again.
"""

import resource
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from setting import plain_options

import archfem as af

MESHES = Path(__file__).parents[2] / "meshes"
FIDELITY = "{ backfill = 'full', rest = 'faces' }"
# The first peak acceleration [m/s²] is that of the code for the site; the second is assumed
SITE = af.Hazard.from_return_periods({475.0: 4.5, 2475.0: 8.0})
MODEL = f"model={{ fidelity = {FIDELITY}, quadrature = 'exact', cells = [2, 2] }}"


def bridge(name: str, pairs: int) -> af.Case:
    """Read a shipped bridge, and give it synthetic pairs."""
    case = af.Case.read(MESHES / f"{name}.toml", [MODEL])
    made = {
        f"pair-{k}": {"synthetic": {"seed": k}, "vertical": {"synthetic": {"seed": k + 100}}}
        for k in range(1, pairs + 1)
    }
    suite = {**case.settings["suite"], "pairs": made, "reduction": 1.0}
    return af.Case.of({**case.settings, "suite": suite}, case.folder)


def column() -> af.Case:
    """Build the small case of `--quick`: a block under three short motions."""
    pairs = {
        f"pair-{seed}": {"synthetic": {"seed": seed, "duration": 1.0, "pga": 1.0}}
        for seed in (1, 2, 3)
    }
    return af.Case.of(
        {
            "title": "a block",
            "structure": {"shape": "column", "breadth": 0.5, "heights": [2.0]},
            "model": {"fidelity": "rigid"},
            "suite": {"name": "short motions", "pairs": pairs},
            "analysis": {"dt": 0.01},
        }
    )


def report(
    name: str, case: af.Case, folder: Path, precision: float, workers: int | None = None
) -> None:
    """Run the IDA of a case, print its medians and the time taken, and draw its curves."""
    begun = time.monotonic()
    result = af.ida(
        case,
        precision=precision,
        folder=folder / name,
        workers=workers,
    )
    spent = sum(
        use.ru_utime + use.ru_stime
        for use in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )
    runs = int(np.isfinite(result.table["scale"]).sum())
    print(f"{name}: {runs} runs, wall {time.monotonic() - begun:.0f} s,")
    print(f"    processor {spent:.0f} s since the start of the program")
    curves = {limit: result.fragility(limit) for limit in result.limits}
    for limit, curve in curves.items():
        low, high = curve.interval()
        print(f"    {limit}: PGA {curve.median:.2f} m/s2 ({low:.2f} to {high:.2f}),", end=" ")
        print(f"dispersion {curve.dispersion:.2f}; turns back: {result.not_monotonic(limit)}")
        print(f"        {curve.annual_rate(SITE)}")
    intensity = np.linspace(0.1, 2.0 * max(each.median for each in curves.values()), 80)
    capacities = {limit: result.capacities(limit) for limit in result.limits}
    fractiles = (intensity, result.fractiles(intensity))
    af.view.draw_ida(result.curves(), capacities, fractiles=fractiles).savefig(
        folder / f"{name}_ida.png"
    )
    drawn = {k: (c.probability(intensity), *c.band(intensity)) for k, c in curves.items()}
    af.view.draw_fragility(drawn, intensity).savefig(folder / f"{name}_fragility.png")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print medians, their intervals and dispersions, and the time taken."""
    parser = plain_options(__doc__)
    parser.add_argument("--bridges", nargs="+", default=["prusias", "prusias_restored"])
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--precision", type=float, default=0.1)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--out", type=Path, default=Path("out/fragility"))
    given = parser.parse_args(arguments)
    if given.quick:
        with tempfile.TemporaryDirectory() as folder:
            report("column", column(), Path(folder), precision=0.5, workers=1)
        return
    for name in given.bridges:
        report(name, bridge(name, given.pairs), given.out, given.precision, given.workers)


if __name__ == "__main__":
    main()
