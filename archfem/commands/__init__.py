"""Command line: arguments, exit codes and printed results.

    cli      argument parser, exit codes
    records  motion, select
    run      run, modes, limit, assess, rate, mesh, accuracy, risk, report, page, compile
    margin   verdict, scale
    study    study
    tools    check, animate, examples, example, new, schema, doctor
    schema   JSON schema of case files

Imports all rooms. Start reading at `cli`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
