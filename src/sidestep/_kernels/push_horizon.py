"""Mass over the horizon under one hypothesis, step by step (Eqs. 4, 6, 7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep._kernels.push import Moves, list_moves, place_moves, push_choices, push_odds, push_separable
from sidestep._kernels.push_evenly import spread_evenly
from sidestep._kernels.push_sections import add_block, clear_box, cover, remove_contact, set_box, trim_box
from sidestep._kernels.push_walled import spread_walled
from sidestep._kernels.sweep import axis_radius, row_count
from sidestep._kernels.sweep_choices import Choices
from sidestep.types import BoolArray, FloatArray, IntArray

SCATTERED = 1e-15
"""Share of a hypothesis that is left out at each side of the box that is pushed on; less than 6·N of it in N steps."""


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
        walls: (words, cells) masks of the actions of a person among walls who acts at random; size 0 without any.
        centre: anchor's index in sections of mass.
        middle: in tables.
        boxes: (N+1, 7) and
        shares: of `push_sections.contact_shares`; size 0: nothing is removed.
        offsets: (2N+2,) where the mass at a half instant starts among the flat blocks.
        midway: whether mid-steps are wanted.
    """

    dimension: int
    reach: int
    randomness: float
    walls: IntArray
    centre: int
    middle: int
    boxes: IntArray
    shares: FloatArray
    offsets: IntArray
    midway: bool


@njit(**KERNEL, nogil=True)
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


@njit(**KERNEL, nogil=True)
def _step(
    behaviour: Behaviour,
    given: Conditions,
    moves: Moves,
    k: int,
    box: IntArray,
    concerned: float,
    field: FloatArray,
    section: int,
    to_section: int,
    halves: FloatArray,
    scratch: FloatArray,
    line: FloatArray,
) -> None:
    """Move the mass of a section's box by one step of policy k; what moves evenly is not added to `halves`."""
    d, centre, half_start = given.dimension, given.centre, given.offsets[2 * k + 1]
    half_radius = given.reach * (2 * k + 1)
    minding = concerned if behaviour.differs[k] else 0.0
    walls = given.walls
    if given.randomness > 0.0:
        share = given.randomness
        spread_evenly(
            field, section, box, centre, given.reach, d, share, walls, given.middle, to_section, scratch, line
        )
        if walls.size > 0:
            spread_walled(field, section, box, centre, given.reach, d, share, walls, given.middle, to_section)
    for part in range(2):
        share = (1.0 - given.randomness) * (minding if part == 0 else 1.0 - minding)
        choices = behaviour.concerned if part == 0 else behaviour.undisturbed
        if share == 0.0:
            continue
        if part == 1 and behaviour.tables.size > 0:
            push_separable(
                field, section, box, centre, behaviour.tables, behaviour.used, given.middle, share, d, to_section,
                halves, half_start, half_radius,
            )  # fmt: skip
        elif choices.odds.size > 0:
            push_odds(
                field, section, box, centre, choices.odds, choices.offsets[k], choices.radii[k], moves, share, d,
                to_section, halves, half_start, half_radius,
            )  # fmt: skip
        else:
            push_choices(
                field, section, box, centre, choices.masks, choices.words, choices.offsets[k], choices.radii[k], moves,
                share, d, to_section, halves, half_start, half_radius,
            )  # fmt: skip


