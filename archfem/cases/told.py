"""Warnings of a run that name what was run, so that those of many can be told apart."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

logger = logging.getLogger("archfem")


@contextmanager
def told_of(*names: str) -> Iterator[None]:
    """Put names before whatever is warned of in a block.

    Args:
        names: e.g. the title of a case and that of its motion; inside another the outer one names.

    Yields:
        Nothing.
    """

    def named(record: logging.LogRecord) -> bool:
        if not getattr(record, "named", False):
            record.msg, record.args = f"{', '.join(names)}: {record.getMessage()}", ()
            record.named = True
        return True

    logger.addFilter(named)
    try:
        yield
    finally:
        logger.removeFilter(named)
