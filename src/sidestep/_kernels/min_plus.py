"""The inner loop of every search over a lattice: the minimum over many shifted rows, kept in registers.

A loop over taps outside and cells inside reads and writes the result once per tap; what is written here keeps `WIDTH`
results in registers while all taps pass. The compiler does not find that by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from sidestep.types import IntArray

WIDTH = 16
"""Results at a time. Rows are read and written in whole multiples of it: what lies behind them must be there to be
read, and is overwritten by numbers without meaning."""
_LINE = ir.VectorType(ir.FloatType(), WIDTH)


def _line(builder: Any, data: Any, at: Any) -> Any:
    """Pointer to a line of floats that starts anywhere."""
    return builder.bitcast(builder.gep(data, [at]), _LINE.as_pointer())


def _read(builder: Any, data: Any, at: Any) -> Any:
    line = builder.load(_line(builder, data, at))
    line.align = 4
    return line


def _everywhere(builder: Any, number: Any) -> Any:
    """The same number in the whole line."""
    first = builder.insert_element(ir.Constant(_LINE, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), None)
    return builder.shuffle_vector(first, ir.Constant(_LINE, ir.Undefined), zeros)


def _generate(tables: int, context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Code for `lower` and `lower_by_two`, which differ in how many tables are added up."""
    number = ir.IntType(64)
    first, last = arguments[:2]
    begin, length = arguments[-2:]
    data = [
        context.make_array(t)(context, builder, v).data if isinstance(t, types.Array) else None
        for t, v in zip(signature.args, arguments, strict=True)
    ]
    lowest = cgutils.alloca_once(builder, _LINE)
    with cgutils.for_range_slice(builder, number(0), length, number(WIDTH), number) as (at, _):
        place = builder.add(begin, at)
        builder.store(_read(builder, data[-3], place), lowest)
        bases = [builder.add(arguments[5 + 3 * n], at) for n in range(tables)]
        with cgutils.for_range_slice(builder, first, last, number(1), number) as (tap, _):
            total = _everywhere(builder, builder.load(builder.gep(data[2], [tap])))
            for n in range(tables):
                shift = builder.load(builder.gep(data[4 + 3 * n], [tap]))
                total = builder.fadd(total, _read(builder, data[3 + 3 * n], builder.add(bases[n], shift)))
            known = builder.load(lowest)
            builder.store(builder.select(builder.fcmp_ordered("<", total, known), total, known), lowest)
        builder.store(builder.load(lowest), _line(builder, data[-3], place)).align = 4
    return context.get_dummy_value()


@intrinsic
def _lower(
    typingctx: Any, first: Any, last: Any, costs: Any, table: Any, shifts: Any, base: Any, out: Any, at: Any, n: Any
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _generate(1, context, builder, signature, arguments)

    whole = types.int64
    return types.void(whole, whole, costs, table, shifts, whole, out, whole, whole), generate


@intrinsic
def _lower_by_two(
    typingctx: Any, first: Any, last: Any, costs: Any, table: Any, shifts: Any, base: Any, other: Any, moves: Any,
    start: Any, out: Any, at: Any, n: Any,
) -> Any:  # fmt: skip
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _generate(2, context, builder, signature, arguments)

    whole = types.int64
    return types.void(
        whole, whole, costs, table, shifts, whole, other, moves, whole, out, whole, whole
    ), generate  # fmt: skip


Costs = NDArray[np.float32]

lower = cast("Callable[[int, int, Costs, Costs, IntArray, int, Costs, int, int], None]", _lower)
"""out[at + i] = min(out[at + i], min_t costs[t] + table[base + shifts[t] + i]), first ≤ t < last, 0 ≤ i < n.

The arguments are first, last, costs, table, shifts, base, out, at and n.
"""
lower_by_two = cast(
    "Callable[[int, int, Costs, Costs, IntArray, int, Costs, IntArray, int, Costs, int, int], None]", _lower_by_two
)
"""The same with a second table, its shifts and its base beside the first ones: costs + table + other."""
