"""Down to the ground: rigid blocks that part, hit each other and the ground, and come to rest.

Contacts are found anew at every step, so that any block may meet any other; it is no engine for
forces in what stands, which two rigid points of a joint leave open. Start reading at `engine`.

    engine    `Falling`: steps in time, frames, the energy balance, rest
    state     where blocks are and how they move; a frame of a run, its energy
    bodies    masses, shapes and friction of a structure's blocks
    pieces    outlines cut into convex pieces
    contact   where pieces touch
    carried   impulses of one step as a start for those of the next
    impacts   the impulses of a step: impact, friction
    handover  from a model of jointed blocks to loose ones
    verdict   `Fall`: what stands, is dislocated or has fallen
"""

from archfem import compiled

compiled.prepare()
