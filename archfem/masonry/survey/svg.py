"""Closed shapes of SVG files: paths, polygons and rectangles, with their transformations.

Paths are lines and cubic curves; quadratic curves are raised in degree, and arcs are divided into
cubic curves (W3C, SVG 2, chapter 9 and appendix B). Nothing in a file is executed, and no other
file is read.
"""

import re
from cmath import phase, rect
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from math import ceil, cos, radians, sin, sqrt, tan, tau
from xml.etree import ElementTree as XML

import numpy as np

from archfem._typing import Array
from archfem.errors import InvalidInput

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"

# Numbers that a command of a path takes; those of an arc contain two flags of one digit
COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}

SHAPES = ("path", "polygon", "polyline", "rect")
# Elements that draw no stone, or whose parts are drawn elsewhere
PASSED = (
    *("defs", "clipPath", "mask", "pattern", "marker", "symbol", "title", "desc", "metadata"),
    *("style", "text", "image", "namedview", "script"),
)

# Stones keep their corners where other vertices turn by at most 10 degrees
LARGEST_TURN = radians(9.0)

# Angle of an arc that a cubic curve follows to 4e-6 of the radius
LARGEST_PIECE = radians(45.0)

# A line or a cubic curve by its two or four control points
Segment = tuple[complex, ...]


def read_svg(text: str, near: float, ignored: Counter[str]) -> Iterator[tuple[str, str, Array]]:
    """Yield name, layer and vertices (n, 2) of the closed shapes, y upwards, in units of the file.

    Shapes in layers that are keys of `ignored` are left out, and counted there, as are hidden ones
    under "layer (hidden)". Chords deviate from curves by at most `near`, by which ends of a closed
    shape may be apart.
    """
    if "<!ENTITY" in text:
        raise InvalidInput("it defines entities, which are not read: save it as plain SVG")
    try:
        root = XML.fromstring(text)
    except XML.ParseError as error:
        raise InvalidInput(f"it is no SVG: {error}") from error
    if _kind(root) != "svg":
        raise InvalidInput(f"it is no SVG: its root is '{_kind(root)}'")
    numbers = Counter[str]()
    for element, layer, matrix, is_hidden in _walk(root, "drawing", np.eye(3)):
        if layer in ignored or is_hidden:
            ignored[layer if layer in ignored else f"{layer} (hidden)"] += 1
            continue
        numbers[layer] += 1
        name = element.get("id") or f"{layer} {numbers[layer]}"
        pieces = list(_trace(element, name))
        for number, segments in enumerate(pieces, 1):
            own = name if len(pieces) == 1 else f"{name} {number}"
            moved = [tuple(_move(matrix, point) for point in each) for each in segments]
            start, end = moved[0][0], moved[-1][-1]
            if abs(end - start) > near:
                raise InvalidInput(
                    f"'{own}' at ({start.real:.5g}, {start.imag:.5g}) on layer '{layer}' is not "
                    f"closed, its ends are {abs(end - start):.3g} units apart: close the path of a "
                    "stone; put any other line on a layer with ignore = true"
                )
            points = np.array([point for each in moved for point in _flatten(each, near)])
            yield own, layer, np.column_stack([points.real, -points.imag])


