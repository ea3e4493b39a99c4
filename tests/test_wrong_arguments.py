"""Arguments of a wrong kind end in an archfem error that states the value and the valid ones."""

import importlib
import inspect
import os
from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem._validation import check_between, matches_annotation

SQUARE = np.array([(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)])
MASKED = np.ma.masked_array([1.0, 2.0], mask=[False, True])
RING = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)
QUAKE = af.Motion(np.zeros(11), dt=0.01)


@pytest.fixture(scope="module")
def model():
    return af.build(RING, fidelity="rigid")


MADE = [
    (lambda: af.BodyForce("x"), r"horizontal \[g\] = 'x' is not a finite number"),
    (lambda: af.BodyForce(0.1, (0.0, 1.0)), r"vertical \[g\] = \(0.0, 1.0\) is not a finite"),
    (lambda: af.BodyForce(1.7e308), r"horizontal \[g\] = 1.7e\+308 is not between"),
    (lambda: af.BodyForce(0.0, -1001.0), r"vertical \[g\] = -1001.0 is not between"),
    (lambda: af.PointLoad(0, (1e17, -1.0)), r"load of \(1e\+17, -1.0\) N is above 1e"),
    (lambda: af.PointLoad(0, -1), r"force \(x, y\) \[N\] = -1 is not a row of values: give \(a, b"),
    (lambda: af.PointLoad(0, (0, -1, 2)), r"has 3 values: give \(a, b\)"),
    (lambda: af.PointLoad("crown", (0, -1)), r"x \[m\] = 'crown' is not a finite number"),
    (lambda: af.PointLoad(0, (0, float("nan"))), r"\[N\]\[1\] = nan is not a finite number"),
    (lambda: af.Settlement(0, 0.01), r"motion .* = 0.01 is not a row of values: give \(a, b, c\)"),
    (lambda: af.Settlement(0, (0.01, 0.0)), r"has 2 values: give \(a, b, c\)"),
    (lambda: af.Settlement(1.5, (0.0, 0.0, 0.0)), "block = 1.5 is not a whole number"),
    (lambda: af.Criteria(hinge=2), r"criteria hinge \[-\] = 2 is not between 0 and 0.5"),
    (lambda: af.Criteria(hinge="0.46"), "criteria hinge .* = '0.46' is not a finite"),
    (lambda: af.Criteria(failures=2.5), "criteria failures = 2.5 is not a whole number"),
    (lambda: af.CountedMechanism(kinds="local"), "kinds = 'local': give some of"),
    (lambda: af.CountedMechanism(kinds=("locally",)), "kinds = .'locally',.: give some of"),
    (lambda: af.CountedMechanism(kinds=3), "kinds = 3: give some of"),
    (lambda: af.CountedMechanism(criteria=0.46), "criteria is a float: give Criteria"),
    (lambda: af.dynamics.MovingMechanism(kinds=("all",)), r"kinds = \('all',\): give some of"),
    (lambda: af.dynamics.EveryMechanism(criteria=0.4), "criteria is a float: give Criteria"),
    (lambda: af.Rayleigh("5 %", (8.0, 16.0)), "damping ratio .* = '5 %' is not a finite number"),
    (lambda: af.Rayleigh(0.05, 8.0), r"damping frequencies \[Hz\] = 8.0 is not a row of values"),
    (lambda: af.Rayleigh(0.05, (8.0, 16.0, 24.0)), "has 3 values"),
    (lambda: af.Rayleigh(0.05, (8.0, 16.0), joints=None), "damping joints is missing"),
    (lambda: af.HHT("x"), "HHT alpha .* = 'x' is not a finite number"),
    (lambda: af.dynamics.Newmark(None), "Newmark beta .* = None is not a finite number"),
    (lambda: af.statics.Newton(tolerance="x"), "tolerance of a solve .* = 'x'"),
    (lambda: af.statics.Newton(petsc="pc_type"), "petsc is a str: give a dictionary"),
    (lambda: af.Record(every="2"), "record every = '2' is not a whole number"),
    (lambda: af.Record(every=0), "record every = 0 is not a whole number of at least 1"),
    (lambda: af.Record(fields_every=2.5), "record fields_every = 2.5 is not a whole number"),
    (lambda: af.Motion("x", 0.01), "horizontal acceleration is not a row of numbers"),
    (lambda: af.Motion(np.zeros(5), "0.01"), "dt '0.01' s"),
    (lambda: af.Motion(np.zeros(5), 0.01, vertical=3.0), "vertical acceleration of shape"),
    (lambda: af.Motion(np.zeros(5), 0.01, name=3), "name of a motion is a int: give words"),
    (lambda: af.Motion.synthetic(pga="0.3 g"), "pga .* = '0.3 g' is not a finite number"),
    (
        lambda: af.Motion.synthetic(seed=1.5),
        "seed of a synthetic motion = 1.5 is not a whole number",
    ),
    (lambda: af.Motion(np.zeros(5), 1e-300), "dt 1e-300 s"),
    (lambda: af.Motion([[1.0, 2.0], [3.0]], 0.01), "is not a row of numbers: setting an array"),
    (
        lambda: af.dead_load(af.Analysis(RING), stages=af.masonry.usual_stages(RING)),
        "an analysis has newton and stages of its own: change them there",
    ),
    (
        lambda: af.Motion([0.0, 1.0, np.nan], 0.01),
        "1 of 3 samples .* the first nan in place 2: give",
    ),
    (
        lambda: af.Analysis(RING, fidelity="rigid").run(af.Motion([1.0], 0.01)),
        "motion '' is one sample, .*: give two or more",
    ),
    (lambda: af.Contact(1e9, 1e9, closure=0.05), "between 1e-07 and 0.02: give the .* in m"),
    (lambda: af.masonry.fit_closing([1e5, 5e5, 1e6], [0.015, 0.05, 0.075]), "limit of 0.132 m"),
    (lambda: af.moving_load(RING, 1e5, area_load=9.0), "area_load 9 Pa looks like kPa"),
    (lambda: af.Motion(MASKED, 0.01), "horizontal acceleration has 1 values masked: fill them in"),
    (lambda: af.response_spectrum(QUAKE, MASKED), r"periods \[s\] has 1 values masked"),
    (
        lambda: af.motion.TableSpectrum([1.0, 2.0], MASKED),
        "values of a spectrum table has 1 values",
    ),
    (lambda: af.Block(np.ma.masked_less(SQUARE, 0.0), af.STONE, "a"), "outline of block 'a' has 2"),
    (lambda: af.Material(30e9, 0.2, 2000.0), "looks like kg/m³: .* have 1.962e.04"),
    (lambda: af.Material(30e9, 0.2, 1e-300), "is not between 0.001 and"),
    (lambda: af.Tbec2018(1.0, 1e300, "ZC"), r"S_1 1e\+300 g: both are between 0 and 10 g"),
    (lambda: af.Eurocode8(1e300, "B"), "is not between 0 and 1"),
    (lambda: af.motion.TableSpectrum([1.0, 2.0], [1.0, 1e300]), "more than 10 g"),
    (lambda: af.StiffnessDamping(0.05, 1e-300), "is not between 0.001 and 1e"),
    (lambda: af.Material("30 GPa", 0.2, 2e4), "young of 'material' = '30 GPa' is not a finite"),
    (lambda: af.Contact(1e9, None), "shear_stiffness of 'contact' = None is not a finite number"),
    (lambda: af.Tbec2018("1", 0.3, "ZC"), "map value S_S .* = '1' is not a finite number"),
    (lambda: af.Eurocode8("x", "B"), "design ground acceleration .* = 'x' is not a finite number"),
    (lambda: af.circular_arch(radius="x", thickness=0.5, embrace=90, voussoirs=5), "radius .* 'x'"),
    (
        lambda: af.circular_arch(radius=3, thickness=0.5, embrace=90, voussoirs=5, width="x"),
        "width .* 'x'",
    ),
    (
        lambda: af.circular_arch(radius=3, thickness=0.5, embrace=90, voussoirs="five"),
        "voussoirs = 'five' is not a finite number",
    ),
    (lambda: af.column(breadth=1.0, heights=2.0), "heights of the blocks .* = 2.0 is not a row"),
    (
        lambda: af.shapes.Arch(name="arch", span="3 m", thickness=0.5, embrace=150, voussoirs=9),
        r"span \[m\] = '3 m' is not a finite",
    ),
    (lambda: af.response_spectrum(QUAKE, "x"), "periods 'x' s are no numbers"),
    (lambda: af.response_spectrum(QUAKE, 10**400), "periods 1000.* s are no numbers"),
    (lambda: QUAKE.at(np.nan), "times = nan: one is not a number"),
    (lambda: af.Contact(1e9, 1e9, np.zeros(3)), "friction of 'contact' = array.* is not a finite"),
    (lambda: af.stands(RING, friction=np.zeros(3)), r"friction = array.* is not known: use one of"),
    (lambda: af.minimum_thickness(int), r"build\(100\) is a int: make a structure"),
    (lambda: af.response_spectrum(3.0, [0.1]), "motion is a float: give a Motion"),
    (lambda: af.response_spectrum(QUAKE, [0.1], damping="5 %"), "damping ratio .* = '5 %'"),
    (lambda: af.collapse_factor(RING, live=0.1), r"load 0.1 is none: give BodyForce"),
    (lambda: af.collapse_factor(RING, live=[]), r"load \[\] is none"),
    (lambda: af.stands("ring"), "structure is a str"),
    (lambda: af.verified_mechanism(RING, None), "joints is a NoneType: give those of an instant"),
    (lambda: af.first_mechanisms(None), "run is a NoneType: give what time_history returns"),
    (lambda: af.dead_load(RING), "model is a Structure: build one"),
    (lambda: af.modes(RING, 3), "model is a Structure: build one"),
    (lambda: af.joint_stiffness(3e10, 0.5, rigid=np.zeros(3)), "rigid = array.* is a ndarray"),
    (lambda: af.joint_stiffness(3e10, 0.5, poisson=RING), "poisson = .* is a Structure: give a n"),
    (lambda: af.joint_stiffness(3e10, 0.5, poisson=0.7), "poisson = 0.7 is above 0.499"),
    (
        lambda: af.dead_load(af.build(RING, fidelity="rigid"), stages=10**400),
        "stages = 10+ … 0+ is",
    ),
    (lambda: af.dynamics.restitution_damping(None, 0.5, 1e308), r"height \[m\] = 1e\+308 is above"),
    (lambda: af.motion.TableSpectrum("aaaa", [1.0]), "periods of a spectrum table = 'aaaa' is no"),
    (lambda: af.motion.TableSpectrum([1, [2]], [1.0]), r"periods .* \[1, \[2\]\] is no array"),
    (lambda: af.matched(QUAKE, np.zeros(3)), "spectrum = array.* give DesignSpectrum"),
    (lambda: af.read_outlines(np.zeros(3)), "path = array.* give words or Path"),
    (lambda: af.read_outlines("x.dxf", layers={"a": 3}), r"layers = \{'a': 3\} is a dict: give"),
    (lambda: af.masonry.usual_stages(np.zeros(3)), "structure = array.* give Structure"),
    (
        lambda: af.Block(SQUARE.tolist(), af.STONE, "a\ud800"),
        r"name = 'a\\ud800' has '\\ud800', wh",
    ),
    (lambda: af.Motion(np.zeros(5), 0.01, name="a\x1b[31m"), r"name of a motion = .* has '\\x1b'"),
    (lambda: af.motion.Ntc2018(0.3, 2.5, 0.3, site=[]), r"subsoil = \[\] is not known: use one of"),
    (
        lambda: af.shapes.pointed_arch(span=3, rise=2, thickness=0.4, voussoirs=2**31),
        "voussoirs = 2147483648 is above 10000, the most there is room for",
    ),
    (
        lambda: af.shapes.pointed_arch(span=3, rise=2, thickness=0.4, voussoirs=9999, chords=9999),
        "voussoirs times chords = 99980001 is above 1000000",
    ),
    (
        lambda: af.masonry.assembled(af.column(breadth=1.0, heights=[1.0]).blocks, lambda *_: 0.6),
        "contact of two blocks is a float: return a Contact from the function",
    ),
    (lambda: af.Material(30e9, 0.2, 2e4, name=3), "name of a material is a int: give words"),
]


