"""HTML report of the results of a case.

    checks       sections on checks and provenance
    report       HTML report of a case
    report_data  case, runs and files of a report
    sections     sections on case, dead load, ground motion and response

Start reading at `report`.
"""
