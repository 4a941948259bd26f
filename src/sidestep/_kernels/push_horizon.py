"""Mass over the whole horizon under one hypothesis: policy by policy, step by step (Eqs. 2, 4, 6, 7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.push import deliberate, push_random_among_walls, push_separable, push_values, remove_contact
from sidestep._kernels.sweep import Array, CostTables, axis_radius, sweep

Mass = NDArray[np.float64]


class Policy(NamedTuple):
    """What a person with one goal would do.

    Attributes:
        costs: stage costs.
        taps: (M, 3, T) cost of the components of the M actions ahead.
        mixture: (3, T, T) what a chosen component stands for, see `push.deliberate`.
        tables: (3, T, W) undisturbed P_d per axis where it is separable, else size 0.
        static: values C of the undisturbed person where it is not separable, else size 0.
        differs: (N,) False where the robot provably changes no action of policy k.
        lead: 1 if the robot's motion is anticipated, 0 if it is taken to stay where it is (N_H = 0).
    """

    costs: CostTables
    taps: Array
    mixture: Mass
    tables: Mass
    static: Array
    differs: NDArray[np.bool_]
    lead: int


class Conditions(NamedTuple):
    """What holds for all hypotheses of one person.

    Attributes:
        dimension, reach, spacing: of the lattice and the actions.
        randomness: ω. tolerance: of ties. rationality: of Eq. 5.
        free: cells a person may occupy, indexed as values, or size 0.
        uniform: (3, T, W) 1/T.
        value_centre, centre, middle: anchor's index in arrays of values, of mass, of tables.
        path: (K, d) m robot in the lattice's frame.
        contact, step_weights (N+1,), profiles (N+1, P), profile_step: see `push.remove_contact`; contact < 0: nothing is removed.
        offsets: (N+1,) where mid-step k starts in the flat array; size 0: not wanted.
    """

    dimension: int
    reach: int
    spacing: float
    randomness: float
    tolerance: float
    rationality: float
    free: NDArray[np.bool_]
    uniform: Mass
    value_centre: int
    centre: int
    middle: int
    path: Mass
    contact: float
    step_weights: Mass
    profiles: Mass
    profile_step: float
    offsets: NDArray[np.int64]


class Scratch(NamedTuple):
    """Arrays that kernels write to and nobody reads afterwards."""

    even: Array
    odd: Array
    plane: Array
    row: Array
    mass: Mass
    moved: Mass
    alive: Mass
    moved_alive: Mass
    line: Mass
    choice: Mass


@njit(cache=True, nogil=True)
def _clear(array, radius, centre, dimension):
    c0, c1, c2 = axis_radius(centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    array[c0 - b0 : c0 + b0 + 1, c1 - b1 : c1 + b1 + 1, c2 - b2 : c2 + b2 + 1] = 0.0


@njit(cache=True, nogil=True)
def _copy(source, target, radius, centre, dimension, scale):
    """Target += scale · source on a box."""
    c0, c1, c2 = axis_radius(centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    for i0 in range(c0 - b0, c0 + b0 + 1):
        for i1 in range(c1 - b1, c1 + b1 + 1):
            s = source[i0, i1, c2 - b2 : c2 + b2 + 1]
            t = target[i0, i1, c2 - b2 : c2 + b2 + 1]
            for c in range(s.size):
                t[c] += scale * s[c]


@njit(cache=True, nogil=True)
def _step(k, policy, given, undisturbed, concerned, scratch, mass, alive, both, moved, moved_alive, half):
    """One step of the mass: shares of the deliberate part follow the undisturbed and the concerned policy (Eqs. 4, 6, 7)."""
    d, reach, box = given.dimension, given.reach, given.reach * k
    half_centre = 2 * box + reach
    if not policy.differs[k]:
        undisturbed, concerned = undisturbed + concerned, 0.0
    if undisturbed > 0.0 and policy.tables.size > 0:
        for pair in range(2 if both else 1):
            source, target = (mass, moved) if pair == 0 else (alive, moved_alive)
            push_separable(
                source,
                box,
                given.centre,
                policy.tables,
                given.middle,
                undisturbed,
                d,
                1,
                target,
                given.centre,
                scratch.line,
            )
        if half.size > 0:
            push_separable(
                mass, box, given.centre, policy.tables, given.middle, undisturbed, d, 2, half, half_centre, scratch.line
            )
    elif undisturbed > 0.0:
        push_values(
            mass, alive, both, box, given.centre, policy.static, given.value_centre, policy.taps[0], policy.mixture,
            given.tolerance, given.rationality, given.free, undisturbed, d, scratch.choice, moved, moved_alive, half,
            half_centre,
        )  # fmt: skip
    if concerned > 0.0:
        values = sweep(
            policy.costs, k + policy.lead, True, policy.taps, box, given.value_centre, d, scratch.even, scratch.odd,
            scratch.plane, scratch.row,
        )  # fmt: skip
        push_values(
            mass, alive, both, box, given.centre, values, given.value_centre, policy.taps[0], policy.mixture,
            given.tolerance, given.rationality, given.free, concerned, d, scratch.choice, moved, moved_alive, half,
            half_centre,
        )  # fmt: skip
    _random_step(box, given, scratch, mass, moved, half, half_centre)
    if both:
        _random_step(box, given, scratch, alive, moved_alive, half[:0], half_centre)


@njit(cache=True, nogil=True)
def _random_step(box, given, scratch, mass, moved, half, half_centre):
    d, share = given.dimension, given.randomness
    if share == 0.0:
        return
    if given.free.size > 0:
        push_random_among_walls(
            mass, box, given.centre, given.free, given.value_centre, share, d, given.reach, 1, moved, given.centre
        )
        if half.size > 0:
            push_random_among_walls(
                mass, box, given.centre, given.free, given.value_centre, share, d, given.reach, 2, half, half_centre
            )
        return
    push_separable(mass, box, given.centre, given.uniform, given.middle, share, d, 1, moved, given.centre, scratch.line)
    if half.size > 0:
        push_separable(
            mass, box, given.centre, given.uniform, given.middle, share, d, 2, half, half_centre, scratch.line
        )


@njit(cache=True, nogil=True)
def propagate(policy, given, scratch, weight, concerned, occupancy, contact, halves):
    """Add one hypothesis to the results.

    Args:
        policy, given, scratch: as their classes say.
        weight: of the hypothesis; the mass starts with it.
        concerned: share of the deliberate part that follows the concerned policy: 0, 1, or P(β=1) for resampled awareness.
        occupancy: (N+1, W0, W1, W2), added to.
        contact: (N,) first-passage probability, added to.
        halves: flat mid-step masses, added to.
    """
    d, reach, centre = given.dimension, given.reach, given.centre
    horizon = occupancy.shape[0] - 1
    mass, moved = scratch.mass, scratch.moved
    alive, moved_alive = scratch.alive, scratch.moved_alive
    c0, c1, c2 = axis_radius(centre, d)
    mass[c0, c1, c2] = weight
    occupancy[0, c0, c1, c2] += weight
    both = False
    habits = 1.0 - given.randomness
    for k in range(horizon):
        box = reach * (k + 1)
        _clear(moved, box, centre, d)
        if both:
            _clear(moved_alive, box, centre, d)
        if given.offsets.size > 0:
            n0, n1, n2 = axis_radius(2 * reach * k + reach, d)
            half = halves[given.offsets[k] : given.offsets[k + 1]].reshape((2 * n0 + 1, 2 * n1 + 1, 2 * n2 + 1))
        else:
            half = halves.reshape((0, 1, 1))
        _step(
            k, policy, given, habits * (1.0 - concerned), habits * concerned, scratch, mass, alive, both, moved,
            moved_alive, half,
        )  # fmt: skip
        mass, moved = moved, mass
        if both:
            alive, moved_alive = moved_alive, alive
        _copy(mass, occupancy[k + 1], box, centre, d, 1.0)
        if given.contact < 0.0:
            continue
        if not both:
            _clear(alive, box, centre, d)
            _copy(mass, alive, box, centre, d, 1.0)
        removed = remove_contact(
            alive, box, centre, given.path[k + 1], given.spacing, given.step_weights[k + 1], given.contact,
            given.profiles[k + 1], given.profile_step, d,
        )  # fmt: skip
        contact[k] += removed
        both = both or removed > 0.0


@njit(cache=True, nogil=True)
def undisturbed_values(policy, given, radius, scratch, out):
    """C of the undisturbed person for the cells of `radius`, into `out`."""
    values = sweep(
        policy.costs, 0, False, policy.taps, radius, given.value_centre, given.dimension, scratch.even, scratch.odd,
        scratch.plane, scratch.row,
    )  # fmt: skip
    _clear(out, radius + given.reach, given.value_centre, given.dimension)
    _copy(values, out, radius + given.reach, given.value_centre, given.dimension, 1.0)


@njit(cache=True, nogil=True)
def first_choice(policy, given, concerned, scratch, out):
    """P_d over the actions at the anchor now, into out (T, T, T); nothing admissible: the person stays."""
    d, reach = given.dimension, given.reach
    v0, v1, v2 = axis_radius(given.value_centre, d)
    found = True
    if concerned and policy.differs[0]:
        values = sweep(
            policy.costs, policy.lead, True, policy.taps, 0, given.value_centre, d, scratch.even, scratch.odd,
            scratch.plane, scratch.row,
        )  # fmt: skip
        found = deliberate(
            values, v0, v1, v2, policy.taps[0], policy.mixture, given.tolerance, given.rationality, given.free, d, out
        )
    elif policy.tables.size > 0:
        for u0 in range(out.shape[0]):
            for u1 in range(out.shape[1]):
                for u2 in range(out.shape[2]):
                    out[u0, u1, u2] = (
                        policy.tables[0, u0, given.middle]
                        * policy.tables[1, u1, given.middle]
                        * policy.tables[2, u2, given.middle]
                    )
    else:
        found = deliberate(
            policy.static, v0, v1, v2, policy.taps[0], policy.mixture, given.tolerance, given.rationality, given.free,
            d, out,
        )  # fmt: skip
    if not found:
        out[:] = 0.0
        out[reach, reach, reach] = 1.0
