"""Rigid blocks without stiffness: collapse factor, least thickness, mechanisms.

    blocks     rigid blocks in equilibrium
    programme  the linear programme and its limits
    weight     self-weight, to which all else is added
    collapse   the load that makes a mechanism; whether a structure stands
    sliding    sliding without dilatancy
    turns      turns of its search
    closed     cohesion on what is closed of joints
    told       what it warns of
    displaced  rigid blocks that have moved far
    movement   the largest movement of a support that is survived
    fill       strength of a fill, earth pressure, how it spreads loads
    strips     what lies above which stone, and what a fan of load meets first
    filled     stones under a fill: its weight and its pressures as loads and limits
    moving     a vehicle at every place on a bridge
    thickness  the least thickness that stands
    skeleton   the blocks that move as rigid bodies when joints fail
    screen     a quick look at whether they can move at all
    counted    mechanisms by counting failed joints
    episodes   how long a mechanism lasts, and how far it opens
    verified   mechanisms by a motion that the failed joints permit

It imports from `masonry`, `joints` and the ground. Start reading at `collapse`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
