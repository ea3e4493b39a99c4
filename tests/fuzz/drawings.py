"""Damaged drawings of every format, read as a survey or checked as the drawing of a case."""

import json
import re
import tempfile
from functools import cache
from pathlib import Path

import ezdxf
import numpy as np

import archfem as af
from archfem.masonry import Layer, read_outlines, surveyed
from fuzz.case_files import DRAWING, checked, mutate
from fuzz.trial import Came, judged

STONES = {"ground": (-1.0, 1.0), "wall": (0.0, 1.0), "wall, top": (1.0, 0.8)}
"""Lower edges and heights of three stones one above another [m]."""

LAYERS = {"ground": Layer(fixed=True), "wall": Layer()}

CASE = """
[structure]
shape = "outlines"
file = "{name}"
unit = "m"
[structure.layers]
ground = {{ fixed = true }}
wall = {{}}
[model]
fidelity = "rigid"
"""

IN_CASES = 0.05
"""Share of the drawings that are checked through a case."""

NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
TOKEN = re.compile(rb"[^\s,:\[\]{}\"]+")

NUMBERS = (
    *(b"0", b"-1", b"1", b"2", b"3", b"0.5", b"1e-300", b"1e300", b"1e308", b"-1e308", b"nan"),
    *(b"inf", b"-inf", b"1e999", b"1e9", b"1e17", b"2147483648", b"-2147483649", b"5e-324"),
    *(b"9223372036854775808", b"1" * 400, b"1" * 5000, b"0x10", b"1_0", b"1,0", b"", b"4294967295"),
)
LUMPS = (
    *(b"\xff\xfe", b"\xef\xbb\xbf", b"\0", b"\r", b"\n", b" ", b"[" * 3000, b"{", b'"', b"\xc3"),
    *(b"\\U+D800", b"\\M+1FFFF", b"%%p", b"\\P{\\fArial|b0;", b"null", b"true", b"-", b"e9"),
    *(b"\n0\nEOF\n", b"\n0\nENDSEC\n", b"\n0\nSEQEND\n", b"\n0\nLINE\n8\nwall\n", b"$End"),
    *(b"\xff" * 8, b"\x00\x00\x00\x80", b"\x00\x00\x00\x00\x00\x00\xf8\x7f", b"\xff\xff\xff\x7f"),
)


def _dxf(version: str, old: bool, fmt: str = "asc") -> bytes:
    """A DXF drawing with light or old polylines, and texts of one or several lines."""
    drawing = ezdxf.new(version, units=6)
    space = drawing.modelspace()
    for number, (name, (y, height)) in enumerate(STONES.items()):
        points = [(0.0, y), (1.0, y), (1.0, y + height), (0.0, y + height)]
        draw = space.add_polyline2d if old else space.add_lwpolyline
        draw(points, close=True, dxfattribs={"layer": name.partition(",")[0]})
        write = space.add_mtext if number and not old else space.add_text
        write(f"stone {number}", dxfattribs={"layer": "0", "insert": (0.4, y + 0.4)})
    with tempfile.NamedTemporaryFile(suffix=".dxf") as file:
        drawing.saveas(file.name, fmt=fmt)
        return Path(file.name).read_bytes()


def _msh() -> str:
    """A mesh of gmsh: two triangles a stone, each stone a physical surface."""
    places = [f"{x} {y} 0" for y in (-1.0, 0.0, 1.0, 1.8) for x in (0.0, 1.0)]
    named = "".join(f'2 {k} "{name}"\n' for k, name in enumerate(STONES, 1))
    cells = ["1 2 9 9 5 6"]
    for k in (1, 2, 3):
        a, b, c, d = range(2 * k - 1, 2 * k + 3)
        cells += [f"2 2 {k} {k} {a} {b} {d}", f"2 2 {k} {k} {a} {d} {c}"]
    return (
        f'$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n1 9 "waist"\n{named}'
        f"$EndPhysicalNames\n$Nodes\n8\n{_numbered(places)}$EndNodes\n"
        f"$Elements\n7\n{_numbered(cells)}$EndElements\n"
    )


def _numbered(rows: list[str]) -> str:
    return "".join(f"{number} {row}\n" for number, row in enumerate(rows, 1))


