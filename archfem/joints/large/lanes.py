"""Eight numbers at a time: vectors of the processor as numbers of compiled kernels.

A kernel without branches computes eight joints at the time of one, where its numbers are `LANES`
and what it compares is a `MASK`. `select` takes the place of a condition. Numba makes such vectors
by itself in simple loops only.
"""

import operator
from typing import Any, ClassVar

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model
from numba.np.arrayobj import make_array

# mypy: disable-error-code="no-untyped-call,untyped-decorator"

WIDTH = 8


class VectorType(types.Type):
    """Type of vectors of numbers or of conditions."""

    def unify(self, typingctx: Any, other: types.Type) -> types.Type | None:
        """Return this type for a variable that is a number elsewhere."""
        del typingctx
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
def _number_to_lanes(context: Any, builder: Any, source: Any, target: Any, value: Any) -> Any:
    """Lower the conversion of a number."""
    del target
    return _splat(builder, context.cast(builder, value, source, types.float64))


def _declare(function: Any, argument: VectorType, result: VectorType, lower: Any) -> None:
    """Declare an operator of one or two vectors, of which one may be a number."""

    @infer_global(function)
    class Template(AbstractTemplate):
        # numba tries templates for this target before its own many, which takes half the time
        metadata: ClassVar[dict[str, str]] = {"target": "cpu"}

        def generic(self, args: Any, kws: Any) -> Any:
            del kws
            numbers = (types.Float, types.Integer) if argument is LANES else ()
            fits = all(each is argument or isinstance(each, numbers) for each in args)
            if argument in args and fits:
                return signature(result, *[argument] * len(args))
            return None

    def implement(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        del context, sig
        return lower(builder, *values)

    for count in (1, 2):
        lower_builtin(function, *[argument] * count)(implement)


def _arithmetic(method: str) -> Any:
    """Return the lowering of an operation with two vectors."""
    return lambda builder, a, b: getattr(builder, method)(a, b)


def _comparison(sign: str) -> Any:
    """Return the lowering of a comparison of two vectors, false where one is not a number."""
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


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


def _size(builder: Any, value: Any) -> Any:
    """Lower the size of numbers."""
    kind = ir.FunctionType(value.type, [value.type])
    name = f"llvm.fabs.v{WIDTH}f64"
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [value])


_declare(abs, LANES, LANES, _size)


# Declares a function of vectors by its lowering, for kernels; Python cannot call it.
_lane_function: Any = intrinsic


@_lane_function
def least(typingctx: Any, a: Any, b: Any) -> Any:
    """Return the smaller of two numbers, in each lane."""
    del typingctx, a, b

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.select(builder.fcmp_ordered("<", args[1], args[0]), args[1], args[0])

    return signature(LANES, LANES, LANES), generate


@_lane_function
def greatest(typingctx: Any, a: Any, b: Any) -> Any:
    """Return the larger of two numbers, in each lane."""
    del typingctx, a, b

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.select(builder.fcmp_ordered(">", args[1], args[0]), args[1], args[0])

    return signature(LANES, LANES, LANES), generate


@_lane_function
def select(typingctx: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return the first number where a condition holds, else the second, in each lane."""
    del typingctx, mask, a, b

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.select(*args)

    return signature(LANES, MASK, LANES, LANES), generate


@_lane_function
def any_lane(typingctx: Any, mask: Any) -> Any:
    """Return whether a condition holds in any lane."""
    del typingctx, mask

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        bits = builder.bitcast(args[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return signature(types.boolean, MASK), generate


def _row_pointer(context: Any, builder: Any, kind: Any, array: Any, row: Any, first: Any) -> Any:
    """Return the address of numbers in a row of an array."""
    made = make_array(kind)(context, builder, array)
    length = builder.extract_value(made.shape, 1)
    place = builder.add(builder.mul(row, length), first)
    return builder.gep(made.data, [place])


@_lane_function
def load(typingctx: Any, array: Any, row: Any, first: Any) -> Any:
    """Return numbers in a row of an array, from `first` on."""
    del typingctx

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer = _row_pointer(context, builder, sig.args[0], *args)
        pointer = builder.bitcast(pointer, _VECTORS[LANES].as_pointer())
        return builder.load(pointer, align=8)

    return signature(LANES, array, types.intp, types.intp), generate


@_lane_function
def store(typingctx: Any, array: Any, row: Any, first: Any, value: Any) -> Any:
    """Store numbers in a row of an array, from `first` on."""
    del typingctx, value

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer = _row_pointer(context, builder, sig.args[0], *args[:3])
        pointer = builder.bitcast(pointer, _VECTORS[LANES].as_pointer())
        builder.store(args[3], pointer, align=8)
        return context.get_dummy_value()

    return signature(types.void, array, types.intp, types.intp, LANES), generate


@_lane_function
def gather(typingctx: Any, array: Any, row: Any, places: Any, side: Any, first: Any) -> Any:
    """Return numbers of a row of an array at places, which a row of integers has from `first`."""
    del typingctx

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        array, row, places, side, first = args
        index = _row_pointer(context, builder, sig.args[2], places, side, first)
        begin = _row_pointer(
            context, builder, sig.args[0], array, row, ir.Constant(ir.IntType(64), 0)
        )
        vector: Any = ir.Constant(_VECTORS[LANES], ir.Undefined)
        for lane in range(WIDTH):
            place = builder.load(builder.gep(index, [ir.Constant(ir.IntType(64), lane)]))
            value = builder.load(builder.gep(begin, [place]))
            vector = builder.insert_element(vector, value, ir.Constant(ir.IntType(32), lane))
        return vector

    return signature(LANES, array, types.intp, places, types.intp, types.intp), generate


@_lane_function
def lane(typingctx: Any, values: Any, number: Any) -> Any:
    """Return the number in one lane."""
    del typingctx, values, number

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.extract_element(*args)

    return signature(types.float64, LANES, types.intp), generate


@_lane_function
def with_lane(typingctx: Any, values: Any, number: Any, value: Any) -> Any:
    """Return the numbers with another one in one lane."""
    del typingctx, values, number, value

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        values, number, value = args
        return builder.insert_element(values, value, number)

    return signature(LANES, LANES, types.intp, types.float64), generate


@_lane_function
def spread(typingctx: Any, value: Any) -> Any:
    """Return a number in all lanes."""
    del typingctx, value

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return _splat(builder, args[0])

    return signature(LANES, types.float64), generate
