"""HTML report of the results of a case.

    conclusion   head, outcome with margin and range, doubts
    inputs       inputs with their marks
    report       HTML report of a case
    report_data  case, runs and files of a report
    sections     sections on inputs, dead load, ground motion, response, checks and sources

Start reading at `report`.
"""