def _meshes() -> list[bytes]:
    """That mesh in the formats that gmsh writes."""
    import gmsh

    found = []
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "wall.msh"
            path.write_text(_msh())
            gmsh.open(str(path))
            for version, binary in ((2.2, 0), (4.1, 0), (2.2, 1), (4.1, 1)):
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.option.setNumber("Mesh.Binary", binary)
                gmsh.write(str(path))
                found.append(path.read_bytes())
    finally:
        gmsh.finalize()
    return found


@cache
def samples() -> dict[str, list[bytes]]:
    """Undamaged drawings by suffix."""
    drawings = [_dxf("R2010", old=False), _dxf("R12", old=True), _dxf("R2000", old=True)]
    drawings.append(_dxf("R2010", old=False, fmt="bin"))
    return {".dxf": drawings, ".msh": _meshes(), ".geojson": [DRAWING.encode()]}


def ready() -> None:
    """Make the drawings, and load the modules that read them."""
    samples()
    af.units.in_unit("1 m", "m", "x")


def trial(seed: int, number: int, folder: Path, suffix: str = "") -> Came:
    """Read one damaged drawing."""
    rng = np.random.default_rng((seed, number))
    suffix = suffix or list(samples())[number % len(samples())]
    originals = samples()[suffix]
    content = originals[int(rng.integers(len(originals)))]
    for _ in range(rng.choice([1, 1, 2, 3])):
        change = _changed if suffix == ".geojson" and rng.random() < 0.5 else _damaged
        content = change(content, rng)
    path = folder / f"wall{suffix}"
    path.write_bytes(content)
    unit = "m" if rng.random() < 0.5 else None
    if rng.random() < IN_CASES:
        case = folder / "case.toml"
        case.write_text(CASE.format(name=path.name))
        return judged(lambda: checked(case), repr(content))

    def read() -> str | None:
        survey = read_outlines(path, unit=unit, layers=LAYERS)
        for block in survey.blocks:
            if not (np.isfinite(block.area) and np.isfinite(block.points).all()):
                return f"'{block.name}' of {block.area} m²"
        surveyed(path, unit=unit, layers=LAYERS)
        return None

    return judged(read, repr(content))


def _changed(content: bytes, rng: np.random.Generator) -> bytes:
    """Change a value of a GeoJSON file, so that it stays JSON."""
    try:
        table = json.loads(content)
        mutate(table, rng)
        return json.dumps(table).encode()
    except (TypeError, ValueError, OverflowError, RecursionError):  # damaged before
        return content


def _damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Change a byte, lump, line, token or number of a drawing."""
    # half of the damages where the outlines are, not in the tables that a DXF file begins with
    first = max(content.rfind(b"ENTITIES"), 0) if rng.random() < 0.5 else 0
    at, kind = int(rng.integers(first, len(content) + 1)), rng.integers(10)
    if kind == 0:
        return content[:at] + bytes([rng.integers(256)]) + content[at + 1 :]
    if kind == 1:
        return content[:at] + _pick(LUMPS, rng) + content[at:]
    if kind == 2:
        return content[:at] + content[at + int(rng.integers(1, 80)) :]
    if kind == 3:
        lump = _pick(LUMPS, rng)
        return content[:at] + lump + content[at + len(lump) :]
    if kind == 4 and rng.random() < 0.3:
        return content[:at]
    if kind <= 6:
        lines = content.split(b"\n")
        line = int(rng.integers(content[:first].count(b"\n"), len(lines)))
        other = int(rng.integers(len(lines)))
        kept = _pick(([], lines[line : line + 1] * 2, lines[other : other + 1]), rng)
        return b"\n".join([*lines[:line], *kept, *lines[line + int(rng.integers(1, 3)) :]])
    found = list((NUMBER if kind >= 8 else TOKEN).finditer(content, first))
    if not found:
        return content[:at]
    match = _pick(found, rng)
    other = _pick(found, rng)[0] if rng.random() < 0.3 else _pick(NUMBERS + LUMPS, rng)
    return content[: match.start()] + other + content[match.end() :]


def _pick(values, rng: np.random.Generator):
    return values[int(rng.integers(len(values)))]
