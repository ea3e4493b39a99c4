"""Run the benchmarks of speed and print their tables as Markdown: times and errors side by side.

python tests/benchmarks/run.py [--record FILE --column 2 --units cm/s2 --dt 0.005 --scale 1.0]
"""

from collections.abc import Sequence

import opensees_ring  # first, because OpenSees must be imported before archfem

# isort: split
import floor
import profile_step
import scaling
import solvers
from setting import options


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one section after another."""
    parser = options(__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=scaling.SIZES)
    chosen = parser.parse_args(arguments)
    quick = ["--quick"] if chosen.quick else []
    names = ("record", "column", "units", "dt", "scale", "repeat")
    given = {f"--{name}": getattr(chosen, name) for name in names}
    motion = [str(word) for pair in given.items() if pair[1] is not None for word in pair]
    sizes = ["--sizes", *map(str, chosen.sizes), "--repeat", str(chosen.repeat)]
    print("## Validation ring, against OpenSees\n", flush=True)
    opensees_ring.main([*motion, *quick])
    print("\n## Against a loop of bare arithmetic\n", flush=True)
    floor.main([*motion, *quick])
    print("\n## Solvers on the validation ring\n", flush=True)
    solvers.main(["--only", "ring of 17", "--repeat", str(chosen.repeat), *quick])
    print("\n## Growth with the number of voussoirs\n", flush=True)
    scaling.main([*sizes, *quick])
    print("\n## Where the time of a call is spent\n", flush=True)
    profile_step.main([*motion, *quick])


if __name__ == "__main__":
    main()
