"""Sliding without dilatancy in limit analysis: solutions by alternating linear programmes.

Let φ(R) be the optimum of the linear programme whose joints carry |V| <= R. A state with normal
forces N is a solution without dilatancy where it is itself an optimum for R = c A + μ N: its
mechanism slides where |V| = R, opens only ends that carry nothing, and dissipates R |slip|. The
mechanism y is dual to φ, and t(y) are its slips. The gap

    value(x) + [c A + μ N(x)]·t(y) - [φ(R) + R·t(y)]  >=  0

is zero for such a pair. It is linear in the forces x for a given mechanism, and in the mechanism
for given forces: a bilinear programme over two separate polyhedra (Konno 1976). Alternation
minimises it in one and then in the other, until it vanishes or stops falling. There the slips are
changed at random and the alternation continues. To descend from a solution, the objective is
limited to values a little worse than its own. The gap is always that of the whole programme, so
that any pair with a vanishing gap is a solution.

In walls with much friction most starts end at sliding of the whole, or at none. Toe wedges are
found where friction is less, and their forces, which are admissible with more of it, lead upwards.

References: Drucker, J. Appl. Mech. 21 (1954) 71-74. Ferris and Tin-Loi, Int. J. Mech. Sci. 43
(2001) 209-224. Gilbert, Casapulla and Ahmed, Comput. Struct. 84 (2006) 873-887. Konno, Math.
Program. 11 (1976) 14-27.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from archfem._display import ProgressReport
from archfem._recent import RecentResults
from archfem._typing import Array
from archfem.errors import DidNotConverge, Interrupted
from archfem.limit.linear_programme import Limits, Optimum, Programme, uneven_compression

# States from which the search starts besides the associated one; fewer for many joints
MAX_START_COUNT = 40

# Joints up to which every start is tried and normal forces are bounded one by one
MAX_FULL_SEARCH_JOINTS = 150

# Shares of the friction with which sliding dilates, one after the other, behind a random vertex
# [-], and the programmes with each
DILATANCY_SHARES = ((0.4, 1), (0.1, 1))

# Those that follow behind the associated optimum, until averages of N settle: in bonds of 400
# joints a last share of 0.1 leaves gaps of 1e-5, behind which alternations stagnate
SETTLING_SHARES = ((0.01, 8), (0.0, 8))

# Shares of the friction at which solutions are followed upwards [-]; solutions followed at once
FRICTION_SHARES = (0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 0.99)
MAX_FOLLOWED = 3

# Rise of the factor with the last of the friction that is never a jump [-]
MAX_SUDDEN_RISE = 0.05

# Rounds in which the bound on all solutions is raised, and change of forces that ends them [-]
MAX_BOUND_ROUNDS, MIN_BOUND_CHANGE = 50, 1e-5

# Relative gap that counts as zero [-]: programmes are solved to 1e-9
GAP_TOLERANCE = 1e-7

# Relative gap of the nearest iterate that stands in where no start leads to a solution [-]
NEAR_GAP_TOLERANCE = 1e-3

# Relative gap that counts as zero with crushing, and error of objectives by its cuts [-]
CRUSHING_GAP_TOLERANCE, CUT_ERROR = 1e-4, 2e-5

# Preference for a weak objective, as a share of it, first and where that holds the gap open [-]
WEAK_PREFERENCE, LEAST_PREFERENCE = 1e-4, 1e-6

# Shear resistance added so that round-off cannot make a programme infeasible [mean block weights]
RESISTANCE_MARGIN = 1e-8

# Cost of compressions with crushing, relative to the largest of friction [-]: it decides between
# states of the same gap alone
LEAST_COMPRESSION = 1e-6

# Relative decrease of the objective from one solution to the next weaker one [-]
OBJECTIVE_DECREASE = 1e-3


@dataclass(frozen=True, eq=False)
class AlternatingIterate:
    """Forces and dual mechanism after one alternation, and their duality gap."""

    state: Optimum  # forces and objective, with the mechanism as its multipliers
    gap: float  # [units of the objective]
    converged: bool  # whether the gap counts as zero


def find_solution(
    programme: Programme, forces: Array, max_alternations: int = 30
) -> AlternatingIterate | None:
    """Find a solution without dilatancy from given forces, or an iterate near one.

    None if the duality gap stagnates above a thousandth of the objective.
    """
    smallest, preference = np.inf, WEAK_PREFERENCE
    for _ in range(max_alternations):  # most end within three
        iterate = _alternate(programme, programme, forces, preference=preference)
        if iterate is None or iterate.converged:
            return iterate
        forces, value = iterate.state.forces, abs(iterate.state.value)
        decrease = GAP_TOLERANCE * smallest if programme.crushing is None else CUT_ERROR * value
        stagnates, smallest = iterate.gap > smallest - decrease, iterate.gap
        if stagnates:
            # the preference may hold a gap of that share of the objective open
            if preference < WEAK_PREFERENCE or smallest > preference * value:
                return iterate if smallest <= NEAR_GAP_TOLERANCE * value else None
            smallest, preference = np.inf, LEAST_PREFERENCE
    return None


def descend(
    programme: Programme,
    first: AlternatingIterate | None,
    forces: Array,
    patience: int,
    progress: ProgressReport | None = None,
) -> Iterator[AlternatingIterate]:
    """Yield solutions of increasing objective until `patience` alternations in a row find none."""
    rng, fruitless, perturb, smallest = np.random.default_rng(1), 0, first is not None, np.inf
    restricted, least = programme, np.nan
    if first is not None:
        least, forces = first.state.value, first.state.forces
        restricted = _require_weaker(programme, least)
    while fruitless < patience:
        if progress is not None:
            progress.show(f"descent {fruitless} of {patience}{_describe_most(programme, least)}")
        factor = rng.lognormal(size=len(forces) // 3) if perturb else None
        iterate = _alternate(programme, restricted, forces, factor)
        if iterate is None:
            return
        if iterate.converged:
            yield iterate
            least, fruitless = iterate.state.value, 0
            restricted = _require_weaker(programme, least)
        perturb = iterate.converged or iterate.gap > (1.0 - GAP_TOLERANCE) * smallest
        smallest, forces = np.inf if perturb else iterate.gap, iterate.state.forces
        fruitless += 1


def _alternate(
    programme: Programme,
    restricted: Programme,
    forces: Array,
    factor: Array | None = None,
    preference: float = WEAK_PREFERENCE,
) -> AlternatingIterate | None:
    """Find the mechanism dual to forces, then the forces of least gap for its slips."""
    resistance = shear_resistance(programme, normal_forces(forces)) + RESISTANCE_MARGIN
    try:
        mechanism = with_shear_limits(programme, resistance).solve(forces=False)
        if mechanism is None:
            return None
        slips = np.abs(mechanism_gaps(programme, mechanism.multipliers).reshape(3, -1)[2])
        # Random slips lead away from where the search stands, some of them in joints that stick.
        changed = slips if factor is None else factor * (slips + 0.1 * slips.max())
        state = _minimise_gap(restricted, changed, preference)
    except DidNotConverge:  # round-off left no state
        return None
    if state is None:
        return None
    value = programme.objective(state)
    change = shear_resistance(programme, normal_forces(state.forces)) - resistance
    gap = value + float(change @ slips) - mechanism.value
    share = GAP_TOLERANCE if programme.crushing is None else CRUSHING_GAP_TOLERANCE
    tolerance = share * max(abs(value), abs(mechanism.value))
    tolerance = tolerance + RESISTANCE_MARGIN * float(slips.sum())
    pair = Optimum(value, state.forces, mechanism.multipliers, state.unknowns)
    return AlternatingIterate(pair, gap, gap <= tolerance)


def _minimise_gap(programme: Programme, slips: Array, preference: float) -> Optimum | None:
    """Return the forces of least gap for given slips; ties go to the largest objective."""
    # The small `preference` for a weak objective decides between states of nearly the same gap.
    dissipation = friction_coefficients(programme) * slips
    cost = np.concatenate([dissipation, dissipation, np.zeros(len(dissipation))])
    if programme.crushing is not None:  # one state alone, for which the crushing cuts converge
        cost += LEAST_COMPRESSION * cost.max() * uneven_compression(len(dissipation))
    if programme.force_cost is not None:
        cost += (1.0 - preference) * programme.force_cost
    unknown_cost = (1.0 - preference) * programme.unknown_cost
    return replace(programme, force_cost=cost, unknown_cost=unknown_cost).solve()


def _require_weaker(programme: Programme, value: float) -> Programme:
    """Return the programme with the objective bounded from below, by slightly more than a value."""
    least = value + OBJECTIVE_DECREASE * abs(value)
    if programme.force_cost is None:  # the first unknown is the load factor, at a cost of -1
        upper_bounds = np.concatenate([[max(-least, 0.0)], programme.upper_bounds[1:]])
        return replace(programme, upper_bounds=upper_bounds)
    row = Limits(sparse.csr_matrix(-programme.force_cost[None, :]), np.array([-least]))
    return programme.limited(row)


def friction_coefficients(programme: Programme) -> Array:
    """Return Coulomb's μ, zero in joints that never slide and dissipate nothing (n_joints,)."""
    return np.where(np.isfinite(programme.friction), programme.friction, 0.0)


