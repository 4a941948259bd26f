"""One step of probability mass along a policy (Eqs. 4, 6). Arrays over cells as in `sweep`; mass is always float64.

`factor` 1 moves mass from cell i to i + u; `factor` 2 moves it to 2i + u of the lattice with half the spacing: where the
person is at mid-step.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sidestep._kernels.sweep import axis_radius


@njit(cache=True, nogil=True)
def span(line, start, stop):
    """First index with mass and one past the last within [start, stop); start == stop if there is none."""
    while start < stop and line[start] == 0.0:
        start += 1
    while stop > start and line[stop - 1] == 0.0:
        stop -= 1
    return start, stop


@njit(cache=True, nogil=True)
def push_separable(mass, radius, centre, tables, middle, share, dimension, factor, out, out_centre, row):
    """out(factor·x + u) += share · mass(x) · Π_a tables[a, u_a, x_a].

    Args:
        mass: (W0, W1, W2), read on the box of `radius` around `centre`.
        tables: (3, 2·reach + 1, W) probability of a component of the action, its cells centred at `middle`.
        share: of the mass that moves this way.
        out: added to; its anchor is at `out_centre`. row: scratch, as long as the last axis of `out`.
    """
    reach = tables.shape[1] // 2
    c0, c1, c2 = axis_radius(centre, dimension)
    o0, o1, o2 = axis_radius(out_centre, dimension)
    m0, m1, m2 = axis_radius(middle, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    r0, r1, r2 = axis_radius(reach, dimension)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            line = mass[c0 + i0, c1 + i1]
            lo, hi = span(line, c2 - b2, c2 + b2 + 1)
            if lo == hi:
                continue
            left = o2 + factor * (lo - c2) - r2
            right = o2 + factor * (hi - 1 - c2) + r2 + 1
            row[left:right] = 0.0
            for u in range(-r2, r2 + 1):
                table = tables[2, u + reach, m2 + lo - c2 : m2 + hi - c2]
                moved = row[left + r2 + u : right]
                source = line[lo:hi]
                for c in range(hi - lo):
                    moved[factor * c] += table[c] * source[c]
            for u0 in range(-r0, r0 + 1):
                for u1 in range(-r1, r1 + 1):
                    part = share * tables[0, u0 + reach, m0 + i0] * tables[1, u1 + reach, m1 + i1]
                    if part == 0.0:
                        continue
                    target = out[o0 + factor * i0 + u0, o1 + factor * i1 + u1, left:right]
                    source = row[left:right]
                    for c in range(right - left):
                        target[c] += part * source[c]


@njit(cache=True, nogil=True)
def deliberate(cost, at0, at1, at2, taps, mixture, tolerance, rationality, free, dimension, choice):
    """P_d over the actions at one cell (Eq. 5, or its Boltzmann form), into choice (T, T, T); False if no action is admissible.

    Args:
        cost: C of `sweep`; (at0, at1, at2) is the cell's index in it.
        taps: (3, T) cost of the components of the first action.
        mixture: (3, T, T) rows: what a chosen component stands for (identity, or the undisturbed component's mean-preserving mixture).
        tolerance: relative; costs this close are tied.
        free: cells a person may occupy, indexed as `cost`, or size 0.
    """
    reach = taps.shape[1] // 2
    r0, r1, r2 = axis_radius(reach, dimension)
    best = np.inf
    for u0 in range(-r0, r0 + 1):
        for u1 in range(-r1, r1 + 1):
            for u2 in range(-r2, r2 + 1):
                value = taps[0, u0 + reach] + (
                    taps[1, u1 + reach] + (taps[2, u2 + reach] + cost[at0 + u0, at1 + u1, at2 + u2])
                )
                choice[u0 + reach, u1 + reach, u2 + reach] = value
                best = min(best, value)
    if not np.isfinite(best):
        return False
    limit = best + tolerance * abs(best) + 1e-12
    total = 0.0
    for u0 in range(reach - r0, reach + r0 + 1):
        for u1 in range(reach - r1, reach + r1 + 1):
            for u2 in range(reach - r2, reach + r2 + 1):
                value = choice[u0, u1, u2]
                weight = 1.0 if value <= limit else 0.0
                if np.isfinite(rationality):
                    weight = np.exp(-rationality * (value - best))
                choice[u0, u1, u2] = weight
                total += weight
    for u0 in range(reach - r0, reach + r0 + 1):
        for u1 in range(reach - r1, reach + r1 + 1):
            for u2 in range(reach - r2, reach + r2 + 1):
                choice[u0, u1, u2] /= total
    if np.isfinite(rationality):
        return True
    _substitute(choice, mixture, free, at0, at1, at2, reach, r0, r1, r2)
    return True


@njit(cache=True, nogil=True)
def _substitute(choice, mixture, free, at0, at1, at2, reach, r0, r1, r2):
    """Replace chosen components by what they stand for, unless that leads into a wall."""
    plain = choice.copy()
    for u0 in range(reach - r0, reach + r0 + 1):
        for u1 in range(reach - r1, reach + r1 + 1):
            for u2 in range(reach - r2, reach + r2 + 1):
                weight = plain[u0, u1, u2]
                if weight == 0.0 or (
                    mixture[0, u0, u0] == 1.0 and mixture[1, u1, u1] == 1.0 and mixture[2, u2, u2] == 1.0
                ):
                    continue
                blocked = False
                for phase in range(2):
                    if phase == 1 and not blocked:
                        choice[u0, u1, u2] -= weight
                    for v0 in range(reach - r0, reach + r0 + 1):
                        for v1 in range(reach - r1, reach + r1 + 1):
                            for v2 in range(reach - r2, reach + r2 + 1):
                                part = mixture[0, u0, v0] * mixture[1, u1, v1] * mixture[2, u2, v2]
                                if part == 0.0:
                                    continue
                                if phase == 1 and not blocked:
                                    choice[v0, v1, v2] += weight * part
                                elif free.size > 0:
                                    inside = free[at0 + v0 - reach, at1 + v1 - reach, at2 + v2 - reach]
                                    blocked = blocked or not inside


@njit(cache=True, nogil=True)
def push_values(
    mass, alive, both, radius, centre, cost, cost_centre, taps, mixture, tolerance, rationality, free,
    share, dimension, choice, out, out_alive, half, half_centre,
):  # fmt: skip
    """Move `share` of the mass along P_d of the values `cost`, cell by cell; `alive` (no contact yet) alongside if `both`.

    `half` (with size > 0) collects where the mass is at mid-step.
    """
    reach = taps.shape[1] // 2
    c0, c1, c2 = axis_radius(centre, dimension)
    v0, v1, v2 = axis_radius(cost_centre, dimension)
    h0, h1, h2 = axis_radius(half_centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    r0, r1, r2 = axis_radius(reach, dimension)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            for i2 in range(-b2, b2 + 1):
                here = share * mass[c0 + i0, c1 + i1, c2 + i2]
                if here == 0.0:
                    continue
                living = share * alive[c0 + i0, c1 + i1, c2 + i2] if both else 0.0
                found = deliberate(
                    cost, v0 + i0, v1 + i1, v2 + i2, taps, mixture, tolerance, rationality, free,
                    dimension, choice,
                )  # fmt: skip
                for u0 in range(-r0, r0 + 1):
                    for u1 in range(-r1, r1 + 1):
                        for u2 in range(-r2, r2 + 1):
                            if found:
                                part = choice[u0 + reach, u1 + reach, u2 + reach]
                            else:
                                part = 1.0 if u0 == 0 and u1 == 0 and u2 == 0 else 0.0
                            if part == 0.0:
                                continue
                            out[c0 + i0 + u0, c1 + i1 + u1, c2 + i2 + u2] += part * here
                            if both:
                                out_alive[c0 + i0 + u0, c1 + i1 + u1, c2 + i2 + u2] += part * living
                            if half.size > 0:
                                half[h0 + 2 * i0 + u0, h1 + 2 * i1 + u1, h2 + 2 * i2 + u2] += part * here


@njit(cache=True, nogil=True)
def push_random_among_walls(mass, radius, centre, free, free_centre, share, dimension, reach, factor, out, out_centre):
    """out(factor·x + u) += share · mass(x) / |admissible u|, where only actions into free cells are admissible (none: stay)."""
    c0, c1, c2 = axis_radius(centre, dimension)
    f0, f1, f2 = axis_radius(free_centre, dimension)
    o0, o1, o2 = axis_radius(out_centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    r0, r1, r2 = axis_radius(reach, dimension)
    for i0 in range(-b0, b0 + 1):
        for i1 in range(-b1, b1 + 1):
            for i2 in range(-b2, b2 + 1):
                here = share * mass[c0 + i0, c1 + i1, c2 + i2]
                if here == 0.0:
                    continue
                near = free[
                    f0 + i0 - r0 : f0 + i0 + r0 + 1, f1 + i1 - r1 : f1 + i1 + r1 + 1, f2 + i2 - r2 : f2 + i2 + r2 + 1
                ]
                count = near.sum()
                if count == 0:
                    out[o0 + factor * i0, o1 + factor * i1, o2 + factor * i2] += here
                    continue
                for u0 in range(-r0, r0 + 1):
                    for u1 in range(-r1, r1 + 1):
                        for u2 in range(-r2, r2 + 1):
                            if near[u0 + r0, u1 + r1, u2 + r2]:
                                out[o0 + factor * i0 + u0, o1 + factor * i1 + u1, o2 + factor * i2 + u2] += here / count


@njit(cache=True, nogil=True)
def remove_contact(alive, radius, centre, robot, spacing, step_weight, contact, profile, profile_step, dimension):
    """Take out of `alive` what touches the robot at `robot` ((d,) m, lattice frame); returns the mass taken out.

    The fraction removed at distance δ is step_weight·[δ < contact] + profile, linear between its samples every `profile_step` m.
    """
    support = max(contact if step_weight > 0.0 else 0.0, profile_step * (profile.size - 1))
    c0, c1, c2 = axis_radius(centre, dimension)
    b0, b1, b2 = axis_radius(radius, dimension)
    r = np.zeros(3)
    r[3 - dimension :] = robot
    removed = 0.0
    lo = np.empty(3, np.int64)
    hi = np.empty(3, np.int64)
    bound = (b0, b1, b2)
    for a in range(3):
        lo[a] = max(-bound[a], int(np.ceil((r[a] - support) / spacing)))
        hi[a] = min(bound[a], int(np.floor((r[a] + support) / spacing)))
    for i0 in range(lo[0], hi[0] + 1):
        for i1 in range(lo[1], hi[1] + 1):
            for i2 in range(lo[2], hi[2] + 1):
                here = alive[c0 + i0, c1 + i1, c2 + i2]
                if here == 0.0:
                    continue
                g0, g1, g2 = spacing * i0 - r[0], spacing * i1 - r[1], spacing * i2 - r[2]
                distance = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
                fraction = step_weight if distance < contact else 0.0
                at = distance / profile_step
                index = int(at)
                if index + 1 < profile.size:
                    fraction += profile[index] + (at - index) * (profile[index + 1] - profile[index])
                alive[c0 + i0, c1 + i1, c2 + i2] = here * (1.0 - fraction)
                removed += here * fraction
    return removed
