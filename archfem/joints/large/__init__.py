"""Joints between blocks with large displacements and rotations, compiled.

    face_kinematics  face poses and joint gaps at large rotations
    forces           joint forces and derivative at large rotations
    overlap_law      contact law on the overlap of two faces
    point_law        contact law at a place and along a facet, also of small displacements
    rates            derivative of the joint forces, in blocks shared by segments

Start reading at `forces`.
"""
