"""Plain words in docstrings, comments, messages, names of tests and scripts, and documentation."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PYTHON = sorted((ROOT / "archfem").rglob("*.py"))
SCRIPTS = {path.parent for name in ("tests", "archbench") for path in (ROOT / name).rglob("*.py")}
SCRIPTS = sorted({*SCRIPTS, ROOT / "docs", ROOT / "docs" / "extensions"})
PAGES = ["README", "CONTRIBUTING", "SECURITY", "SUPPORT", "CODE_OF_CONDUCT"]
PAGES = [ROOT / f"{name}.md" for name in PAGES]
PAGES += sorted((ROOT / "docs").rglob("*.md"))
PAGES += [*sorted((ROOT / "meshes").glob("*.toml")), *sorted((ROOT / "notebooks").glob("*.py"))]

# Words for which mechanics, numerics or everyday English have a plainer one.
AVOIDED = re.compile(
    r"\b(told|asked|asks|knows|remembers|remembered|meant|lest|gravest|waist|rungs?)\b"
    r"|\bcomes? to\b|\bcame to\b|\bhangs? on\b|\bgoes on\b"
    r"|\bwhat (it|they|this|that|one|an? \w+|the \w+) (does|do|has|have|gives?)\b",
    re.IGNORECASE,
)

# Phrases in which such a word has its plain sense.
PLAIN_SENSE = (
    "rungs: fidelities", "comes to rest", "come to rest", "came to rest",
)  # fmt: skip


def plain(text):
    """The text without phrases in which an avoided word has its plain sense."""
    for phrase in PLAIN_SENSE:
        text = text.replace(phrase, "")
    return text


def avoided(text):
    """Avoided words of a text, each with the words about it."""
    text = " ".join(plain(text).split())
    return [text[max(0, m.start() - 30) : m.end() + 30] for m in AVOIDED.finditer(text)]


def written(path):
    """Docstrings, messages and comments of a module."""
    source = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value
    yield from comments(source)


def comments(source):
    """Comments of a source, each with its line."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def stated(source):
    """Docstrings, comments and defined names of a module, with their lines; names as words.

    Keywords and attributes of the package that a module only uses are no names of its own. Strings
    are data that a test passes or expects.
    """
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield node.lineno, str(node.value.value)
        if name := defined_name(node):
            yield node.lineno, in_words(name)
    yield from comments(source)


def defined_name(node):
    """The name that a node of the syntax tree defines, or None."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef() | ast.ExceptHandler():
            return node.name
        case ast.arg():
            return node.arg
        case ast.alias():
            return node.asname
        case ast.Name(ctx=ast.Store()):
            return node.id
        case ast.Attribute(ctx=ast.Store()):
            return node.attr
    return None


def in_words(name):
    """Words of a name, parted at underscores and at capitals inside it."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.replace("_", " "))


def is_suspicious(source):
    """Whether any part of a source, strings joined as the parser does, has an avoided word.

    Code counts as well. Most modules have none, and are not divided into strings and comments.
    """
    joined = re.sub(r"""["']\s*[fr]*["']""", "", source)
    return bool(avoided(re.sub(r"""\\n|["'#]""", " ", joined)))


def test_the_package_has_plain_words():
    places = [
        f"{path}:{line}: {found}"
        for path in PYTHON
        if is_suspicious(path.read_text(encoding="utf-8"))
        for line, text in written(path)
        for found in avoided(text)
    ]
    assert not places, "\n".join(places)


@pytest.mark.parametrize("folder", SCRIPTS, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_tests_and_scripts_have_plain_words(folder):
    places = []
    for path in sorted(folder.glob("*.py")):
        source = path.read_text(encoding="utf-8")
        if is_suspicious(in_words(source)):
            found = ((line, each) for line, text in stated(source) for each in avoided(text))
            places += [f"{path.name}:{line}: {each}" for line, each in found]
    assert not places, "\n".join(places)


def test_the_documentation_has_plain_words():
    generated = {"build", "made", "generated"}
    places = [
        f"{path}: {found}"
        for path in PAGES
        if not generated.intersection(path.relative_to(ROOT).parts)
        for found in avoided(path.read_text(encoding="utf-8"))
    ]
    assert not places, "\n".join(places)


def test_an_avoided_word_is_found():
    assert avoided("whatever it is asked, it knows") == ["whatever it is asked, it knows"] * 2
    assert not avoided("the block comes to rest")
    assert is_suspicious('text = (\n    "it comes "\n    f"to {number}"\n)  # 1')
    assert is_suspicious("a = 1  # it comes\n# to one")
    assert is_suspicious(r"a = 'it comes\nto one'")
    assert not is_suspicious("a = 1  # the block")


@pytest.mark.parametrize(
    "source",
    [
        "def test_layers_must_be_told(): pass",
        "async def what_the_ring_has(): pass",
        "class TimedTold: pass",
        "def test(rung): pass",
        "def test(*, asked=1): pass",
        "def test(**told): pass",
        "lambda rungs: 1",
        "told, a = 1, 2",
        "[1 for asked in a]",
        "if (told := 1): pass",
        "path.asked = []",
        "import archfem as told",
        "try:\n    pass\nexcept OSError as told:\n    pass",
        'def test():\n    """Of each\n    rung."""',
        'A = 1\n"""What a rung is."""',
        "a = 1  # as it is told",
    ],
)
def test_an_avoided_word_of_a_test_is_found(source):
    assert is_suspicious(in_words(source))
    assert [each for _, text in stated(source) for each in avoided(text)]


@pytest.mark.parametrize(
    "source",
    [
        "mesh_sensitivity(case, rungs=[])",
        "study.told.digest(found.rungs)",
        'given = {"rungs": 1}',
        "from archfem import rungs",
        "def test_a_block_comes_to_rest(): pass",
    ],
)
def test_uses_of_public_names_and_plain_senses_are_no_avoided_words(source):
    assert not [each for _, text in stated(source) for each in avoided(text)]
