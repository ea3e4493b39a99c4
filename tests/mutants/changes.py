"""Places of a module where a number is made, and what may be changed there."""

import ast
from collections.abc import Iterator

OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARISONS = {ast.Lt: ast.GtE, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.GtE: ast.Lt}
NAMES = {"max": "min", "min": "max", "sin": "cos", "cos": "sin", "maximum": "minimum"}
NAMES |= {"minimum": "maximum", "argmax": "argmin", "argmin": "argmax"}
FACTOR = 1.1
"""By which a number is multiplied; a whole number grows by one."""


def changes(source: str) -> list[tuple[int, str]]:
    """Return what may be changed in a module: in which line, and what becomes of it.

    Words of errors, annotations, imports and what a function that only refuses does are left out.

    Args:
        source: of the module.
    """
    return [
        (node.lineno, f"{ast.unparse(node)} → {ast.unparse(other)}")
        for node, _, other in _found(ast.parse(source))
    ]


def changed(source: str, number: int) -> str:
    """Return a module with one change.

    Args:
        source: of the module.
        number: of the change, among those that `changes` gives.
    """
    tree = ast.parse(source)
    node, parent, other = _found(tree)[number]
    _put(parent, node, other)
    return ast.unparse(ast.fix_missing_locations(tree))


def _found(tree: ast.AST) -> list[tuple[ast.AST, ast.AST, ast.expr]]:
    """Expressions that may be changed, each with what it stands in and what becomes of it."""
    places = ((node, parent, _changed(node)) for node, parent in _places(tree))
    return [(node, parent, other) for node, parent, other in places if other is not None]


def _places(tree: ast.AST) -> Iterator[tuple[ast.AST, ast.AST]]:
    """Expressions that compute, each with what it stands in."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list"):
            continue
        for node in value if isinstance(value, list) else [value]:
            if not isinstance(node, ast.AST) or isinstance(
                node, ast.Raise | ast.Import | ast.ImportFrom | ast.JoinedStr | ast.Subscript
            ):
                continue
            if isinstance(node, ast.If) and isinstance(node.body[-1], ast.Raise):
                continue
            yield node, tree
            yield from _places(node)


def _changed(node: ast.AST) -> ast.expr | None:
    """What becomes of an expression; None where nothing is changed."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        grown = node.value + 1 if isinstance(node.value, int) else FACTOR * node.value or 0.1
        return ast.Constant(grown)
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
    if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        ops = [COMPARISONS[type(node.ops[0])](), *node.ops[1:]]
        return ast.Compare(node.left, ops, node.comparators)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        return node.operand
    if isinstance(node, ast.Name) and node.id in NAMES:
        return ast.Name(NAMES[node.id], node.ctx)
    if isinstance(node, ast.Attribute) and node.attr in NAMES:
        return ast.Attribute(node.value, NAMES[node.attr], node.ctx)
    return None


def _put(parent: ast.AST, node: ast.AST, other: ast.expr) -> None:
    """Put one expression in the place of another."""
    for field, value in ast.iter_fields(parent):
        if value is node:
            setattr(parent, field, other)
        elif isinstance(value, list):
            setattr(parent, field, [other if each is node else each for each in value])
