"""What `make mutants` changes in a module, and what it leaves alone."""

from mutants.changes import changed, changes

SOURCE = '''
"""A module of 3 words."""
LIMIT = 0.5
def f(x: float = 2) -> float:
    """Of 1."""
    if x < 0:
        raise ValueError(f"{x + 1}")
    return max(x, -LIMIT) * 3
'''


def test_every_number_and_operator_of_the_physics_is_changed_once():
    words = [words for _, words in changes(SOURCE)]
    assert sorted(words) == [
        "-LIMIT → LIMIT",
        "0.5 → 0.55",
        "2 → 3",
        "3 → 4",
        "max → min",
        "max(x, -LIMIT) * 3 → max(x, -LIMIT) / 3",
    ]
    for number in range(len(words)):
        text = changed(SOURCE, number)
        assert text != changed(SOURCE, number - 1)
        compile(text, "changed", "exec")
        assert text.count("raise ValueError") == 1
