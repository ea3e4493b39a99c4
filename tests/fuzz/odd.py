"""Absurd values, and some unusual valid ones."""

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

NUMBERS = (
    *(0, -1, 1, 2, 3, 0.5, -0.5, 7, 1e-300, -1e-300, 1e300, 5e-324, 1.7e308, 1e-9, 1e9, 1e17),
    *(float("nan"), float("inf"), float("-inf"), -0.0, 2**31, 2**63, 2**64, 10**400, -(10**400)),
)
WORDS = (
    *("", " ", "x", "nan", "inf", "-1 m", "1 m", "0.5 m", "1e400 m", "9**9**9**9 m", "9**9 m"),
    *(
        "35 deg",
        "1 kN",
        "1 m/s**2",
        "1 ms",
        "1e-300 m",
        "((((",
        "m" * 5000,
        "(" * 3000 + "1",
        "1 +",
    ),
    *("__import__('os').system('false')", "\0", "\ud7ff", "ÿ", "$$", "$x^{", "../../etc/passwd"),
    *(
        "/dev/zero",
        "/dev/stdin",
        "/",
        "1" * 5000,
        "1" * 5000 + " m",
        "1_0 m",
        "٣ m",
        "None",
        "auto",
    ),
    *("1 m; import os", "m**m", "1 m**1e9", "1 %", "1 delta_degC", "2 m @ 3", "1 dB", "1/0 m"),
)
"""Only text that can be written in a file of UTF-8."""

OBJECTS = (
    *(None, True, False, 1j, b"1", object(), (), [], {}, {"a": 1}, {1}, [1], [[1]], (1.0, 2.0)),
    *(
        [float("nan")],
        [None],
        ["x"],
        [1, 2, 3],
        Decimal("1"),
        Fraction(1, 2),
        print,
        int,
        Path("x"),
    ),
    *(np.float32(1), np.int8(1), np.nan, np.array(1.0), np.array([]), np.zeros(3), np.ones((2, 2))),
    *(np.array([np.nan]), np.array(["x"]), np.array([1, None]), np.ma.masked_array([1.0], [True])),
    *(np.ma.masked, np.array([1 + 1j]), range(3), iter([1]), np.datetime64("2020-01-01"), ...),
    *([1e300, 1e300], [0, 0], (0, 0), [[1, 2], [3]], "xy", bytearray(b"1"), memoryview(b"1")),
)
