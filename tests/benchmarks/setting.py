"""Command line, ground motion and validation ring that the benchmarks share."""

import argparse
from copy import copy

import numpy as np

import archfem as af

DAMPING = af.Rayleigh(0.05, (8.0, 16.0), joints="initial")
"""Damping proportional to the initial stiffness, which every program offers."""

QUICK_DURATION = 0.25
"""Duration of motions with `--quick`, the shortest that can be made [s]."""


def plain_options(description: str) -> argparse.ArgumentParser:
    """Make a parser with the one option that every benchmark has."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--quick", action="store_true", help="the smallest scene and few steps, to see that it runs"
    )
    return parser


def options(description: str) -> argparse.ArgumentParser:
    """Make a parser with the options of benchmarks under a ground motion."""
    parser = plain_options(description)
    add = parser.add_argument
    add("--record", help="file with a ground motion; the default motion is synthetic")
    add("--column", type=int, help="column of the record, counted from 1")
    add("--units", help="unit of plain columns: g, m/s2, cm/s2 or gal")
    add("--dt", type=float, help="time between samples of plain columns [s]")
    add("--scale", type=float, default=1.0, help="factor on the record [-]")
    add("--repeat", type=int, default=3, help="runs that are timed, of which the least counts")
    return parser


def ground_motion(chosen: argparse.Namespace) -> af.Motion:
    """Read the first 10 s of the chosen record, or make 10 s of a synthetic motion."""
    if chosen.quick:
        return quick_motion(1.6)
    if chosen.record is None:
        return af.Motion.synthetic(duration=10.0, pga=1.6, seed=3, vertical_ratio=0.0)
    record = af.Motion.read(chosen.record, column=chosen.column, units=chosen.units, dt=chosen.dt)
    return record.scaled(chosen.scale).cut(0.0, 10.0)


def quick_motion(pga: float) -> af.Motion:
    """Make the synthetic motion of `--quick`."""
    return af.Motion.synthetic(duration=QUICK_DURATION, pga=pga, seed=3, vertical_ratio=0.0)


def lumped(model: af.models.Model) -> af.models.Model:
    """Replace the consistent mass matrix of a model by its row sums, on the same pattern.

    Row sums do not change, so neither do the weight and the inertia forces of the ground motion.
    """
    twin = copy(model)
    twin.mass = model.mass.copy()
    rows = np.repeat(np.arange(model.size), np.diff(model.mass.indptr))
    sums = np.asarray(model.mass.sum(axis=1)).ravel()
    twin.mass.data = np.where(rows == model.mass.indices, sums[rows], 0.0)
    return twin


def largest_eccentricity(structure: af.Structure, resultants: np.ndarray) -> float:
    """Return the largest |e| = |M| / (N h) of closed joints from N, V, M (steps, joints, 3) [-]."""
    normal, moment = resultants[..., 0], resultants[..., 2]
    depths = np.broadcast_to(structure.depths, normal.shape)
    closed = normal > 0.0
    return float(np.abs(moment[closed] / (normal * depths)[closed]).max())


def print_left_out(reason: str) -> None:
    """Print that a benchmark, or a part of it, cannot run on this machine."""
    print(f"left out: {reason}")
