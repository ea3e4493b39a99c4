"""Time stepping in compiled loops: three methods that give the history of `dynamics`, faster.

`contact` works in the modes of the closed structure, `chain` on banded matrices, `compliance` with
one sparse factor and the compliance of the open points.
"""
