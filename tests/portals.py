"""A portal of two posts and a lintel of a role, for tests of what is assessed."""

import archfem as af

DRY = af.Contact(1.48e9, 0.30e9, friction=0.6)


def box(left, low, right, high, name, **given):
    """A rectangle of stone."""
    corners = ((left, low), (right, low), (right, high), (left, high))
    return af.Block(corners, af.STONE, name, **given)


def portal(role, further=()):
    """Posts 0.5 m wide and 2 m high, one stone each, a lintel of a role, and further blocks."""
    posts = [
        box(x, 0.0, x + 0.5, 2.0, f"{side} post", part=f"{side} pier", role="pier")
        for x, side in ((0.0, "left"), (2.5, "right"))
    ]
    ground = box(-1.0, -0.5, 8.0, 0.0, "ground", fixed=True, part="ground", role="other")
    lintel = box(-0.2, 2.0, 3.2, 2.5, "lintel", part="lintel", role=role)
    return af.masonry.assembled([ground, *posts, lintel, *further], DRY, width=0.8)
