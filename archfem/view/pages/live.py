"""Page that simulates falling stones in the browser, by the compiled time steps of archfem."""

import json
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.fall import with_sliding_joints
from archfem.dynamics.rigid_body.simulation import TRIED_STEPS, RigidBlockSimulation, prepare_steps
from archfem.errors import InvalidInput
from archfem.masonry.joint_closing import FINISHES, joint_stiffness
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion
from archfem.units import G
from archfem.view.pages.document import StandalonePage, render

# Kernels of the simulation, and the names and types of their arguments, both by `make wasm`
WASM, LAYOUT = (Path(__file__).parent / "wasm" / f"kernels.{kind}" for kind in ("wasm", "json"))

# Stones above which a page would take minutes for its runs
MAX_STONES = 60


@dataclass(frozen=True, eq=False)
class LivePage(StandalonePage):
    """Page of an arch that a reader changes and shakes, shown in a notebook or written by `save`.

    Attributes:
        title: above the arch.
        arches: bodies, joints and step parameters of the structures, by `describe_arch`.
        motions: data of the ground motions.
    """

    title: str
    arches: Sequence[Mapping[str, Any]]
    motions: Sequence[Mapping[str, Any]]

    frame_height = 1080.0

    @property
    def page(self) -> str:
        """The complete page (HTML), without references to other files."""
        return self.render("live/live.html")

    def render(self, template: str) -> str:
        """Return the page of a template, with all data in it."""
        layout = json.loads(LAYOUT.read_text())
        data = {"arches": self.arches, "motions": self.motions, "leaves": layout["leaves"]}
        data["wasm"] = _pack(WASM.read_bytes())
        return render(
            template,
            title=self.title,
            packed=_pack(json.dumps(data).encode()),
            digest=layout["digest"],
            step=1e3 * TRIED_STEPS[0],
            motions=self.motions,
            finishes=FINISHES,
            has_ring=any(arch["ring"] for arch in self.arches),
            has_thrust=any(arch["thrust"] for arch in self.arches),
        )


@validate_arguments
def page(
    analysis: Analysis, path: str | Path | None = None, *, motions: Sequence[Motion] = ()
) -> LivePage:
    """Return a page on which a reader changes the arch of an analysis and shakes it.

    It needs no connection: stones fall by the time steps of `dynamics.RigidBlockSimulation`,
    compiled for browsers. Twenty similar arches are shaken, and their share of falls is shown. A
    single ring between two supports can be cut into other stones, and thinner or thicker ones;
    other structures are shaken as they are. Joints of a finish close in statics: in the thrust line
    under dead load, and in the largest push at large displacements. Those of the shaking are hard.

    Args:
        analysis: the analysis; of it the structure, and the thrust line under dead load.
        path: file to write, .html; None writes none.
        motions: ground motions to choose from; by default two synthetic ones and a pulse. A push
            and a table that tilts are added.

    Returns:
        The page, which a notebook shows.

    Raises:
        InvalidInput: stones are not rigid and dry: there is fill, a bond or a law of the user; or
            there are too many of them.
        DidNotConverge: the structure has no equilibrium.
    """
    structure = analysis.structure
    check_stones(structure)
    arch = describe_arch(structure, analysis.dead_load().joints["eccentricity"].values)
    found = LivePage(structure.name, [arch], list_motions(motions))
    if path is not None:
        found.save(path)
    return found


def check_stones(structure: Structure) -> None:
    """Refuse structures that are not of rigid stones alone, and those of too many."""
    fill = find_yielding_blocks(structure)
    if fill or any(block.grain for block in structure.blocks):
        name = next(b.name for k, b in enumerate(structure.blocks) if k in fill or b.grain)
        raise InvalidInput(
            f"block '{name}' is fill, and a page has rigid stones alone: leave the fill out, or "
            "use run.player()"
        )
    if len(structure.free) > MAX_STONES:
        raise InvalidInput(
            f"{len(structure.free)} stones: a page of more than {MAX_STONES} takes minutes to "
            "answer; use run.player(), or make the page of a part"
        )


