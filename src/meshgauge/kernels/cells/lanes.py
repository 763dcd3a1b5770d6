"""Numbers of several cells side by side, on which kernels compute as on one: what Numba cannot say in plain Python.

LLVM makes vectors of a loop over cells only where it can prove a lot, and then of all of the loop at once. Said so, the
instructions come in the order in which they are written, and what fetches the next cells can stand between them: a
processor looks a few hundred instructions ahead, and does both at once.

`N` cells: eight where there are registers of 512 bits, else four. Numbers mixed with them are taken for all cells. Each
operation does to a cell what it does to a number, to the last bit; ``a * b + c`` may be rounded once, as in a
`fused_kernel`. With the JIT off arrays of NumPy stand for them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..jit import JIT_DISABLED

if JIT_DISABLED:
    N = 8
    """Cells side by side."""

    where, root, signed = np.where, np.sqrt, np.copysign

    def take(array: Any, at: Any) -> Any:
        """``array[at : at + N]``, float64."""
        return array[int(at) : int(at) + N].copy()

    def put(array: Any, at: Any, values: Any) -> None:
        """``array[at : at + N] = values``, to an array of float64."""
        array[int(at) : int(at) + N] = values

    def put_flags(array: Any, at: Any, flags: Any) -> None:
        """The same of what is true or not, to an array of uint8."""
        array[int(at) : int(at) + N] = flags

    def low(a: Any, b: Any) -> Any:
        """The lesser of two; the second if one is NaN."""
        return np.where(a < b, a, b)

    def high(a: Any, b: Any) -> Any:
        """The greater of two; the second if one is NaN."""
        return np.where(a > b, a, b)

    def fold(a: Any, b: Any) -> Any:
        """The lesser of two positive numbers; else the negative one next to 0. Neither is 0 or NaN."""
        return np.where(a.view(np.int64) < b.view(np.int64), a, b)

    def bits(flags: Any) -> Any:
        """A number that is 0 if none of them is true."""
        return int(flags.any())

else:
    import operator
    from collections.abc import Callable

    import numba
    from llvmlite import ir
    from llvmlite.binding import get_host_cpu_features
    from numba import types
    from numba.core import cgutils
    from numba.core.typeconv import Conversion
    from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
    from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

    N = 8 if "+avx512f" in (numba.config.CPU_FEATURES or get_host_cpu_features().flatten()).split(",") else 4

    _DOUBLES, _FLAGS = ir.VectorType(ir.DoubleType(), N), ir.VectorType(ir.IntType(1), N)
    _INTEGERS, _BYTES = ir.VectorType(ir.IntType(64), N), ir.VectorType(ir.IntType(8), N)

    class _Lanes(types.Type):  # type: ignore[misc]  # Numba is not typed
        """N doubles."""

        def can_convert_from(self, typingctx: Any, other: Any) -> Any:
            return Conversion.safe if isinstance(other, types.Float) else None

    class _Flags(types.Type):  # type: ignore[misc]
        """N comparisons."""

    _lanes, _flags = _Lanes("Lanes"), _Flags("Flags")

    @register_model(_Lanes)
    class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
        def __init__(self, manager: Any, numba_type: Any) -> None:
            super().__init__(manager, numba_type, _DOUBLES)

    @register_model(_Flags)
    class _FlagsModel(models.PrimitiveModel):  # type: ignore[misc]
        def __init__(self, manager: Any, numba_type: Any) -> None:
            super().__init__(manager, numba_type, _FLAGS)

    @lower_cast(types.Float, _lanes)
    def _for_all(context: Any, builder: Any, from_type: Any, to_type: Any, value: Any) -> Any:
        words, none = ir.VectorType(ir.IntType(32), N), ir.Constant(_DOUBLES, ir.Undefined)
        value = context.cast(builder, value, from_type, types.float64)
        first = builder.insert_element(none, value, ir.IntType(32)(0))
        return builder.shuffle_vector(first, none, ir.Constant(words, [0] * N))

    def _means(function: Any, numba_type: Any, build: Callable[..., Any], n: int = 2) -> None:
        """Have an operator or a function of Python do that to n arguments that are lanes, or flags."""
        given = (_flags if numba_type == _flags and function is operator.and_ else _lanes,) * n

        class _Template(ConcreteTemplate):  # type: ignore[misc]
            cases = [signature(numba_type, *given)]  # noqa: RUF012  as Numba has it

        infer_global(function)(_Template)
        lower_builtin(function, *given)(lambda context, builder, signature, args: build(builder, *args))

    def _of_llvm(builder: Any, name: str, *args: Any) -> Any:
        shape = ir.FunctionType(_DOUBLES, [_DOUBLES] * len(args))
        return builder.call(cgutils.get_or_insert_function(builder.module, shape, f"llvm.{name}.v{N}f64"), args)

    _means(operator.add, _lanes, lambda builder, a, b: builder.fadd(a, b, flags=("contract",)))
    _means(operator.sub, _lanes, lambda builder, a, b: builder.fsub(a, b, flags=("contract",)))
    _means(operator.mul, _lanes, lambda builder, a, b: builder.fmul(a, b, flags=("contract",)))
    _means(operator.truediv, _lanes, lambda builder, a, b: builder.fdiv(a, b))
    _means(operator.neg, _lanes, lambda builder, a: builder.fneg(a), 1)
    _means(abs, _lanes, lambda builder, a: _of_llvm(builder, "fabs", a), 1)
    _means(operator.lt, _flags, lambda builder, a, b: builder.fcmp_ordered("<", a, b))
    _means(operator.gt, _flags, lambda builder, a, b: builder.fcmp_ordered(">", a, b))
    _means(operator.ne, _flags, lambda builder, a, b: builder.fcmp_unordered("!=", a, b))
    _means(operator.and_, _flags, lambda builder, a, b: builder.and_(a, b))

    def _built(build: Callable[..., Any]) -> Callable[..., Any]:
        return lambda context, builder, signature, args: build(builder, *args)

    @intrinsic
    def where(typingctx: Any, flags: Any, a: Any, b: Any) -> Any:
        """One where the flag is true, the other elsewhere."""
        return _lanes(_flags, _lanes, _lanes), _built(lambda builder, flags, a, b: builder.select(flags, a, b))

    @intrinsic
    def root(typingctx: Any, a: Any) -> Any:
        """The square root."""
        return _lanes(_lanes), _built(lambda builder, a: _of_llvm(builder, "sqrt", a))

    @intrinsic
    def signed(typingctx: Any, a: Any, b: Any) -> Any:
        """The size of the one with the sign of the other."""
        return _lanes(_lanes, _lanes), _built(lambda builder, a, b: _of_llvm(builder, "copysign", a, b))

    @intrinsic
    def low(typingctx: Any, a: Any, b: Any) -> Any:
        """The lesser of two; the second if one is NaN."""
        return _lanes(_lanes, _lanes), _built(
            lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b)
        )

    @intrinsic
    def high(typingctx: Any, a: Any, b: Any) -> Any:
        """The greater of two; the second if one is NaN."""
        return _lanes(_lanes, _lanes), _built(
            lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b)
        )

    @intrinsic
    def fold(typingctx: Any, a: Any, b: Any) -> Any:
        """The lesser of two positive numbers; else the negative one next to 0. Neither is 0 or NaN.

        As integers, numbers are in this order.
        """

        def build(builder: Any, a: Any, b: Any) -> Any:
            a, b = builder.bitcast(a, _INTEGERS), builder.bitcast(b, _INTEGERS)
            return builder.bitcast(builder.select(builder.icmp_signed("<", a, b), a, b), _DOUBLES)

        return _lanes(_lanes, _lanes), _built(build)

    @intrinsic
    def bits(typingctx: Any, flags: Any) -> Any:
        """A number that is 0 if none of them is true."""
        return types.int64(_flags), _built(
            lambda builder, flags: builder.zext(builder.bitcast(flags, ir.IntType(N)), ir.IntType(64))
        )

    def _place(context: Any, builder: Any, signature: Any, args: Any, vector: Any) -> Any:
        """Where in the array, which comes first, the vector starts, of which the second argument says the place."""
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        return builder.bitcast(builder.gep(data, [args[1]]), vector.as_pointer())

    @intrinsic
    def take(typingctx: Any, array: Any, at: Any) -> Any:
        """``array[at : at + N]``, float64."""

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            values = builder.load(_place(context, builder, signature, args, _DOUBLES))
            values.align = 8
            return values

        return _lanes(array, at), codegen

    @intrinsic
    def put(typingctx: Any, array: Any, at: Any, values: Any) -> Any:
        """``array[at : at + N] = values``, to an array of float64."""

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            place = _place(context, builder, signature, args, _DOUBLES)
            builder.store(args[2], place).align = 8
            return context.get_dummy_value()

        return types.void(array, at, _lanes), codegen

    @intrinsic
    def put_flags(typingctx: Any, array: Any, at: Any, flags: Any) -> Any:
        """The same of what is true or not, to an array of uint8."""

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            place = _place(context, builder, signature, args, _BYTES)
            builder.store(builder.zext(args[2], _BYTES), place).align = 1
            return context.get_dummy_value()

        return types.void(array, at, _flags), codegen
