"""Scenes on which solvers are timed: structure, friction, fidelity, ground motion, damping.

Only public names of archfem are used, so that scenes can also be run on another checkout.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import archfem as af

DT = 0.005
"""Time step of all scenes [s]."""

SOIL_ALL_NODES = {"backfill": "full"}
"""Fidelity of the bridge's backfill, beside that of its stones."""


def ring(voussoirs: int = 17) -> af.Structure:
    """Build the validation ring of Demirel and Aldemir (2021), cut into a number of voussoirs.

    The joint stiffness grows with the number of joints, so that all rings have one compliance.
    """
    share = (voussoirs + 1) / 18.0
    contact = af.masonry.STONE_TO_STONE
    contact = replace(
        contact,
        normal_stiffness=share * contact.normal_stiffness,
        shear_stiffness=share * contact.shear_stiffness,
    )
    return af.circular_arch(
        radius=2.95,
        thickness=0.55,
        embrace=159.0,
        voussoirs=voussoirs,
        width=1.0,
        contact=contact,
    )


def arch_on_piers() -> af.Structure:
    """Build a segmental arch of 15 voussoirs on two piers, which stands at a friction of 0.3."""
    return af.shapes.buttressed_arch(
        measured="centre line",
        span=5.0,
        thickness=0.6,
        voussoirs=15,
        breadth=2.0,
        height=2.4,
        embrace=140.0,
    )


def wall(courses: int = 8, length: float = 4.0) -> af.Structure:
    """Build a wall in running bond: courses 0.3 m high of blocks 0.8 m long on a foundation."""
    foundation = _rectangle((0.0, length), (-0.3, 0.0), "foundation", fixed=True)
    blocks = [foundation]
    for course in range(courses):
        # Every other course begins with half a block, which shifts its upright joints.
        first = 0.8 if course % 2 == 0 else 0.4
        ends = [0.0, *np.arange(first, length - 1e-9, 0.8).tolist(), length]
        for number, span in enumerate(pairwise(ends)):
            level = (0.3 * course, 0.3 * (course + 1))
            blocks.append(_rectangle(span, level, f"course {course}, block {number}"))
    return af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE, name="wall")


def _rectangle(
    x: tuple[float, float], y: tuple[float, float], name: str, fixed: bool = False
) -> af.Block:
    """Build one block of the wall."""
    outline = ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
    return af.Block(
        outline, af.STONE, name, fixed=fixed, corners=(0, 1, 2, 3), part="wall", role="other"
    )


@cache
def bridge_case() -> af.Case:
    """Read the shipped bridge from the checkout that is imported."""
    return af.Case.read(Path(af.__file__).parents[1] / "meshes" / "prusias.toml")


@cache
def bridge_motion() -> af.Motion:
    """Return 4 s about the peak of the bridge's first pair, at R = 3."""
    motion = bridge_case().alone("pair-1").ground_suite().motions[0]
    peak = motion.dt * int(np.argmax(np.abs(motion.horizontal)))
    start = max(0.0, peak - 0.5)
    return motion.cut(start, start + 4.0)


def with_friction(structure: af.Structure, friction: float | None) -> af.Structure:
    """Return a structure with one coefficient of friction in all joints; None never slides."""
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in structure.joints]
    return replace(structure, joints=tuple(joints))


@dataclass(frozen=True)
class Site:
    """A structure with its ground motion and damping.

    Attributes:
        structure: builds the structure.
        motion: returns the ground motion.
        damping: viscous damping of the scene.
        steps: default number of time steps.
    """

    structure: Callable[[], af.Structure]
    motion: Callable[[], af.Motion]
    damping: af.Rayleigh
    steps: int


RING_DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
BRIDGE_DAMPING = af.Rayleigh(0.05, (3.0, 12.0))