def shear_resistance(programme: Programme, normal: Array) -> Array:
    """Return the shear c A + μ N at which joints slide (n_joints,) [mean block weights]."""
    return programme.cohesion + friction_coefficients(programme) * normal


def with_shear_limits(programme: Programme, resistance: Array) -> Programme:
    """Return the programme with limits |V| <= R independent of N; joints that never slide stay."""
    friction = np.where(np.isfinite(programme.friction), 0.0, np.inf)
    return replace(programme, friction=friction, cohesion=resistance)


def mechanism_gaps(programme: Programme, multipliers: Array) -> Array:
    """Return openings of both ends and slips of a mechanism, with those of a moving support."""
    gaps = -(programme.blocks.balance.T @ multipliers)
    return gaps if programme.force_cost is None else gaps + programme.force_cost


def normal_forces(forces: Array) -> Array:
    """Return the normal force of each joint (n_joints,) [mean block weights]."""
    return forces.reshape(3, -1)[:2].sum(axis=0)


@dataclass(frozen=True)
class NonassociatedBounds:
    """Bounds on the factors of solutions without dilatancy, which need not be unique.

    Attributes:
        bracket: bounds on the factor of every solution (2,): for a growing load a proven lower
            bound and the associated factor.
        between: factors of the weakest and of the strongest solution of the search (2,); NaN
            where it has none.
        starts: number of states from which the search started, one where it is proved least, and
            of those that reached a solution.
        path: shares of the friction, and factors of the weakest solution with each of them, of
            stones that do not crush.
        unbalanced: largest residual of the balance of the returned solution [mean block weights].
        excess: largest |V| - c A - μ N, relative to the largest N [-].
        opening: largest opening of an end that carries force, relative to the largest gap [-]; NaN
            with a strength, at which ends that carry force give way.
        gap: complementarity gap, friction dissipation minus work of the loads, relative to the
            objective [-].
        agreeing: number of starting states that reached the weakest solution, within a thousandth.
        interrupted: whether Ctrl-C ended the search.
    """

    bracket: tuple[float, float]
    between: tuple[float, float]
    starts: tuple[int, int]
    path: tuple[tuple[float, float], ...] = ()
    unbalanced: float = np.nan
    excess: float = np.nan
    opening: float = np.nan
    gap: float = np.nan
    agreeing: int = 0
    interrupted: bool = False

    def __str__(self) -> str:
        """Describe the range of the solutions in one line."""
        return "the search was interrupted: " * self.interrupted + self._describe_range()

    def _describe_range(self) -> str:
        """Describe the range of the solutions, whether or not the search has ended."""
        tried, successful = self.starts
        lower, upper = self.bracket
        if not np.isfinite(lower):
            return "without dilatancy it does not either: no factor is too large"
        weakest, strongest = self.between
        if f"{lower:.4g}" == f"{weakest:.4g}" == f"{upper:.4g}":
            return "proved the least, also without dilatancy: equilibrium and mechanism agree"
        limits = f"proved: none is below {lower:.4g}, nor above {upper:.4g}"
        if np.isinf(upper):  # a load that no associated factor limits has a lower bound alone
            limits = f"proved: none is below {lower:.4g}"
        elif not self.has_lower_bound:
            limits = f"proved: none is above {upper:.4g}; no lower bound is known"
        if np.isclose(weakest, upper, rtol=1e-6):
            limits += "; the least found is the factor of 'coulomb' too"
        if np.isnan(weakest):
            reached = f"{tried} starting states led to no" if tried else "no start has reached a"
            return f"{reached} solution without dilatancy; {limits}"
        least = str(self.agreeing or "a descent below them")
        if not successful and self.gap > GAP_TOLERANCE:
            least = f"a state near one, whose work balances within {100.0 * self.gap:.1g} %"
        return (
            f"solutions without dilatancy found from {weakest:.4g}, the least, to {strongest:.4g} "
            f"(by {successful} of {tried} starting states, the least by {least}); {limits}"
        )

    @property
    def has_lower_bound(self) -> bool:
        """Whether the lower bound is above zero, beyond round-off."""
        return abs(self.bracket[0]) > GAP_TOLERANCE * abs(self.bracket[1])

    @property
    def may_be_less(self) -> bool:
        """Whether a solution below the least that was found is not excluded."""
        return self.bracket[0] < (1.0 - CRUSHING_GAP_TOLERANCE) * self.between[0]

    @property
    def jumps(self) -> bool:
        """Whether the factor rises far faster with the last of the friction than before."""
        # as where the path to a toe wedge is lost, and sliding of the whole wall is found
        if len(self.path) < 2 or not np.isfinite(self.between[0]):
            return False
        shares, factors = np.transpose([*self.path, (1.0, self.between[0])])
        rises = np.diff(factors) / np.diff(shares)
        usual = max(0.0, rises[:-1].max()) * (1.0 - shares[-2])
        return bool(factors[-1] - factors[-2] > 3.0 * usual + MAX_SUDDEN_RISE * abs(factors[-1]))


