"""Joints between blocks that move as far as they like, compiled.

    means    means over a step of what gaps carry that go straight
    frames   opening, slip and turn of faces that have moved far
    poses    where the faces of blocks are that turn as far as they like
    overlap  the law over the overlap of faces that have slid far
    rubbing  the shear of a point, with friction and cohesion
    carrying what a joint carries by both
    compiled how functions that only compute are compiled
    moved    a step of the joints: forces, memory, and their derivatives

Start reading at `moved`.
"""

from archfem import compiled

compiled.prepare()
