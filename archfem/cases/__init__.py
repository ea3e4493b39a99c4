"""Analyses as files: TOML in, folders of results out.

    toml        tables of a file, no deeper and no larger than anybody means
    settings    tables of a case file and changes to them
    based       tables of a file over those of another that it is based on
    structures  [structure], [materials], [contacts] as a `Structure`
    motions     [motion], [suite] as a `Motion`, a `Suite`
    limits      [limit] as loads and friction for limit analysis
    building    [dead_load] as stages of building
    stepping    damping and scheme of [analysis]
    case        one analysis as one value, read from a TOML file
    run         carry out a case; go on where an earlier run ended
    kept        histories that an earlier command left, where they still answer
    summary     tables and sentences of what was found
    report      tables and pictures, into a folder
    told        warnings that name case and motion
    inputs      what an answer hangs on besides: the files a case reads, the program
    shipped     the cases that archfem brings
    reportable  results that have a report and a player
    folders     result folders opened again
    dossier     the report of a case, one page to hand in and to print

It imports from all rooms to its left. Start reading at `case`, then at `run`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
