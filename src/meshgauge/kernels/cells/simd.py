"""Moving data between memory and blocks of cells: what Numba cannot say in plain Python.

A block is some cells in structure-of-arrays order, so that the arithmetic over it vectorises. Filling it one number
at a time costs one store per coordinate, all to different cache lines, and is what limits a tetrahedron: 6.3 ns against
4.8 ns with `load4`, which reads four points and writes three vectors. Connectivity and output are long streams that
the hardware prefetcher follows only while they are read, not while a block is computed: asking ahead with `prefetch`
took a million tetrahedra from 8.3 ns to 6.3 ns each, the time they need in cache.

With the JIT off the same names are plain functions.
"""

from __future__ import annotations

from typing import Any

from ..jit import JIT_DISABLED

if JIT_DISABLED:

    def widest() -> None:
        """Do nothing: Python has no vectors."""

    def prefetch(array: Any, index: Any) -> None:
        """Do nothing: a hint to the processor has no meaning in Python."""

    def prefetch_write(array: Any, index: Any) -> None:
        """Do nothing: a hint to the processor has no meaning in Python."""

    def load4(points: Any, a: Any, b: Any, c: Any, d: Any, block: Any, at: Any, n: Any) -> None:
        """Copy the points that start at a, b, c, d of a flat array to rows x, y, z of a block."""
        for lane, first in enumerate((a, b, c, d)):
            for axis in range(3):
                block[int(at) + int(n) * axis + lane] = points[int(first) + axis]

else:
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic

    def _data(context: Any, builder: Any, numba_type: Any, value: Any) -> Any:
        return context.make_array(numba_type)(context, builder, value).data

    @intrinsic
    def widest(typingctx: Any) -> Any:
        """In the first line of a kernel: let LLVM use the widest vectors that the processor has.

        It prefers 256 bits where 512 might lower the clock; the arithmetic of a block gains more than that costs.
        """

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            # llvmlite's own `add` takes only attributes without a value.
            set.add(builder.function.attributes, '"prefer-vector-width"="512"')
            return context.get_dummy_value()

        return types.void(), codegen

    def _prefetch(write: int) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            pointer = builder.gep(_data(context, builder, signature.args[0], args[0]), [args[1]])
            pointer = builder.bitcast(pointer, ir.IntType(8).as_pointer())
            word = ir.IntType(32)
            shape = ir.FunctionType(ir.VoidType(), [pointer.type, word, word, word])
            function = cgutils.get_or_insert_function(builder.module, shape, "llvm.prefetch.p0i8")
            # Locality 3 (keep in all caches), 1 for data rather than instructions.
            builder.call(function, [pointer, *(ir.Constant(word, n) for n in (write, 3, 1))])
            return context.get_dummy_value()

        return codegen

    @intrinsic
    def prefetch(typingctx: Any, array: Any, index: Any) -> Any:
        """Ask for the cache line of ``array[index]``. The index may lie outside: nothing is read."""
        return types.void(array, index), _prefetch(0)

    @intrinsic
    def prefetch_write(typingctx: Any, array: Any, index: Any) -> Any:
        """Ask for the cache line of ``array[index]``, to be written. The index may lie outside."""
        return types.void(array, index), _prefetch(1)

    @intrinsic
    def load4(typingctx: Any, points: Any, a: Any, b: Any, c: Any, d: Any, block: Any, at: Any, n: Any) -> Any:
        """Copy the points that start at a, b, c, d of a flat array to rows x, y, z of a block, n apart.

        ``block[at : at + 4]`` receives the four x, ``block[at + n : ...]`` the y, ``block[at + 2 * n : ...]`` the z, as
        float64.
        """

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            source = _data(context, builder, signature.args[0], args[0])
            target = _data(context, builder, signature.args[5], args[5])
            real, double, word = source.type.pointee, ir.DoubleType(), ir.IntType(32)
            pair, pair_double = ir.VectorType(real, 2), ir.VectorType(double, 2)
            four = ir.VectorType(double, 4)
            is_single = isinstance(real, ir.FloatType)

            def picked(first: Any, second: Any, *lanes: int) -> Any:
                mask = ir.Constant(ir.VectorType(word, 4), [ir.Constant(word, n) for n in lanes])
                return builder.shuffle_vector(first, second, mask)

            pairs, thirds = [], []
            for start in args[1:5]:
                pointer = builder.gep(source, [start])
                xy = builder.load(builder.bitcast(pointer, pair.as_pointer()))
                xy.align = 4 if is_single else 8
                z = builder.load(builder.gep(pointer, [ir.Constant(ir.IntType(64), 2)]))
                pairs.append(builder.fpext(xy, pair_double) if is_single else xy)
                thirds.append(builder.fpext(z, double) if is_single else z)
            low = picked(pairs[0], pairs[2], 0, 1, 2, 3)
            high = picked(pairs[1], pairs[3], 0, 1, 2, 3)
            z4 = ir.Constant(four, ir.Undefined)
            for lane, z in enumerate(thirds):
                z4 = builder.insert_element(z4, z, ir.Constant(word, lane))
            rows = (picked(low, high, 0, 4, 2, 6), picked(low, high, 1, 5, 3, 7), z4)
            for axis, row in enumerate(rows):
                offset = builder.add(args[6], builder.mul(args[7], ir.Constant(args[7].type, axis)))
                stored = builder.store(row, builder.bitcast(builder.gep(target, [offset]), four.as_pointer()))
                stored.align = 8
            return context.get_dummy_value()

        return types.void(points, a, b, c, d, block, at, n), codegen
