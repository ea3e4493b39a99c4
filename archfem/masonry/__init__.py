"""What stands and what acts on it: blocks, joints, materials, parts and their roles.

    block         `Block`: a plane body, its outline, area and centroid
    structure     `Joint`, `Structure`: what touches, and what both form
    materials     what blocks are made of and how they touch
    roles         which parts are rings, piers or neither
    actions       what acts besides self-weight: body forces, point loads, settlements
    assembly      from blocks to a structure: joints wherever they touch
    direction     which way a ring or a pier runs
    fill          soft bodies cut into pieces with joints of their own
    geometry      areas, centroids and sides of outlines in the plane
    naming        things found by name or by number
    overlaps      what outlines must not do
    rigid_motion  how points of a block move with it
    stages        in which a structure was built
    softness      how soft a block is beside its joints
    shapes        structures from a few lengths: rings, columns, bridges
    survey        structures from drawings: GeoJSON and DXF outlines

It imports from the ground only. Start reading at `structure`, then at `shapes`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
