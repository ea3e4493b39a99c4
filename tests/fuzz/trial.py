"""The result of a trial, and how the end of a call is judged."""

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
"""Most letters of the words of a trial: errors may quote their input."""


@dataclass(frozen=True)
class Came:
    """The result of a trial.

    Attributes:
        kind: one of `KINDS`.
        words: the error, or the fault of the answer.
        input: the call or file that was tried, as text from which it can be repeated.
    """

    kind: str
    words: str = ""
    input: str = ""


def judged(trial: Callable[[], str | None], input_text: str) -> Came:
    """Carry out a trial.

    Args:
        trial: carries it out, and returns the fault of its answer, if there is one.
        input_text: the call or file that is tried.
    """
    try:
        wrong = trial()
    except af.ArchfemError as error:
        said = str(error)
        if len(said) > 20_000:
            return Came(FOREIGN, f"an error of {len(said)} letters", input_text)
        return Came(REFUSED, said[:WORDS], input_text)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # an error that is not archfem's own
        last = traceback.extract_tb(sys.exc_info()[2])[-1]
        where = f"{last.filename.rpartition('/')[2]}:{last.lineno}"
        words = f"{type(error).__name__} in {where}: {str(error)[:WORDS]}"
        return Came(FOREIGN, words, f"{input_text}\n{traceback.format_exc(limit=-12)[:8000]}")
    return Came(NONSENSE, wrong, input_text) if wrong else Came(ANSWERED, "", input_text)