SITES = {
    "ring of 17": Site(
        ring, lambda: af.Motion.synthetic(duration=20.0, pga=5.0, seed=1), RING_DAMPING, 1000
    ),
    "ring of 60": Site(
        lambda: ring(60),
        lambda: af.Motion.synthetic(duration=20.0, pga=5.0, seed=1),
        RING_DAMPING,
        1000,
    ),
    "arch on piers": Site(
        arch_on_piers,
        lambda: af.Motion.synthetic(duration=20.0, pga=3.0, seed=2),
        RING_DAMPING,
        1000,
    ),
    "wall": Site(
        wall, lambda: af.Motion.synthetic(duration=20.0, pga=4.0, seed=3), RING_DAMPING, 1000
    ),
    "bridge, R = 3": Site(lambda: bridge_case().structure, bridge_motion, BRIDGE_DAMPING, 400),
    "bridge, R = 1": Site(
        lambda: bridge_case().structure, lambda: bridge_motion().scaled(3.0), BRIDGE_DAMPING, 400
    ),
    "shipped ring": Site(
        ring, lambda: af.Motion.synthetic(duration=20.0, pga=5.5, seed=3), RING_DAMPING, 4000
    ),
}


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One case of a table.

    Attributes:
        group: name of the table to which the scene belongs.
        site: key of `SITES`.
        fidelity: fidelity of all blocks, or of the bridge's stones.
        friction: coefficient of friction of all joints [-]; None never slides.
        displacements: "small" or "large".
        newmark: whether the average acceleration method replaces the default scheme.
        quadrature: rule along the joints; None is the default rule.
        steps: number of time steps; None takes that of the site.
    """

    group: str
    site: str
    fidelity: str
    friction: float | None
    displacements: str = "small"
    newmark: bool = False
    quadrature: str | None = None
    steps: int | None = None

    @property
    def name(self) -> str:
        """Return a name that is unique within all scenes."""
        words = [self.site, self.fidelity, "no friction" if self.friction is None else ""]
        words[-1] = words[-1] or f"friction {self.friction:g}"
        words += [self.quadrature] if self.quadrature else []
        words += ["Newmark"] if self.newmark else []
        words += ["large"] if self.displacements == "large" else []
        return ", ".join(words)

    @property
    def step_count(self) -> int:
        """Return the number of time steps."""
        return self.steps or SITES[self.site].steps

    @property
    def structure(self) -> af.Structure:
        """Build the structure."""
        return with_friction(SITES[self.site].structure(), self.friction)

    @cached_property
    def model(self) -> Any:
        """Build the model."""
        fidelity: Any = self.fidelity
        if self.site.startswith("bridge"):
            fidelity = {**SOIL_ALL_NODES, "rest": self.fidelity}
        return af.build(
            self.structure,
            fidelity=fidelity,
            quadrature=self.quadrature,
            displacements=self.displacements,
        )

    @cached_property
    def dead_load(self) -> Any:
        """Solve for equilibrium under dead load."""
        return af.dead_load(self.model)

    def history(self, steps: int, method: Any, **settings: Any) -> af.History:
        """Run a time history over a number of steps, by default from dead load."""
        site = SITES[self.site]
        settings = {"start": self.dead_load, "damping": site.damping} | settings
        if self.newmark:
            settings["scheme"] = af.dynamics.Newmark()
        # Half a step more, against round-off in the number of samples.
        motion = site.motion().cut(0.0, (steps + 0.5) * DT)
        if self.newmark:
            # Newmark's method gains energy under stronger motions, and such runs end in an error.
            motion = motion.scaled(0.3)
        return af.time_history(self.model, motion, dt=DT, method=method, **settings)


FRICTIONS = (None, 0.6, 0.3)

SMALL_DISPLACEMENTS = {
    "ring of 17": ("rigid", "faces", "condensed", "full"),
    "ring of 60": ("rigid", "faces", "condensed"),
    "arch on piers": ("rigid", "faces", "full"),
    "wall": ("rigid", "faces"),
    "bridge, R = 3": ("rigid", "faces"),
    "bridge, R = 1": ("faces", "full"),
}
"""Fidelities of each site in the table of small displacements."""


def all_scenes() -> list[Scene]:
    """List the scenes of all tables."""
    scenes = [
        Scene(group="small", site=site, fidelity=fidelity, friction=friction)
        for site, fidelities in SMALL_DISPLACEMENTS.items()
        for fidelity in fidelities
        for friction in FRICTIONS
    ]
    for fidelity in ("rigid", "faces", "condensed", "full"):
        for rule in (None, "nodal") if fidelity != "rigid" else (None,):
            scenes.append(
                Scene(
                    group="newmark",
                    site="ring of 17",
                    fidelity=fidelity,
                    friction=None,
                    newmark=True,
                    quadrature=rule,
                )
            )
    scenes += [
        Scene(group="newmark", site=site, fidelity="rigid", friction=None, newmark=True)
        for site in ("ring of 60", "arch on piers", "wall", "bridge, R = 3")
    ]
    scenes.append(Scene(group="shipped", site="shipped ring", fidelity="full", friction=0.6))
    scenes += [
        Scene(
            group="large",
            site=site,
            fidelity=fidelity,
            friction=friction,
            displacements="large",
            steps=steps,
        )
        for site, fidelity, steps in (
            ("ring of 17", "rigid", 400),
            ("ring of 17", "faces", 400),
            ("ring of 60", "rigid", 400),
            ("wall", "rigid", 400),
            ("bridge, R = 3", "rigid", 100),
            ("bridge, R = 3", "faces", 100),
        )
        for friction in (None, 0.6)
    ]
    return scenes
