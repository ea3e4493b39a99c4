"""Elevations in SVG: shapes, curves and transformations against closed forms; bad files."""

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

import archfem as af
from archfem.masonry.survey.svg import read_svg

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:k="http://www.inkscape.org/namespaces/x">'


def area(points):
    x, y = points.T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def read(*elements, near=1e-3):
    return list(read_svg(HEAD + "".join(elements) + "</svg>", near, Counter()))


def test_a_ring_of_arcs_is_that_of_its_shape(tmp_path):
    """Stones in cm and y downwards, on layers that say which are supports."""
    angles = np.radians(np.linspace(165.0, 15.0, 8))
    paths = []
    for a, b in pairwise(angles):
        p, q = ([(100 * r * np.cos(t), -100 * r * np.sin(t)) for r in (2.7, 3.3)] for t in (a, b))
        (x0, y0), (x1, y1), (x2, y2), (x3, y3) = p[0], q[0], q[1], p[1]
        arcs = f"A270 270 0 0 1 {x1} {y1} L{x2} {y2} A330,330 0 00{x3} {y3}"
        paths.append(f'<path d="M{x0},{y0} {arcs} z"/>')
    supports = []
    for t, side in ((angles[0], -1.0), (angles[-1], 1.0)):
        ends = [np.array([r * np.cos(t), r * np.sin(t)]) for r in (2.7, 3.3)]
        back = 0.3 * side * (ends[1] - ends[0])[::-1] * [1.0, -1.0]
        corners = [*ends, ends[1] + back, ends[0] + back]
        points = " ".join(f"{100 * x},{-100 * y}" for x, y in corners)
        supports.append(f'<polygon points="{points}"/>')
    text = (
        HEAD + f'<g k:label="ring">{"".join(paths)}</g><g id="rock">{"".join(supports)}</g></svg>'
    )
    (path := tmp_path / "ring.svg").write_text(text)
    layers = {"ring": af.masonry.Layer(), "rock": af.masonry.Layer(fixed=True)}
    found = af.masonry.surveyed(path, unit="cm", layers=layers)
    ring = af.circular_arch(radius=3.0, thickness=0.6, embrace=150.0, voussoirs=7)
    assert len(found.joints) == 8
    size = sum(block.area for block in found.blocks if not block.fixed)
    expected = sum(block.area for block in ring.blocks if not block.fixed)
    # chords of half a millimetre of sagitta
    assert size == pytest.approx(expected, rel=1e-3)
    load = af.BodyForce(1.0, 0.0)
    factor = af.collapse_factor(ring, live=load).factor
    assert af.collapse_factor(found, live=load).factor == pytest.approx(factor, rel=2e-3)
    with pytest.raises(af.errors.InvalidInput, match=r"give .* right, .*, 6.47 m by unit = \"cm\""):
        af.masonry.surveyed(path, layers=layers)


@pytest.mark.parametrize(
    ("d", "expected"),
    [
        # a parabola of height h over a base b bounds 2 b h / 3; its control point is at 2 h
        ("M0 0 Q 3 4 6 0 Z", 8.0),
        # the same below again, by the reflected control point: S = 0, so both apart by a line
        ("M0 0 Q 3 4 6 0 T 12 0 L 12 4 0 4 z", 48.0),
        ("m0 0 q3 4 6 0z", 8.0),
        # a cubic curve from (0, 0) by (0, 1) and (1, 1) to (1, 0) bounds 3/5
        ("M0 0 C0 1 1 1 1 0Z", 0.6),
        # S reflects (1, 1) about (1, 0): the area below cancels, above a line at -1
        ("M0 0 C0 1 1 1 1 0 S 2 -1 2 0 V-1 H0 Z", 2.0),
        # half a circle, half an ellipse turned by a right angle, and radii that are too small
        ("M-2 0 A2 2 0 0 1 2 0 z", 2.0 * math.pi),
        ("M-1 0 a 3 1 90 0 0 2 0 z", 1.5 * math.pi),
        ("M-2 0 A1 1 0 0 1 2 0 z", 2.0 * math.pi),
        # the large part of a circle beside a chord of 90 degrees
        ("M1 0 A1 1 0 1 1 0 -1 Z", 0.75 * math.pi + 0.5),
        ("M0,0h2v3H0z", 6.0),
    ],
)
def test_areas_of_curves(d, expected):
    ((_, _, points),) = read(f'<path d="{d}"/>', near=1e-6)
    assert area(points) == pytest.approx(expected, rel=1e-5)


def test_transformations_are_applied_from_the_inside():
    inner = '<rect x="1" y="1" width="2" height="1" transform="scale(2) rotate(90 1 1)"/>'
    ((_, layer, points),) = read(f'<g id="wall" transform="translate(10,-1)">{inner}</g>')
    assert layer == "wall"
    # (3, 1) turned about (1, 1) is (1, 3), doubled (2, 6), moved (12, 5), and y is upwards
    assert points[1] == pytest.approx([12.0, -5.0])
    (_, _, skewed), (_, _, given) = read(
        '<rect width="1" height="1" transform="skewX(45)"/>',
        '<rect width="1" height="1" transform="matrix(1 0 1 1 0 0)"/>',
    )
    assert skewed == pytest.approx(given)
    assert skewed[2] == pytest.approx([2.0, -1.0])


def test_hidden_shapes_are_counted_and_visible_parts_of_hidden_groups_read():
    def draw(k, attributes):
        return f'<rect id="{k}" x="{2 * k}px" width="1" height="1" {attributes}/>'

    hidden, shown = draw(1, ""), draw(2, "visibility='visible'")
    whole = f'<g id="A" style="visibility: hidden">{hidden}{shown}</g>'
    none = f'<g id="B" display="none">{draw(3, "") + shown}<use/></g>'
    others = draw(4, "visibility='hidden'") + draw(5, "style='fill:red;visibility:collapse'")
    ignored = Counter()
    found = read_svg(HEAD + whole + none + others + draw(6, "") + "</svg>", 1e-3, ignored)
    assert [name for name, _, _ in found] == ["2", "6"]
    assert ignored == {"A (hidden)": 1, "B (hidden)": 2, "drawing (hidden)": 2}


def test_what_is_hidden_or_defined_is_no_stone():
    square = '<rect width="1" height="1"/>'
    hidden = f'<g style="display:none">{square}</g><defs>{square}</defs><text>note</text>'
    pieces = read(hidden, '<path id="two" d="M0 0h1v1z m5 0h1v1z"/>')
    assert [name for name, _, _ in pieces] == ["two 1", "two 2"]


@pytest.mark.parametrize(
    ("element", "words"),
    [
        ("<circle r='1'/>", "has a 'circle': convert objects to paths"),
        (
            '<path id="crack" d="M0 0 L1 1"/>',
            r"'crack' at \(0, 0\) on layer 'drawing' is not closed",
        ),
        ('<path id="a" d="M0 0 L1"/>', "'a' has no number for 'L'"),
        ('<path id="a" d="0 0 L1 1"/>', "'a' has no command of a path"),
        ('<polygon id="a" points="0 0 1 1"/>', "'a' has 2 corners"),
        ('<rect width="1em" height="1"/>', "width = '1em', and a number without a unit"),
        ('<rect width="1" height="1" transform="bend(3)"/>', "is none of SVG"),
        ("<g>", "it is no SVG"),
        ("<!ENTITY a 'b'>", "defines entities"),
    ],
)
def test_other_files_are_refused_in_words(element, words):
    with pytest.raises(af.errors.InvalidInput, match=words):
        read(element)
