"""Pushovers whose joints slide: they reach the limit of joints that slide flat, and end."""

from math import radians, tan
from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.limit.closed import closed_cohesion
from archfem.masonry.materials import BACKFILL
from archfem.statics.ends import CRAWL, Stop, finished
from archfem.statics.pushover import _extrapolated

SIDEWAYS = af.BodyForce(1.0)

EXACT = 1e-7
"""Relative: programmes are solved to 1e-9 block weights, and the curve is flat at its end."""

TENDS = 1e-3
"""Relative: how near the extrapolation of a curve comes to its limit."""

REACHED = 5e-3
"""Relative: what is missing where a path ends far along, and its last steps are coarse."""


def boxed(length, size, angle=35.0):
    """Dry fill in pieces between two walls, on a floor, 1.5 m high."""
    shape = {"material": af.STONE, "fixed": True}
    boxes = {
        "floor": ((-0.5, length + 0.5), (-0.5, 0.0), shape),
        "fill": ((0.0, length), (0.0, 1.5), {"material": BACKFILL}),
        "back": ((-0.5, 0.0), (0.0, 1.5), shape),
        "wall": ((length, length + 0.5), (0.0, 1.5), shape),
    }
    blocks = [
        af.Block(((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])), name=name, part=name,
                 role="other", **kind)
        for name, (x, y, kind) in boxes.items()
    ]  # fmt: skip
    contact = af.Contact(0.3e9, 0.24e9, tan(radians(30.0)))
    return af.masonry.jointed_fill(af.masonry.assembled(blocks, contact), size, angle=angle)


def filled_bridge(cohesion, above):
    """One span under fill in pieces of 35°, between sidewalls that rise so far [Pa, m]."""
    ring = af.shapes.Arch(name="arch", span=4.0, rise=1.6, thickness=0.45, voussoirs=11)
    wall = {"length": 1.5, "height": 2.0, "above": above}
    whole = af.bridge(
        arches=[ring],
        sidewalls=[af.shapes.Sidewall(name=f"{side} wall", **wall) for side in ("left", "right")],
        backfill=af.shapes.Backfill(cover=0.5),
        width=4.0,
    )
    return af.masonry.jointed_fill(whole, 0.8, angle=35.0, cohesion=cohesion)


def flat(structure):
    """Least factor found of joints that slide without dilating."""
    return af.collapse_factor(structure, live=SIDEWAYS, friction="nonassociated").factor


def test_dry_fill_reaches_the_limit_of_joints_that_slide_flat(verified):
    """With dilatancy no factor is too large: pieces that wedge between fixed walls lock."""
    fill = boxed(2.0, 1.5)
    push = af.pushover(af.build(fill, fidelity="rigid", cells=(1, 1)), SIDEWAYS)
    assert np.isinf(af.collapse_factor(fill, live=SIDEWAYS).factor)
    limit = flat(fill)
    verified("dry fill between walls, pushed sideways: limit", limit, "limit analysis", push.factor)
    assert push.factor == pytest.approx(limit, rel=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize("control", ["displacement", "force"])
def test_dry_fill_goes_on_by_creep_where_steps_would_crawl(control):
    """By steps alone it was at 0.88 of the limit after 400 of them."""
    fill = boxed(3.0, 0.7)
    push = af.pushover(af.build(fill, fidelity="rigid", cells=(1, 1)), SIDEWAYS, control=control)
    limit = flat(fill)
    assert "moved by" in push.outcome
    assert push.factor == pytest.approx(limit, rel=REACHED)
    assert push.limit == pytest.approx(limit, rel=REACHED)


@pytest.mark.slow
@pytest.mark.parametrize(("cohesion", "above"), [(0.0, 2.2), (10e3, 0.8)], ids=["dry", "10 kPa"])
def test_a_bridge_under_fill_in_pieces_tends_to_the_limit_of_flat_sliding(
    cohesion, above, verified
):
    """Joints that open lose cohesion: with what is left the limits agree, with all it is higher."""
    fill = filled_bridge(cohesion, above)
    model = af.build(fill, fidelity="rigid", cells=(2, 1))
    push = af.pushover(model, SIDEWAYS, control="force")
    limit = flat(closed_cohesion(fill, push.joints.isel(step=-1)))
    case = f"bridge under fill in pieces, {cohesion:g} Pa, pushed sideways: limit"
    verified(case, limit, "limit analysis", push.limit)
    assert push.limit == pytest.approx(limit, rel=TENDS)
    assert 0.99 * limit < push.factor < limit
    associated = af.collapse_factor(fill, live=SIDEWAYS).factor
    assert limit < 0.84 * associated
    if cohesion:
        assert flat(fill) > 1.15 * limit


@pytest.mark.slow
def test_a_path_that_crawls_at_its_limit_ends_and_says_so():
    model = af.build(filled_bridge(0.0, 2.2), fidelity="rigid", cells=(2, 1))
    push = af.pushover(model, SIDEWAYS)
    assert "it crawls: in 40 steps the load moved by no more than 1%" in push.outcome
    assert push.factor == pytest.approx(0.27481, rel=2.0 * REACHED)


@pytest.mark.parametrize(("step", "crawls"), [(1e-5, True), (1e-2, False)])
def test_what_hardly_moves_in_many_steps_crawls(step, crawls):
    way = 1.0 + step * np.arange(CRAWL + 1)
    path = SimpleNamespace(
        displacements=way, factors=list(1.0 + 1e-4 * way), units="1", moving="load", states=way
    )
    path.model = SimpleNamespace(structure=SimpleNamespace(size=1e3))
    reason = finished(path, Stop(), af.Criteria(), np.array([1.0, 0.1]))
    assert (reason is not None and reason.startswith("it crawls")) == crawls


def test_a_last_step_that_is_short_does_not_look_flat():
    """λ = 1 - 0.1 d^(-1/2): its limit is 1, however little the last step brought."""
    way = np.append(np.geomspace(1.0, 50.0, 40), 50.0 + 1e-5)
    limit, uncertainty = _extrapolated(way, 1.0 - 0.1 / np.sqrt(way))
    assert limit == pytest.approx(1.0, rel=1e-9)
    assert uncertainty == pytest.approx(0.1 / np.sqrt(50.0), rel=1e-3)
