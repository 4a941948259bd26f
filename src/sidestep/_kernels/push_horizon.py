"""Mass over the horizon under one hypothesis, step by step (Eqs. 4, 6, 7)."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from sidestep._kernels.push import push_choices, push_odds, push_separable
from sidestep._kernels.push_sections import add_box, add_planes, clear_rows, remove_contact
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_choices import Choices
from sidestep.types import BoolArray, FloatArray, IntArray


class Behaviour(NamedTuple):
    """What a person with one goal does.

    Attributes:
        mixture: (3, T, T) what a chosen component stands for.
        tables: (3·T, C) undisturbed P_d per axis where it is separable, else size 0.
        used: (3·T,) 0 where a row of `tables` is all zero.
        undisturbed: choices of the undisturbed person, where P_d is not separable.
        concerned: choices of the person who minds the robot.
        differs: (N,) False where policy k is the undisturbed one.
    """

    mixture: FloatArray
    tables: FloatArray
    used: FloatArray
    undisturbed: Choices
    concerned: Choices
    differs: BoolArray


class Conditions(NamedTuple):
    """What holds for all hypotheses of one person.

    Attributes:
        dimension: d.
        reach: largest action in cells.
        randomness: ω.
        uniform: (3·T, C) 1/T; size 0 if there are walls.
        admissible: choices of a person among walls who acts at random; size 0 if there are none.
        all_used: (3·T,) ones.
        same: (3, T, T) identity.
        centre: anchor's index in sections of mass.
        middle: in tables.
        half_centre: in mid-step mass, in dense columns.
        boxes: (N+1, 7) and
        shares: of `push_sections.contact_shares`; size 0: nothing is removed.
        offsets: (2N+2,) where the mass at a half instant starts in the flat array of all of them.
    """

    dimension: int
    reach: int
    randomness: float
    uniform: FloatArray
    admissible: Choices
    all_used: FloatArray
    same: FloatArray
    centre: int
    middle: int
    half_centre: int
    boxes: IntArray
    shares: FloatArray
    offsets: IntArray


@njit(cache=True, nogil=True, error_model="numpy")
def _read_actions(
    field: FloatArray, section: int, centre: int, reach: int, dimension: int, weight: float, actions: FloatArray
) -> None:
    """After one step from the anchor, the mass in each cell is the probability of the action that leads there."""
    rows = row_count(centre, dimension)
    c0, c1 = axis_radius(centre, dimension)
    r0, r1 = axis_radius(reach, dimension)
    a = 0
    for i0 in range(c0 - r0, c0 + r0 + 1):
        for i1 in range(c1 - r1, c1 + r1 + 1):
            for i2 in range(centre - reach, centre + reach + 1):
                actions[a] = field[section + i0 * rows + i1, i2] / weight
                a += 1


@njit(cache=True, nogil=True, error_model="numpy")
def propagate(
    behaviour: Behaviour,
    given: Conditions,
    first: int,
    last: int,
    touched: bool,
    weight: float,
    concerned: float,
    field: FloatArray,
    lines: FloatArray,
    occupancy: FloatArray,
    contact: FloatArray,
    halves: FloatArray,
    actions: FloatArray,
) -> bool:
    """Push one hypothesis from instant `first` to `last` and add it to the results.

    Args:
        behaviour: of the hypothesis.
        given: the same for all hypotheses.
        first: 0, or where the last call stopped; the mass is then taken from `field`.
        last: k of the last step.
        touched: what the last call returned; False at first.
        weight: of the hypothesis; the mass starts with it.
        concerned: share of the deliberate part that follows the concerned policy: 0, 1, or P(β=1) if awareness is
            resampled.
        field: (4·rows + mid-step rows, C): free mass at even and odd instants, living mass likewise, mid-steps.
        lines: (≥ 4, C) scratch.
        occupancy: ((N+1)·rows, C), added to; or size 0.
        contact: (N,) first-passage probability, added to.
        halves: flat masses at half instants, the odd ones of which are added to; or size 0.
        actions: (n,) written at the first step: P(u | x; goal, β) at the anchor (Eq. 4); or size 0.

    Returns:
        whether some mass has touched the robot: living mass is then kept apart.
    """
    d, reach, centre = given.dimension, given.reach, given.centre
    c0, c1 = axis_radius(centre, d)
    rows = (2 * c0 + 1) * row_count(centre, d)
    anchor = c0 * row_count(centre, d) + c1
    half = 4 * rows if halves.size > 0 else -1
    if first == 0:
        clear_rows(field, 0, 0, centre, d, 1)
        field[anchor, centre] = weight
        if occupancy.size > 0:
            occupancy[anchor, centre] += weight
    for k in range(first, last):
        here, there = k % 2 * rows, (k + 1) % 2 * rows
        box = reach * (k + 1)
        clear_rows(field, there, box, centre, d, 1)
        if touched:
            clear_rows(field, 2 * rows + there, box, centre, d, 1)
        if half >= 0:
            clear_rows(field, half, 2 * box - reach, given.half_centre, d, 2)
        minding = concerned if behaviour.differs[k] else 0.0
        for part in range(4):
            share = 1.0 - given.randomness
            tables, used, choices, mixture = behaviour.tables, behaviour.used, behaviour.concerned, behaviour.mixture
            if part == 0:
                share *= minding
            if part == 1 or part == 2:
                share *= 1.0 - minding
                choices = behaviour.undisturbed
            if part == 3:
                share, choices, mixture = given.randomness, given.admissible, given.same
                tables, used = given.uniform, given.all_used
            by_tables = part >= 2 and tables.size > 0
            by_choices = part == 0 or (part == 1 and behaviour.tables.size == 0) or (part == 3 and tables.size == 0)
            if share == 0.0:
                continue
            living, to_living = 2 * rows + here, 2 * rows + there if touched else -1
            if by_choices and choices.odds.size > 0:
                push_odds(
                    field, here, living, reach * k, centre, choices.odds, choices.offsets[k], choices.radii[k], mixture,
                    share, d, there, to_living, half, given.half_centre,
                )  # fmt: skip
            elif by_choices:
                push_choices(
                    field, here, living, reach * k, centre, choices.masks, choices.words, choices.offsets[k],
                    choices.radii[k], mixture, share, d, there, to_living, half, given.half_centre,
                )  # fmt: skip
            for kind in range(3 if by_tables else 0):
                source, target, target_centre, factor = here, there, centre, 1
                if kind == 1:
                    source, target = 2 * rows + here, 2 * rows + there
                if kind == 2:
                    target, target_centre, factor = half, given.half_centre, 2
                if (kind == 1 and not touched) or target < 0:
                    continue
                push_separable(
                    field, source, reach * k, centre, tables, used, given.middle, share, d, factor, target,
                    target_centre, lines,
                )  # fmt: skip
        if k == 0 and actions.size > 0:
            _read_actions(field, there, centre, reach, d, weight, actions)
        if occupancy.size > 0:
            add_box(field, there, box, centre, d, occupancy, (k + 1) * rows)
        if half >= 0:
            add_planes(field, half, given.half_centre, 2 * box - reach, d, halves, given.offsets[2 * k + 1])
        if given.boxes.size == 0:
            continue
        if not touched:
            clear_rows(field, 2 * rows + there, box, centre, d, 1)
            add_box(field, there, box, centre, d, field, 2 * rows + there)
        removed = remove_contact(field, 2 * rows + there, centre, d, given.boxes, given.shares, k + 1)
        contact[k] += removed
        touched = touched or removed > 0.0
    return touched