def describe_arch(structure: Structure, thrust: Array | None = None) -> dict[str, Any]:
    """Return bodies, joints and time steps of a structure as lists; with e under dead load."""
    check_stones(structure)
    structure = with_sliding_joints(structure)
    simulation = RigidBlockSimulation(structure)
    parameters, _ = prepare_steps(simulation, TRIED_STEPS[0])
    of_joints = {key: getattr(structure, key).tolist() for key in ("ends", "friction", "cohesion")}
    columns = {"blocks": structure.pairs.tolist(), **of_joints}
    joints = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    values = simulation.bodies._asdict().items()
    has_thrust = thrust is not None and bool(np.isfinite(thrust).all())
    return {
        "name": structure.name,
        "bodies": {key: value if np.isscalar(value) else value.tolist() for key, value in values},
        "parameters": parameters._asdict(),
        "joints": joints,
        "sizes": [float(np.sqrt(block.area)) for block in structure.blocks],
        "finishes": list_finishes(structure),
        "thrust": np.asarray(thrust).tolist() if has_thrust else None,
        "ring": describe_ring(structure),
    }


def list_finishes(structure: Structure) -> list[dict[str, Any]]:
    """Return the usual laws of joints between the softest stones, by finish."""
    stones = [structure.blocks[k] for k in structure.free]
    softest = min((stone.material for stone in stones), key=lambda material: material.young)
    spacing = float(np.mean([np.sqrt(stone.area) for stone in stones]))
    known = {} if softest.strength is None else {"strength": softest.strength}
    found = []
    for finish in FINISHES:
        law = joint_stiffness(softest.young, spacing, finish, rigid=True, **known)
        usual = {"stiffness": law.initial[1], "shear": law.shear[1], "closure": law.closure[1]}
        found.append({"name": finish, "width": structure.width} | usual)
    return found


def describe_ring(structure: Structure) -> dict[str, Any] | None:
    """Return joints and density of a single ring between two supports, or None."""
    count, pairs = len(structure.joints), structure.pairs.tolist()
    supports = structure.blocks[0].fixed and structure.blocks[-1].fixed
    if not supports or pairs != [[k, k + 1] for k in range(count)] or count < 3:
        return None
    roles = [structure.blocks[k].role for k in structure.free]
    if len(structure.blocks) != count + 1 or roles != ["ring"] * (count - 1):
        return None
    ends, stones = structure.ends, [structure.blocks[k] for k in structure.free]
    # stones lie on the left of the line from intrados to extrados of the joint before them
    first = ends[0, 1] - ends[0, 0]
    across = ends[1].mean(axis=0) - ends[0].mean(axis=0)
    if first[0] * across[1] - first[1] * across[0] > 0.0:
        return None
    mass = sum(structure.density(block) * block.area for block in stones) * structure.width
    return {
        "ends": ends.tolist(),
        "kept": 0.5,
        "stones": len(stones),
        "thickness": round(float(structure.depths.min()), 4),
        "density": mass / sum(block.area for block in stones),
        "level": float(min(block.points[:, 1].min() for block in structure.blocks if block.fixed)),
    }


def list_motions(motions: Sequence[Motion] = ()) -> list[dict[str, Any]]:
    """Return motions as lists: those given or default ones, a push and a tilting table."""
    found = [_describe_motion(motion) for motion in motions or _default_motions()]
    # the page chooses strengths near that which brings the arch down; short pushes need more
    if not motions:
        found = [motion | {"strength": None, "often": 2.7} for motion in found]
    slow = ("push", "a steady push sideways"), ("tilt", "a table that tilts slowly")
    return found + [{"name": name, "kind": kind, "often": 1.05} for kind, name in slow]


def _default_motions() -> list[Motion]:
    """Return two synthetic earthquakes and a pulse."""
    shared = {"duration": 8.0, "dt": 0.01, "pga": G}
    motions = [replace(Motion.synthetic(seed=k, **shared), name=f"earthquake {k}") for k in (1, 2)]
    pulse = -G * np.sin(2.0 * np.pi * np.arange(81) / 80.0)
    still = np.zeros(50)
    return [*motions, Motion(np.concatenate([still, pulse, still]), 0.01, name="a jolt of 0.8 s")]


def _describe_motion(motion: Motion) -> dict[str, Any]:
    """Return a motion, to 1e-5 m/s², which records do not resolve."""
    level = motion.horizontal
    upright = np.zeros_like(level) if motion.vertical is None else motion.vertical
    count = min(len(level), len(upright))
    return {
        "name": motion.name,
        "dt": motion.dt,
        "x": np.round(level[:count], 5).tolist(),
        "y": np.round(upright[:count], 5).tolist(),
        "peak": motion.pga,
        "strength": round(motion.pga / G, 2),
    }


def _pack(content: bytes) -> str:
    """Return bytes as deflated text."""
    return b64encode(zlib.compress(content, 9)).decode("ascii")
