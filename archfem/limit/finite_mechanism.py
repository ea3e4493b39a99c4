"""Finite motion of a collapse mechanism: load factor along the path of rigid blocks.

Limit analysis gives the velocities with which a structure begins to fall, and the factor α of the
forces that start it. Here the blocks follow that mechanism by finite rotations and
slips: hinges are pins at corners, and a sliding corner stays on the face that it touches. At each
place along the path, α is the factor at which the growing forces balance the weights, by
virtual work on the velocities there.

These events change the mechanism: a joint that closes again, a contact that would need tension, a
corner that slides off its face, and a tie that slackens or yields. There, limit analysis is
repeated on the displaced blocks, with friction at the contacts that remain, and its mechanism is
followed from then on. Ties are rigid-plastic: one that was longer before, or at rest, does not
pull.

Faces slide flat: sliding in limit analysis dilates by μ (associated flow), the finite motion does
not. Where a joint slides and others hinge, α at rest can therefore be below the collapse factor.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from archfem._display import ExplainedWord
from archfem._typing import Array, Flags, Numbers
from archfem._validation import check_choice, validate_arguments
from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.collapse import Outcome, collapse_factor
from archfem.limit.displaced_blocks import (
    STILL,
    TOUCHING,
    Contact,
    KinematicChain,
    PlacedBlocks,
    face_slips,
    find_mechanism,
)
from archfem.limit.linear_programme import NoEquilibrium
from archfem.limit.linkage import Linkage, LinkageState
from archfem.limit.self_weight import refuse_bonds
from archfem.masonry.block import find_neighbours, find_overlaps
from archfem.masonry.loads import Action, AttachedLoad, PointLoad, list_loads
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import HasStructure, Structure, join_joint_names, structure_of

# Share of the smaller of two neighbours that may overlap beside their joint [-]
MAX_CHIP_SHARE = 2e-3

# Multiples of the friction that continue a path where the given one barely fails, and relative
# change of the factor beyond which this is no small correction [-]
MORE_FRICTION = 1.02, 1.05, 1.1
MAX_JUMP = 0.05

# Multiples of the friction that select one of several mechanisms of equal factor [-]
LESS_FRICTION = 0.99, 0.97, 0.94, 0.9


class PathEnd(ExplainedWord):
    """Reason for which the path of a mechanism ends."""

    FALLS = "falls", "at the end of the path it falls by its weight alone"
    LOCKS = "locks", "at the end its contacts permit no further motion"
    COLLIDES = "collides", "at the end two blocks run into each other beside their joints"
    ENDURES = "endures", "it still needs a force after a way as long as the structure is large"
    UNRESOLVED = "unresolved", "at the end no mechanism was found whose faces slide flat"
    RELEASED = "released", "at the end a tie yields or slackens, and no equilibrium follows"
    BREAKS = "breaks", "at the end a tie breaks, at a strain of 2 % of its free length"
    SLIDES = "slides", "it slides without turning, up to the ends of the faces as drawn"


@dataclass(frozen=True)
class PathEvent:
    """A change of the mechanism along its path, or its end."""

    place: int  # number of the place where it happens
    text: str  # or the end
    closes: bool = False  # whether joints close
    of_tie: bool = False  # whether a tie slackens or yields


@dataclass(frozen=True, eq=False, repr=False)
class MechanismPath:
    """Path of a mechanism: factor and displacements from rest to the fall.

    Attributes:
        blocks: the blocks at rest, with their loads.
        factors: factor α of the growing forces at each place (n,) [-].
        displacements: displacements of centroids, and rotations (n, n_blocks, 3) [m, m, rad].
        velocity: velocities at rest, the fastest corner at 1 m/s (n_blocks, 3).
        mechanisms: mechanisms, one after the other.
        events: changes of the mechanism, each with the number of its place and its text.
        end: reason for which the path ends; `end.sentence` gives its meaning.
        holds: last place up to which no other mechanism has a lower factor; beyond it the factors
            are upper bounds. None where that was not examined.
        pulls: largest force of each tie on the way, while it keeps its length (n_ties,) [N].
        met: names of the blocks that run into each other at the end, or of the tie that breaks,
            slackens or yields there.
    """

    blocks: PlacedBlocks
    factors: Array
    displacements: Array
    velocity: Array
    mechanisms: tuple[KinematicChain, ...]
    events: tuple[PathEvent, ...]
    end: PathEnd
    holds: int | None = None
    pulls: Array = field(default_factory=lambda: np.zeros(0))
    met: tuple[str, ...] = ()

    @property
    def first_changes(self) -> dict[str, int]:
        """Place of each change of the mechanism, which may happen again and again, by its text."""
        found: dict[str, int] = {}
        for event in self.events:
            if event.text != self.end:
                found.setdefault(event.text, event.place)
        return found

    @cached_property
    def stretches(self) -> Array:
        """Largest stretch of each tie up to each place (n, n_ties) [m]."""
        found = [self.blocks.moved(each).stretches for each in self.displacements]
        return np.maximum.accumulate(np.maximum(found, 0.0))

    def follow_centroid(self, numbers: Numbers) -> Array:
        """Return the displacement of the common centroid of some blocks along x (n,) [m]."""
        blocks = [self.blocks.structure.blocks[number] for number in numbers]
        weights = [block.area * block.material.unit_weight for block in blocks]
        return np.average(self.displacements[:, numbers, 0], axis=1, weights=weights)

    @property
    def ending(self) -> str:
        """Meaning of the end, with the names of blocks that run into each other, or of a tie."""
        return ": ".join([self.end.sentence, *[" and ".join(self.met)] * bool(self.met)])

    @cached_property
    def curve(self) -> xr.Dataset:
        """Factor [-], and displacement of the growing loads along themselves [m], over place."""
        blocks = self.blocks
        loaded = [not blocks.structure.blocks[k].fixed for k, *_ in blocks.pulls]
        forces = np.array([force for *_, force in blocks.pulls])[loaded]
        every = blocks, *map(blocks.moved, self.displacements)
        places = np.array([[place for _, place, _ in each.pulls] for each in every])[:, loaded]
        moved = np.sum(forces * (places[1:] - places[0]), axis=(1, 2)) / np.hypot(*forces.T).sum()
        values = {"factor": (self.factors, "1"), "displacement": (moved, "m")}
        return xr.Dataset(
            {key: ("place", value, {"units": unit}) for key, (value, unit) in values.items()}
        )

    def end_sliding(self) -> "MechanismPath":
        """Return the path to its end, which is at rest where nothing turns: α does not fall."""
        if np.abs(self.velocity[:, 2]).max() * self.blocks.structure.size > STILL:
            return self
        rest = self.factors[:1], self.displacements[:1], self.velocity
        return MechanismPath(self.blocks, *rest, self.mechanisms[:1], (), PathEnd.SLIDES)

    @property
    def breaks(self) -> bool:
        """Whether a tie is stretched by more than breaks it, at the end of the path."""
        ties = zip(self.blocks.ties, self.stretches.T, strict=True)
        return any(sizes[-1] > tie.limit for tie, sizes in ties)

    def end_broken(self) -> "MechanismPath":
        """Return the path up to where the first tie breaks, which one does."""
        numbers = np.arange(len(self.factors))
        ties = zip(self.blocks.ties, self.stretches.T, strict=True)
        number, name = min((np.interp(x.limit, sizes, numbers), x.name) for x, sizes in ties)
        last = int(np.ceil(number))
        factors, displacements = (
            np.append(x[:last], [x[last] + (number - last) * (x[last] - x[last - 1])], axis=0)
            for x in (self.factors, self.displacements)
        )
        events = tuple(event for event in self.events if event.place < last)
        kept = self.blocks, factors, displacements, self.velocity, self.mechanisms, events
        return MechanismPath(*kept, PathEnd.BREAKS, None, self.pulls, (f"that at {name}",))

    def __repr__(self) -> str:
        """Describe start and end of the path in one line."""
        moved = float(self.curve["displacement"][-1])
        return (
            f"MechanismPath: factor {self.factors[0]:.4g} at rest, {self.factors[-1]:.4g} after "
            f"{moved:.4g} m along the forces, {len(self.events)} events; {self.ending}"
        )


@validate_arguments
def collapse_path(
    structure: Structure | HasStructure,
    *,
    live: Action | Sequence[Action],
    friction: str | None = "coulomb",
    dead: Sequence[Action] = (),
) -> MechanismPath:
    """Follow the collapse mechanism of rigid blocks by finite rotations and slips to their fall.

    The path begins with the mechanism of `collapse_factor`, and gives the descending branch of the
    curve whose peak that factor is: hinges are pins at corners, faces slide flat. At each place α
    balances the loads, by virtual work,

        α f_live·v + f_dead·v - Σ μ N |G_s v| = 0.

    A mechanism ends where a joint closes, a contact would need tension, or a corner slides off its
    face. Limit analysis on the displaced blocks gives the next one. Forces keep their direction and
    stay with the points of the blocks on which they act. Joints are rigid, have no cohesion and do
    not crush: with elastic ones a curve lies below, and tends to this path as displacements grow.

    Args:
        structure: supports are its fixed blocks; or an `archfem.Analysis` of it.
        live: one action, or several that grow together.
        friction: "coulomb", by which the first mechanism dilates and its motion does not, so that
            the first factor may be below `collapse_factor`; None forbids sliding.
        dead: loads that act beside self-weight and do not grow.

    Returns:
        Factors, displacements and events; its `curve` is that of a pushover.

    Raises:
        InvalidInput: an option is unknown; an action misses the structure; the structure does not
            stand, has a fill, or has joints with cohesion or tensile strength; or no factor makes
            it a mechanism.
        DidNotConverge: no mechanism was found that moves without the dilatancy of sliding faces.

    Example:
        >>> wall = af.column(breadth=0.6, heights=[2.4])
        >>> path = af.limit.collapse_path(wall, live=af.BodyForce(1.0))
        >>> round(float(path.factors[0]), 4), round(float(path.curve["displacement"][-1]), 4)
        (0.25, 0.3)
    """
    structure, grows = structure_of(structure), list_loads(live)
    check_choice(friction, "friction", ("coulomb", None))
    refuse_bonds(structure)
    if (cohesion := max(joint.contact.cohesion for joint in structure.joints)) > 0.0:
        raise InvalidInput(
            f"joints have a cohesion of {cohesion:.3g} Pa, which a path leaves out: for the safe "
            "answer without it give Contact(cohesion=0.0)"
        )
    if find_yielding_blocks(structure):
        raise InvalidInput(
            "a fill does not follow the stones on a path: under horizontal forces "
            "af.kinematic_assessment(…, fill=…) follows them with its pressures as built"
        )
    found = collapse_factor(structure, live=grows, friction=friction, dead=dead, strength=np.inf)
    if found.outcome is not Outcome.COLLAPSES:
        raise InvalidInput(f"{found.outcome.sentence}: there is no mechanism to follow")
    placed = PlacedBlocks.at_rest(structure, _attach_actions(structure, dead))
    placed = replace(placed, growing=_attach_actions(structure, grows))
    joints = list(range(len(structure.joints)))
    coefficient = structure.friction if friction else np.full(len(joints), np.inf)
    mechanism = find_mechanism(placed, joints, coefficient)
    assert mechanism is not None
    follower = PathFollower(placed, joints, coefficient)
    path = follower.follow(mechanism)
    return replace(path, holds=follower.last_equilibrium(path))


def _attach_actions(structure: Structure, actions: Sequence[Action]) -> tuple[AttachedLoad, ...]:
    """Return actions as forces that stay with points of the blocks."""
    loads = []
    for action in actions:
        if isinstance(action, PointLoad):
            number, (x, y) = action.place(structure)
            loads.append(AttachedLoad(number, (float(x), float(y)), force=action.force))
            continue
        for number, (x, y), weight in PlacedBlocks.at_rest(structure).masses:
            if structure.blocks[number].fixed:
                continue
            force = weight * action.horizontal, weight * action.vertical
            loads.append(AttachedLoad(number, (float(x), float(y)), force=force))
    return tuple(loads)


class _Stop(Exception):
    """Raised with the reason where the path ends."""

    def __init__(self, end: PathEnd) -> None:
        super().__init__(end.sentence)
        self.end = end


@dataclass(eq=False)
class PathFollower:
    """Follows a mechanism from event to event."""

    blocks: PlacedBlocks  # at rest
    joints: Sequence[int]  # joints that may open or slip
    friction: Array  # coefficients, infinite where nothing slides (n_joints,)
    factors: list[float] = field(default_factory=list)
    displacements: list[Array] = field(default_factory=list)
    events: list[PathEvent] = field(default_factory=list)
    travel: float = 0.0  # of the fastest corner, so far [m]
    pulls: Array = field(default_factory=lambda: np.zeros(0))  # as of the path (n_ties,) [N]
    stuck: int = 0  # mechanisms that did not move since the last place that did
    met: tuple[str, ...] = ()  # names of the blocks that run into each other at the end

    def follow(self, mechanism: KinematicChain, max_events: int = 20) -> MechanismPath:
        """Follow a mechanism until it falls, locks, collides, or the path is cut off."""
        mechanisms: list[KinematicChain] = [mechanism]
        motion = np.zeros_like(self.blocks.displacement)
        self.pulls = np.zeros(len(self.blocks.ties))
        try:
            mechanisms[0], state, velocity = self._start(self.blocks, mechanism)
            motion = state.bodies.spread(velocity)
            while len(mechanisms) <= max_events:
                before = self.travel
                blocks = self._follow_linkage(state, velocity)
                moved = self.travel - before > TOUCHING * self.blocks.structure.size
                self.stuck = 0 if moved else self.stuck + 1
                renewed, state, velocity = self._start(blocks, self._renew(blocks))
                mechanisms.append(renewed)
            end = PathEnd.UNRESOLVED
        except _Stop as stop:
            end = stop.end
        except DidNotConverge:
            if not self.factors:
                raise
            end = PathEnd.UNRESOLVED
        places = self.blocks, np.array(self.factors), np.array(self.displacements), motion
        changes = tuple(mechanisms), tuple(self.events)
        return MechanismPath(*places, *changes, end, None, self.pulls, self.met)

    def _start(
        self, blocks: PlacedBlocks, mechanism: KinematicChain
    ) -> tuple[KinematicChain, LinkageState, Array]:
        """Return a mechanism that slides without dilatancy, and the start of its path.

        It is the first that moves, behind as many as did not since the last place that moved.
        """
        for trial in islice(self._trials(blocks, mechanism), self.stuck, None):
            trial = self._without_grazing(blocks, trial)
            state = LinkageState(Linkage(blocks, trial), blocks)
            velocity = state.velocity(state.linkage.first_velocity)
            if velocity is None or not self._opens_joints(state, velocity):
                continue
            if trial.is_flat or self._presses(state, velocity):
                return trial, state, velocity
        self._record(blocks, mechanism.factor)
        raise _Stop(PathEnd.LOCKS)

    def _trials(self, blocks: PlacedBlocks, mechanism: KinematicChain) -> Iterator[KinematicChain]:
        """Yield mechanisms that may move at a place: a given one, and others without dilatancy."""
        yield mechanism
        # With the dilatancy of associated flow joints open that would close if faces slid flat, and
        # contacts are in compression that would need tension.
        if not self.travel:
            yield self._renew(blocks, flat=True)
            return
        # where several are of equal factor, less friction selects one of them, on the safe side
        found = None
        for share in (1.0, *LESS_FRICTION):
            with suppress(DidNotConverge, NoEquilibrium):
                if found := find_mechanism(blocks, self.joints, share * self.friction, flat=True):
                    yield found
        if found is None:
            raise _Stop(PathEnd.UNRESOLVED)

    def _without_grazing(self, blocks: PlacedBlocks, mechanism: KinematicChain) -> KinematicChain:
        """Return a mechanism without sliding contacts that open although their rate is zero."""
        # A corner that leaves a face along a circle keeps it to first order only: as a constraint,
        # redundant beside the others, it would lock the linkage.
        for contact in [each for each in mechanism.contacts if each.slip]:
            others = tuple(each for each in mechanism.contacts if each is not contact)
            freed = replace(mechanism, contacts=others)
            whole = LinkageState(Linkage(blocks, mechanism), blocks)
            state = LinkageState(Linkage(blocks, freed), blocks)
            ranks = [np.linalg.matrix_rank(each.jacobian, tol=STILL) for each in (whole, state)]
            if ranks[0] == ranks[1] and self._leaves(whole, state, contact):
                mechanism = freed
        return mechanism

    def _leaves(self, whole: LinkageState, freed: LinkageState, contact: Contact) -> bool:
        """Return whether a contact has a gap after a small step of a linkage without it."""
        velocity = freed.velocity(whole.linkage.first_velocity)
        step = 1e-3 * self.blocks.structure.size
        trial = None if velocity is None else freed.advanced(velocity, step)
        if velocity is None or trial is None or not self._presses(freed, velocity):
            return False
        moved = LinkageState(whole.linkage, trial[0].blocks)
        contacts = whole.linkage.mechanism.contacts
        place = next(k for k, each in enumerate(contacts) if each is contact)
        return bool(moved.misfits[place] > 1e-11 * self.blocks.structure.size)

    def _opens_joints(self, state: LinkageState, velocity: Array) -> bool:
        """Return whether no contact closes."""
        body, touching = state.bodies.body, state.blocks.touching(self.joints)
        contacts = [each for each in touching if body[each.corner] != body[each.face]]
        contacts = face_slips(state.blocks, contacts, state.bodies.spread(velocity))
        return bool((state.bodies.rates(contacts)[0] @ velocity >= -10.0 * STILL).all())

    def _presses(self, state: LinkageState, velocity: Array) -> bool:
        """Return whether no contact needs tension."""
        forces = state.balance(velocity, self.friction)[1]
        return not bool((forces < -2e-5 * self._force_unit).any())

    @property
    def _force_unit(self) -> float:
        """Mean weight of a block that moves [N]."""
        return float(np.abs(self.blocks.dead[:, 1]).sum() / len(self.blocks.structure.free))

    def _record(self, blocks: PlacedBlocks, factor: float) -> None:
        """Append a place to the path."""
        self.factors.append(factor)
        self.displacements.append(blocks.displacement)

    def _record_state(self, state: LinkageState, factor: float, forces: Array) -> None:
        """Append the place of a state to the path, and compare the forces of its held ties."""
        np.fmax.at(self.pulls, state.linkage.held, forces[len(state.contacts) :])
        self._record(state.blocks, factor)

    def _renew(self, blocks: PlacedBlocks, *, flat: bool = False) -> KinematicChain:
        """Return the mechanism of limit analysis at the present places."""
        # Where friction just fails, stones slip by little to a state that a little more would hold:
        # the path continues as the upper bound that `last_equilibrium` finds.
        for share in (1.0, *MORE_FRICTION) if self.travel else (1.0,):
            try:
                mechanism = find_mechanism(blocks, self.joints, share * self.friction, flat=flat)
            except NoEquilibrium:
                # without the length that a tie kept, two motions are free, and no factor holds them
                if self.events and self.events[-1].of_tie:
                    self.met = (self.events[-1].text,)
                    raise _Stop(PathEnd.RELEASED) from None
                continue
            if mechanism is None:
                raise _Stop(PathEnd.LOCKS)
            jumps = share > 1.0 and abs(mechanism.factor / self.factors[-1] - 1.0) > MAX_JUMP
            if mechanism.factor <= 0.0 or jumps:
                break
            return mechanism
        self._record(blocks, 0.0)
        raise _Stop(PathEnd.FALLS)

    def _follow_linkage(self, state: LinkageState, velocity: Array) -> PlacedBlocks:
        """Follow a linkage to its next event and return the blocks there."""
        size = self.blocks.structure.size
        factor, pressures = state.balance(velocity, self.friction)
        self._record_state(state, factor, pressures)
        step = 1e-3 * size
        while self.travel <= size:
            trial = state.advanced(velocity, step)
            forces = None if trial is None else trial[0].balance(trial[1], self.friction)
            ahead = None if forces is None else forces[0]
            # a factor that changes by less than 4 % a step keeps the curve smooth
            if ahead is None or abs(ahead - factor) > 0.04 * max(abs(self.factors[0]), 1e-3):
                step *= 0.5
                if step > 1e-9 * size:
                    continue
            if trial is None or forces is None:
                raise _Stop(PathEnd.LOCKS)
            if (self._margins(*trial, step, forces) <= 0.0).any():
                return self._finish(state, velocity, step, trial)
            (state, velocity), factor = trial, forces[0]
            self.travel += step
            self._record_state(state, *forces)
            step = min(1.5 * step, 0.01 * size)
        raise _Stop(PathEnd.ENDURES)

    def _finish(
        self, state: LinkageState, velocity: Array, step: float, last: tuple[LinkageState, Array]
    ) -> PlacedBlocks:
        """Record the place of the first event within a step, and return the blocks there."""
        tried: dict[float, tuple[LinkageState, Array] | None] = {0.0: (state, velocity), step: last}
        shares, margins_at_end = dict[float, float](), self._margins(*last, step)
        happened = margins_at_end <= 0.0

        def least_share(way: float) -> float:
            """Return the least margin of these events, over its size at the end of the step."""
            trial = tried[way] = tried.get(way) or state.advanced(velocity, way)
            margins = -np.ones_like(margins_at_end) if trial is None else self._margins(*trial, way)
            share = np.min(margins[happened] / -margins_at_end[happened], initial=1e6)
            if (margins[~happened] <= 0.0).any():
                share = -1.0  # another event, and an earlier one
            # nothing happens at the start; a share of zero would end the search without a bracket
            shares[way] = share = (share or -1e-300) if way else abs(share)
            return float(share)

        brentq(least_share, 0.0, step, xtol=1e-9 * self.blocks.structure.size)
        step = min(way for way, share in shares.items() if share < 0.0)
        if (trial := tried[step]) is None:
            raise _Stop(PathEnd.LOCKS)
        first = self._margins(*trial, step) <= 0.0
        event = self._name_event(len(self.factors), trial[0], first)
        self.travel += step
        if event.closes:  # just before, where the corner is within the tolerance
            trial = tried[max(way for way in shares if way < step)] or trial
        factor, forces = trial[0].balance(trial[1], self.friction)
        self._record_state(trial[0], max(factor, 0.0), forces)
        self.events.append(event)
        if isinstance(event.text, PathEnd):
            raise _Stop(event.text)
        return trial[0].blocks

    def _margins(
        self,
        state: LinkageState,
        velocity: Array,
        step: float,
        balance: tuple[float, Array] | None = None,
    ) -> Array:
        """Return how far a state is from each event; one without a positive margin has happened."""
        factor, forces = balance or state.balance(velocity, self.friction)
        blocks, size = state.blocks, self.blocks.structure.size
        body, pairs, near = state.bodies.body, blocks.structure.pairs, TOUCHING * size
        apart = (body[pairs[:, 0]] != body[pairs[:, 1]])[:, None]
        # deeper than a step reaches, a corner is behind the face and not in it
        gaps = np.where(apart & (blocks.gaps > -4.0 * step - near), blocks.gaps, np.inf)
        # well above the tolerance of the programme that follows; undetermined forces are NaN
        near_zero, pulls = 1e-5 * self._force_unit, forces[len(state.contacts) :]
        left = np.concatenate([forces, state.held_sizes - pulls]) + near_zero
        pressed, of_ties = np.split(np.nan_to_num(left, nan=np.inf), [len(state.contacts)])
        ways = [self._way_to_end(blocks, each) if each.slip else np.inf for each in state.contacts]
        edges = np.array(ways) + 2.0 * near
        met = gaps.ravel() + 0.5 * near
        room = self._least_room(state)[0]
        return np.concatenate([[factor], met, pressed, edges, of_ties, [room]])

    @cached_property
    def tolerated(self) -> Array:
        """Overlap of each pair of blocks that ends no path (n_blocks, n_blocks) [m²].

        Of neighbours it is a chip of a corner: faces drawn as chords of an arc would else lock.
        """
        structure, found = self.blocks.structure, self.blocks.outlines
        areas = np.array([block.area for block in structure.blocks])
        tolerated = np.zeros(2 * areas.shape)
        one, other = find_neighbours(found, 1e-3 * structure.size)
        tolerated[one, other] = MAX_CHIP_SHARE * np.minimum(areas[one], areas[other])
        one, other = structure.pairs[np.flatnonzero(self.blocks.setback)].T
        tolerated[one, other] = tolerated[other, one] = np.inf
        return tolerated

    def _least_room(self, state: LinkageState) -> tuple[float, Sequence[int]]:
        """Return the least margin of blocks that run into others, and the two, if any overlap."""
        pairs, _, areas, depths = find_overlaps(state.blocks.outlines, state.bodies.body)
        if not len(pairs):
            return np.inf, ()
        rooms = np.maximum(
            self.tolerated[*pairs.T] - areas, 1e-5 * self.blocks.structure.size - depths
        )
        least = int(rooms.argmin())
        return float(rooms[least]), pairs[least].tolist()

    @staticmethod
    def _way_to_end(blocks: PlacedBlocks, contact: Contact) -> float:
        """Return the way of a corner to the nearer end of the face on which it slides [m]."""
        side = int(contact.face == blocks.structure.pairs[contact.joint, 1])
        face = blocks.faces[side, contact.joint]
        length = np.linalg.norm(face[1] - face[0])
        share = (contact.point - face[0]) @ (face[1] - face[0]) / length
        return float(min(share, length - share))

    def _name_event(self, place: int, state: LinkageState, happened: Flags) -> PathEvent:
        """Return the first of the events that have happened at a state."""
        names = [joint.name for joint in state.blocks.structure.joints]
        if happened[0]:
            return PathEvent(place, PathEnd.FALLS)
        closes = happened[1 : 4 * len(names) + 1].reshape(2, -1, 2).any(axis=(0, 2))
        if closes.any():
            closing = join_joint_names([names[k] for k in np.flatnonzero(closes)])
            return PathEvent(place, f"{closing} closes", closes=True)
        others = happened[4 * len(names) + 1 : -1]
        of_contacts, of_ties = np.split(others, [2 * len(state.contacts)])
        for way, changed in zip(("slackens", "yields"), of_ties.reshape(2, -1), strict=True):
            for number in state.linkage.held[changed]:
                name = state.blocks.ties[number].name
                return PathEvent(place, f"the tie at {name} {way}", of_tie=True)
        changes = of_contacts.reshape(2, -1)
        for contact, opens, is_off in zip(state.contacts, *changes, strict=True):
            if opens:
                return PathEvent(place, f"a contact of {names[contact.joint]} opens")
            if is_off:
                name = names[contact.joint]
                return PathEvent(place, f"a corner slides off its face at {name}")
        self.met = tuple(state.blocks.structure.blocks[k].name for k in self._least_room(state)[1])
        return PathEvent(place, PathEnd.COLLIDES)

    def last_equilibrium(self, path: MechanismPath, samples: int = 9) -> int:
        """Return the last place up to which no mechanism has a lower factor than the path."""
        # Places are checked from rest on, then bisected between the last two.
        places = np.unique(np.linspace(0, len(path.factors) - 1, samples).astype(int))
        bad = next((k for k in places if not self._holds(path, k)), None)
        if bad is None:
            return len(path.factors) - 1
        good = max(int(k) for k in (*places[places < bad], 0))
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if self._holds(path, middle) else (good, middle)
        return good

    def _holds(self, path: MechanismPath, place: int, tolerance: float = 1e-4) -> bool:
        """Return whether limit analysis at a place gives the factor of the path."""
        released = path.end is PathEnd.RELEASED and place == len(path.factors) - 1
        if path.factors[place] <= 0.0 or released:
            return True  # the fall itself, or the end at which nothing is in equilibrium
        blocks = self.blocks.moved(path.displacements[place])
        blocks = replace(blocks, longest=path.stretches[place])
        try:
            mechanism = find_mechanism(blocks, self.joints, self.friction)
        except NoEquilibrium:
            return False
        return mechanism is None or mechanism.factor >= (1.0 - tolerance) * path.factors[place]
