"""JSON schema of case files: fresh, valid for all that is shipped, and as strict as the reader."""

import importlib
import sys
import tomllib
from copy import deepcopy
from pathlib import Path

import pytest

import archfem as af
from archfem.cases.examples import list_examples, list_new_cases
from archfem.cases.toml_file import merge_tables
from archfem.commands import schema

SHIPPED = Path(schema.__file__).with_name("case.schema.json")
FILES = list_examples() | {f"new {kind}": path for kind, path in list_new_cases().items()}


@pytest.fixture(scope="module")
def validator():
    """The validator of the schema; its library takes two seconds to load, here in one worker."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "rfc3987_syntax", None)  # grammars of addresses, not used here
        jsonschema = importlib.import_module("jsonschema")
    jsonschema.Draft7Validator.check_schema(schema.build_schema())
    return jsonschema.Draft7Validator(schema.build_schema())


def read(path):
    """Tables of a file, without those of its base."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def test_the_shipped_schema_is_that_of_the_reader(capsys):
    assert af.commands.main(["schema"]) == 0
    text = capsys.readouterr().out
    assert SHIPPED.read_text(encoding="utf-8") == text, "archfem schema > case.schema.json"


@pytest.mark.parametrize("name", FILES)
def test_every_shipped_file_is_valid(name, validator):
    errors = validator.iter_errors(read(FILES[name]))
    assert [error.message for error in errors] == []


def misspelt(table):
    """Copies of a table with one key each that is misspelt, at any depth."""
    for key, value in table.items():
        yield {(f"{k}x" if k == key else k): v for k, v in table.items()}
        if isinstance(value, dict):
            yield from ({**table, key: inner} for inner in misspelt(value))


@pytest.mark.parametrize(
    "name",
    [
        "ring",
        "ring_suite",
        pytest.param("prusias", marks=pytest.mark.slow),
        pytest.param("survey", marks=pytest.mark.slow),
        "new wall",
    ],
)
def test_a_misspelt_key_is_refused_where_the_reader_refuses_it(name, validator):
    settings, folder, refused = read(FILES[name]), FILES[name].parent, 0
    base = settings.pop("base", None)
    for wrong in misspelt(settings):
        whole = wrong if base is None else merge_tables(read(folder / base), wrong)
        try:
            af.Case.of(deepcopy(whole), folder)
        except af.ArchfemError as error:
            unknown = "unknown key" in str(error)
        else:
            unknown = False
        # names of parts, pairs and materials are free
        assert not (unknown and validator.is_valid(wrong)), wrong
        refused += unknown
    assert refused > 10


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("model", "fidelity"), "rigit"),
        (("model", "displacements"), "huge"),
        (("structure", "shape"), "circle"),
        (("structure", "voussoirs"), "17"),
        (("structure", "radius"), "wide"),
        (("analysis", "scheme"), "newmarc"),
        (("analysis", "until"), {"name": "counted mechanism", "kind": ["local"]}),
        (("output", "animation"), "yes"),
        (("report", "author"), 7),
        (("verdict", "vary"), {"joint_rule": ["exact", "five"]}),
        (("verdict", "vary"), {"k_m": [0.1, 10.0]}),
        (("verdict", "vary"), {"friction": "low"}),
        (("verdict", "vary"), {"survey": {}}),
    ],
)
def test_a_wrong_value_is_refused_by_both(path, value, validator):
    settings = read(FILES["ring"])
    settings.setdefault(path[0], {})[path[1]] = value
    assert not validator.is_valid(settings)
    with pytest.raises(af.ArchfemError, match=path[1]):
        af.Case.of(settings)


def test_texts_and_defaults_are_those_of_the_docstrings():
    tables = schema.build_schema()["properties"]
    assert tables["model"]["properties"]["degree"]["default"] == 1
    assert (
        "Coulomb"
        in tables["contacts"]["additionalProperties"]["properties"]["friction"]["description"]
    )
