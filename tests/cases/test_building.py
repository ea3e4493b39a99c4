"""What a case says of how its structure was built, and of its fill."""

import pytest

import archfem as af
from archfem.cases.run import at_rest

BRIDGE = {
    "structure": {
        "shape": "bridge",
        "arches": {"arch": {"span": 4.0, "rise": 1.6, "thickness": 0.45, "voussoirs": 9}},
        "sidewalls": {
            "length": 1.0,
            "height": 0.8,
            "above": 1.0,
            "left wall": {},
            "right wall": {},
        },
        "backfill": {"cover": 0.4},
    },
    "model": {"fidelity": "rigid", "cells": [1, 1]},
}
FILL = {"law": "jointed", "size": "0.8 m", "friction_angle": "35 degree", "cohesion": "20 kPa"}


def case(fill=None, **tables):
    """A small bridge, with a fill and other tables."""
    structure = BRIDGE["structure"] | ({} if fill is None else {"fill": fill})
    return af.Case.of({**BRIDGE, "structure": structure, **tables})


def test_a_fill_is_elastic_unless_it_is_to_be_in_pieces():
    whole, same, cut = case(), case({"law": "elastic"}), case(FILL)
    assert whole.structure == same.structure
    pieces = [block for block in cut.structure.blocks if block.grain]
    assert len(pieces) > 10
    between = [joint for joint in cut.structure.joints if joint.contact.name == "fill"]
    assert {joint.contact.cohesion for joint in between} == {20e3}
    assert between[0].contact.friction == pytest.approx(0.7002, rel=1e-4)


def test_a_case_is_built_in_stages():
    built = case(FILL, dead_load={"stages": "usual", "layers": 2})
    assert [stage.name for stage in built.stages] == [
        "piers and walls", "rings", "centring struck", "fill, layer 1", "fill, layer 2",
    ]  # fmt: skip
    assert case().stages is None
    assert at_rest(built).model.built is not None


def test_stages_of_a_cases_own():
    own = [
        {"blocks": ["left wall", "right wall"]},
        {"blocks": ["arch"], "centring": True},
        {"name": "the fill", "blocks": ["backfill"]},
        {"strike": True},
    ]
    stages = case(FILL, dead_load={"stage": own}).stages
    assert [stage.name for stage in stages] == ["stage 0", "stage 1", "the fill", "stage 3"]
    found = at_rest(case(FILL, dead_load={"stage": own}))
    assert found.joints["N"].values.min() >= 0.0


@pytest.mark.parametrize(
    ("fill", "dead_load", "words"),
    [
        ({"law": "plastic"}, {}, "structure.fill.law = 'plastic'"),
        ({"size": 0.5}, {}, "need law = 'jointed'"),
        ({"law": "jointed", "size": 0.5}, {}, "friction_angle"),
        (FILL, {"stages": "some"}, "dead_load.stages = 'some'"),
        (FILL, {"layers": 2}, "not asked for"),
        (FILL, {"stages": "usual", "stage": [{"blocks": ["arch"]}]}, "stages of its own"),
        (FILL, {"stage": [{"blocks": ["arch"]}]}, "no stage places"),
        (FILL, {"steps": 2}, "unknown key 'dead_load.steps'"),
    ],
)
def test_what_cannot_be_meant_is_refused(fill, dead_load, words):
    with pytest.raises(af.InvalidInput, match=words):
        case(fill, dead_load=dead_load)
