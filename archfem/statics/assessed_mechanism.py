"""Result of a kinematic assessment: oscillator, capacity curve, checks, notes and doubts."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import DOUBT_MARK, NOTE_MARK, ResultDisplay
from archfem._files import align_columns
from archfem._typing import Array
from archfem.limit.collapse import ONE_OF_MANY, slides_anywhere
from archfem.limit.finite_mechanism import MechanismPath
from archfem.limit.mechanism_names import name_mechanism
from archfem.masonry.loads import name_side
from archfem.masonry.structure import (
    CLEAR_TURNS,
    Structure,
    join_names,
    list_or_count,
)
from archfem.models.model import Doubt
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.statics.assessment_checks import (
    AssessmentCheck,
    LimitState,
    describe_difference,
    list_lower,
    spectral_acceleration,
)
from archfem.units import STANDARD_GRAVITY, Ends, MPa, format_ratio, kN


@dataclass(frozen=True, eq=False, repr=False)
class KinematicAssessment(ResultDisplay):
    """Kinematic assessment of a mechanism.

    Attributes:
        structure: assessed structure, without a fill.
        spectrum: design spectrum or ground motion of the demand.
        direction: sense of the horizontal forces along x, 1 or -1.
        alpha_0: factor α₀ of the horizontal forces that sets the mechanism in motion [-]; infinite
            where none does.
        M_star: participating mass M* [kg].
        e_star: participating share e* of the mass that moves [-].
        a_0_star: spectral acceleration a₀* that sets it in motion, without the confidence factor
            [m/s²].
        d_0_star: spectral displacement d₀* at which α vanishes [m]; infinite where the path ends
            before, as that of a body that slides without turning.
        T_s: secant period 2π √(d_s* / a*(d_s*)) at d_s* = 0.16 d₀* [s]: 0.4 of the 0.4 d₀* of
            NTC-2008; undefined (NaN) where d₀* is infinite.
        curve: capacity curve over place: `d` [m], `a` [m/s²], `alpha` [-], and `d_control`, the
            horizontal displacement of the control point [m]; its attribute `holds` is the last
            place from which on it is no upper bound.
        linear: check of the acceleration with the behaviour factor.
        displacement: check of the displacement; None where the mechanism cannot move.
        limit_state: rules of the displacement check.
        confidence_factor: FC, by which accelerations of the curve are divided in both checks [-].
        strength: compressive strength at which joints crush [Pa]; infinite where they do not.
        control: name of the block whose centroid is the control point, or of several, or
            "all weights"; `notes` has d₀* and the ratio by the other where they differ.
        path: finite motion of the mechanism; None where nothing moves.
        notes: assumptions of the result, and omissions on the safe side.
        doubts: why a ratio may be too high, or too low to pass, by how much is not known, each with
            a remedy.
        least: that under the assumption on a fill that has the least ratio; None without a fill.
        of_bodies: the same with one weight for each body that moves as one, at its centroid, and
            one for each load, which raises e* and lowers both ratios; None of an assessment with
            such weights.
        above: that of what is above a bed of a stack, if it has a lower ratio than the mechanism of
            least α₀, as above a tie; it must pass too.
    """

    structure: Structure
    spectrum: DesignSpectrum | Motion
    direction: float
    alpha_0: float
    M_star: float
    e_star: float
    a_0_star: float
    d_0_star: float
    T_s: float
    curve: xr.Dataset
    linear: AssessmentCheck
    displacement: AssessmentCheck | None
    limit_state: LimitState
    confidence_factor: float
    strength: float
    control: str
    path: MechanismPath | None
    notes: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    of_bodies: "KinematicAssessment | None" = None
    least: "KinematicAssessment | None" = None
    above: "KinematicAssessment | None" = None

    @property
    def mechanism_name(self) -> str:
        """The mechanism in words; "" where nothing moves."""
        return name_mechanism(self.structure, self.path.velocity) if self.path else ""

    @property
    def hinges(self) -> tuple[tuple[int, str], ...]:
        """Joints that turn at first, with the face where the blocks stay in contact."""
        return tuple((c.joint, end) for c, end in self._contacts if c.joint not in self.sliding)

    @cached_property
    def sliding(self) -> tuple[int, ...]:
        """Numbers of the joints that slide at first."""
        return tuple(sorted({c.joint for c, _ in self._contacts if c.slip}))

    @cached_property
    def _contacts(self) -> list[tuple[Any, str]]:
        """Contacts of the first mechanism, with the end of the joint where they are."""
        found = []
        for contact in self.path.mechanisms[0].contacts if self.path else ():
            away = np.linalg.norm(self.structure.ends[contact.joint] - contact.point, axis=1)
            found.append((contact, ("intrados", "extrados")[int(away.argmin())]))
        return found

    @property
    def checks(self) -> list[AssessmentCheck]:
        """Linear check, and that of the displacement where the mechanism moves."""
        return [self.linear, *([self.displacement] if self.displacement else [])]

    @property
    def passes(self) -> bool:
        """Whether the displacement check passes, or without it the linear one.

        It must pass under every assumption on a fill, `checks[-1].over_fill` having the range, and
        with one weight for each body, and, where alpha_0 is searched, with e* = 1. Where its ratio
        is an upper bound, which passes none, the linear check must pass. `above` must pass too.
        """
        last = self.checks[-1]
        shown = last.passes or (last.outcome == "passes" and self.linear.passes)
        return shown and (self.above is None or self.above.passes)

    def demand(self, periods: Array) -> tuple[Array, Array]:
        """Return spectral displacements [m] and accelerations [m/s²] of the demand.

        Args:
            periods: natural periods (n,) [s].

        Returns:
            Displacement and pseudo-acceleration spectrum at the damping of the limit state.
        """
        acceleration = spectral_acceleration(self.spectrum, periods, self.limit_state.damping)
        return acceleration * (periods / (2.0 * np.pi)) ** 2, acceleration

    def table(self) -> str:
        """Return the quantities and both checks, a line each."""
        units = {"alpha_0": "-", "e_star": "-", "M_star": "kg"}
        units["a_0_star"] = f"m/s² ({self.a_0_star / STANDARD_GRAVITY:.3f} g)"
        units |= {"d_0_star": "m", "T_s": "s"} if np.isfinite(self.d_0_star) else {}
        rows = [(name, getattr(self, name), unit) for name, unit in units.items()]
        for check in self.checks:
            own = {"capacity": check.unit, "demand": check.unit, "ratio": "-"}
            rows += [(f"{check.name}: {key}", getattr(check, key), own[key]) for key in own]
        texts = [[name, f"{value:.4g}", unit] for name, value, unit in rows]
        filled = [x for x in self.checks if x.over_fill is not None]
        texts += [[f"{x.name}: ratio over the fill", x.ratios, "-"] for x in filled]
        return align_columns(["quantity", "value", "unit"], texts)

    def _summary(self) -> str:
        """Describe the result in one line."""
        vanishes = f"d_0* {self.d_0_star:.4g} m, " if np.isfinite(self.d_0_star) else ""
        last, both = self.checks[-1], [(x.decisive, x.ratio) for x in self.checks[::-1]]
        outcome = last.outcome if last.unshown else describe_difference(*both) or last.outcome
        return (
            f"KinematicAssessment of '{self.structure.name}': alpha_0 {self.alpha_0:.4g}, a_0* "
            f"{self.a_0_star:.4g} m/s², {vanishes}{'; '.join([outcome, *self._lower])}"
        )

    def __str__(self) -> str:
        """Describe mechanism, oscillator, checks and notes, a line each."""
        side = name_side(self.direction)
        lines = [f"kinematic assessment of {self.structure.name}, pushed to the {side}"]
        if self.path is None:
            crush = " unless joints crush" * bool(np.isfinite(self.strength))
            lines.append(f"no horizontal force makes it a mechanism{crush}")
        else:
            joints = self.structure.joints
            sides = [(joints[k], side) for k, side in self.hinges]
            turning = [f"{x.name} at the {x.name_face(side)}" for x, side in sides]
            hinges = list_or_count(turning, CLEAR_TURNS)
            sliding = list_or_count([joints[k].name for k in self.sliding])
            many = not hinges and sliding and slides_anywhere(self.structure, self.alpha_0)
            vanishes = f", d_0* = {self.d_0_star:.4g} m, T_s = {self.T_s:.3f} s"
            weight = self.M_star * self.structure.gravity / self.e_star / kN
            divided = f", which the checks divide by FC = {self.confidence_factor:g}"
            lines += [
                f"{self.mechanism_name}{ONE_OF_MANY * bool(many)}; hinges: {hinges or 'none'}; "
                f"sliding: {sliding or 'none'}",
                f"alpha_0 = {self.alpha_0:.4g}, e* = {self.e_star:.3f} of the {weight:.4g} kN that "
                f"move, M* = {self.M_star:.4g} kg{' of this body' * bool(many)}, "
                f"a_0* = {self.a_0_star:.4g} m/s² ({self.a_0_star / STANDARD_GRAVITY:.3f} g)"
                f"{divided}{vanishes if np.isfinite(self.d_0_star) else ''}",
            ]
            moved = abs(self.curve["d"].values.round(5))
            places = self.path.first_changes
            changes = [f"{text} at d* = {moved[k]:.3g} m" for text, k in places.items()]
            changed = f"along the path the mechanism changes: {join_names(changes, '; ')}"
            if np.isfinite(self.strength) and self.hinges:
                back = Ends.of(self.path.blocks.setback[[k for k, _ in self.hinges]])
                crushed = f"joints crush at {self.strength / MPa:.3g} MPa: hinges are set back by"
                lines.append(f"{crushed} {back:mm}")
            lines += [changed] * bool(changes)
            lines += [self.path.ending] if self.displacement else []
            lines += map(str, self.checks)
            if (over_fill := self.checks[-1].over_fill) is not None:
                lines.append(over_fill.describe_states(digits=3, name=" times the spectrum"))
                own = (k for k, x in over_fill.values.items() if x == self.checks[-1].assumed)
                lines += [f"all else is under one assumption: {key}" for key in [*own][:1]]
        lines += [f"{NOTE_MARK}{note}" for note in [*self.notes, *self._lower]]
        return "\n".join([*lines, *(f"{DOUBT_MARK}{doubt}" for doubt in self.doubts)])

    @property
    def _lower(self) -> list[str]:
        """Mechanism and ratios of what is above a bed, if they are lower."""
        if not self.above or not (lower := list_lower(self.above.checks, self.checks)):
            return []
        moves = f"from alpha_0 = {self.above.alpha_0:.4g} on"
        ratios = "; ".join(f"{format_ratio(x.decisive)} by {x.name}, {x.words}" for x in lower)
        return [f"{self.above.mechanism_name}, {moves}, has a lower ratio: {ratios}"]
