"""Structures as case files describe them."""

import tomllib
from pathlib import Path

import pytest

import archfem as af
from archfem.cases.structures import planned

RING = Path(__file__).parents[2] / "meshes" / "ring.toml"
BRIDGES = [
    path
    for path in sorted(RING.parent.glob("prusias*.toml"))
    if path.stem not in ("prusias_retrofit", "prusias_sensitivity")  # studies of them
]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("structure.width=0", "do not fit into a width of 0 m"),
        ("structure.arches.main arch.spn=3", "structure.arches.main arch.spn': did you mean"),
        ("structure.piers.gapp=3", "'structure.piers.gapp': did you mean 'gap'"),
        ("structure.backfill.hmp=3", "'structure.backfill.hmp': did you mean 'hump'"),
        ("structure.paving={thickness=0.2,lenght=1}", "structure.paving.lenght': did you mean"),
        ("suite.pairs.pair-1.synthetic.sed=1", "'suite.pairs.pair-1.synthetic.sed': did you mean"),
        ("suite.target.code=['EC8']", r"suite.target.code = \['EC8'\] is not known"),
        ("analysis.damping.jonts='closed'", "'analysis.damping.jonts': did you mean"),
    ],
)
def test_refusals_name_the_key_in_tables_of_a_bridge(change, says):
    with pytest.raises((af.InvalidInput, af.InvalidStructure), match=says):
        af.Case.read(RING.with_name("prusias.toml"), [change])


@pytest.mark.parametrize("path", BRIDGES, ids=lambda p: p.stem)
def test_shipped_bridges(path):
    structure = af.Case.read(path).structure
    parts = {block.part for block in structure.blocks}
    assert {"north arch", "main arch", "south arch", "north pier", "south pier"} <= parts
    assert ("paving" in parts) == (path.stem in ("prusias_paving", "prusias_restored"))
    assert structure.joints[structure.joint_number("main arch, joint 5")].part == "main arch"


def test_a_table_of_parts_says_what_holds_for_all_of_them():
    case = af.Case.read(
        RING.with_name("prusias.toml"),
        ["structure.piers.height=2.8", "structure.piers.south pier.height=2.4"],
    )
    lowest = {
        part: min(
            y for block in case.structure.blocks if block.part == part for _, y in block.outline
        )
        for part in ("north pier", "south pier")
    }
    assert lowest["north pier"] - lowest["south pier"] == pytest.approx(-0.4)


@pytest.mark.parametrize(
    ("told", "blocks"),
    [
        ('shape="pointed_arch", span=4.0, rise="3 m", thickness=0.5, voussoirs=11', 13),
        ('shape="elliptical_arch", span=4.0, rise=1.2, thickness=0.6, voussoirs=11', 13),
        ('shape="flat_arch", span=2.0, thickness=0.5, voussoirs=7, skewback="20 deg"', 9),
        ('shape="arch_along", intrados=[[0,0],[1,"1 m"],[2,0]], thickness=0.4, voussoirs=5', 7),
        (
            'shape="buttressed_arch", span=4.0, rise=1.2, thickness=0.5, voussoirs=11, '
            "breadth=1.5, height=2.0, course=0.5",
            21,
        ),
        (
            'shape="arcade", spans=[4.0, 5.0], embraces=[170.0], thicknesses=[0.6], voussoirs=[9], '
            "heights=[2.0, 3.0, 2.5], breadths=[1.6], course=1.0",
            28,
        ),
    ],
)
def test_shapes_by_name(told, blocks):
    assert len(planned(tomllib.loads(f"structure = {{ {told} }}")).blocks) == blocks
