"""Eight numbers at a time: vectors of the processor as numbers of compiled kernels.

A kernel without branches computes eight joints at the time of one, where its numbers are `LANES`
and what it compares is a `MASK`. `select` takes the place of a condition. Numba makes such vectors
by itself in simple loops only. `least`, `greatest`, `select`, `any_lane` and `logarithm` also take
single numbers, for kernels that serve both.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, models, register_model
from numba.np.arrayobj import make_array

# mypy: disable-error-code="no-untyped-call,untyped-decorator"

WIDTH = 8


class VectorType(types.Type):
    """Type of vectors of numbers or of conditions."""

    def unify(self, _typingctx: Any, other: types.Type) -> types.Type | None:
        """Return this type for a variable that is a number elsewhere."""
        return self if self is LANES and isinstance(other, types.Float | types.Integer) else None


LANES, MASK = VectorType("lanes"), VectorType("mask")
_VECTORS = {LANES: ir.VectorType(ir.DoubleType(), WIDTH), MASK: ir.VectorType(ir.IntType(1), WIDTH)}


@register_model(VectorType)
class _VectorModel(models.PrimitiveModel):
    """Vectors are held in registers."""

    def __init__(self, manager: Any, kind: VectorType) -> None:
        super().__init__(manager, kind, _VECTORS[kind])


def _splat(builder: Any, value: Any) -> Any:
    """Return a vector of one number."""
    vector = builder.insert_element(
        ir.Constant(_VECTORS[LANES], ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(vector, ir.Constant(_VECTORS[LANES], ir.Undefined), zeros)


@lower_cast(types.Float, LANES)
@lower_cast(types.Integer, LANES)
def _number_to_lanes(context: Any, builder: Any, source: Any, _target: Any, value: Any) -> Any:
    """Lower the conversion of a number."""
    return _splat(builder, context.cast(builder, value, source, types.float64))


def _declare(function: Any, argument: VectorType, result: VectorType, lower: Any) -> None:
    """Declare an operator of one or two vectors, of which one may be a number."""
    numbers = (types.Float, types.Integer) if argument is LANES else ()

    def find_signature(kinds: Any) -> Any:
        fits = all(kind is argument or isinstance(kind, numbers) for kind in kinds)
        is_ours = argument in kinds and fits
        return signature(result, *[argument] * len(kinds)) if is_ours else None

    def implement(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return lower(builder, *values)

    _register(function, find_signature)
    for count in (1, 2):
        lower_builtin(function, *[argument] * count)(implement)


def _register(function: Any, find_signature: Callable[[Any], Any]) -> None:
    """Register the typing of a function, which finds the signature of a call."""
    contents = {
        "key": function,
        # numba tries what is for this target before its own, which takes half the time
        "metadata": {"target": "cpu"},
        "generic": lambda _, kinds, keywords: find_signature(kinds),
    }
    infer_global(function, types.Function(type("Template", (AbstractTemplate,), contents)))


def _lane_function(
    result: Any, *arguments: Any, takes_numbers: bool = False
) -> Callable[[Any], Any]:
    """Return a decorator of code that lowers a function, with types; None is any type."""
    of_number = {LANES: types.float64, MASK: types.boolean}

    def declare(function: Any) -> Any:
        def find_signature(kinds: Any) -> Any:
            pairs = zip(arguments, kinds, strict=True)
            found = [result, *(kind or given for kind, given in pairs)]
            if takes_numbers and not any(isinstance(kind, VectorType) for kind in kinds):
                found = [of_number.get(kind, kind) for kind in found]
            return signature(*found)

        def implement(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            found = function(context, builder, sig.args, *values)
            return context.get_dummy_value() if found is None else found

        _register(function, find_signature)
        lower_builtin(function, types.VarArg(types.Any))(implement)
        return function

    return declare


def _arithmetic(method: str) -> Any:
    """Return the lowering of an operation with two vectors."""
    return lambda builder, a, b: getattr(builder, method)(a, b)


def _comparison(sign: str) -> Any:
    """Return the lowering of a comparison of two vectors, false where one is not a number."""
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


def _size(builder: Any, value: Any) -> Any:
    """Lower the size of numbers."""
    kind, name = ir.FunctionType(value.type, [value.type]), f"llvm.fabs.v{WIDTH}f64"
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [value])


for _name, _method in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    for _operator in (_name, f"i{_name}"):
        _declare(getattr(operator, _operator), LANES, LANES, _arithmetic(_method))
_SIGNS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}
for _name, _sign in _SIGNS.items():
    _declare(getattr(operator, _name), LANES, MASK, _comparison(_sign))
for _name in ("and_", "or_", "xor"):
    _declare(getattr(operator, _name), MASK, MASK, _arithmetic(_name))
_declare(operator.neg, LANES, LANES, lambda builder, a: builder.fneg(a))
_declare(operator.invert, MASK, MASK, lambda builder, a: builder.not_(a))
_declare(abs, LANES, LANES, _size)


@_lane_function(LANES, LANES, LANES, takes_numbers=True)
def least(_context: Any, builder: Any, _kinds: Any, a: Any, b: Any) -> Any:
    """Return the smaller of two numbers, in each lane."""
    return builder.select(builder.fcmp_ordered("<", b, a), b, a)


@_lane_function(LANES, LANES, LANES, takes_numbers=True)
def greatest(_context: Any, builder: Any, _kinds: Any, a: Any, b: Any) -> Any:
    """Return the larger of two numbers, in each lane."""
    return builder.select(builder.fcmp_ordered(">", b, a), b, a)


@_lane_function(LANES, MASK, LANES, LANES, takes_numbers=True)
def select(_context: Any, builder: Any, _kinds: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return the first number where a condition holds, else the second, in each lane."""
    return builder.select(mask, a, b)


