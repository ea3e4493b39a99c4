"""What the benchmarks shake: the validation ring, its damping, its motion."""

import argparse
from copy import copy
from dataclasses import replace

import numpy as np

import archfem as af
from archfem.joints.resultants import joint_dataset
from archfem.masonry.materials import STONE_TO_STONE
from archfem.models.jointed import Jointed

DT = 0.005
"""Time step [s]."""

DAMPING = af.Rayleigh(0.05, (8.0, 16.0), joints="initial")
"""On the initial stiffness, which every program offers."""


def ring(voussoirs: int = 17) -> af.Structure:
    """Build the validation ring, cut into so many stones.

    Joints are the stiffer the more there are, so that all rings are as compliant as the first.
    """
    share = (voussoirs + 1) / 18.0
    contact = replace(
        STONE_TO_STONE,
        normal_stiffness=share * STONE_TO_STONE.normal_stiffness,
        shear_stiffness=share * STONE_TO_STONE.shear_stiffness,
    )
    return af.circular_arch(
        radius=2.95,
        thickness=0.55,
        embrace=159.0,
        voussoirs=voussoirs,
        width=1.0,
        contact=contact,
    )


def lumped(model: Jointed) -> Jointed:
    """Replace a model's consistent mass by its row sums, on the same pattern.

    The sums of a row do not change, so neither do weight and the forces of the ground's motion.
    """
    twin = copy(model)
    twin.mass = model.mass.copy()
    rows = np.repeat(np.arange(model.size), np.diff(model.mass.indptr))
    sums = np.asarray(model.mass.sum(axis=1)).ravel()
    twin.mass.data = np.where(rows == model.mass.indices, sums[rows], 0.0)
    return twin


def options(description: str) -> argparse.ArgumentParser:
    """Make a parser with the options that the benchmarks share."""
    parser = argparse.ArgumentParser(description=description)
    add = parser.add_argument
    add("--record", help="file with a ground motion; by default one is made")
    add("--column", type=int, help="column of the record, counted from 1")
    add("--units", help="unit of plain columns: g, m/s2, cm/s2 or gal")
    add("--dt", type=float, help="time between samples of plain columns [s]")
    add("--scale", type=float, default=1.0, help="factor on the record [-]")
    add("--repeat", type=int, default=3, help="times that each run is timed; the least counts")
    return parser


def ground_motion(chosen: argparse.Namespace) -> af.Motion:
    """Take the first 10 s of the record that was asked for, or make 10 s of motion."""
    if chosen.record is None:
        return af.Motion.synthetic(duration=10.0, pga=1.6, seed=3, vertical_ratio=0.0)
    record = af.Motion.read(chosen.record, column=chosen.column, units=chosen.units, dt=chosen.dt)
    return record.scaled(chosen.scale).cut(0.0, 10.0)


def eccentricities(structure: af.Structure, resultants: np.ndarray) -> np.ndarray:
    """Eccentricity of every joint at every step (steps, n_joints) from N, V, M [-]."""
    times = np.arange(len(resultants), dtype=float)
    return joint_dataset(structure, resultants, times)["eccentricity"].values


def largest(structure: af.Structure, resultants: np.ndarray) -> float:
    """Largest |e| over joints and steps [-]."""
    return float(np.nanmax(np.abs(eccentricities(structure, resultants))))
