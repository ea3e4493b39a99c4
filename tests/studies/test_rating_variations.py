"""Ratings with one changed property at a time: against whole ratings of changed cases."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import archfem as af
from archfem.cases.analysis_keys import rate_case
from archfem.studies import variations
from archfem.studies.variations import _list_rating_changes, _say_spreads, vary_rating

PRINTED = 5e-4
"""Relative: factors are printed with four digits."""

CASE = """
title = "two spans"
[structure]
shape = "bridge"
width = "3 m"
[structure.arches]
thickness = "0.4 m"
voussoirs = 5
left = { span = "3 m", rise = "1 m" }
right = { span = "3 m", rise = "1 m", thickness = "0.45 m" }
[structure.piers]
PIER
height = "1.5 m"
course = "0.75 m"
pier = {}
[structure.backfill]
cover = "0.3 m"
[structure.paving]
thickness = "0.1 m"
[materials.stone]
unit_weight = "22 kN/m³"
strength = "4 MPa"
[limit]
fill = { friction_angle = "35 degree" }
[rating]
vehicle = { name = "cart", axles = ["40 kN", "60 kN"], spacings = ["1.2 m"], live = 1.35 }
"""


@pytest.mark.slow
def test_each_row_is_the_rating_of_a_changed_case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(
        CASE.replace("PIER", 'breadth = "0.88 m"').replace(
            '[structure.paving]\nthickness = "0.1 m"\n', ""
        )
    )
    case = af.Case.read(path)
    found = rate_case(case.structure, case.rating, case.limit)
    rows, words, left = vary_rating(case, case.settings["rating"], found)
    assert left == 0
    cells = dict(rows.rows)
    assert cells.pop("piers a tenth narrower") == "-"  # on which the rings do not fit
    by_cs454 = float(cells.pop("all unfavourable at once, by CS 454"))
    factors = {name: float(cell) for name, cell in cells.items()}
    thin = ["structure.arches.thickness=0.36", "structure.arches.right.thickness=0.405"]
    rough = [f'contacts."{each} to stone".friction=0.5' for each in ("stone", "soil")]
    for name, changes in {
        "rings a tenth thinner": thin,
        "piers a tenth broader": ["structure.piers.breadth=0.968"],
        "0.1 m less cover": ["structure.backfill.cover=0.2"],
        "half the strength of the stones": ["limit.strength=2e6"],
        "fill of 40°": ["limit.fill.friction_angle=40 degree"],
        "0.1 less friction of joints": rough,
    }.items():
        other = af.Case.read(path, changes)
        whole = rate_case(other.structure, other.rating, other.limit)
        assert factors[name] == pytest.approx(whole.factor, rel=PRINTED), name
    # in proportion to the width, which is that of the wheels and the cover
    for share in (0.9, 1.1):
        width = f"a vehicle on {share * 1.8:.3g} m"
        assert factors[width] == pytest.approx(share * found.factor, rel=PRINTED)
    assert factors["no pressure of the fill"] == pytest.approx(found.without_pressure, rel=1e-3)
    assert factors["its active pressure alone"] == pytest.approx(found.active_alone, rel=1e-3)
    least_of_all, least, *_, most = sorted(factors, key=factors.get)
    ends = f"to {factors[least]:.4g} ({least}) at least and {factors[most]:.4g} ({most}) at most"
    at_once = f"all unfavourable at once {factors[least_of_all]:.4g}"
    begin = f"one property at a time changes the factor of cart, {found.factor:.4g}, "
    first = f"{begin}{ends}; {at_once}"
    assert words[0] == first
    # against a rating with the worst of each property
    worst = [*thin, *rough, "structure.backfill.cover=0.2", "limit.strength=2e6"]
    # of the wheels, 1.5 m, and of the lesser cover
    width = 0.9 * (1.5 + 0.2)
    worst += [f"rating.width={width}"]
    worst += ["limit.fill.mobilisation=0", "limit.fill.active=0"]
    weight = case.structure.blocks[-1].material.unit_weight
    worst += [f"materials.backfill.unit_weight={0.9 * weight}"]
    other = af.Case.read(path, worst)
    whole = rate_case(other.structure, other.rating, other.limit)
    assert factors[least_of_all] == pytest.approx(whole.factor, rel=PRINTED)
    assert next(iter(cells)) == least_of_all
    code = af.limit.VEHICLES["CS454-single"]
    cart = {**case.rating, "live": code.live, "impact": code.impact, "width": width}
    cart["vehicle"] = replace(case.rating["vehicle"], impact_on=code.impact_on)
    whole = rate_case(other.structure, cart, other.limit)
    assert by_cs454 == pytest.approx(whole.factor, rel=PRINTED)
    assert [*factors.values()] == sorted(factors.values())
    assert words[1].startswith("measure first, for cart: ")


def test_all_quantities_are_ranked_by_what_they_change():
    """Also the pressure of the fill and the width, which no measurement finds."""
    listed = [
        (each, f"{each} {end}", {}) for each in ("width", "rings", "pressure") for end in "ab"
    ]
    listed += [("friction of joints", "smooth", {})]
    values = (0.9, 1.1, 0.8, 1.3, 0.6, 1.8, 1.0)
    known = dict(zip([name for _, name, _ in listed], values, strict=True))
    _, ranked = _say_spreads("cart", listed, {"the values of the case": 1.0, **known}, 0)
    assert ranked == (
        "measure first, for cart: pressure of the fill, which is assumed (0.6 to 1.8), rings (0.8 "
        "to 1.3), width that carries a vehicle, a rule (0.9 to 1.1)"
    )


@pytest.mark.parametrize("key", ["breadth", "gap"])
def test_the_keys_of_a_case_are_changed_one_property_at_a_time(tmp_path, key):
    """By a gap all piers are a tenth of the least breadth broader."""
    path = tmp_path / "case.toml"
    text = CASE.replace("PIER", f'{key} = "0.8 m"').replace("0.3 m", "0.1 m")
    walls = '[structure.sidewalls]\nlength = "1.5 m"\nheight = "1 m"\nstate = "fixed"\n'
    text = text.replace("[structure.backfill]", f"{walls}a = {{}}\nb = {{}}\n[structure.backfill]")
    path.write_text(text)
    case = af.Case.read(path)
    dry, depths = af.masonry.STONE_TO_STONE, (0.7, 0.5, 0.6)
    joints = [SimpleNamespace(role="pier", depth=depth, contact=dry) for depth in depths]
    structure = SimpleNamespace(width=3.0, joints=joints, blocks=case.structure.blocks)
    found = SimpleNamespace(structure=structure, strength=4e6, width=2.8, fill=case.limit.fill)
    listed = [*_list_rating_changes(case, found)]
    changes = {name: change for _, name, change in listed}
    subjects = {"rings", "piers", "cover", "abutments", "weight of backfill"}
    subjects |= {"strength", "friction angle of the fill", "friction of joints", "width"}
    assert {subject for subject, *_ in listed} == subjects
    by = {"breadth": 0.08, "gap": 0.05}[key]
    rings = ["structure.arches.thickness", "structure.arches.right.thickness"]
    expected = {
        "rings a tenth thinner": dict(zip(rings, (0.36, 0.405), strict=True)),
        "rings a tenth thicker": dict(zip(rings, (0.44, 0.495), strict=True)),
        "piers a tenth narrower": {f"structure.piers.{key}": 0.8 - by},
        "piers a tenth broader": {f"structure.piers.{key}": 0.8 + by},
        "0.1 m less cover": {"structure.backfill.cover": 0.02},
        "0.1 m more cover": {"structure.backfill.cover": 0.2},
        "half the strength of the stones": {"limit.strength": 2e6},
        "a vehicle on 2.52 m": {"rating.width": 2.52},
        "a vehicle on 3 m": {"rating.width": 3.0},
        "abutments free": {"structure.sidewalls.state": "free"},
        "0.1 less friction of joints": {'contacts."stone to stone".friction': 0.5},
        "0.1 more friction of joints": {'contacts."stone to stone".friction': 0.7},
    }
    # that of the stones is given, that of fill scatters all the same
    given = text + '[materials.backfill]\nunit_weight = "18 kN/m³"\n'
    path.write_text(given.replace("PIER", f'{key} = "0.8 m"'))
    of_fill = dict(x[1:] for x in _list_rating_changes(af.Case.read(path), found))
    name, key = "backfill", "materials.backfill.unit_weight"
    assert of_fill["backfill a tenth lighter"] == pytest.approx({key: 0.9 * 18e3})
    assert not [name for name in of_fill if name.startswith("stone ")]
    weight = next(b.material.unit_weight for b in structure.blocks if b.material.name == name)
    expected |= {"backfill a tenth lighter": {key: 0.9 * weight}}
    expected |= {"backfill a tenth heavier": {key: 1.1 * weight}}
    for angle in (30, 40):
        changed = changes.pop(f"fill of {angle}°")["limit.fill.friction_angle"]
        assert float(changed.removesuffix(" degree")) == pytest.approx(angle)
    assert changes.keys() == expected.keys()
    for name, values in expected.items():
        own = changes[name]
        assert own == (values if name == "abutments free" else pytest.approx(values)), name


@pytest.mark.slow
def test_fill_in_pieces_and_joints_that_hardly_slide_are_varied_by_their_friction(tmp_path):
    """Joints that never slide are not, nor those of a rating without sliding."""
    path = tmp_path / "case.toml"
    pieces = '"jointed", piece_size = "1 m", friction_angle = "0.5 rad"'
    text = CASE.replace('fill = { friction_angle = "35 degree" }', "")
    text = text.replace("[structure.arches]", f"fill = {{ law = {pieces} }}\n[structure.arches]")
    text = text.replace("PIER", 'breadth = "0.9 m"') + '[contacts."soil to stone"]\nfriction = '
    path.write_text(f"{text}0.1\n")
    case = af.Case.read(path)
    found = SimpleNamespace(structure=case.structure, strength=4e6, width=2.0, fill=None)
    listed = {name: change for _, name, change in _list_rating_changes(case, found)}
    angle = listed["fill of 23.6°"]
    stands = af.Case.read(path, [f"{key}={value}" for key, value in angle.items()]).structure
    (own,) = {joint.contact for joint in stands.joints if joint.contact.name == "fill"}
    assert own.friction == pytest.approx(np.tan(0.5 - np.radians(5.0)))
    less = {"stone to stone": 0.5, "soil to stone": 0.05}
    assert listed["0.1 less friction of joints"] == pytest.approx(
        {f'contacts."{name}".friction': value for name, value in less.items()}
    )
    path.write_text(f'{text}"none"\n')
    case = af.Case.read(path)
    found.structure = case.structure
    rough = {name: change for _, name, change in _list_rating_changes(case, found)}
    assert [*rough["0.1 more friction of joints"]] == ['contacts."stone to stone".friction']
    never = af.Case.read(path, ["limit.friction=none"])
    assert not [name for _, name, _ in _list_rating_changes(never, found) if "joints" in name]


@pytest.mark.slow
def test_a_backing_is_left_out_alone_and_at_once_with_the_worst_of_the_others(
    tmp_path, monkeypatch
):
    path = tmp_path / "case.toml"
    text = CASE.replace('right = { span = "3 m", rise = "1 m", thickness = "0.45 m" }\n', "")
    text = text.replace(
        '[structure.piers]\nPIER\nheight = "1.5 m"\ncourse = "0.75 m"\npier = {}', ""
    )
    path.write_text(text.replace('"35 degree"', '"35 degree", backing_height = "0.6 m"'))
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (1.0, 1.5))
    case = af.Case.read(path)
    found = rate_case(case.structure, case.rating, case.limit)
    cells = dict(vary_rating(case, case.settings["rating"], found)[0].rows)
    removed = ['remove=["limit.fill.backing_height"]']
    bare = af.Case.read(path, removed)
    alone = rate_case(bare.structure, bare.rating, bare.limit).factor
    assert float(cells["no backing"]) == pytest.approx(alone, rel=PRINTED)
    assert alone < 0.9 * found.factor
    worst = [*removed, "structure.arches.thickness=0.36", "structure.backfill.cover=0.2"]
    worst += ["limit.strength=2e6", "limit.fill.mobilisation=0", "limit.fill.active=0"]
    width = 0.9 * (1.5 + 0.1 + 0.2)  # of the wheels, the paving and the lesser cover
    weight = 0.9 * case.structure.blocks[-1].material.unit_weight
    worst += [f"rating.width={width}", f"materials.backfill.unit_weight={weight}"]
    worst += [f'contacts."{each} to stone".friction=0.5' for each in ("stone", "soil")]
    least = af.Case.read(path, worst)
    whole = rate_case(least.structure, least.rating, least.limit).factor
    assert float(cells["all unfavourable at once"]) == pytest.approx(whole, rel=PRINTED)


@pytest.mark.slow
def test_variations_before_a_stop_are_computed_once(tmp_path, unplotted, monkeypatch):
    """Their factors are here the mean depths of the joints."""
    path, out = tmp_path / "case.toml", tmp_path / "out"
    text = CASE.replace('right = { span = "3 m", rise = "1 m", thickness = "0.45 m" }\n', "")
    head, _, rest = text.partition("[structure.piers]")
    path.write_text(head + rest[rest.index("[structure.backfill]") :])
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (1.5,))
    seen, stop = [], [3]

    def rate_again(found, structure, *_, **options):
        seen.append(structure)
        if len(seen) == stop[0]:
            raise KeyboardInterrupt
        return float(structure.depths.mean())

    monkeypatch.setattr(variations, "rate_again", rate_again)
    command = ["rate", str(path), "--vary", "--vehicle", "CS454-single", "--out", str(out)]
    assert af.commands.main(command) == 130
    late = pd.read_csv(out / "rating_variations.csv")["factor"] == "not computed"
    assert 2 < late.sum() < len(late)
    assert f"; {late.sum()} variations were not computed" in (out / "rating.txt").read_text()
    stop[0] = 0
    assert af.commands.main(command) in (0, 3)
    assert "not computed" not in set(pd.read_csv(out / "rating_variations.csv")["factor"])
    assert len(seen) == 2 + 1 + late.sum()  # of two that are kept, and an interrupted one


@pytest.mark.slow
def test_variations_that_are_stopped_are_kept(tmp_path, unplotted, capsys, monkeypatch, caplog):
    """The same command computes only those that are left; another rating computes all."""
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(CASE.replace("PIER", 'breadth = "0.88 m"'))
    monkeypatch.setattr("archfem.limit.rating._places_along", lambda *_: (1.5, 2.0))
    again, seen, stop = variations.rate_again, [], [3]

    def rate_again(*given, **options):
        seen.append(given)
        if len(seen) == stop[0]:
            raise KeyboardInterrupt
        return again(*given, **options)

    monkeypatch.setattr(variations, "rate_again", rate_again)
    command = ["rate", str(path), "--vary", "--out", str(out)]
    assert af.commands.main(command) == 130
    table, names = out / "rating_variations.csv", "cart, without impact with"
    rows = pd.read_csv(table).set_index(names)["factor"]
    late = rows[rows == "not computed"]
    # rings, and a narrower pier, which is refused before it is rated; all at once also by CS 454
    assert len(late) == 17 - 3
    assert float(rows["rings a tenth thinner"]) < float(rows["rings a tenth thicker"])
    text = (out / "rating.txt").read_text()
    assert f"in doubt: interrupted: {len(late)} variations of the rating were not computed" in text
    assert f"; {len(late)} variations were not computed" in text
    stop[0] = 0
    assert af.commands.main(command) == 3
    assert len(seen) == 16 + 1  # all but the narrower pier, and the interrupted one twice
    second = pd.read_csv(table).set_index(names)["factor"]
    assert "not computed" not in set(second)
    assert second["rings a tenth thinner"] == rows["rings a tenth thinner"]
    text, factors = (out / "rating.txt").read_text(), pd.to_numeric(second, errors="coerce")
    assert "interrupted" not in text
    # all at once by CS 454 has a row of its own, and no place among the changes
    changed = factors.drop("all unfavourable at once, by CS 454").dropna()
    at_once, *single = changed.sort_values().items()
    ends = [f"{factor:.4g} ({name})" for name, factor in (single[0], single[-1])]
    assert " to {} at least and {} at most; ".format(*ends) in text
    assert "; {} {:.4g}\n".format(*at_once) in text
    seen.clear()

    def refuse(*given, **_):
        seen.append(given)
        raise af.DidNotConverge("no optimum", last=None)

    monkeypatch.setattr(variations, "rate_again", refuse)
    af.commands.main([*command, "--live", "1.5"])
    assert len(seen) == 16
    # that rings do not fit on a narrower pier is no failure
    assert caplog.text.count("no optimum") == 16
    assert "piers a tenth narrower" not in caplog.text
    capsys.readouterr()


@pytest.mark.slow
def test_a_rating_of_the_command_is_varied(tmp_path, unplotted, capsys, monkeypatch):
    """By a gap too, whose pier is a tenth of its breadth broader; the paving stays."""
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(CASE.replace("PIER", 'gap = "0.6 m"'))
    changed = []
    keep = af.Case.of
    monkeypatch.setattr(af.Case, "of", lambda *given: changed.append(given[0]) or keep(*given))
    assert af.commands.main(["rate", str(path), "--vary", "--out", str(out)]) == 3  # free ends
    said = capsys.readouterr().out
    assert "\none property at a time changes the factor of " in said
    rows = pd.read_csv(out / "rating_variations.csv")
    names = rows["cart, without impact with"]
    assert {"piers a tenth narrower", "0.1 m more cover"} <= {*names}
    assert (np.diff(rows["factor"][names.str.startswith("rings")]) > 0.0).all()
    gaps = [each["structure"]["piers"]["gap"] for each in changed]
    breadth = float(re.search(r"'pier' ([\d.]+) m broad", said)[1])
    assert max(x for x in gaps if isinstance(x, float)) == pytest.approx(0.6 + 0.1 * breadth, 1e-3)
    assert {each["structure"]["paving"]["thickness"] for each in changed} == {"0.1 m"}


@pytest.mark.parametrize("by_rule", [True, False])
def test_all_at_once_has_the_width_of_its_own_cover(tmp_path, monkeypatch, by_rule):
    """Wheels of 1.5 m and the cover, 0.3 m less 0.1 m; a given width stays, less a tenth."""
    (tmp_path / "case.toml").write_text(CASE.replace("PIER", 'breadth = "0.9 m"'))
    case = af.Case.read(tmp_path / "case.toml")
    changed = []

    def rate_changed(_, __, changes, ___):
        changed.append(changes)
        return dict.fromkeys(changes, 1.0)

    monkeypatch.setattr(variations, "_rate_changed", rate_changed)
    vehicle = case.rating["vehicle"]
    paved = 1.5 + 0.3 + 0.1
    assert vehicle.spread_over(case.structure) == pytest.approx(paved)
    found = SimpleNamespace(vehicle=vehicle, width=paved, is_width_by_rule=by_rule, by_cs454={})
    worst = {"rating.width": 0.9 * paved, "structure.backfill.cover": 0.2}
    variations._rate_at_once(case, found, worst, None)
    ((at_once,),) = (each.values() for each in changed)
    assert at_once["rating.width"] == pytest.approx(0.9 * (paved - 0.1 * by_rule))


@pytest.mark.parametrize(("free", "says"), [(4.001, True), (3.9, False)])
def test_free_abutments_that_change_nothing_say_by_which_size(tmp_path, monkeypatch, free, says):
    walls = '[structure.sidewalls]\nlength = "5.5 m"\nheight = "0.5 m"\nstate = "fixed"\n'
    walls += 'a = {}\nb = { length = "3 m" }\n[structure.backfill]'
    text = CASE.replace("PIER", 'breadth = "0.9 m"').replace("[structure.backfill]", walls)
    (tmp_path / "case.toml").write_text(text)
    case = af.Case.read(tmp_path / "case.toml")
    given = {
        "factor": 4.0,
        "without_pressure": 3.0,
        "active_alone": 3.0,
        "full_pressure": 5.0,
        "strength": np.inf,
    }
    words = {"vehicle": SimpleNamespace(name="cart"), "label": "cart", "crushing": {}}
    words |= {"by_cs454": {}, "is_width_by_rule": False}
    found = SimpleNamespace(
        structure=case.structure, fill=case.limit.fill, width=2.5, **given, **words
    )

    def rate_changed(case, found, changes, folder):
        return {name: free if name == "abutments free" else 3.5 for name in changes}

    monkeypatch.setattr(variations, "_rate_changed", rate_changed)
    rows = vary_rating(case, case.settings["rating"], found)[0].rows
    (row,) = [row for row in rows if row[0].startswith("abutments free")]
    said = ", no change: 0.5 m high on 5.5 m and 0.5 m high on 3 m they do not move"
    assert row == [f"abutments free{said * says}", f"{free:.4g}"]