@_lane_function(LANES, LANES, takes_numbers=True)
def logarithm(_context: Any, builder: Any, kinds: Any, a: Any) -> Any:
    """Return the natural logarithm, in each lane."""
    kind, suffix = ir.FunctionType(a.type, [a.type]), f"v{WIDTH}f64" if kinds[0] is LANES else "f64"
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.log.{suffix}")
    return builder.call(function, [a])


@_lane_function(types.boolean, MASK, takes_numbers=True)
def any_lane(_context: Any, builder: Any, kinds: Any, mask: Any) -> Any:
    """Return whether a condition holds in any lane."""
    if kinds[0] is types.boolean:
        return mask
    bits = builder.bitcast(mask, ir.IntType(WIDTH))
    return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))


@_lane_function(types.float64, LANES, types.intp)
def lane(_context: Any, builder: Any, _kinds: Any, values: Any, number: Any) -> Any:
    """Return the number in one lane."""
    return builder.extract_element(values, number)


@_lane_function(LANES, LANES, types.intp, types.float64)
def with_lane(_context: Any, builder: Any, _kinds: Any, values: Any, place: Any, value: Any) -> Any:
    """Return the numbers with another one in one lane."""
    return builder.insert_element(values, value, place)


@_lane_function(LANES, LANES)
def spread(_context: Any, _builder: Any, _kinds: Any, value: Any) -> Any:
    """Return a number in all lanes."""
    return value  # converted by then


def _address(context: Any, builder: Any, kind: Any, array: Any, row: Any, column: Any) -> Any:
    """Return the address of a number in an array of two dimensions."""
    made = make_array(kind)(context, builder, array)
    place = builder.add(builder.mul(row, builder.extract_value(made.shape, 1)), column)
    return builder.gep(made.data, [place])


def _lanes_at(context: Any, builder: Any, kind: Any, array: Any, row: Any, first: Any) -> Any:
    """Return the address of numbers one after another."""
    address = _address(context, builder, kind, array, row, first)
    return builder.bitcast(address, _VECTORS[LANES].as_pointer())


@_lane_function(LANES, None, types.intp, types.intp)
def load(context: Any, builder: Any, kinds: Any, array: Any, row: Any, first: Any) -> Any:
    """Return numbers in a row of an array, from `first` on."""
    return builder.load(_lanes_at(context, builder, kinds[0], array, row, first), align=8)


@_lane_function(types.void, None, types.intp, types.intp, LANES)
def store(
    context: Any, builder: Any, kinds: Any, array: Any, row: Any, first: Any, values: Any
) -> None:
    """Store numbers in a row of an array, from `first` on."""
    builder.store(values, _lanes_at(context, builder, kinds[0], array, row, first), align=8)


@_lane_function(LANES, None, types.intp, None, types.intp, types.intp)
def gather(context: Any, builder: Any, kinds: Any, *values: Any) -> Any:
    """Return numbers of a row of an array at places, which a row of integers has from `first`."""
    array, row, places, side, first = values
    begin = _address(context, builder, kinds[0], array, row, ir.Constant(ir.IntType(64), 0))
    index = _address(context, builder, kinds[2], places, side, first)
    gathered: Any = ir.Constant(_VECTORS[LANES], ir.Undefined)
    for number in range(WIDTH):
        place = builder.load(builder.gep(index, [ir.Constant(ir.IntType(64), number)]))
        value = builder.load(builder.gep(begin, [place]))
        gathered = builder.insert_element(gathered, value, ir.Constant(ir.IntType(32), number))
    return gathered
