"""Run all benchmarks of speed and print their tables as Markdown: times and errors side by side.

python tests/benchmarks/run.py [--record FILE --column 2 --units cm/s2 --dt 0.005 --scale 1.0]
"""

# OpenSees goes first: it brings an MPI of its own, which breaks once PETSc's has been loaded.
try:
    import opensees_ring
except ImportError as error:
    opensees_ring, missing = None, str(error)

import floor
import profile_step
import scaling
from setting import ground_motion, options


def main() -> None:
    """Print one section after another."""
    parser = options(__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=scaling.SIZES)
    chosen = parser.parse_args()
    motion, repeat = ground_motion(chosen), chosen.repeat
    print("## Validation ring, against OpenSees\n", flush=True)
    if opensees_ring is None:
        print(f"left out, as OpenSeesPy is missing ({missing}): pip install -e '.[bench]'\n")
    else:
        print(opensees_ring.report(motion, repeat), "\n", flush=True)
    print("## Against a loop of bare arithmetic\n", flush=True)
    print(floor.report(motion, repeat), "\n", flush=True)
    print("## Growth with the number of stones\n", flush=True)
    print(scaling.report(chosen.sizes, repeat), "\n", flush=True)
    print("## Where the time of a step goes\n", flush=True)
    print(profile_step.report(profile_step.CASES, motion, repeat), flush=True)


if __name__ == "__main__":
    main()
