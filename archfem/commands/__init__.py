"""The command line: words after `archfem`, and what each command prints.

    line      words as a command, and its exit code
    cases     commands for one case, and for records
    telling   what is said of a case as its results come
    films     the command for films
    studies   the command for studies
    examples  cases that archfem brings
    doctor    what is installed, and what is missing

It imports from all rooms. Start reading at `line`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
