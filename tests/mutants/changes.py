"""Places of a module where a number is made, and possible changes of them."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARISONS = {ast.Lt: ast.GtE, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.GtE: ast.Lt}
NAMES = {"max": "min", "min": "max", "sin": "cos", "cos": "sin", "maximum": "minimum"}
NAMES |= {"minimum": "maximum", "argmax": "argmin", "argmin": "argmax"}
FACTOR = 1.1
"""By which a number is multiplied; a whole number grows by one."""

REPORTING = ("logger.", "bar.", "tqdm")
"""Beginnings of calls that only report on a run: logs, bars of progress."""

SHOWN = 90
"""Letters of the text around a change, which distinguishes it from others of its module."""

SIMPLE = ast.expr | ast.keyword | ast.Return | ast.Assign | ast.AnnAssign | ast.AugAssign | ast.Expr


@dataclass
class Change:
    """A possible change: the expression, its replacement, and the code around it."""

    node: ast.AST
    other: ast.expr
    around: list[ast.AST]
    """From the module down to what the expression stands in directly."""

    @property
    def line(self) -> int:
        return self.node.lineno

    @property
    def function(self) -> str:
        """Name of the function or class that it stands in; empty for the module itself."""
        kinds = ast.FunctionDef | ast.ClassDef
        return ".".join(each.name for each in self.around if isinstance(each, kinds))

    @property
    def words(self) -> str:
        """The shortest piece of source around it that says enough, before and after."""
        outer = self.node
        for each in reversed(self.around):
            if not isinstance(each, SIMPLE) or len(ast.unparse(each)) > SHOWN:
                break
            outer = each
        before = ast.unparse(outer)
        if outer is self.node:
            return f"{before} → {ast.unparse(self.other)}"
        _put(self.around[-1], self.node, self.other)
        after = ast.unparse(outer)
        _put(self.around[-1], self.other, self.node)
        return f"{before} → {after}"

    @property
    def statement(self) -> ast.stmt | None:
        """Statement of a function that it stands in; None for what runs as the module is read."""
        found, within = None, False
        for each, inside in pairwise([*self.around, self.node]):
            if isinstance(each, ast.FunctionDef | ast.ClassDef):
                found, within = None, isinstance(each, ast.FunctionDef) and inside in each.body
            if within and isinstance(inside, ast.stmt):
                found = inside
        return found


def changes(source: str) -> list[Change]:
    """Return the possible changes of a module.

    Words of errors, logs and bars of progress, annotations and imports are left out. So are bodies
    of functions that only refuse, and sizes of a shape that are to be found (negative numbers).

    Args:
        source: of the module.
    """
    return _found(ast.parse(source))


def changed(source: str, number: int) -> str:
    """Return a module with one change.

    Args:
        source: of the module.
        number: of the change, among those that `changes` gives.
    """
    tree = ast.parse(source)
    change = _found(tree)[number]
    _put(change.around[-1], change.node, change.other)
    return ast.unparse(ast.fix_missing_locations(tree))


def marked(source: str, name: str) -> str:
    """Return a module that reports each statement with changes as it executes.

    Each is reported to the function `_reached` among the built-in names, where there is one, as the
    module's name and the statement's line; so is the first statement of each function, which may
    read values that the module has once it is imported.

    Args:
        source: of the module.
        name: of the module.
    """
    tree = ast.parse(source)
    marks = {id(found): found for each in _found(tree) if (found := each.statement) is not None}
    marks |= {id(first): first for first in _first_statements(tree)}
    for node in list(ast.walk(tree)):
        for field in ("body", "orelse", "finalbody"):
            block = getattr(node, field, None)
            if not isinstance(block, list) or not any(id(each) in marks for each in block):
                continue
            said = ((ast.parse(f"_reached(({name!r}, {s.lineno}))").body, s) for s in block)
            setattr(node, field, [e for m, s in said for e in ([*m, s] if id(s) in marks else [s])])
    first = 0
    while first < len(tree.body) and isinstance(tree.body[first], ast.Expr):
        first += 1
    start = "import builtins; _reached = getattr(builtins, '_reached', bool)"
    tree.body[first:first] = ast.parse(start).body
    return ast.unparse(ast.fix_missing_locations(tree))


def _first_statements(tree: ast.AST) -> Iterator[ast.stmt]:
    """The first statement of each function, after its docstring."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            yield from function.body[int(ast.get_docstring(function) is not None) :][:1]


def _found(tree: ast.AST) -> list[Change]:
    """Expressions that may be changed, each with the code around it and its replacement."""
    places = ((node, around, _changed(node)) for node, around in _places(tree, []))
    return [Change(node, other, around) for node, around, other in places if other is not None]


def _places(tree: ast.AST, above: list[ast.AST]) -> Iterator[tuple[ast.AST, list[ast.AST]]]:
    """Expressions that compute, each with the code around it."""
    around = [*above, tree]
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
            if _is_shape(around) and ast.unparse(node) == "-1":
                continue
            if isinstance(node, ast.Call) and ast.unparse(node.func).startswith(REPORTING):
                continue
            yield node, around
            yield from _places(node, around)


def _is_shape(around: list[ast.AST]) -> bool:
    """Whether what stands in these is a size that `reshape` is given, by itself or in a tuple."""
    call = around[-2] if isinstance(around[-1], ast.Tuple) else around[-1]
    return (
        isinstance(call, ast.Call)
        and isinstance(call.func, ast.Attribute)
        and call.func.attr == "reshape"
    )


def _changed(node: ast.AST) -> ast.expr | None:
    """The replacement of an expression; None where nothing is changed."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        if isinstance(node.value, int):
            return ast.Constant(node.value + 1)
        return ast.Constant(float(f"{FACTOR * node.value or 0.1:.12g}"))
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
    if isinstance(node, ast.BoolOp):
        return ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
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
