"""Warnings name what was run."""

import logging

from archfem.cases.told import told_of


def test_warnings_name_case_and_motion(caplog):
    logger = logging.getLogger("archfem")
    with told_of("study", "pair 3"), told_of("ring", "pair 3"):
        logger.warning("energy drifts by %d %%", 3)
    logger.warning("on its own, 100% as it is")
    assert caplog.messages == [
        "study, pair 3: energy drifts by 3 %",
        "on its own, 100% as it is",
    ]
