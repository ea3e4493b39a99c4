"""HTML report of the results of a case.

    capacities      demands with their sources, and capacities, a row for each check
    conclusion      head, outcome with margin and range
    doubts          doubts and notes of results, and what was not varied
    inputs          inputs with their marks
    motion_rules    rules of norms for suites of motions
    outcomes        outcomes of runs in words: falls, lost blocks, displacements
    report          HTML report of a case
    report_data     case, runs and files of a report
    response        sections on ground motions, runs and their checks
    scales          scales and peaks of motions at which a structure fails
    study_findings  the worst of each case of a study, and what changes the answer
    sections        the other sections: inputs, structure, capacity, further results, sources

Start reading at `report`.
"""
