"""Mutated case files, as `archfem check` takes them."""

import argparse
import contextlib
import copy
import io
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import archfem as af
from archfem.cases.toml_file import format_tables
from archfem.commands import tools
from fuzz import odd
from fuzz.trial import Came, judged

BASES = (
    """
title = "a column"
[structure]
shape = "column"
breadth = "1 m"
heights = [1.0, "0.8 m"]
[model]
fidelity = "rigid"
cells = [4, 1]
[motion]
synthetic = { seed = 1, duration = 1.0, pga = "1 m/s**2" }
start = 0.1
end = "0.9 s"
[analysis]
dt = "5 ms"
scheme = "conserving"
damping = { ratio = 0.05, frequency = "8 Hz", joints = "closed" }
[criteria]
hinge = 0.46
failures = 4
friction = 0.6
duration = 0.02
[record]
every = 1
[output]
joints = [0, "joint 1"]
free_body = "block 1"
""",
    """
[structure]
shape = "circular_arch"
radius = "2.95 m"
thickness = "0.55 m"
embrace = "159 degree"
voussoirs = 7
width = 1.0
chords = 2
gravity = 9.81
material = "granite"
contact = "dry"
[materials.granite]
young = "30 GPa"
poisson = 0.2
unit_weight = "26 kN/m**3"
strength = "80 MPa"
[contacts.dry]
normal_stiffness = "1.48 MPa/mm"
shear_stiffness = "0.30 MPa/mm"
friction = 0.60
cohesion = "0 Pa"
[model]
fidelity = "faces"
cells = [2, 1]
quadrature = "lobatto"
[motion]
file = "record.txt"
units = "g"
dt = 0.01
scale = 1.2
resample = 0.005
[limit]
horizontal = 1.0
friction = "coulomb"
[assessment]
spectrum = { code = "EC8", ag = 0.2, ground = "B" }
loads = [ { block = "voussoir 1", point = ["0 m", "1 m"], weight = "5 kN" } ]
[dead_load]
stages = "usual"
""",
    """
[structure]
shape = "arch_on_piers"
radius = 2.0
thickness = 0.5
voussoirs = 7
pier_breadth = 1.2
courses = [1.0, 1.0]
[model]
fidelity = "rigid"
[suite]
name = "small"
scale = 1.1
reduction = 2.0
target = { code = "TBEC-2018", ss = 1.14, s1 = 0.315, site = "ZD" }
[suite.pairs]
first = { synthetic = { seed = 1, duration = 1.0, pga = 1.0 } }
second = { synthetic = { seed = 2, duration = 1.0 }, vertical = { synthetic = { seed = 3 } } }
[limit]
point = { x = "0.4 m", force = ["0 kN", "-1 kN"] }
friction = "nonassociated"
""",
    """
[structure]
shape = "bridge"
width = 4.0
[structure.arches.one]
measured = "centre line"
span = 3.0
rise = 1.2
thickness = 0.4
voussoirs = 7
[structure.backfill]
cover = 0.3
[model]
fidelity = "rigid"
[limit]
point = { x = "0.4 m", force = ["0 kN", "-1 kN"] }
fill = { friction_angle = "35 degree", cohesion = 0.0, dispersal = "boussinesq", spread = 30 }
[dead_load]
stages = "usual"
layers = 3
""",
    """
[structure]
shape = "outlines"
file = "drawing.geojson"
unit = "m"
snap = 0.01
contacts = { "stone/backfill" = "soil to stone" }
[model]
fidelity = "rigid"
""",
)
"""Cheap cases that name most of the keys there are."""

RECORD = "\n".join(f"{np.sin(0.3 * k) / 50:.5f}" for k in range(200)) + "\n"


GROUND = '"part": "ground", "fixed": true'
WALL = '"part": "wall", "role": "pier", "material": "stone"'


def _square(x: float, y: float, properties: str) -> str:
    corners = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]]
    return (
        f'{{"type": "Feature", "properties": {{{properties}}}, "geometry": '
        f'{{"type": "Polygon", "coordinates": [{corners}]}}}}'
    )


DRAWING = (
    '{"type": "FeatureCollection", "features": ['
    f"{_square(0, -1, GROUND)}, {_square(0, 0, WALL)}, {_square(0, 1, WALL)}]}}"
)


def ready() -> None:
    """Load the modules that `check` needs."""
    from archfem.masonry.survey import outlines  # noqa: F401

    af.units.in_unit("1 m", "m", "x")


