"""Analyses as TOML files, and folders of their results.

    analysis_keys    [limit], [rating] and [assessment]
    analysis_tables  [model], [analysis], [criteria], [record], [dead_load]: read and written
    answers          answers of a result for the report: sentences, rows, doubts
    case             Case: an analysis, its motion, outputs
    defaults         deciding values that a case does not give
    examples         shipped cases
    motion_keys      [motion] and [suite]
    provenance       digests of inputs and program, modules of the user
    push_factors     pushes as multiples of the acceleration of a site
    rating_text      ratings of bridges as text
    report           HTML report of the results of a case
    result_folder    result folders written and opened again
    result_text      results as text
    risk_keys        [risk]: hazard, sampling, alternatives
    run              carry out a case, resume, result classes
    structure_keys   [structure], [materials] and [contacts]: read and written
    structure_text   structures as text
    toml_file        reading, writing, merging, overriding TOML tables
    verdict_keys     [verdict]: ranges of properties

Imports all rooms before it. Start reading at `case`, then at `run`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
