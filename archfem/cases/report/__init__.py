"""HTML report of the results of a case.

    report       HTML report of a case
    report_data  case, runs and files of a report
    sections     sections on case, dead load, ground motion, response, checks and sources

Start reading at `report`.
"""
