"""Structures of blocks, joints and materials, and the loads on them.

    assembly         joints from touching blocks
    backfill         backfill cut into pieces with joints
    block            Block, plane geometry, overlap checks
    construction     construction stages
    joint_closing    stiffness and closure of joints, by finish or by a test
    loads            BodyForce, PointLoad, Settlement
    materials        Material, Contact, presets
    out_of_plane     columns of walls across their plane, and the push that overturns these
    parts            roles and axes of rings and piers
    ring_thickness   a ring with another thickness about its middle line
    shapes           parametric arches, columns, walls, arcades and bridges from a few lengths
    standing         bodies that stand on a structure, such as a lorry
    stiffness_ratio  block stiffness relative to its joints
    structure        Joint, Structure, rigid motion, look-up by name
    survey           structures from surveyed outlines in GeoJSON, DXF or gmsh files

Imports the support modules only. Start reading at `structure`, then at `shapes`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
