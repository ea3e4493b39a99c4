"""Command line: arguments, exit codes and printed results.

    cli     argument parser, exit codes
    run     run, modes, mesh, accuracy, report, motion, compile
    schema  JSON schema of case files
    study   study
    tools   check, animate, examples, example, new, schema, doctor

Imports all rooms. Start reading at `cli`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
