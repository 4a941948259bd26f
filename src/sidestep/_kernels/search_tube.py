"""Which cells the cheapest motion may visit: those that are not too dear even if there were no risk.

Without risk a step costs its effort and what is paid where it ends. Where effort is a sum over axes, the least of that
needs one axis at a time; where it is not, it is taken for nothing. What a motion through a cell costs at least is then
what the way there and the way on cost; cells that pass a bound are left out of the search, and as long as what is found
costs no more than the bound, nothing is missed.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.min_plus import WIDTH, lower
from sidestep._kernels.options import KERNEL
from sidestep._kernels.search_costs import Costs, cells_of, grow_into, grown, row_at
from sidestep.types import IntArray


@njit(**KERNEL)
def axis_efforts(radius: int, taps: IntArray, effort: Costs) -> Costs:
    """Efforts (3, 2K+1) per axis and displacement whose sum is at most the effort of every tap."""
    out = np.full((3, 2 * radius + 1), np.float32(np.inf))
    for t in range(taps.shape[0]):
        for a in range(3):
            for c in (radius - taps[t, a], radius + taps[t, a]):
                out[a, c] = min(out[a, c], effort[t])
    for t in range(taps.shape[0]):
        total = out[0, taps[t, 0] + radius] + out[1, taps[t, 1] + radius] + out[2, taps[t, 2] + radius]
        if total > effort[t] * np.float32(1.000001) + np.float32(1e-9):
            return np.zeros((3, 2 * radius + 1), np.float32)
    return out


@njit(**KERNEL)
def _windows(radius: int, active: IntArray, taps: IntArray) -> IntArray:
    """How far (2K+1, 2K+1) taps reach along the last axis, by their displacements along the others; −1: none."""
    out = np.full((2 * radius * active[0] + 1, 2 * radius * active[1] + 1), -1, np.int64)
    for t in range(taps.shape[0]):
        a, b, c = taps[t, 0], taps[t, 1], abs(taps[t, 2])
        for sign in (-1, 1):
            i, j = sign * a + radius * active[0], sign * b + radius * active[1]
            out[i, j] = max(out[i, j], c)
    return out


@njit(**KERNEL)
def _clear(out: Costs, at: int, count: int) -> None:
    for n in range(np.uintp(at), np.uintp(at + count)):
        out[n] = np.inf


@njit(**KERNEL)
def _add_stage(
    low: IntArray, size: IntArray, known: Costs, stage: Costs, blocked: NDArray[np.bool_], out: Costs
) -> None:
    """What is `known` over a box and the stage cost of its cells; walls are forbidden."""
    h0, h1, h2 = stage.shape[0] // 2, stage.shape[1] // 2, stage.shape[2] // 2
    at = 0
    for i in range(low[0] + h0, low[0] + h0 + size[0]):
        for j in range(low[1] + h1, low[1] + h1 + size[1]):
            row, source = out[at : at + size[2]], known[at : at + size[2]]
            goal = stage[i, j, low[2] + h2 : low[2] + h2 + size[2]]
            for n in range(np.uintp(size[2])):
                row[n] = source[n] + goal[n]
            if blocked.size > 0:
                wall = blocked[i, j, low[2] + h2 : low[2] + h2 + size[2]]
                for n in range(np.uintp(size[2])):
                    row[n] = np.inf if wall[n] else row[n]
            at += size[2]


@njit(**KERNEL)
def _spread(
    radius: int, active: IntArray, efforts: Costs, windows: IntArray, source: Costs, size: IntArray, out: Costs
) -> None:
    """Least of effort and `source` at the end of a tap, for all cells of a box.

    Args:
        radius: K, with
        active: (3,),
        efforts: of `axis_efforts`, and
        windows: of `_windows`.
        source: over a box larger by K on all sides, and `WIDTH` more.
        size: (3,) of the box.
        out: over the box, and `WIDTH` more.
    """
    v = grown(size, size, radius, radius, active)[1]
    rows = v[0] * v[1]
    kinds = np.zeros(radius + 1, np.int64)  # where the rows lie that a window was taken of
    used = 0
    for i in range(windows.shape[0]):
        for j in range(windows.shape[1]):
            w = windows[i, j]
            if w >= 0 and kinds[w] == 0:
                used += 1
                kinds[w] = used
    along = np.empty(used * rows * size[2] + WIDTH, np.float32)
    inside = np.arange(2 * radius + 1)
    for w in range(radius + 1):
        if kinds[w] == 0:
            continue
        for n in range(rows):
            at = ((kinds[w] - 1) * rows + n) * size[2]
            _clear(along, at, size[2])
            lower(radius - w, radius + w + 1, efforts[2], source, inside, n * v[2], along, at, size[2])
    costs = np.empty(windows.size, np.float32)
    shifts = np.empty(windows.size, np.int64)
    count = 0
    for i in range(windows.shape[0]):
        for j in range(windows.shape[1]):
            if windows[i, j] >= 0:
                e0 = efforts[0, i + radius * (1 - active[0])]  # a missing axis has one displacement
                e1 = efforts[1, j + radius * (1 - active[1])]
                costs[count] = e0 + e1
                shifts[count] = ((kinds[windows[i, j]] - 1) * rows + i * v[1] + j) * size[2]
                count += 1
    for i in range(size[0]):
        for j in range(size[1]):
            at = (i * size[1] + j) * size[2]
            _clear(out, at, size[2])
            lower(0, count, costs, along, shifts, (i * v[1] + j) * size[2], out, at, size[2])


@njit(**KERNEL)
def costs_to_go(
    horizon: int,
    radius: int,
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    stage: Costs,
    terminal: Costs,
    blocked: NDArray[np.bool_],
) -> tuple[Costs, IntArray]:
    """What is paid at least after each step 1..N, over all cells that can be reached by then.

    Args:
        horizon: as for `search.solve`, and so are the other arguments.
        radius: K.
        active: (3,).
        taps: (n, 3).
        effort: (n,).
        stage: (2KN+1 per active axis).
        terminal: the same shape.
        blocked: the same shape, or empty.

    Returns:
        costs (flat), one box after another, and (N + 2,) where they start.
    """
    efforts, windows = axis_efforts(radius, taps, effort), _windows(radius, active, taps)
    low, size = np.zeros((horizon + 1, 3), np.int64), np.ones((horizon + 1, 3), np.int64)
    begin = np.zeros(horizon + 2, np.int64)
    for k in range(1, horizon + 1):
        grow_into(low[0], size[0], radius * k, radius * k, active, low[k], size[k])
        begin[k + 1] = begin[k] + cells_of(size[k])
    out = np.empty(begin[horizon + 1] + WIDTH, np.float32)
    at = begin[horizon]
    for i in range(terminal.shape[0]):
        for j in range(terminal.shape[1]):
            for k in range(terminal.shape[2]):
                out[at] = terminal[i, j, k]
                at += 1
    arrive, first = np.empty(stage.size + WIDTH, np.float32), np.empty(WIDTH, np.float32)
    for k in range(horizon - 1, 0, -1):
        following = out[begin[k + 1] :]
        _add_stage(low[k + 1], size[k + 1], following, stage, blocked, arrive)
        for n in range(WIDTH):  # whole lines are written, into the next box too
            first[n] = following[n]
        _spread(radius, active, efforts, windows, arrive, size[k], out[begin[k] :])
        for n in range(WIDTH):
            following[n] = first[n]
    return out, begin


@njit(**KERNEL)
def _boxes_between(
    low: IntArray, size: IntArray, radius: int, active: IntArray, more: int
) -> tuple[IntArray, IntArray]:
    """Boxes (2N + 1, 3) at the half instants: those of the steps, and what lies halfway between them.

    Args:
        low: (N + 1, 3) lowest cells at the steps, counted from the start.
        size: (N + 1, 3) cells.
        radius: K.
        active: (3,).
        more: cells around, as far as the robot can get.
    """
    blocks = 2 * low.shape[0] - 1
    first, count = np.zeros((blocks, 3), np.int64), np.ones((blocks, 3), np.int64)
    for b in range(1, blocks):
        reach = (radius * b + 1) // 2
        one, other = b // 2, (b + 1) // 2
        for a in range(3):
            if active[a]:
                last = (low[one, a] + size[one, a] + low[other, a] + size[other, a] - 1) >> 1
                first[b, a] = max(((low[one, a] + low[other, a]) >> 1) - more, -reach)
                count[b, a] = min(last + more, reach) - first[b, a] + 1
    return first, count


@njit(**KERNEL)
def tube(
    horizon: int,
    radius: int,
    active: IntArray,
    taps: IntArray,
    effort: Costs,
    first: Costs,
    stage: Costs,
    blocked: NDArray[np.bool_],
    to_go: Costs,
    begin: IntArray,
    slack: float,
    more: int,
) -> tuple[float, IntArray, IntArray, IntArray, IntArray]:
    """Boxes around the cells through which a motion may cost up to `slack` more than the cheapest without risk.

    Args:
        horizon: as for `search.solve`, and so are the next seven.
        radius: K.
        active: (3,).
        taps: (n, 3).
        effort: (n,).
        first: (n,).
        stage: (2KN+1 per active axis).
        blocked: the same shape, or empty.
        to_go: of `costs_to_go`, with
        begin: (N + 2,).
        slack: inf: all cells that can be reached.
        more: as for `_boxes_between`.

    Returns:
        cost of the cheapest without risk, (N + 1, 3) lowest cells, counted from the robot, and (N + 1, 3) cells; and
        what `_boxes_between` returns for these.
    """
    low, size = np.zeros((horizon + 1, 3), np.int64), np.ones((horizon + 1, 3), np.int64)
    for k in range(1, horizon + 1):
        grow_into(low[0], size[0], radius * k, radius * k, active, low[k], size[k])
    corner, box = grown(low[0], size[0], radius, radius, active)
    found = np.full(cells_of(box) + WIDTH, np.float32(np.inf))
    h0, h1, h2 = stage.shape[0] // 2, stage.shape[1] // 2, stage.shape[2] // 2
    least = np.inf
    for t in range(taps.shape[0]):
        i, j, k = taps[t, 0], taps[t, 1], taps[t, 2]
        at = row_at(i, j, k, corner, box)
        cost = effort[t] + first[t] + stage[i + h0, j + h1, k + h2]
        found[at] = min(found[at], cost)
        least = min(least, float(cost + to_go[begin[1] + at]))
    if not np.isfinite(least) or slack == np.inf:
        first_between, between = _boxes_between(low, size, radius, active, more)
        return least, low, size, first_between, between
    efforts, windows = axis_efforts(radius, taps, effort), _windows(radius, active, taps)
    bound = least + slack + 1e-5 * (1.0 + abs(least) + slack)
    for k in range(1, horizon + 1):
        whole_low, whole = grown(low[0], size[0], radius * k, radius * k, active)
        _enclose(whole_low, whole, found, corner, box, to_go[begin[k] :], bound, low[k], size[k])
        if k == horizon:
            break
        outer_low, outer = grown(low[k], size[k], 2 * radius, 2 * radius, active)
        source = np.full(cells_of(outer) + WIDTH, np.float32(np.inf))
        for i in range(low[k, 0], low[k, 0] + size[k, 0]):
            for j in range(low[k, 1], low[k, 1] + size[k, 1]):
                at = row_at(i, j, low[k, 2], outer_low, outer)
                known = row_at(i, j, low[k, 2], corner, box)
                for n in range(size[k, 2]):
                    source[at + n] = found[known + n]
        corner, box = grown(low[k], size[k], radius, radius, active)
        found = np.empty(cells_of(box) + WIDTH, np.float32)
        _spread(radius, active, efforts, windows, source, box, found)
        _add_stage(corner, box, found, stage, blocked, found)
    first_between, between = _boxes_between(low, size, radius, active, more)
    return least, low, size, first_between, between


@njit(**KERNEL)
def _enclose(
    whole_low: IntArray,
    whole: IntArray,
    found: Costs,
    corner: IntArray,
    box: IntArray,
    to_go: Costs,
    bound: float,
    low: IntArray,
    size: IntArray,
) -> None:
    """Put the smallest box around the cells where `found` and what is still to pay are at most `bound`."""
    i0, i1, j0, j1, k0, k1 = box[0], -1, box[1], -1, box[2], -1
    for i in range(box[0]):
        for j in range(box[1]):
            at = (i * box[1] + j) * box[2]
            on = row_at(i + corner[0], j + corner[1], corner[2], whole_low, whole)
            start, stop = 0, box[2]
            while start < stop and found[at + start] + to_go[on + start] > bound:
                start += 1
            if start == stop:
                continue
            while found[at + stop - 1] + to_go[on + stop - 1] > bound:
                stop -= 1
            i0, i1, j0, j1 = min(i0, i), max(i1, i), min(j0, j), max(j1, j)
            k0, k1 = min(k0, start), max(k1, stop - 1)
    if i1 < 0:  # by rounding
        i0, i1, j0, j1, k0, k1 = 0, box[0] - 1, 0, box[1] - 1, 0, box[2] - 1
    low[0], low[1], low[2] = corner[0] + i0, corner[1] + j0, corner[2] + k0
    size[0], size[1], size[2] = i1 - i0 + 1, j1 - j0 + 1, k1 - k0 + 1
