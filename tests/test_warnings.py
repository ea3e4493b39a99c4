"""Which warnings are errors of a test: not those of packages that the system happens to have."""

import warnings

import numpy as np
import pytest


def test_warnings_between_other_packages_are_no_errors():
    """matplotlib says so where the system has another version of it."""
    module = "matplotlib.projections"
    with warnings.catch_warnings(record=True) as met:
        warnings.warn_explicit("Unable to import Axes3D", UserWarning, "x.py", 63, module)
    assert len(met) == 1


@pytest.mark.parametrize("category", [UserWarning, DeprecationWarning, FutureWarning])
def test_warnings_of_archfem_and_of_tests_are_errors(category):
    with pytest.raises(category):
        warnings.warn_explicit("deprecated", category, "x.py", 1, "archfem.cases.run")
    with pytest.raises(category):
        warnings.warn("deprecated", category)  # noqa: B028  (of this module)


def test_invalid_operations_on_numbers_are_errors_in_every_module():
    with pytest.raises(RuntimeWarning):
        np.ones(1) / np.zeros(1)
    with pytest.raises(RuntimeWarning):
        warnings.warn_explicit("overflow", RuntimeWarning, "x.py", 1, "scipy.linalg")


def test_plugins_of_the_system_are_not_loaded(pytestconfig):
    assert pytestconfig.getoption("disable_plugin_autoload")
    assert pytestconfig.pluginmanager.hasplugin("xdist")
