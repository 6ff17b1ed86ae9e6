"""Between arrays of small vectors and arrays of components, eight vectors at a time.

The compiler's own choice for these patterns is one load and store per number; shuffling whole registers takes a
third of the time and leaves the store buffer free to drain while the next block is computed. LLVM lowers the
shuffles to what the processor has, so this is as portable as the rest.
"""

from typing import Any

from llvmlite import ir
from numba import types

from palpate.sensing.kernels.intrinsic import intrinsic

LANES = 8
"""Vectors moved per call."""

_INDEX = ir.IntType(32)


def _at(builder: Any, base: Any, index: Any, width: int) -> Any:
    """Pointer to LANES * width numbers from base[index] on."""
    block = ir.VectorType(ir.DoubleType(), LANES * width)
    return builder.bitcast(builder.gep(base, [index]), block.as_pointer())


def _shuffle(builder: Any, a: Any, b: Any, order: list[int]) -> Any:
    mask = ir.Constant(ir.VectorType(_INDEX, len(order)), [ir.Constant(_INDEX, i) for i in order])
    return builder.shuffle_vector(a, b, mask)


def _data(context: Any, builder: Any, signature: Any, arguments: Any, index: int) -> Any:
    return context.make_array(signature.args[index])(context, builder, arguments[index]).data


@intrinsic
def load_wrenches(
    typing_context: Any, wrenches: Any, offset: Any, rows: Any, first_row: Any, row_length: Any
) -> Any:
    """Write rows[first_row + c row_length + i] = wrenches[offset + 6 i + c] for i < LANES, c < 6.

    Both arrays are contiguous, of float64, and flat or not; nothing is checked.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        given = _data(context, builder, signature, arguments, 0)
        to = _data(context, builder, signature, arguments, 2)
        block = builder.load(_at(builder, given, arguments[1], 6), align=8)
        row = arguments[3]
        for component in range(6):
            order = [6 * i + component for i in range(LANES)]
            builder.store(_shuffle(builder, block, block, order), _at(builder, to, row, 1), align=8)
            row = builder.add(row, arguments[4])
        return context.get_dummy_value()

    return types.void(wrenches, types.intp, rows, types.intp, types.intp), generate


def _store(builder: Any, value: Any, pointer: Any, streaming: bool) -> None:
    """Store a register; past the caches if `streaming`, which needs an address that is a multiple of 64 bytes."""
    stored = builder.store(value, pointer, align=64 if streaming else 8)
    if streaming:
        stored.set_metadata("nontemporal", builder.module.add_metadata([ir.Constant(_INDEX, 1)]))


def _vector_store(streaming: bool) -> Any:
    @intrinsic
    def store(typing_context: Any, target: Any, offset: Any, rows: Any, first_row: Any, row_length: Any) -> Any:
        """Write target[offset + 3 i + c] = rows[first_row + c row_length + i] for i < LANES, c < 3.

        Both arrays are contiguous, of float64; nothing is checked.
        """

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            to = _data(context, builder, signature, arguments, 0)
            given = _data(context, builder, signature, arguments, 2)
            components, row = [], arguments[3]
            for _ in range(3):
                components.append(builder.load(_at(builder, given, row, 1), align=8))
                row = builder.add(row, arguments[4])
            x, y, z = components
            xy = _shuffle(builder, x, y, list(range(2 * LANES)))
            zz = _shuffle(builder, z, z, list(range(LANES)) * 2)
            for part in range(3):
                # element e of the target is component e % 3 of vector e // 3; z stands behind x and y
                order = [(e % 3) * LANES + e // 3 for e in range(part * LANES, (part + 1) * LANES)]
                position = builder.add(arguments[1], ir.Constant(ir.IntType(64), part * LANES))
                _store(builder, _shuffle(builder, xy, zz, order), _at(builder, to, position, 1), streaming)
            return context.get_dummy_value()

        return types.void(target, types.intp, rows, types.intp, types.intp), generate

    return store


store_vectors = _vector_store(streaming=False)
stream_vectors = _vector_store(streaming=True)
"""As `store_vectors`, past the caches: the target must be aligned to 64 bytes, the offset to LANES numbers. For
results larger than the caches this saves reading every line before it is written."""


@intrinsic
def stream_row(typing_context: Any, target: Any, offset: Any, rows: Any, first_row: Any) -> Any:
    """Write target[offset + i] = rows[first_row + i] for i < LANES past the caches; see `stream_vectors`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        to = _data(context, builder, signature, arguments, 0)
        given = _data(context, builder, signature, arguments, 2)
        row = builder.load(_at(builder, given, arguments[3], 1), align=8)
        _store(builder, row, _at(builder, to, arguments[1], 1), streaming=True)
        return context.get_dummy_value()

    return types.void(target, types.intp, rows, types.intp), generate


@intrinsic
def fence(typing_context: Any) -> Any:
    """Make streamed results visible to other threads before anything that follows."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(), generate
