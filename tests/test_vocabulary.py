"""Plain words in docstrings, comments, messages and documentation."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PYTHON = sorted((ROOT / "archfem").rglob("*.py"))
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))
PAGES += [*sorted((ROOT / "meshes").glob("*.toml")), *sorted((ROOT / "notebooks").glob("*.py"))]

# Words for which mechanics, numerics or everyday English have a plainer one.
AVOIDED = re.compile(
    r"\b(told|asked|asks|knows|remembers|remembered|meant|lest|gravest|rungs?)\b"
    r"|\bcomes? to\b|\bcame to\b|\bhangs? on\b|\bgoes on\b"
    r"|\bwhat (it|they|this|that|one|an? \w+|the \w+) (does|do|has|have|gives?)\b",
    re.IGNORECASE,
)

# Phrases in which such a word has its plain sense.
PLAIN_SENSE = (
    "rungs: fidelities", "asked: evaluator", "comes to rest", "come to rest", "came to rest",
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
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def is_suspicious(source):
    """Whether any part of a source, strings joined as the parser does, has an avoided word.

    Code counts as well. Most modules have none, and are not divided into strings and comments.
    """
    joined = re.sub(r"""["']\s*[fr]*["']""", "", source)
    return bool(avoided(re.sub(r"""\\n|["'#]""", " ", joined)))


@pytest.mark.parametrize("path", PYTHON, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_package_speaks_plainly(path):
    if not is_suspicious(path.read_text(encoding="utf-8")):
        return
    places = [f"{line}: {found}" for line, text in written(path) for found in avoided(text)]
    assert not places, "\n".join(places)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_documentation_speaks_plainly(path):
    if any(part in {"build", "made", "generated"} for part in path.relative_to(ROOT).parts):
        pytest.skip("generated page")
    assert not avoided(path.read_text(encoding="utf-8"))


def test_an_avoided_word_is_found():
    assert avoided("whatever it is asked, it knows") == ["whatever it is asked, it knows"] * 2
    assert not avoided("the block comes to rest")
    assert is_suspicious('text = (\n    "it comes "\n    f"to {number}"\n)  # 1')
    assert is_suspicious("a = 1  # it comes\n# to one")
    assert is_suspicious(r"a = 'it comes\nto one'")
    assert not is_suspicious("a = 1  # the block")
