"""What came of a trial, and how a function's end is judged."""

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass

import archfem as af

ANSWERED, REFUSED = "answered", "refused"
FOREIGN, HUNG, NONSENSE = "FOREIGN", "HUNG", "NONSENSE"
KINDS = (ANSWERED, REFUSED, FOREIGN, HUNG, NONSENSE)
BAD = (FOREIGN, HUNG, NONSENSE)

WORDS = 200
"""Most letters of what is said of a trial: errors may quote what was given."""


@dataclass(frozen=True)
class Came:
    """What came of a trial.

    Attributes:
        kind: one of `MECHANISM_KINDS`.
        words: the error, or what is wrong with the answer.
        told: what was tried, as text that a person can repeat it from.
    """

    kind: str
    words: str = ""
    told: str = ""


def judged(trial: Callable[[], str | None], told: str) -> Came:
    """Carry out a trial.

    Args:
        trial: does it, and says what is wrong with the answer, if anything is.
        told: what is tried.
    """
    try:
        wrong = trial()
    except af.ArchfemError as error:
        said = str(error)
        if len(said) > 20_000:
            return Came(FOREIGN, f"an error of {len(said)} letters", told)
        return Came(REFUSED, said[:WORDS], told)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # what no user should ever see
        last = traceback.extract_tb(sys.exc_info()[2])[-1]
        where = f"{last.filename.rpartition('/')[2]}:{last.lineno}"
        words = f"{type(error).__name__} in {where}: {str(error)[:WORDS]}"
        return Came(FOREIGN, words, f"{told}\n{traceback.format_exc(limit=-12)[:8000]}")
    return Came(NONSENSE, wrong, told) if wrong else Came(ANSWERED, "", told)