def trial(seed: int, number: int, folder: Path) -> Came:
    """Check one mutated case file."""
    rng = np.random.default_rng((seed, number))
    (folder / "record.txt").write_text(RECORD)
    (folder / "drawing.geojson").write_bytes(
        _torn(DRAWING.encode(), rng) if rng.random() < 0.1 else DRAWING.encode()
    )
    settings = tomllib.loads(BASES[number % len(BASES)])
    try:
        for _ in range(rng.choice([1, 1, 2, 3])):
            mutate(settings, rng)
        content = format_tables(settings).encode()
    except (TypeError, ValueError, OverflowError, RecursionError):
        content = BASES[0].encode()
    if rng.random() < 0.25:
        content = _torn(content, rng)
    path = folder / "case.toml"
    path.write_bytes(content)
    return judged(lambda: checked(path), content[:20_000].decode(errors="backslashreplace"))


def checked(path: Path) -> str | None:
    """Check a case and return the fault of the printed text."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        tools.check(argparse.Namespace(case=str(path), changes=[]))
    if "dead load in" not in said.getvalue():
        return "nothing is said of the dead load"
    found = re.search(r"^.*\b(nan|inf)\b.*$", said.getvalue(), re.MULTILINE)
    return found and found[0]


def mutate(settings: dict[str, Any], rng: np.random.Generator) -> None:
    """Change one place of a case."""
    places = list(_places(settings))
    table, key = places[int(rng.integers(len(places)))]
    kind = rng.integers(10)
    if kind <= 3:
        table[key] = _picked(odd.NUMBERS + odd.WORDS, rng)
    elif kind == 4 and isinstance(table[key], int | float):
        table[key] = table[key] * 10.0 ** rng.integers(-3, 4)
    elif kind == 5:
        del table[key]
    elif kind == 6:
        other, name = places[int(rng.integers(len(places)))]
        table[key] = copy.deepcopy(other.get(name) if isinstance(other, dict) else other[name])
    elif kind == 7:
        table[key] = _picked(([table[key]] * 50, {"x": table[key]}, [], {}, [[]], [{}]), rng)
    elif kind == 8 and isinstance(table, dict):
        table[_picked(("", "x", "sh ape", "file", "synthetic", "fill", "law", *table), rng)] = 1
    else:
        inner: Any = 1
        for _ in range(int(rng.choice([5, 60, 400]))):
            inner = {"a": inner} if kind == 8 else [inner]
        table[key] = inner


def _places(table: Any) -> Iterator[tuple[Any, Any]]:
    """Where values of a case stand: a table or list, and the key or index in it."""
    if isinstance(table, dict | list):
        for key in list(table) if isinstance(table, dict) else range(len(table)):
            yield table, key
            yield from _places(table[key])


def _picked(values: Any, rng: np.random.Generator) -> Any:
    return values[int(rng.integers(len(values)))]


LUMPS = (
    *(b"\xef\xbb\xbf", b"\xff\xfe", b"\0", b"\x1a", b"\r", b"[" * 5000, b"{a=" * 5000, b"\xc3"),
    *(b"1" * 5000, b"a." * 5000 + b"b = 1\n", b'"""', b"'", b"=", b"\n[model]\n", b"1e", b"0x" * 9),
    *(b'\nbase = "case.toml"\n', b'\nbase = "/dev/zero"\n', b"\nremove = 3\n", b"-", b"e999"),
    *(b"1979-05-27T07:32:00Z", b"[[structure]]\n", b"\ntitle = 5\n", b"\xf0\x9f\x8f\x9b", b"nan"),
)


def _torn(content: bytes, rng: np.random.Generator) -> bytes:
    """A file with a byte changed, a lump put in, a piece taken out, or its end cut off."""
    at, kind = int(rng.integers(len(content) + 1)), rng.integers(5)
    if kind == 0:
        return content[:at] + bytes([rng.integers(256)]) + content[at + 1 :]
    if kind == 1:
        return content[: 0 if rng.random() < 0.3 else at] + _picked(LUMPS, rng) + content[at:]
    if kind == 2:
        return content[:at] + content[at + int(rng.integers(1, 80)) :]
    if kind == 3:
        lines = content.split(b"\n")
        line = int(rng.integers(len(lines)))
        return b"\n".join(lines[:line] + [lines[line]] * 2 + lines[line:])
    return content[:at]