@pytest.mark.parametrize(("make", "says"), MADE, ids=range(len(MADE)))
def test_constructors_refuse_wrong_arguments(make, says):
    with pytest.raises(af.InvalidInput, match=says):
        make()


ROOMS = ("motion", "masonry", "masonry.shapes", "joints", "limit", "models", "statics")
ROOMS += ("dynamics", "view", "cases", "studies")

# those of arrays in which undefined or unbounded values have a meaning, so that none is refused
WITH_GAPS = {"failure_flags", "joint_dataset", "draw_capacity", "draw_convergence"}
WITH_GAPS |= {"draw_fragility", "draw_ida", "draw_study", "draw_tornado"}


def public_functions():
    """Functions that the package and its rooms export, by name."""
    rooms = [af, *(importlib.import_module(f"archfem.{room}") for room in ROOMS)]
    found = {name: getattr(room, name) for room in rooms for name in dir(room)}
    return {
        name: each
        for name, each in found.items()
        if inspect.isfunction(each) and name not in WITH_GAPS | {"parameter_axes"}
    }


@pytest.mark.parametrize(
    "bad",
    [object(), np.zeros(3), 10**400, "\ud800", None, [object()], np.ma.masked, {"a": np.zeros(2)}],
    ids=["object", "array", "huge", "surrogate", "none", "list", "masked", "table"],
)
def test_every_public_function_refuses_unusable_arguments(bad, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    functions = public_functions()
    assert len(functions) > 100
    for function in functions.values():
        parameters = inspect.signature(function).parameters.values()
        needed = [each.name for each in parameters if each.default is each.empty]
        with pytest.raises(af.ArchfemError):  # the traceback names the function
            function(**dict.fromkeys(needed, bad))
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize(
    "cells", [4, None, "44", 2.5, (4,), (4, 4, 4), (4.0, 4), (0, 4), (4, -1), ("4", 4), (True, 4)]
)
def test_cells_are_two_whole_numbers(fidelity, cells):
    with pytest.raises(af.InvalidInput, match="cells"):
        af.build(RING, fidelity=fidelity, cells=cells)


@pytest.mark.parametrize("coarse", [5e-324, 1.7e308])
def test_the_cell_size_is_ignored_where_no_block_is_unstructured(coarse):
    assert af.build(RING, fidelity="faces", max_cell_size=coarse).size == 6 * 7


def test_a_step_beyond_the_range_of_numbers_is_refused(tmp_path):
    (tmp_path / "record.txt").write_text("0.1\n0.2\n0.1\n")
    with pytest.raises(af.InvalidInput, match=r"dt \[s\] = 1000.* is not a finite number"):
        af.Motion.read(tmp_path / "record.txt", units="g", dt=10**400)


@pytest.mark.parametrize("key", ["fidelity", "cell", "degree", "quadrature", "displacements"])
def test_an_array_in_place_of_a_word_is_refused(key):
    with pytest.raises(af.InvalidInput, match=rf"{key} .*array.*(not known|of degree)"):
        af.build(RING, **{key: np.zeros(3)})


def test_cells_of_any_integer_and_row():
    assert af.build(RING, fidelity="rigid", cells=np.array([2, 2])).size == 3 * 7


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"motion": 0.3}, "motion is a float: give a Motion"),
        ({"model": RING}, "model is a Structure: build one"),
        ({"dt": "0.005"}, r"dt \[s\] = '0.005' is not a finite number"),
        ({"dt": 5}, r"dt \[s\] = 5 is not between 1e-06 and 0.1"),
        ({"start": "rest"}, "start is a str: give dead_load"),
        ({"damping": 0.05}, r"damping = 0.05: give 'effective', .*Rayleigh\(0.05"),
        ({"scheme": "hht"}, r"scheme is a str: give Conserving\(\), Newmark\(\) or HHT"),
        ({"record": 10}, "record is a int: give Record"),
        ({"newton": 1e-8}, "newton is a float: give Newton"),
        ({"criteria": 0.46}, "criteria is a float: give Criteria"),
        ({"until": "mechanism"}, "until = 'mechanism' is no event"),
        ({"until": af.CountedMechanism}, "until = <class .*> is no event"),
        ({"method": "fast"}, "fast"),
    ],
)
def test_time_history(model, given, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.time_history(**{"model": model, "motion": QUAKE} | given)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"live": 0.1}, "load 0.1 is none: give BodyForce"),
        ({"live": [af.BodyForce(0.1), 3]}, "is none: give BodyForce"),
        ({"model": RING}, "model is a Structure"),
        ({"start": 3}, "equilibrium is a int"),
        ({"stop": 3}, "stop is a int: give a Stop"),
        ({"criteria": 3}, "criteria is a int: give a Criteria"),
    ],
)
def test_pushover(model, given, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.pushover(**{"model": model, "live": af.BodyForce(0.1)} | given)


def test_a_start_of_another_structure_is_refused(model, tmp_path):
    """The other structure has as many coordinates, and joints of the same names."""
    thicker = af.build(
        af.circular_arch(radius=2.95, thickness=0.65, embrace=159.0, voussoirs=7), fidelity="rigid"
    )
    assert thicker.size == model.size
    run = af.time_history(model, QUAKE, dt=0.005)
    longer = af.Motion(np.zeros(21), dt=0.01)
    dead, last = af.dead_load(model), af.dynamics.last_state(run)
    for start in (dead, last):
        with pytest.raises(af.InvalidInput, match="the state is of another structure"):
            af.time_history(thicker, longer, dt=0.005, start=start)
    with pytest.raises(af.InvalidInput, match="the state is of another structure"):
        af.pushover(thicker, af.BodyForce(1.0), start=dead)
    with pytest.raises(af.InvalidInput, match=r"q of the state has shape \(5,\)"):
        af.time_history(model, longer, dt=0.005, start=replace(last, q=last.q[:5]))
    hidden = np.ma.masked_array(last.q, mask=np.arange(len(last.q)) == 0)
    with pytest.raises(af.InvalidInput, match="q of the state has 1 values masked"):
        af.time_history(model, longer, dt=0.005, start=replace(last, q=hidden))
    path = run.save(tmp_path / "history.nc")
    assert af.History.read(path, RING).structure is RING
    with pytest.raises(af.InvalidInput, match="but blocks are elsewhere"):
        af.History.read(path, thicker.structure)


@pytest.mark.parametrize("dt", [1e-12, 1.9e-14])
def test_steps_that_are_too_short_are_refused_before_memory_is_taken(model, dt):
    with pytest.raises(af.InvalidInput, match=r"is not between 1e-06 and 0\.1"):
        af.time_history(model, QUAKE, dt=dt)


def test_invalid_widths_and_gravities_are_refused():
    for key, value in (("width", 1e-300), ("gravity", 1e-200)):
        with pytest.raises(af.errors.InvalidStructure, match=f"{key} .* is not between"):
            replace(RING, **{key: value})


def test_a_model_that_has_no_operator_is_a_model(stack):
    """A member of a protocol may be None, as the operator of blocks that move far is."""
    far = af.build(stack, fidelity="rigid", displacements="large")
    assert far.operator is None
    assert matches_annotation(far, af.models.Model)
    assert not matches_annotation(stack, af.models.Model)


@pytest.mark.parametrize("ends", ["()", "[)", "(]", "[]"])
def test_a_parenthesis_excludes_the_bound_of_a_number(ends):
    assert check_between(0.5, "share", 0.0, 1.0, ends=ends) == 0.5
    for bound, end in zip((0.0, 1.0), ends, strict=True):
        if end in "[]":
            assert check_between(bound, "share", 0.0, 1.0, ends=ends) == bound
            continue
        with pytest.raises(af.InvalidInput, match=f"share = {bound} is not between 0 and 1: try"):
            check_between(bound, "share", 0.0, 1.0, ends=ends, remedy="try 0.5")
    for outside in (-0.1, 1.1, np.nan):
        with pytest.raises(af.InvalidInput, match="share = "):
            check_between(outside, "share", 0.0, 1.0, ends=ends)
