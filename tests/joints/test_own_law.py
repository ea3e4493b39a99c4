"""Joint laws of the user: closed forms, the built-in law written again, and refused laws."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import archfem as af

ROOT = Path(__file__).parents[2]
STIFF = 1.48e9, 0.30e9  # of the stones' joints [Pa/m]


def crushing():
    """Return the law that the tasks of the documentation define."""
    text = (ROOT / "docs/howto/tasks.md").read_text(encoding="utf-8")
    (code,) = [c for c in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "Crushing:" in c]
    space = {"__name__": "page"}
    exec(compile(code, "tasks.md", "exec"), space)
    return space["Crushing"]


@dataclass(frozen=True)
class Hardening:
    stiffness: float
    depth: float  # closing at which the stiffness has tripled
    shear_stiffness: float

    memory_size: ClassVar[int] = 0

    def respond(self, opening, slip, memory):
        closing = np.maximum(-opening, 0.0)
        normal = -self.stiffness * closing * (1.0 + closing / self.depth)
        shear = self.shear_stiffness * slip
        across = np.where(opening <= 0.0, self.stiffness * (1.0 + 2.0 * closing / self.depth), 0.0)
        return (normal, shear), ((across, 0.0), (0.0, self.shear_stiffness)), memory

    def energy(self, opening, slip, memory):
        closing = np.maximum(-opening, 0.0)
        across = self.stiffness * closing**2 * (0.5 + closing / (3.0 * self.depth))
        return across + 0.5 * self.shear_stiffness * slip**2


@dataclass(frozen=True)
class NoTension:
    across: float
    along: float
    memory_size: ClassVar[int] = 0

    def respond(self, opening, slip, memory):
        stiffness = np.where(opening <= 0.0, self.across, 0.0)
        tractions = stiffness * opening, self.along * slip
        return tractions, ((stiffness, 0.0), (0.0, self.along)), memory

    def energy(self, opening, slip, memory):
        return 0.5 * (self.across * np.minimum(opening, 0.0) ** 2 + self.along * slip**2)


def ring(law):
    contact = af.Contact(*STIFF, friction=None, law=law)
    return af.circular_arch(span=5.0, rise=2.0, thickness=0.5, voussoirs=7, contact=contact)


def shaken(law, *, damped=True, pga=8.0, steps=24):
    model = af.build(ring(law), fidelity="rigid", quadrature="trapezoidal", quadrature_points=3)
    motion = af.Motion(pga * np.sin(0.35 * np.arange(steps + 1)), dt=0.005)  # 11 Hz
    damping = af.StiffnessDamping(0.05, 20.0) if damped else None
    return af.time_history(model, motion, damping=damping, dt=0.005, method="snes").dataset


def test_the_law_of_dry_joints_written_again_gives_the_same_history():
    built_in, own = shaken(None), shaken(NoTension(*STIFF))
    # joints open, over parts of steps
    assert abs(built_in["eccentricity"]).max() > 0.4
    for name in ("N", "V", "M", "opening", "rotation"):
        scale = float(abs(built_in[name]).max())
        # solves end at 1e-8 of the weight, means of a step at 1e-10
        np.testing.assert_allclose(own[name], built_in[name], rtol=0.0, atol=1e-8 * scale)


def test_a_block_slides_by_friction_with_history():
    law = af.joints.DryJoint(*STIFF, friction=0.3)
    contact = af.Contact(*STIFF, friction=0.3, law=law)
    block = af.column(breadth=2.0, heights=[0.2], contact=contact)
    push, dt, end, friction = 5.0, 0.00125, 0.05, 0.3 * 9.80665
    motion = af.Motion(np.full(round(end / dt) + 1, push), dt=dt)
    model = af.build(block, fidelity="rigid", quadrature="gauss", quadrature_points=2)
    own = af.time_history(model, motion, dt=dt, method="snes").dataset
    # the ground runs away under the block: on its shear springs at first, then on friction
    frequency = np.sqrt(STIFF[1] * 9.80665 / (0.2 * 20e3))  # k_s / (density times height)
    begin = np.arccos(1.0 - friction / push) / frequency
    speed, rest = push / frequency * np.sin(frequency * begin), end - begin
    slip = friction / frequency**2 + speed * rest + 0.5 * (push - friction) * rest**2
    # the springs, of 140 Hz, see six steps in a period
    assert float(abs(own["slip"][-1, 0])) == pytest.approx(slip, rel=5e-3)
    assert abs(own["energy_drift"]).max() < 1e-6  # J, of some ten


def test_a_law_without_history_loses_no_energy():
    law = Hardening(STIFF[0], 50e-6, STIFF[1])
    own = shaken(law, damped=False)
    # solves end at 1e-8 of the weight, some 10 kN, over displacements of some millimetres
    assert abs(own["energy_drift"]).max() < 1e-6


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
def test_a_column_closes_by_its_law(fidelity):
    law = Hardening(1.0e9, 20e-6, STIFF[1])
    contact = af.Contact(*STIFF, law=law)
    column = af.column(breadth=0.6, heights=[1.2, 1.2], contact=contact)
    rest = af.dead_load(af.build(column, fidelity=fidelity))
    pressure = np.array([48e3, 24e3])  # 2.4 m and 1.2 m of 20 kN/m³
    # k c (1 + c / d) = p
    closing = 10e-6 * (np.sqrt(1.0 + 4.0 * pressure / (1.0e9 * 20e-6)) - 1.0)
    operator = rest.model.operator
    gaps = operator.openings(rest.q)
    # equilibrium to 1e-8 of the weight
    np.testing.assert_allclose(-gaps, closing[operator.points.joint], rtol=1e-6)


def test_crushed_mortar_stays_closed():
    law = crushing()(1.0e9, STIFF[1], strength=30e3, hardening=0.5e9)
    column = af.column(breadth=0.6, heights=[1.2, 1.2], contact=af.Contact(*STIFF, law=law))
    model = af.build(column, fidelity="rigid", quadrature="gauss")
    loaded = af.dead_load(model)
    crushed = loaded.model.memory.reshape(2, -1)
    # (p - f) / h where the pressure p is above the strength, of 30 kPa, and nothing elsewhere
    np.testing.assert_allclose(crushed[0], -18e3 / 0.5e9, rtol=1e-6)
    assert not crushed[1].any()
    unloaded = af.statics.equilibrium_under(loaded.model, model.load(af.BodyForce(0.0, -0.5)))
    operator = unloaded.model.operator
    # elastic by half the pressure, on the crushed part
    gaps = operator.openings(unloaded.q).reshape(2, -1)
    np.testing.assert_allclose(gaps[0], -18e3 / 0.5e9 - 24e3 / 1.0e9, rtol=1e-6)
    np.testing.assert_allclose(gaps[1], -12e3 / 1.0e9, rtol=1e-6)


@dataclass(frozen=True)
class Wrong(NoTension):
    def respond(self, opening, slip, memory):
        tractions, ((across, _), (_, along)), memory = super().respond(opening, slip, memory)
        return tractions, ((0.5 * across, 0.0), (0.0, along)), memory


@dataclass(frozen=True)
class WrongEnergy(NoTension):
    def energy(self, opening, slip, memory):
        return 2.0 * super().energy(opening, slip, memory)


@dataclass(frozen=True)
class Infinite(NoTension):
    def respond(self, opening, slip, memory):
        tractions, tangent, memory = super().respond(opening, slip, memory)
        return (np.log(opening), tractions[1]), tangent, memory


@dataclass(frozen=True)
class Faulty(NoTension):
    def respond(self, opening, slip, memory):
        raise KeyError("x")


@dataclass(frozen=True)
class Forgetful(NoTension):
    memory_size: ClassVar[int] = 1

    def respond(self, opening, slip, memory):
        return (*super().respond(opening, slip, memory)[:2], [])


@dataclass(frozen=True)
class Uncounted:
    def respond(self, opening, slip, memory):
        return None

    energy = respond


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (Wrong(*STIFF), "tangent by opening differs from the difference of tractions by 33%"),
        (WrongEnergy(*STIFF), "traction of opening differs from the difference of energy by"),
        (Infinite(*STIFF), "no finite values at opening -"),
        (Faulty(*STIFF), "test_own_law.py, line .* KeyError"),
        (Forgetful(*STIFF), "0 rows of memory for memory_size = 1"),
        (Uncounted(), "memory_size None: give the number"),
        (np.inf, "has no method respond"),
    ],
)
def test_a_law_is_checked(law, said):
    with pytest.raises(af.InvalidInput, match=said):
        af.build(ring(law), fidelity="rigid")


def test_a_law_acts_where_it_can():
    structure = ring(NoTension(*STIFF))
    for settings, said in (
        ({"displacements": "large"}, "does not exist with large displacements"),
        ({"fidelity": "monolithic"}, "is not written in UFL"),
        ({"quadrature": "exact"}, "acts at points"),
    ):
        with pytest.raises(af.InvalidInput, match=said):
            af.build(structure, **{"fidelity": "rigid"} | settings)
    model, motion = af.build(structure, fidelity="rigid"), af.Motion(np.zeros(3), 0.01)
    with pytest.raises(af.InvalidInput, match="HHT follows no history"):
        af.time_history(model, motion, scheme=af.HHT())
    with pytest.raises(af.InvalidInput, match="nor have a law of their own"):
        af.time_history(model, motion, method="compliance")
    with pytest.raises(af.InvalidInput, match="nothing is built in stages"):
        af.dead_load(model, stages=af.masonry.usual_stages(structure))
    with pytest.raises(af.InvalidInput, match="blocks that fall do not follow"):
        af.dynamics.RigidBlockSimulation(
            af.column(breadth=0.6, heights=[1.2], contact=af.Contact(*STIFF, law=NoTension(*STIFF)))
        )


def test_a_contact_leaves_its_strength_to_the_law():
    law = NoTension(*STIFF)
    for values in ({"cohesion": 1e3}, {"dilatancy": 0.1}, {"cohesion": 1e3, "tension": 1e2}):
        with pytest.raises(af.InvalidInput, match="beside a law: leave it out"):
            af.Contact(*STIFF, law=law, **values)
    with pytest.raises(af.InvalidInput, match="is no frozen object"):
        af.Contact(*STIFF, law=NoTension)
    structure = ring(law)
    first = structure.joints[0]
    toothed = replace(first, contact=af.Contact(*STIFF, dilatancy=0.1))
    mixed = replace(structure, joints=(toothed, *structure.joints[1:]))
    with pytest.raises(af.InvalidInput, match="has dilatancy or tension beside"):
        af.build(mixed, fidelity="rigid")
    # a dry joint beside joints with a law has that of dry joints
    dry_joint = replace(first, contact=af.Contact(*STIFF, friction=None))
    dry = replace(structure, joints=(dry_joint, *structure.joints[1:]))
    whole = af.dead_load(af.build(ring(None), fidelity="rigid", quadrature="lobatto"))
    rest = af.dead_load(af.build(dry, fidelity="rigid"))
    np.testing.assert_allclose(rest.joints["N"], whole.joints["N"], rtol=1e-6)


CASE = """
[structure]
shape = "column"
breadth = "0.6 m"
heights = ["1.2 m"]

[contacts."stone to stone"]
law = {{ name = "plain", {} }}

[model]
fidelity = "rigid"
"""


def test_a_case_names_a_registered_law(tmp_path):
    af.joints.register_joint_law("plain", NoTension)
    path = tmp_path / "case.toml"
    path.write_text(CASE.format("across = 2e9, along = 1e9"))
    assert af.Case.read(path).structure.joints[0].contact.law == NoTension(2e9, 1e9)
    path.write_text(CASE.format("acros = 2e9, along = 1e9"))
    with pytest.raises(af.InvalidInput, match="acros"):
        _ = af.Case.read(path).structure
    path.write_text(CASE.format("across = 2e9"))
    with pytest.raises(af.InvalidInput, match="missing 1 required"):
        _ = af.Case.read(path).structure
    path.write_text(CASE.format("across = 2e9").replace("plain", "other"))
    with pytest.raises(af.InvalidInput, match=r"law\.name = 'other' is not known"):
        _ = af.Case.read(path).structure
    with pytest.raises(af.InvalidInput, match="no method respond"):
        af.joints.register_joint_law("empty", dataclass(frozen=True)(type("Empty", (), {})))
