"""A model of one cell, for tests of stress."""

import numpy as np
from scipy import sparse

import archfem as af

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def one_cell(stack, stress):
    """A model of one square cell, whose only coordinate is a factor on a stress."""
    block = np.full(4, stack.free[0])
    stresses = sparse.csr_matrix(np.reshape(stress, (3, 1)))
    cells = af.models.Cells(
        np.array(SQUARE), block, (np.arange(4),), sparse.csr_matrix((8, 1)), stresses
    )
    return af.build(stack, fidelity="rigid").copy_with(size=1, cells=cells)
