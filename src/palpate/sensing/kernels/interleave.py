"""Writing three rows as an array of 3-vectors, eight at a time.

The compiler's own choice for this pattern is 24 single stores; whole vectors take a third of the time and
leave the store buffer free to drain while the next block is computed. LLVM lowers the shuffle to what the
processor has, so this is as portable as the rest.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

LANES = 8
"""Vectors written per call."""


@intrinsic
def store_interleaved(
    typing_context: Any, target: Any, offset: Any, rows: Any, first_row: Any, row_length: Any
) -> Any:
    """Write target[offset + 3 i + c] = rows[first_row + c row_length + i] for i < LANES, c < 3.

    Both arrays are contiguous, of float64; nothing is checked.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to, frm = (context.make_array(signature.args[i])(context, builder, arguments[i]).data for i in (0, 2))
        lanes = ir.VectorType(ir.DoubleType(), LANES)
        index_type = ir.IntType(32)

        def at(base: Any, index: Any) -> Any:
            return builder.bitcast(builder.gep(base, [index]), lanes.as_pointer())

        def shuffle(a: Any, b: Any, order: list[int]) -> Any:
            constants = [ir.Constant(index_type, i) for i in order]
            mask = ir.Constant(ir.VectorType(index_type, len(order)), constants)
            return builder.shuffle_vector(a, b, mask)

        start, components = arguments[3], []
        for _ in range(3):
            components.append(builder.load(at(frm, start), align=8))
            start = builder.add(start, arguments[4])
        x, y, z = components
        xy = shuffle(x, y, list(range(2 * LANES)))
        zz = shuffle(z, z, list(range(LANES)) * 2)
        for part in range(3):
            # element e of the target is component e % 3 of vector e // 3; z stands behind x and y
            order = [(e % 3) * LANES + e // 3 for e in range(part * LANES, (part + 1) * LANES)]
            position = builder.add(arguments[1], ir.Constant(ir.IntType(64), part * LANES))
            builder.store(shuffle(xy, zz, order), at(to, position), align=8)
        return context.get_dummy_value()

    return types.void(target, types.intp, rows, types.intp, types.intp), generate
