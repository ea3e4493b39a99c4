"""Fragility of the Roman bridge as it stands and restored: IDA of made pairs, and what it takes.

    python tests/benchmarks/bridge_fragility.py --out out/fragility --workers 2

Pairs are made and matched to the case's spectrum, as those that it ships; a horizontal motion and a
vertical one each. Where it is ended it goes on by the same line.
"""

import argparse
import resource
import time
from pathlib import Path

import numpy as np

import archfem as af

MESHES = Path(__file__).parents[2] / "meshes"
FIDELITY = "{ backfill = 'full', rest = 'faces' }"
MODEL = f"model={{ fidelity = {FIDELITY}, quadrature = 'exact', cells = [2, 2] }}"


def bridge(name: str, pairs: int) -> af.Case:
    """A shipped bridge under made pairs."""
    case = af.Case.read(MESHES / f"{name}.toml", [MODEL])
    made = {
        f"pair-{k}": {"synthetic": {"seed": k}, "vertical": {"synthetic": {"seed": k + 100}}}
        for k in range(1, pairs + 1)
    }
    suite = {**case.settings["suite"], "pairs": made, "reduction": 1.0}
    return af.Case.of({**case.settings, "suite": suite}, case.folder)


def main() -> None:
    """Print medians, their intervals and dispersions, and the time taken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bridges", nargs="+", default=["prusias", "prusias_restored"])
    parser.add_argument("--pairs", type=int, default=10)
    parser.add_argument("--precision", type=float, default=0.1)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--out", type=Path, default=Path("out/fragility"))
    given = parser.parse_args()
    for name in given.bridges:
        begun = time.monotonic()
        found = af.ida(
            bridge(name, given.pairs),
            precision=given.precision,
            folder=given.out / name,
            workers=given.workers,
        )
        spent = sum(
            use.ru_utime + use.ru_stime
            for use in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        )
        runs = int(np.isfinite(found.table["scale"]).sum())
        print(f"{name}: {given.pairs} pairs, {runs} runs, wall {time.monotonic() - begun:.0f} s,")
        print(f"    processor {spent:.0f} s of this and what came before")
        curves = {limit: found.fragility(limit) for limit in found.limits}
        for limit, curve in curves.items():
            low, high = curve.interval()
            print(f"    {limit}: PGA {curve.median:.2f} m/s2 ({low:.2f} to {high:.2f}),", end=" ")
            print(f"dispersion {curve.dispersion:.2f}; turns back: {found.not_monotonic(limit)}")
        intensity = np.linspace(0.1, 2.0 * max(each.median for each in curves.values()), 80)
        capacities = {limit: found.capacities(limit) for limit in found.limits}
        fractiles = (intensity, found.fractiles(intensity))
        af.view.draw_ida(found.curves(), capacities, fractiles=fractiles).savefig(
            given.out / f"{name}_ida.png"
        )
        drawn = {k: (c.probability(intensity), *c.band(intensity)) for k, c in curves.items()}
        af.view.draw_fragility(drawn, intensity).savefig(given.out / f"{name}_fragility.png")


if __name__ == "__main__":
    main()
