"""How fast errors fall."""

import numpy as np


def observed_order(sizes, errors):
    """Slope of error over size in logarithms, between neighbours."""
    return np.diff(np.log(errors)) / np.diff(np.log(sizes))