@njit(**KERNEL, nogil=True)
def propagate(
    mixture: FloatArray, tables: FloatArray, used: FloatArray, differs: BoolArray, words: int,
    calm_radii: IntArray, calm_offsets: IntArray, calm_masks: IntArray, calm_odds: FloatArray,
    radii: IntArray, choice_offsets: IntArray, masks: IntArray, odds: FloatArray,
    dimension: int, reach: int, randomness: float, walls: IntArray, centre: int, middle: int,
    boxes: IntArray, shares: FloatArray, offsets: IntArray, midway: bool,
    first: int, last: int, weight: float, concerned: float, field: FloatArray, scratch: FloatArray, line: FloatArray,
    lost: IntArray, blocks: FloatArray, contact: FloatArray, actions: FloatArray,
) -> None:  # fmt: skip
    """Push one hypothesis from instant `first` to `last` and add it to the results.

    What has touched the robot is pushed along as well, as "lost" mass, in the box where there is any: it is little and
    near the robot, and what is not lost is the rest.

    Args:
        mixture, tables, used, differs: of the hypothesis, see `Behaviour`; its choices are taken apart, as is
            `Conditions`: to hand compiled code a tuple takes longer than to hand it all that is in it.
        words: see `Choices`; calm_…: the undisturbed choices; radii, choice_offsets, masks, odds: the concerned ones.
        dimension, … midway: see `Conditions`.
        first: 0, or where the last call stopped; the mass is then taken from `field`.
        last: k of the last step.
        weight: of the hypothesis; the mass starts with it.
        concerned: share of the deliberate part that follows the concerned policy: 0, 1, or P(β=1) if awareness is
            resampled.
        field: (4·rows, C): mass at even and odd instants, lost mass likewise.
        scratch: (2, ·) for `push_evenly`.
        line: likewise.
        lost: (6,) box of lost mass, kept for the next call.
        blocks: flat mass at half instants, added to; or size 0.
        contact: (N,) first-passage probability, added to.
        actions: (n,) written at the first step: P(u | x; goal, β) at the anchor (Eq. 4); or size 0.
    """
    behaviour = Behaviour(
        mixture, tables, used, Choices(calm_radii, calm_offsets, words, calm_masks, calm_odds),
        Choices(radii, choice_offsets, words, masks, odds), differs,
    )  # fmt: skip
    given = Conditions(
        dimension, reach, randomness, walls, centre, middle, boxes, shares, offsets, midway
    )  # fmt: skip
    d = dimension
    c0, c1 = axis_radius(centre, d)
    rows = (2 * c0 + 1) * row_count(centre, d)
    halves = blocks if given.midway else blocks[:0]
    moves = list_moves(behaviour.mixture, d)
    here_box, box, lost_to = np.zeros(6, np.int64), np.zeros(6, np.int64), np.empty(6, np.int64)
    nowhere = np.zeros(6, np.int64)
    nowhere[1] = -1
    if first == 0:
        field[c0 * row_count(centre, d) + c1, centre] = weight
        lost[:] = 0
        lost[1] = -1
        if blocks.size > 0:
            blocks[0] += weight
    set_box(here_box, reach * first, d)
    for k in range(first, last):
        here, there = k % 2 * rows, (k + 1) % 2 * rows
        set_box(box, reach * (k + 1), d)
        place_moves(moves, row_count(centre, d), field.shape[1], reach * (2 * k + 1), d)
        clear_box(field, there, box, centre, d)
        _step(behaviour, given, moves, k, here_box, concerned, field, here, there, halves, scratch, line)
        if k == 0 and actions.size > 0:
            _read_actions(field, there, centre, reach, d, weight, actions)
        cover(here_box, reach, d, nowhere, here_box)
        trim_box(field, there, here_box, centre, d, SCATTERED * weight)
        if blocks.size > 0:
            add_block(field, there, box, centre, d, blocks, given.offsets[2 * k + 2], reach * (k + 1))
        if given.boxes.size == 0:
            continue
        if not cover(lost, reach, d, given.boxes[k + 1], lost_to):
            continue
        clear_box(field, 2 * rows + there, lost_to, centre, d)
        if lost[0] <= lost[1]:
            _step(
                behaviour, given, moves, k, lost, concerned, field, 2 * rows + here, 2 * rows + there,
                halves[:0], scratch, line,
            )  # fmt: skip
        contact[k] += remove_contact(field, there, 2 * rows + there, centre, d, given.boxes, given.shares, k + 1)
        for side in range(6):
            lost[side] = lost_to[side]
