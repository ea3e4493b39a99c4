"""Command line: arguments, exit codes and printed results.

    cli    argument parser, exit codes
    run    run, check, modes, mesh, accuracy, report, motion, compile
    study  study
    tools  animate, examples, example, doctor

Imports all rooms. Start reading at `cli`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