def _kind(element: XML.Element) -> str:
    """Return the name of an element without its namespace."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _read_style(element: XML.Element, name: str) -> str | None:
    """Return a property of the style of an element, else its attribute of that name."""
    found = re.findall(rf"(?:^|;)\s*{name}\s*:\s*([\w-]+)", element.get("style", ""))
    return found[-1] if found else element.get(name)


def _walk(
    parent: XML.Element, layer: str, matrix: Array, visibility: str = "visible"
) -> Iterator[tuple[XML.Element, str, Array, bool]]:
    """Yield shapes, their layers (innermost named groups), matrices and whether they are hidden."""
    for element in parent:
        kind = _kind(element)
        if kind in PASSED or not kind:
            continue
        own = matrix @ _read_transform(element.get("transform", ""))
        # parts of a hidden group may be visible, but none of one without display
        shown = _read_style(element, "visibility") or visibility
        if "none" in (visibility, _read_style(element, "display")):
            shown = "none"
        is_hidden = shown in ("none", "hidden", "collapse")
        if kind in ("g", "svg", "a"):
            labels = [value for key, value in element.items() if key.endswith("}label")]
            yield from _walk(element, (labels or [element.get("id") or layer])[0], own, shown)
        elif kind in SHAPES:
            yield element, layer, own, is_hidden
        elif is_hidden:
            continue
        elif "}" not in element.tag or "w3.org" in element.tag:
            raise InvalidInput(
                f"layer '{layer}' has a '{kind}': convert objects to paths, and unlink clones"
            )


def _read_transform(text: str) -> Array:
    """Return the matrix of a transformation (3, 3)."""
    matrix = np.eye(3)
    for kind, inside in re.findall(r"(\w+)\s*\(([^)]*)\)", text):
        values = [float(number) for number in re.findall(NUMBER, inside)]
        count = len(values)
        step = np.eye(3)
        if kind == "matrix" and count == 6:
            step[:2] = np.reshape(values, (3, 2)).T
        elif kind == "translate" and count in (1, 2):
            step[:2, 2] = [*values, 0.0][:2]
        elif kind == "scale" and count in (1, 2):
            step[0, 0], step[1, 1] = values[0], values[-1]
        elif kind == "rotate" and count in (1, 3):
            c, s = cos(radians(values[0])), sin(radians(values[0]))
            step[:2, :2] = [[c, -s], [s, c]]
            centre = np.array(values[1:] or [0.0, 0.0])
            step[:2, 2] = centre - step[:2, :2] @ centre
        elif kind in ("skewX", "skewY") and count == 1:
            row = int(kind == "skewY")
            step[row, 1 - row] = tan(radians(values[0]))
        else:
            raise InvalidInput(f"the transformation '{kind}({inside})' is none of SVG")
        matrix = matrix @ step
    return matrix


def _move(matrix: Array, point: complex) -> complex:
    """Return a transformed point."""
    x, y, _ = matrix @ [point.real, point.imag, 1.0]
    return complex(x, y)


def _trace(element: XML.Element, name: str) -> Iterator[list[Segment]]:
    """Yield the closed or open pieces of a shape."""
    if _kind(element) == "path":
        yield from _read_path(element.get("d", ""), name)
        return
    if _kind(element) == "rect":
        keys = ("x", "y", "width", "height")
        sizes = {key: element.get(key, "0").strip().removesuffix("px") for key in keys}
        for key, text in sizes.items():
            if not re.fullmatch(NUMBER, text):
                raise InvalidInput(
                    f"'{name}' is a rectangle with {key} = {text!r}, and a number without a unit "
                    "is read: convert it to a path"
                )
        x, y, w, h = map(float, sizes.values())
        corners = [complex(x, y), complex(x + w, y), complex(x + w, y + h), complex(x, y + h)]
    else:
        values = [float(number) for number in re.findall(NUMBER, element.get("points", ""))]
        corners = [complex(*pair) for pair in zip(values[::2], values[1::2], strict=False)]
    if len(corners) < 3:
        raise InvalidInput(f"'{name}' has {len(corners)} corners: a block has at least 3")
    after = [*corners[1:], corners[0]] if _kind(element) != "polyline" else corners[1:]
    yield list(zip(corners, after, strict=False))


def _read_path(text: str, name: str) -> Iterator[list[Segment]]:
    """Yield the pieces of a path, each closed by Z or by where it ends."""
    here = start = control = 0j
    last = ""  # kind of the last command; `control` is the last control point of its curve
    pieces: list[list[Segment]] = [[]]
    for command, values in _read_commands(text, name):
        kind = command.upper()
        points = _place(command, values, here) if kind != "Z" else [start]
        if kind in "MZ":
            if kind == "Z" and here != start:
                pieces[-1].append((here, start))
            start = points[0]
            pieces.append([])
        elif kind == "A":
            pieces[-1] += _divide_arc(here, points[0], values[:5])
        elif kind in "LHV":
            pieces[-1].append((here, points[0]))
        else:
            # S and T continue the tangent of a curve of their kind
            if kind in "ST":
                follows = last != "" and last in {"S": "CS", "T": "QT"}[kind]
                points.insert(0, 2.0 * here - control if follows else here)
            control, end = points[-2], points[-1]
            raised = [(point + 2.0 * control) / 3.0 for point in (here, end)]
            pieces[-1].append((here, *(points[:2] if kind in "CS" else raised), end))
        here, last = points[-1], kind
    yield from (piece for piece in pieces if piece)


def _place(command: str, values: list[float], here: complex) -> list[complex]:
    """Return the points of a command of a path, which are absolute where it is a capital."""
    kind, origin = command.upper(), 0j if command.isupper() else here
    if kind == "H":
        return [complex(origin.real + values[0], here.imag)]
    if kind == "V":
        return [complex(here.real, origin.imag + values[0])]
    numbers = values[-2:] if kind == "A" else values
    return [origin + complex(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=True)]


def _read_commands(text: str, name: str) -> Iterator[tuple[str, list[float]]]:
    """Yield the commands of a path with their numbers; repeated ones one by one."""
    command, place = "", 0
    gap, flag, number = re.compile(r"[\s,]*"), re.compile("[01]"), re.compile(NUMBER)
    while True:
        place = gap.match(text, place).end()  # type: ignore[union-attr]
        if place >= len(text):
            return
        if text[place].upper() in COUNTS:
            command, place = text[place], place + 1
        elif not command or command in "Zz":
            raise InvalidInput(f"'{name}' has no command of a path at '{text[place : place + 20]}'")
        values: list[float] = []
        for k in range(COUNTS[command.upper()]):
            place = gap.match(text, place).end()  # type: ignore[union-attr]
            token = (flag if command in "Aa" and k in (3, 4) else number).match(text, place)
            if token is None:
                raise InvalidInput(
                    f"'{name}' has no number for '{command}' at '{text[place : place + 20]}'"
                )
            values.append(float(token[0]))
            place = token.end()
        yield command, values
        # further points after a move are ends of lines
        command = {"M": "L", "m": "l"}.get(command, command)


def _divide_arc(start: complex, end: complex, values: list[float]) -> list[Segment]:
    """Return cubic curves along an elliptic arc: radii, rotation [degrees], large and sweep."""
    rx, ry, turned, large, sweep = abs(values[0]), abs(values[1]), *values[2:]
    if start == end:
        return []
    if rx == 0.0 or ry == 0.0:
        return [(start, end)]
    axis = rect(1.0, radians(turned))
    half = 0.5 * (start - end) / axis
    # on the unit circle; radii that are too small are enlarged
    chord = complex(half.real / rx, half.imag / ry)
    size = max(abs(chord), 1.0)
    rx, ry, chord = rx * size, ry * size, chord / size
    side = -1.0 if large == sweep else 1.0
    centre = side * -1j * chord / abs(chord) * sqrt(max(1.0 - abs(chord) ** 2, 0.0))
    first, angle = chord - centre, phase((-chord - centre) / (chord - centre))
    if sweep and angle < 0.0:
        angle += tau
    elif not sweep and angle > 0.0:
        angle -= tau
    count = max(1, ceil(abs(angle) / LARGEST_PIECE - 1e-9))
    arm, step = 4.0 / 3.0 * tan(0.25 * angle / count), rect(1.0, angle / count)

    def place(point: complex) -> complex:
        point += centre
        return 0.5 * (start + end) + axis * complex(rx * point.real, ry * point.imag)

    segments: list[Segment] = []
    for k in range(count):
        a, b = first * step**k, first * step ** (k + 1)
        points = a, a * (1.0 + 1j * arm), b * (1.0 - 1j * arm), b
        segments.append(tuple(map(place, points)))
    segments[0] = (start, *segments[0][1:])
    segments[-1] = (*segments[-1][:3], end)
    return segments


def _flatten(segment: Segment, near: float) -> list[complex]:
    """Return points along a line or a cubic curve, without its end."""
    if len(segment) == 2:
        return [segment[0]]
    a, b, c, d = segment
    # the error of chords is an eighth of the second derivative; and each turns by little
    bend = 6.0 * max(abs(a - 2.0 * b + c), abs(b - 2.0 * c + d))
    legs = [leg for leg in (b - a, c - b, d - c) if abs(leg) > 0.0]
    turn = sum(abs(phase(v / u)) for u, v in pairwise(legs))
    count = max(1, ceil(sqrt(bend / (8.0 * near))), ceil(turn / LARGEST_TURN))
    shares = [k / count for k in range(count)]
    return [
        (1 - s) ** 3 * a + 3 * s * (1 - s) ** 2 * b + 3 * s**2 * (1 - s) * c + s**3 * d
        for s in shares
    ]
