"""Odd input by the thousand: each trial must end in an answer, or in an error of archfem's own."""