# The last search of a programme as it is, by `_key_of`
_searched: dict[bytes, tuple[Optimum | None, NonassociatedBounds]] = {}


def search_nonassociated(
    programme: Programme, start: Optimum | None, scale: float
) -> tuple[Optimum | None, NonassociatedBounds]:
    """Search from many starts for the state of largest objective that slides without dilatancy.

    A symmetric structure that is pushed to the left is searched as if it were pushed to the right,
    unless it has just been searched so.
    """
    if (mirror := _find_mirror(programme)) is None:
        _searched.clear()
        state, bounds = _search(programme, start, scale)
        if not bounds.interrupted:
            _searched[_key_of(programme)] = state, bounds
        return state, bounds
    assert programme.columns is not None
    pushed = replace(programme, columns=-programme.columns)
    known = _searched.get(_key_of(pushed))
    state, bounds = known or _search(pushed, pushed.solve(), scale)
    if state is not None:
        motion, forces = mirror[0] @ state.multipliers, mirror[1] @ state.forces
        state = replace(state, forces=forces, multipliers=motion)
    return state, bounds


def _key_of(programme: Programme) -> bytes:
    """Return the blocks, joints and loads of a programme; "" if not loads alone grow."""
    blocks, columns = programme.blocks, programme.columns
    if programme.limits or programme.force_cost is not None or columns is None:
        return b""
    parts = [programme.load, programme.friction, programme.cohesion, programme.crushing]
    parts += [blocks.balance.toarray(), blocks.structure.normals, blocks.structure.centroids]
    return b"".join(np.array(each, float).tobytes() for each in (*parts, 0.0 + columns.toarray()))


