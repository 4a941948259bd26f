"""Choices of those who mind the robot, swept only where it makes a difference (Eqs. 2 and 5).

Danger costs something, so nobody pays less for it; and where nobody who walks best meets any, nobody pays more. So
what a person with M actions ahead pays differs from what the undisturbed pay only in a part of the lattice: near the
robot, and in the cells from which the way leads there. Stage by stage, that part is contained in where there is danger
and in what is within reach of the part of the stage after it. There the values are lowered as in `sweep`, and compared;
everywhere else they are those of the undisturbed, which all policies share. What is lost by taking a difference that
breaks no tie for none is bounded by `least` per stage.

In 2-D, with danger that is a product over the axes. Layout as in `sweep`, bits as in `sweep_choices`.

A part of the lattice is an array (rows + 1, 2): first and last column of every row (first > last: nothing), and in the
end the first and the last row, beyond which nothing is read.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.sweep import Values, lower_layer
from sidestep._kernels.sweep_choices import Choices, heed_walls
from sidestep._kernels.sweep_marks import mark_box, mark_part
from sidestep.types import BoolArray, FloatArray, IntArray


class NearScratch(NamedTuple):
    """Arrays that `choose_near` writes to.

    Attributes:
        even, odd: (rows, C) undisturbed values of two stages; near: (rows, C) values of those who mind the robot.
        lines: (3, C).
        kept: (rows·C,) undisturbed values while others stand in their place.
        pool: (2, ·) the others, of all policies one after another, of two stages.
        parts: (2, N, rows + 1, 2) where that is.
        felt: (T, rows + 1, 2) where there is danger at every instant.
        calm: (words or 2·words, cells) bits of the undisturbed.
    """

    even: Values
    odd: Values
    near: Values
    lines: Values
    kept: Values
    pool: Values
    parts: IntArray
    felt: IntArray
    calm: IntArray


@njit(**KERNEL, nogil=True)
def _find_danger(axes: Values, instant: int, least: float, part: IntArray) -> int:
    """Write the part outside of which there is less danger than `least` at an instant; return its cells."""
    along, across, weight = 3 * instant + 1, 3 * instant + 2, axes[3 * instant, 0]
    most = 0.0
    for c in range(axes.shape[1]):
        most = max(most, axes[across, c])
    first, last, cells = 0, axes.shape[1] - 1, 0
    while first <= last and weight * axes[along, first] * most < least:
        first += 1
    while last >= first and weight * axes[along, last] * most < least:
        last -= 1
    part[-1, 0], part[-1, 1] = first, last
    for row in range(first, last + 1):
        low, high, scale = 0, axes.shape[1] - 1, weight * axes[along, row]
        while low <= high and scale * axes[across, low] < least:
            low += 1
        while high >= low and scale * axes[across, high] < least:
            high -= 1
        part[row, 0], part[row, 1] = low, high
        cells += high - low + 1
    return cells


@njit(**KERNEL, nogil=True)
def _little_felt(cells: IntArray, differs: BoolArray, radii: IntArray, lead: int, steps: int, reach: int) -> bool:
    """Whether there is danger in less than half of all the cells that a sweep would go through."""
    some, everything = 0, 0
    for k in range(radii.size):
        for j in range(1, steps + 1 if differs[k] else 1):
            whole = (2 * (radii[k] + reach * j) + 1) ** 2
            everything += whole
            some += min(cells[k + lead + j - 1], whole)
    return 2 * some < everything


@njit(**KERNEL, nogil=True)
def _grow(felt: IntArray, then: IntArray, reach: int, centre: int, radius: int, part: IntArray) -> bool:
    """Write the union of `felt` and of what is within reach of `then`, cut to a box; whether there is anything."""
    first, last = centre + radius + 1, centre - radius - 1
    if felt[-1, 0] <= felt[-1, 1]:
        first, last = felt[-1, 0], felt[-1, 1]
    if then[-1, 0] <= then[-1, 1]:
        first, last = min(first, then[-1, 0] - reach), max(last, then[-1, 1] + reach)
    first, last = max(first, centre - radius), min(last, centre + radius)
    part[-1, 0], part[-1, 1] = first, last
    for row in range(first, last + 1):
        low, high = centre + radius + 1, centre - radius - 1
        if felt[-1, 0] <= row <= felt[-1, 1]:
            low, high = felt[row, 0], felt[row, 1]
        for near in range(max(row - reach, then[-1, 0]), min(row + reach, then[-1, 1]) + 1):
            if then[near, 0] <= then[near, 1]:
                low, high = min(low, then[near, 0] - reach), max(high, then[near, 1] + reach)
        part[row, 0], part[row, 1] = max(low, centre - radius), min(high, centre + radius)
    return first <= last


@njit(**KERNEL, nogil=True)
def _put(pool: Values, start: int, part: IntArray, values: Values) -> int:
    """Write what `pool` holds for a part from `start` on into `values`; return where it ends."""
    end = start
    for row in range(part[-1, 0], part[-1, 1] + 1):
        first, at, count = np.uintp(part[row, 0]), np.uintp(end), max(part[row, 1] - part[row, 0] + 1, 0)
        for c in range(np.uintp(count)):
            values[row, first + c] = pool[at + c]
        end += count
    return end


@njit(**KERNEL, nogil=True)
def _take(values: Values, part: IntArray, pool: Values, start: int) -> int:
    """Write what `values` hold for a part into `pool`, from `start` on; return where it ends."""
    end = start
    for row in range(part[-1, 0], part[-1, 1] + 1):
        first, at, count = np.uintp(part[row, 0]), np.uintp(end), max(part[row, 1] - part[row, 0] + 1, 0)
        for c in range(np.uintp(count)):
            pool[at + c] = values[row, first + c]
        end += count
    return end


@njit(**KERNEL, nogil=True)
def _differing(values: Values, calm: Values, part: IntArray, least: float) -> int:
    """Cut a part down to where `values` are more than `least` above `calm`; return its cells."""
    cells, top, bottom = 0, part[-1, 1] + 1, part[-1, 0] - 1
    for row in range(part[-1, 0], part[-1, 1] + 1):
        first, last = part[row, 0], part[row, 1]
        while first <= last and not values[row, first] > calm[row, first] + least:
            first += 1
        while last >= first and not values[row, last] > calm[row, last] + least:
            last -= 1
        part[row, 0], part[row, 1] = first, last
        if first <= last:
            cells += last - first + 1
            top, bottom = min(top, row), row
    part[-1, 0], part[-1, 1] = top, bottom
    return cells


@njit(**KERNEL, nogil=True)
def _take_calm(choices: Choices, k: int, calm: IntArray, calm_radius: int) -> None:
    """Give policy k the bits of the undisturbed."""
    radius = choices.radii[k]
    width, pitch, off = 2 * radius + 1, 2 * calm_radius + 1, calm_radius - radius
    for word in range(calm.shape[0]):
        to = choices.offsets[k]
        for i in range(width):
            source = (off + i) * pitch + off
            for c in range(width):
                choices.masks[word, to + c] = calm[word, source + c]
            to += width


@njit(**KERNEL, nogil=True)
def choose_near(
    goal_axes: Values, goal_table: Values, danger_axes: Values, taps: Values, lead: int, differs: BoolArray,
    centre: int, tolerance: float, least: float, free: BoolArray, mixture: FloatArray,
    even: Values, odd: Values, near: Values, lines: Values, kept: Values, pool: Values, parts: IntArray,
    felt: IntArray, calm: IntArray, radii: IntArray, offsets: IntArray, words: int, masks: IntArray, odds: FloatArray,
) -> bool:  # fmt: skip
    """Write the choices of all policies that are wanted, as `choose` does with the danger term.

    Args:
        goal_axes, goal_table, danger_axes: see `CostTables`; taps … mixture: see `choose`, `differs` being what is
            wanted.
        least: a cost that breaks no tie even if it is paid at every stage.
        even … calm: see `NearScratch`.
        radii, offsets, words, masks, odds: see `Choices`; written to.

    Returns:
        False where the danger is felt in so many cells that this would save nothing; then nothing was written.
    """
    choices = Choices(radii, offsets, words, masks, odds)
    steps, reach, policies = taps.shape[0], taps.shape[2] // 2, radii.size
    by_table = goal_table.size > 0
    goal = goal_table if by_table else goal_axes
    step = 1 if by_table else 0
    counts = np.zeros(danger_axes.shape[0] // 3, np.int64)
    for instant in range(lead, counts.size):
        counts[instant] = _find_danger(danger_axes, instant, least, felt[instant])
    if not _little_felt(counts, differs, radii, lead, steps, reach):
        return False
    starts, whole = np.zeros((2, policies), np.int64), np.empty((even.shape[0], 2), np.int64)
    for k in range(policies):
        parts[0, k, -1], parts[1, k, -1] = (1, 0), (1, 0)
    calm_radius = radii[policies - 1]
    source, target, now = odd, even, 1
    for j in range(steps, 0, -1):
        source, target, now, used = target, source, 1 - now, 0
        low, high = centre - calm_radius - reach * j, centre + calm_radius + reach * j
        for n in range(high - low + 1):
            lines[1, n] = 0.0 if by_table else goal_axes[0, 0] + goal_axes[1, low + n]
            lines[2, n] = 0.0
            whole[n, 0], whole[n, 1] = low, high
        lower_layer(
            source, 0, low, high + 1, whole, 0, taps, j, True, goal, low if by_table else 2, step, goal_axes, 2, 0,
            lines, target,
        )  # fmt: skip
        for k in range(policies):
            if not differs[k]:
                continue
            part, then, instant = parts[now, k], parts[1 - now, k], k + lead + j - 1
            if not _grow(felt[instant], then, reach, centre, radii[k] + reach * j, part):
                continue
            first, last = part[-1, 0], part[-1, 1]
            for n in range(last - first + 1):
                lines[1, n] = 0.0 if by_table else goal_axes[0, 0] + goal_axes[1, first + n]
                lines[2, n] = danger_axes[3 * instant, 0] * danger_axes[3 * instant + 1, first + n]
            _take(source, then, kept, 0)
            _put(pool[1 - now], starts[1 - now, k], then, source)
            lower_layer(
                source, 0, first, last + 1, part, first, taps, j, True, goal, first if by_table else 2, step,
                danger_axes, 3 * instant + 2, 0, lines, near,
            )  # fmt: skip
            _put(kept, 0, then, source)
            cells = _differing(near, target, part, least)
            if used + cells > pool.shape[1]:
                return False
            starts[now, k] = used
            used = _take(near, part, pool[now], used)
    _mark_all(
        choices, target, source, taps, differs, centre, tolerance, free, mixture, lines, pool[now], parts[now],
        parts[1 - now], starts[now], kept, calm,
    )  # fmt: skip
    return True


@njit(**KERNEL, nogil=True)
def _mark_all(
    choices: Choices, cost: Values, along: Values, taps: Values, differs: BoolArray, centre: int, tolerance: float,
    free: BoolArray, mixture: FloatArray, lines: Values, pool: Values, parts: IntArray, within: IntArray,
    starts: IntArray, kept: Values, calm: IntArray,
) -> None:  # fmt: skip
    """Bits of all policies: those of the undisturbed, and what is different within reach of `parts`."""
    reach, rows, policies = taps.shape[2] // 2, cost.shape[0], choices.radii.size
    groups, nothing = np.empty(lines.shape[1], np.int32), np.zeros((1, 2), np.int64)
    nothing[0, 0] = 1
    last, whole = choices.radii[policies - 1], within[policies - 1]
    mark_box(cost, taps, last, centre, 2, tolerance, along, along, lines, groups, calm, 0)
    if free.size > 0:
        whole[:, 0], whole[:, 1] = centre - last, centre + last
        undisturbed = Choices(choices.radii, choices.offsets, choices.words, calm, choices.odds)
        _heed(free, rows, whole, mixture, undisturbed, -(centre - last) * (2 * last + 2), 2 * last + 1)
    for k in range(policies):
        if not differs[k]:
            continue
        _take_calm(choices, k, calm, last)
        radius, part = choices.radii[k], within[k]
        if not _grow(nothing, parts[k], reach, centre, radius, part):
            continue
        pitch = 2 * radius + 1
        corner = choices.offsets[k] - (centre - radius) * (pitch + 1)
        _take(cost, parts[k], kept, 0)
        _put(pool, starts[k], parts[k], cost)
        mark_part(cost, taps, part, tolerance, along, lines, groups, choices.masks, corner, pitch)
        _put(kept, 0, parts[k], cost)
        if free.size > 0:
            _heed(free, rows, part, mixture, choices, corner, pitch)


@njit(**KERNEL, nogil=True)
def _heed(
    free: BoolArray, rows: int, part: IntArray, mixture: FloatArray, choices: Choices, corner: int, pitch: int
) -> None:
    """Let walls change the choices of a part; column 0 of row 0 would be at `corner`, rows `pitch` apart."""
    for row in range(part[-1, 0], part[-1, 1] + 1):
        for c in range(part[row, 0], part[row, 1] + 1):
            heed_walls(free, row, rows, c, mixture, 2, choices, corner + row * pitch + c)
