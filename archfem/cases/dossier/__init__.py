"""The report of a case: one page, to hand in and to print, of what a result folder holds.

    results   what a report is written from: a case, its runs, a folder
    display   the model by which blocks of a run move on the page
    case_part  case, assumptions, units, geometry
    rest_part  dead load, stress, modes, limit analysis
    ground_part  motions and their spectra
    run_part  what each run did: player, joints, mechanism, fall
    check_part  predicted error, energy, balance, mesh; versions, hashes, files
    writing   all parts together

Start reading at `writing`. What the results do not hold is said to be missing, with the command
that finds it.
"""