def _find_mirror(programme: Programme) -> tuple[sparse.csr_matrix, sparse.csr_matrix] | None:
    """Return mirror maps of motions and forces of a symmetric structure pushed to the left."""
    balance, columns, load = programme.blocks.balance, programme.columns, programme.load
    if programme.limits or programme.force_cost is not None or columns is None:
        return None
    if columns.shape[1] != 1 or columns[0::3].sum() <= 0.0:
        return None
    centroids = programme.blocks.structure.centroids[list(programme.blocks.structure.free)]
    axis = centroids[:, 0].min() + centroids[:, 0].max()
    partner = cKDTree(centroids).query(centroids * [-1.0, 1.0] + [axis, 0.0])[1]
    place = (3 * partner[:, None] + np.arange(3)).ravel()
    motion = sparse.identity(len(place), format="csr")[place]
    motion.data *= np.tile([-1.0, 1.0, -1.0], len(partner))
    # a mirrored column of the balance is another one or its negative: one projection finds it
    projection, mirrored = np.random.default_rng(0).random(len(place)), motion @ balance
    known, count = balance.T @ projection, balance.shape[1]
    image = (mirrored.T @ projection)[:, None]
    index = cKDTree(np.concatenate([known, -known])[:, None]).query(image)[1]
    sign, index = np.where(index < count, 1.0, -1.0), index % count
    forces = sparse.csr_matrix((sign, (index, np.arange(count))), (count, count))
    differences = mirrored - balance @ forces, motion @ columns + columns, motion @ load - load
    crushing = [] if programme.crushing is None else [programme.crushing]
    strengths = np.tile([programme.friction, programme.cohesion, *crushing], 3)
    # both ends are pressed; round-off of outlines is 1e-15 of their size
    alike = np.allclose(strengths[:, index], strengths) and sign[: 2 * count // 3].min() > 0.0
    return (motion, forces) if alike and max(abs(x).max() for x in differences) < 1e-9 else None


@dataclass(eq=False)
class _SearchState:
    """Solutions and bound of a search so far."""

    path: Sequence[tuple[float, float]] = ()  # shares of the friction, and objectives with them
    tried: int = 0  # starts
    solutions: Sequence[AlternatingIterate] = ()  # to which starts led
    weaker: tuple[AlternatingIterate, ...] = ()  # from a descent below these
    bound: float = 0.0  # on all objectives from above, zero of a growing load until it is proved


def _search(
    programme: Programme, start: Optimum | None, scale: float
) -> tuple[Optimum | None, NonassociatedBounds]:
    """Return the result of `search_nonassociated` for a programme as it is."""
    found, interrupted, programme = _SearchState(), False, replace(programme, starts_from_last=True)
    associated = -np.inf if start is None else start.value
    try:
        _search_solutions(programme, start, found)
    except KeyboardInterrupt:
        if programme.force_cost is not None:  # no bound is known
            raise
        interrupted = True
    limits = scale * associated, scale * max(associated, found.bound)
    reached = [*found.solutions, *found.weaker]
    solutions = [each for each in reached if each.converged] or reached
    successful = sum(each.converged for each in found.solutions)
    values = [scale * iterate.state.value for iterate in solutions] or [np.nan]
    bounds = NonassociatedBounds(
        (min(limits), max(limits)),
        (min(values), max(values)),
        (found.tried, successful),
        tuple((share, scale * value) for share, value in found.path),
        interrupted=interrupted,
    )
    if not solutions:
        return None, bounds
    weakest = max(solutions, key=lambda iterate: iterate.state.value)
    close = np.isclose(values[:successful], scale * weakest.state.value, rtol=OBJECTIVE_DECREASE)
    bounds = replace(bounds, agreeing=int(close.sum()))
    return weakest.state, _with_residuals(programme, weakest, bounds)


def _search_solutions(programme: Programme, start: Optimum | None, found: _SearchState) -> None:
    """Bound the objective; unless that proves a solution, search from all starts and descend."""
    joints = len(programme.blocks.structure.depths)
    near = None if start is None else find_solution(programme, start.forces)
    known = near if near and near.converged else None
    if known:
        found.tried, found.solutions = 1, [known]
    state = start if known is None else known.state
    associated = -np.inf if state is None else state.value
    found.bound = _bound_objective(programme, state)
    if known and found.bound <= associated + CRUSHING_GAP_TOLERANCE * abs(associated):
        return  # none is weaker
    # the number of starts falls with the joints squared
    number = max(2, MAX_START_COUNT * min(joints, MAX_FULL_SEARCH_JOINTS) ** 2 // joints**2)
    hard = replace(programme, crushing=None)
    with ProgressReport("limit analysis", len(FRICTION_SHARES) + number) as progress:
        # with crushing each share would take minutes in walls of hundreds of stones
        followed, found.path = _follow_friction(hard, progress, associated)
        starts = followed + _free_head_joints(hard)
        starts += _relax_starts(hard, start, number)
        try:
            found.solutions = _find_solutions(programme, starts, progress, associated)
            found.tried = len(starts)
            if known and programme.crushing is not None:  # no start of hard stones need lead to it
                found.tried, found.solutions = len(starts) + 1, [*found.solutions, known]
        except Interrupted as error:
            if error.last[1]:
                found.tried, found.solutions = error.last
            raise
        first = max(found.solutions, key=lambda iterate: iterate.state.value, default=None)
        least = -np.inf
        if first is not None:
            least = first.state.value + OBJECTIVE_DECREASE * abs(first.state.value)
        if starts and max(found.bound, associated) > least:  # a weaker solution is possible
            # near the last optimum slips changed at random would lead to few other vertices
            fresh = replace(programme, starts_from_last=False)
            for iterate in descend(fresh, first, starts[0], patience=30, progress=progress):
                found.weaker += (iterate,)


def _follow_friction(
    programme: Programme, progress: ProgressReport, most: float
) -> tuple[list[Array], list[tuple[float, float]]]:
    """Return forces of solutions with nearly all friction, and shares and objectives on the way."""
    followed: list[Array] = []
    path = []
    for share in FRICTION_SHARES:
        words = f"{share:.3g} of the friction{_describe_most(programme, most)}"
        progress.show(words, done=1)
        reduced, starts = replace(programme, friction=share * programme.friction), followed
        with suppress(DidNotConverge):  # it might not stand with so little friction
            if (associated := reduced.solve()) is not None:
                starts = [associated.forces, *followed]
        states = [iterate.state for iterate in _find_solutions(reduced, starts)]
        states.sort(key=lambda state: -state.value)
        if states:
            path.append((share, states[0].value))
        followed = [*(state.forces for state in states), *followed][:MAX_FOLLOWED]
    return followed, path


def _free_head_joints(programme: Programme) -> list[Array]:
    """Return forces of the associated optimum whose steep joints have no friction, if any."""
    # head joints along the crack of a toe wedge carry nothing
    normals = programme.blocks.structure.normals
    steep = (np.abs(normals[:, 0]) > np.abs(normals[:, 1])) & np.isfinite(programme.friction)
    with suppress(DidNotConverge):  # it might not stand without this friction
        freed = replace(programme, friction=np.where(steep, 0.0, programme.friction)).solve()
        return [] if freed is None else [freed.forces]
    return []


def _find_solutions(
    programme: Programme,
    starts: Sequence[Array],
    progress: ProgressReport | None = None,
    most: float = np.nan,
) -> list[AlternatingIterate]:
    """Return the solutions to which given forces lead; Ctrl-C raises with those so far.

    Where there is none, the iterate nearest to one stands in. Progress says the least, or a bound.
    """
    solutions, near, number = list[AlternatingIterate](), list[AlternatingIterate](), 1
    hard = replace(programme, crushing=None)
    known = RecentResults[AlternatingIterate | None](len(starts))
    try:
        for number, forces in enumerate(starts, start=1):
            if progress is not None:
                least = max((each.state.value for each in solutions), default=most)
                words = f"start {number} of {len(starts)}{_describe_most(programme, least)}"
                progress.show(words, done=1)
            iterate = find_solution(hard, forces)
            if programme.crushing is not None:
                # most starts lead to one state of hard stones, from which few alternations are left
                for state in [forces] if iterate is None else [iterate.state.forces, forces]:
                    key = (np.round(state, 6) + 0.0).tobytes()
                    iterate = known.look_up(key, partial(find_solution, programme, state))
                    if iterate is not None and iterate.converged:
                        break
            if iterate is not None:
                (solutions if iterate.converged else near).append(iterate)
    except KeyboardInterrupt as error:
        raise Interrupted((number - 1, solutions)) from error
    return solutions or sorted(near, key=lambda iterate: iterate.gap)[:1]


def _describe_most(programme: Programme, value: float) -> str:
    """Describe the bound of an objective on a growing load; "" of none."""
    known = np.isfinite(value) and programme.force_cost is None
    return f", factor at most {-value:.4g}" if known else ""


def find_weakest(programme: Programme, starts: Sequence[Array]) -> Optimum | None:
    """Return the solution of largest objective found from given forces, or None."""
    solutions = [iterate.state for iterate in _find_solutions(programme, starts)]
    return max(solutions, key=lambda state: state.value, default=None)


def starting_forces(
    programme: Programme, start: Optimum | None, number: int, seed: int
) -> list[Array]:
    """Return the forces of the associated optimum and of a number of random vertices."""
    rng, first = np.random.default_rng(seed), [] if start is None else [start.forces]
    vertices = [_random_vertex(programme, start, rng) for _ in range(number)]
    return first + [forces for each in vertices for forces in each]


def _relax_starts(programme: Programme, start: Optimum | None, number: int) -> list[Array]:
    """Return forces of the associated optimum and of random vertices, each and as it relaxes."""
    # Joints resist μ N, averaged with the states before, and sliding dilates less and less
    # (Gilbert et al.): from such states most alternations end at a solution, from vertices few.
    rng, states = np.random.default_rng(0), list[Array]()
    first = [] if start is None else [start.forces]
    for chain in range(1 + number // (1 + len(DILATANCY_SHARES))):
        for forces in _random_vertex(programme, start, rng) if chain else first:
            states.append(forces)
            normal = normal_forces(forces)
            for share, count in DILATANCY_SHARES + SETTLING_SHARES * (chain == 0):
                with suppress(DidNotConverge):
                    for _ in range(count):
                        relaxed = _limit_dilatancy(programme, normal, share)
                        if (state := relaxed.solve()) is None:
                            break
                        forces = state.forces
                        normal = 0.5 * (normal + normal_forces(forces))
                    states.append(forces)
    return states


def _limit_dilatancy(programme: Programme, normal: Array, share: float) -> Programme:
    """Return the programme in which a share of the friction dilates; N as given holds the rest."""
    held = shear_resistance(programme, (1.0 - share) * normal) + RESISTANCE_MARGIN
    limited = with_shear_limits(programme, held)
    friction = limited.friction + share * friction_coefficients(programme)
    return replace(limited, friction=friction)


def _random_vertex(
    programme: Programme, start: Optimum | None, rng: np.random.Generator
) -> list[Array]:
    """Return forces of a random vertex of the admissible states, if there is one."""
    # the least randomly weighted sum of compressions, under a random fraction of the load
    joints = len(programme.blocks.structure.depths)
    cost = np.concatenate([rng.random(2 * joints), np.zeros(joints)])
    if programme.force_cost is not None:  # a settlement: its work at random weight
        size = _largest_magnitude(programme.force_cost)
        cost, loaded = cost + rng.uniform(-1, 1) * programme.force_cost / size, programme
    else:
        assert programme.columns is not None
        live, others = programme.columns[:, :1], programme.columns[:, 1:]
        if start is None:  # unbounded: a load of 0.1 to 10 times the weight
            live_size = float(abs(live).sum())
            weight = float(np.abs(programme.load).sum())
            factor = 10.0 ** rng.uniform(-1, 1) * weight / live_size if live_size > 0.0 else 0.0
        else:
            factor = float(rng.random() * start.unknowns[0])
        load = programme.load - live @ np.array([factor])
        costs, bounds = programme.unknown_cost[1:], programme.upper_bounds[1:]
        loaded = replace(programme, load=load, columns=others, unknown_cost=costs)
        loaded = replace(loaded, upper_bounds=bounds)
    with suppress(DidNotConverge):  # no equilibrium under so much load
        if (state := replace(loaded, force_cost=cost).solve()) is not None:
            return [state.forces]
    return []


def _bound_objective(programme: Programme, known: Optimum | None) -> float:
    """Bound the objective of every solution without dilatancy weaker than a known state."""
    # A solution's N is at least the least N of any state of equilibrium that is as strong as the
    # bounds let it be. A state with |V| <= c A + μ min N is therefore admissible in the programme
    # whose optimum the solution is. There the joints that slide limit the bound: their least N is
    # sought again, between closer bounds. Where the known state has no N, the least is zero.
    negated = None if programme.force_cost is None else -programme.force_cost
    opposite = replace(programme, force_cost=negated, unknown_cost=-programme.unknown_cost)
    bound, least = -_least_objective(opposite), np.zeros(len(programme.friction))
    carries = np.ones(len(least)) if known is None else normal_forces(known.forces)
    sought = (carries > RESISTANCE_MARGIN) & (len(least) <= MAX_FULL_SEARCH_JOINTS)
    cut = programme.with_cuts_at(known)
    for number in range(MAX_BOUND_ROUNDS):
        # no N is less than with some of the crushing cuts alone, which are those at known states
        between = replace(_limit_objective(cut, known, bound), crushing=None)
        last = least.copy()
        for joint in np.flatnonzero(sought):
            least[joint] = max(least[joint], _least_normal_force(between, joint))
        if number and not np.any(least > last + MIN_BOUND_CHANGE * least.max()):
            return bound
        try:
            safe = with_shear_limits(programme, shear_resistance(programme, least)).solve()
        except DidNotConverge:  # no equilibrium with so little friction
            return bound
        if safe is None:
            return -np.inf
        bound = min(bound, safe.value)
        if known and bound <= known.value + CRUSHING_GAP_TOLERANCE * abs(known.value):
            return bound
        cut = programme.with_cuts_at(known).with_cuts_at(safe)
        slips = np.abs(mechanism_gaps(programme, safe.multipliers).reshape(3, -1)[2])
        sought = slips > GAP_TOLERANCE * slips.max()
    return bound


def _limit_objective(programme: Programme, known: Optimum | None, bound: float) -> Programme:
    """Return the programme of states between a known one and a bound, if a load grows."""
    if known is None or programme.columns is None or programme.force_cost is not None:
        return programme
    rise = max(bound - known.value, 0.0) + GAP_TOLERANCE * abs(known.value)
    load = programme.load + programme.columns[:, :1] @ np.array([bound])
    upper_bounds = np.concatenate([[rise], programme.upper_bounds[1:]])
    return replace(programme, load=load, upper_bounds=upper_bounds)


def _least_normal_force(programme: Programme, joint: int) -> float:
    """Return the least N of a joint in any state of equilibrium, less round-off."""
    cost, no_cost = np.zeros((3, len(programme.friction))), np.zeros_like(programme.unknown_cost)
    cost[:2, joint] = 1.0
    least = _least_objective(replace(programme, force_cost=cost.ravel(), unknown_cost=no_cost))
    return least - RESISTANCE_MARGIN


def _least_objective(programme: Programme) -> float:
    """Return the least objective, or -inf where it is unbounded or the solver fails."""
    try:
        optimum = programme.solve()
    except DidNotConverge:
        return -np.inf
    return -np.inf if optimum is None else optimum.value


def _with_residuals(
    programme: Programme, iterate: AlternatingIterate, bounds: NonassociatedBounds
) -> NonassociatedBounds:
    """Return the bounds with the residuals of the conditions that define a solution."""
    state = iterate.state
    normal, shear = normal_forces(state.forces), np.abs(state.forces.reshape(3, -1)[2])
    residual = programme.blocks.balance @ state.forces - programme.load
    if programme.columns is not None:
        residual = residual + programme.columns @ state.unknowns
    gaps = mechanism_gaps(programme, state.multipliers)
    carries = state.forces[: 2 * len(normal)] > GAP_TOLERANCE * max(float(normal.max()), 1.0)
    slides = np.isfinite(programme.friction)
    excess = np.max((shear - shear_resistance(programme, normal))[slides], initial=0.0)
    opening = np.max(gaps[: len(carries)][carries], initial=0.0)
    if programme.crushing is not None:  # crushed ends open under force
        opening = np.nan
    return replace(
        bounds,
        unbalanced=float(np.abs(residual).max()),
        excess=float(excess) / _largest_magnitude(normal),
        opening=float(opening) / _largest_magnitude(gaps),
        gap=max(iterate.gap, 0.0) / _largest_magnitude(np.array([state.value, RESISTANCE_MARGIN])),
    )


def _largest_magnitude(values: Array) -> float:
    """Return the largest magnitude, at least the smallest normal number, to divide by."""
    return float(np.abs(values).max(initial=np.finfo(float).tiny))
