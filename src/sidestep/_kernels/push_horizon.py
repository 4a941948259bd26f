"""Mass over the whole horizon under one hypothesis: policy by policy, step by step (Eqs. 2, 4, 6, 7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sidestep._kernels.push import add_box, add_planes, clear, push_minimisers, push_separable, remove_contact
from sidestep._kernels.push_cells import deliberate, push_cells, spread_randomly
from sidestep._kernels.sweep import CostTables, Values, axis_radius, row_count, sweep
from sidestep.types import BoolArray, FloatArray, IntArray


class Policy(NamedTuple):
    """What a person with one goal would do.

    Attributes:
        costs: stage costs.
        taps: (M, 3, T) cost of the components of the M actions ahead.
        mixture: (3, T, T) what a chosen component stands for, see `push_cells.deliberate`.
        tables: (3·T, C) undisturbed P_d per axis where it is separable, else size 0.
        used: (3·T,) 0 where a row of `tables` is all zero.
        static: values C of the undisturbed person where P_d is not separable, else size 0.
        differs: (N,) False where the robot provably changes no action of policy k.
        lead: 1 if the robot's motion is anticipated, 0 if it is taken to stay where it is (N_H = 0).
    """

    costs: CostTables
    taps: Values
    mixture: FloatArray
    tables: FloatArray
    used: FloatArray
    static: Values
    differs: BoolArray
    lead: int


class Conditions(NamedTuple):
    """What holds for all hypotheses of one person.

    Attributes:
        dimension: d.
        reach: largest action in cells.
        spacing: m.
        randomness: ω.
        tolerance: relative width of a tie.
        rationality: of Eq. 5, or inf.
        free: cells a person may occupy, laid out as values, or size 0.
        uniform: (3·T, C) 1/T.
        value_centre: anchor's index in arrays of values.
        centre: in arrays of mass.
        middle: in tables.
        half_centre: in mid-step mass, in dense columns.
        path: (K, 3) m robot in the lattice's frame, 0 on the axes that only pad.
        contact: m between centres; < 0: nothing is removed.
        fractions: (N+1, F) as for `push.remove_contact`, or size 0.
        fraction_step: m.
        offsets: (N+1,) where mid-step k starts in the flat array; size 0: not wanted.
    """

    dimension: int
    reach: int
    spacing: float
    randomness: float
    tolerance: float
    rationality: float
    free: BoolArray
    uniform: FloatArray
    value_centre: int
    centre: int
    middle: int
    half_centre: int
    path: FloatArray
    contact: float
    fractions: FloatArray
    fraction_step: float
    offsets: IntArray


class Scratch(NamedTuple):
    """Arrays that kernels write to and nobody reads afterwards; sizes as in `human.cost.CostGrid` and `prediction.occupancy`."""

    even: Values
    odd: Values
    plane: Values
    lines: Values
    values: Values
    counts: Values
    mass: FloatArray
    moved: FloatArray
    alive: FloatArray
    moved_alive: FloatArray
    half: FloatArray
    parts: FloatArray
    choice: FloatArray


@njit(cache=True, nogil=True)
def _move_by_tables(
    policy: Policy,
    given: Conditions,
    undisturbed: float,
    box: int,
    scratch: Scratch,
    mass: FloatArray,
    alive: FloatArray,
    both: bool,
    moved: FloatArray,
    moved_alive: FloatArray,
    halfway: bool,
) -> None:
    """Everything that separates by axis: the undisturbed deliberate part, and the random part where there are no walls."""
    for part in range(2):
        tables, used = policy.tables, policy.used
        share = undisturbed
        if part == 1:
            tables, used = given.uniform, np.ones(given.uniform.shape[0])
            share = given.randomness if given.free.size == 0 else 0.0
        if share == 0.0 or tables.size == 0:
            continue
        for kind in range(3):
            source, target, target_centre, factor = mass, moved, given.centre, 1
            if kind == 1:
                source, target = alive, moved_alive
            if kind == 2:
                target, target_centre, factor = scratch.half, given.half_centre, 2
            if (kind == 1 and not both) or (kind == 2 and not halfway):
                continue
            push_separable(
                source, box, given.centre, tables, used, given.middle, share, given.dimension, factor, target,
                target_centre, scratch.parts,
            )  # fmt: skip


@njit(cache=True, nogil=True)
def _move_by_values(
    policy: Policy,
    given: Conditions,
    concerned: float,
    undisturbed: float,
    k: int,
    scratch: Scratch,
    mass: FloatArray,
    alive: FloatArray,
    both: bool,
    moved: FloatArray,
    moved_alive: FloatArray,
    halfway: bool,
) -> None:
    """What follows values: the concerned part, the undisturbed one where it does not separate; and chance among walls."""
    d, box = given.dimension, given.reach * k
    half = scratch.half if halfway else scratch.half[:0]
    for part in range(3):
        cost, share = policy.static, undisturbed
        if part == 1:
            share = concerned
        if part == 2:
            cost, share = scratch.even[:0], given.randomness if given.free.size > 0 else 0.0
        if share == 0.0 or (part == 0 and policy.tables.size > 0):
            continue
        if part == 1:
            cost = sweep(
                policy.costs, k + policy.lead, True, policy.taps, box, given.value_centre, d, scratch.even, scratch.odd,
                scratch.plane, scratch.lines,
            )  # fmt: skip
        if given.free.size > 0 or np.isfinite(given.rationality):
            push_cells(
                mass, alive, both, box, given.centre, cost, given.value_centre, policy.taps, policy.mixture,
                given.tolerance, given.rationality, given.free, share, d, moved, moved_alive, half, given.half_centre,
                scratch.choice,
            )  # fmt: skip
        else:
            push_minimisers(
                mass, alive, both, box, given.centre, cost, given.value_centre, policy.taps, policy.mixture,
                given.tolerance, share, d, moved, moved_alive, half, given.half_centre, scratch.values, scratch.counts,
                scratch.parts,
            )  # fmt: skip


@njit(cache=True, nogil=True)
def propagate(
    policy: Policy,
    given: Conditions,
    scratch: Scratch,
    weight: float,
    concerned: float,
    occupancy: FloatArray,
    contact: FloatArray,
    halves: FloatArray,
) -> None:
    """Add one hypothesis to the results.

    Args:
        policy: of the hypothesis.
        given: the same for all hypotheses.
        scratch: overwritten.
        weight: of the hypothesis; the mass starts with it.
        concerned: share of the deliberate part that follows the concerned policy: 0, 1, or P(β=1) if awareness is resampled.
        occupancy: (N+1, rows, C), added to.
        contact: (N,) first-passage probability, added to.
        halves: flat mid-step masses, added to.
    """
    d, reach, centre = given.dimension, given.reach, given.centre
    mass, moved = scratch.mass, scratch.moved
    alive, moved_alive = scratch.alive, scratch.moved_alive
    c0, c1 = axis_radius(centre, d)
    clear(mass, 0, centre, d, 1)
    mass[c0 * row_count(centre, d) + c1, centre] = weight
    occupancy[0, c0 * row_count(centre, d) + c1, centre] += weight
    both = False
    halfway = given.offsets.size > 0
    habits = 1.0 - given.randomness
    for k in range(occupancy.shape[0] - 1):
        box = reach * (k + 1)
        clear(moved, box, centre, d, 1)
        if both:
            clear(moved_alive, box, centre, d, 1)
        if halfway:
            clear(scratch.half, 2 * box - reach, given.half_centre, d, 2)
        by_values = habits * concerned if policy.differs[k] else 0.0
        calm = habits - by_values
        _move_by_tables(policy, given, calm, box - reach, scratch, mass, alive, both, moved, moved_alive, halfway)
        _move_by_values(policy, given, by_values, calm, k, scratch, mass, alive, both, moved, moved_alive, halfway)
        mass, moved = moved, mass
        add_box(mass, occupancy[k + 1], box, centre, d)
        if halfway:
            add_planes(scratch.half, given.half_centre, 2 * box - reach, d, halves, given.offsets[k])
        if given.contact < 0.0:
            continue
        if both:
            alive, moved_alive = moved_alive, alive
        else:
            clear(alive, box, centre, d, 1)
            add_box(mass, alive, box, centre, d)
        fractions = given.fractions[k + 1] if given.fractions.size > 0 else given.fractions[0]
        removed = remove_contact(
            alive, box, centre, d, given.path[k + 1], given.spacing, given.contact, fractions, given.fraction_step
        )
        contact[k] += removed
        both = both or removed > 0.0


@njit(cache=True, nogil=True)
def undisturbed_values(policy: Policy, given: Conditions, radius: int, scratch: Scratch, out: Values) -> None:
    """C of the undisturbed person for the cells of `radius`, into `out`."""
    values = sweep(
        policy.costs, 0, False, policy.taps, radius, given.value_centre, given.dimension, scratch.even, scratch.odd,
        scratch.plane, scratch.lines,
    )  # fmt: skip
    out[:] = values


@njit(cache=True, nogil=True)
def first_choice(policy: Policy, given: Conditions, scratch: Scratch, out: FloatArray) -> None:
    """P(u | x; β) at the anchor now (Eq. 4): out (2, T, T, T), [1] concerned; axes that only pad have their entry at `reach`."""
    d, reach = given.dimension, given.reach
    count = 2 * reach + 1
    r0, r1 = axis_radius(reach, d)
    for beta in range(2):
        found = True
        choice = out[beta]
        choice[:] = 0.0
        by_values = beta == 1 and policy.differs[0]
        if by_values or policy.tables.size == 0:
            cost = policy.static
            if by_values:
                cost = sweep(
                    policy.costs, policy.lead, True, policy.taps, 0, given.value_centre, d, scratch.even, scratch.odd,
                    scratch.plane, scratch.lines,
                )  # fmt: skip
            found = deliberate(
                cost, given.value_centre, 0, 0, 0, policy.taps, policy.mixture, given.tolerance, given.rationality,
                given.free, d, choice,
            )  # fmt: skip
            if not found:
                choice[:] = 0.0
                choice[reach, reach, reach] = 1.0
        else:
            for u0 in range(reach - r0, reach + r0 + 1):
                for u1 in range(reach - r1, reach + r1 + 1):
                    for u2 in range(count):
                        part = policy.tables[2 * count + u2, given.middle]
                        if r0 > 0:
                            part *= policy.tables[u0, given.middle]
                        if r1 > 0:
                            part *= policy.tables[count + u1, given.middle]
                        choice[u0, u1, u2] = part
        spread_randomly(given.free, given.value_centre, 0, 0, 0, reach, given.randomness, d, scratch.choice)
        for u0 in range(reach - r0, reach + r0 + 1):
            for u1 in range(reach - r1, reach + r1 + 1):
                for u2 in range(count):
                    choice[u0, u1, u2] = (1.0 - given.randomness) * choice[u0, u1, u2] + scratch.choice[u0, u1, u2]
