"""Parameter studies: sampling, parallel evaluation, stored results, fragility.

    cache            models, motions and solvers reused between points
    cluster          evaluation on a Dask cluster
    collapse_risk    annual rate of collapse
    comparison       cases side by side: findings and tables
    convergence      order, limit and error bar; accuracy of a case
    ensemble         histories under many motions, scales and properties, reduced
    evaluators       functions from a case to a flat table
    fork_server      modules that workers share
    fragility        fragility functions
    ida              incremental dynamic analysis
    joint_stiffness  influence of joint stiffness on findings
    parameter_space  products, samples, points
    process_pool     workers on this machine
    result_store     rows on disk, progress, dataset
    shared_results   results that workers share, computed once
    statements       statements of a publication beside findings
    study            Study, Comparison; study files; pairs of a suite
    variations       verdict_range: runs over uncertain properties

Imports all rooms before it. Start reading at `study`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
