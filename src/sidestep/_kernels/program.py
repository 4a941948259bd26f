"""The convex program around a path: Eq. 9 to second order, with half-planes for what is forbidden and too fast.

Unknown are the positions x_1..x_N (m), flat; x_0 is given. All arrays are as wide as the d real axes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray

CHORDS = 4
"""Half-planes per step that stand for the speed disc, around the present direction."""
CHORD_ANGLE = 0.35
"""rad that each of them spans; the speed lost between two is 1.5 %."""


@njit(**KERNEL)
def goal_model(
    path: FloatArray, goal: FloatArray, weight: FloatArray, squared: bool, terminal: float
) -> tuple[FloatArray, FloatArray]:
    """Diagonal curvature and slope (N, d) of the straight-line goal cost; for distances a quadratic from above.

    Args:
        path: (N+1, d) m.
        goal: (d,) m.
        weight: (d,) θ5.
        squared: ‖x−g‖²_θ5, else ‖θ5·(x−g)‖.
        terminal: further multiple at step N.
    """
    steps, d = path.shape[0] - 1, path.shape[1]
    curvature, slope = np.empty((steps, d)), np.empty((steps, d))
    for k in range(steps):
        scale = 1.0 + (terminal if k == steps - 1 else 0.0)
        length = 0.0
        for a in range(d):
            length += (weight[a] * (path[k + 1, a] - goal[a])) ** 2
        length = max(math.sqrt(length), 1e-3)
        for a in range(d):
            curvature[k, a] = scale * (2.0 * weight[a] if squared else weight[a] * weight[a] / length)
            slope[k, a] = curvature[k, a] * (path[k + 1, a] - goal[a])
    return curvature, slope


@njit(**KERNEL)
def objective(
    path: FloatArray,
    curvature: FloatArray,
    slope: FloatArray,
    effort: FloatArray,
    first: FloatArray,
    first_weight: float,
    out: FloatArray,
) -> None:
    """Write the Hessian of the objective around `path` and, below it, the linear term: `out` (N·d + 1, N·d).

    Args:
        path: (N+1, d) m.
        curvature: (N, d), with
        slope: (N, d), of everything but the motion itself.
        effort: (d,) weight of ½·‖x_k − x_{k−1}‖² per axis.
        first: (d,) m, where x_1 is preferred, with
        first_weight: of ½·‖x_1 − first‖²; 0 where no place is.
        out: whatever it holds is overwritten.
    """
    steps, d = curvature.shape
    hessian, linear = out[: steps * d], out[steps * d]
    hessian[:] = 0.0
    for k in range(steps):
        for a in range(d):
            n = k * d + a
            hessian[n, n] = (2.0 if k + 1 < steps else 1.0) * effort[a] + curvature[k, a] + 1e-9
            linear[n] = slope[k, a] - curvature[k, a] * path[k + 1, a]
            if k > 0:
                hessian[n, n - d] = hessian[n - d, n] = -effort[a]
            else:
                hessian[n, n] += first_weight
                linear[n] -= effort[a] * path[0, a] + first_weight * first[a]


@njit(**KERNEL)
def _chords(move: FloatArray, length: float, normals: FloatArray) -> float:
    """Write the inner half-planes (CHORDS, d) to the ball of `length` around the direction of `move`; their limit."""
    d = move.size
    size = 0.0
    for a in range(d):
        size += move[a] * move[a]
    size = math.sqrt(size)
    forward = np.zeros(d)
    for a in range(d):
        forward[a] = move[a] / size if size > 1e-9 else (1.0 if a == 0 else 0.0)
    if d == 2:
        for m in range(CHORDS):
            angle = CHORD_ANGLE * (m - 0.5 * (CHORDS - 1))
            c, s = math.cos(angle), math.sin(angle)
            normals[m, 0] = c * forward[0] - s * forward[1]
            normals[m, 1] = c * forward[1] + s * forward[0]
        return length * math.cos(0.5 * CHORD_ANGLE)
    other, side, up = np.zeros(3), np.zeros(3), np.zeros(3)
    other[2 if abs(forward[2]) < 0.9 else 0] = 1.0
    size = _across(forward, other, side)
    for a in range(3):
        side[a] /= size
    _across(forward, side, up)
    for m in range(CHORDS):
        angle = 0.5 * math.pi * m + 0.25 * math.pi
        for a in range(3):
            tilt = math.cos(angle) * side[a] + math.sin(angle) * up[a]
            normals[m, a] = math.cos(0.5 * CHORD_ANGLE) * forward[a] + math.sin(0.5 * CHORD_ANGLE) * tilt
    return length * math.cos(0.5 * CHORD_ANGLE)


@njit(**KERNEL)
def _across(a: FloatArray, b: FloatArray, out: FloatArray) -> float:
    """Write a × b (3,) and return its length; NumPy's own takes 5 s to compile."""
    total = 0.0
    for n in range(3):
        m, k = (n + 1) % 3, (n + 2) % 3
        out[n] = a[m] * b[k] - a[k] * b[m]
        total += out[n] * out[n]
    return math.sqrt(total)


@njit(**KERNEL)
def _speed_limits(path: FloatArray, length: float, box: bool, slack: float) -> tuple[FloatArray, FloatArray]:
    """Normals (N·m, d) and limits (N·m,) m of every step; a limit of inf cannot be met within the trust region."""
    steps, d = path.shape[0] - 1, path.shape[1]
    count = 2 * d if box or d == 1 else CHORDS
    normals, limits = np.zeros((steps * count, d)), np.full(steps * count, length)
    for k in range(steps):
        at = k * count
        if box or d == 1:
            for a in range(d):
                normals[at + a, a], normals[at + d + a, a] = 1.0, -1.0
        else:
            limits[at : at + count] = _chords(path[k + 1] - path[k], length, normals[at : at + count])
        for m in range(at, at + count):
            along = slack
            for a in range(d):
                along += normals[m, a] * (path[k + 1, a] - path[k, a])
            if along < limits[m]:
                limits[m] = np.inf
    return normals, limits


@njit(**KERNEL)
def half_planes(
    path: FloatArray, room: FloatArray, directions: FloatArray, reach: float, length: float, box: bool, slack: float
) -> FloatArray:
    """Constraints A·x ≤ b that keep off forbidden places and within the speed limit: (N·d + 1, ·) Aᵀ and, below it, b.

    Args:
        path: (N+1, d) m.
        room: (2N, m) m that the path may move at half instants 1..2N in each direction; or size 0.
        directions: (m, d) unit vectors.
        reach: m; a room as large is no constraint.
        length: m per step at the speed limit.
        box: the limit holds for every axis, not for the norm.
        slack: m by which a step can grow within the trust region.
    """
    steps, d = path.shape[0] - 1, path.shape[1]
    normals, limits = _speed_limits(path, length, box, slack)
    per_step = limits.size // steps
    count = 0
    for n in range(room.shape[0]):
        for m in range(room.shape[1]):
            count += room[n, m] < reach
    for m in range(limits.size):
        count += limits[m] < np.inf
    out = np.zeros((steps * d + 1, count))
    columns, bounds = out[: steps * d], out[steps * d]
    row = 0
    for n in range(room.shape[0]):
        midway, later = n % 2 == 0, n // 2  # unknown `later` is the position at step later + 1
        for m in range(room.shape[1]):
            if not room[n, m] < reach:
                continue
            bounds[row] = room[n, m]
            for a in range(d):
                normal, after, before = directions[m, a], path[later + 1, a], path[later, a]
                bounds[row] += normal * (0.5 * (before + after) if midway else after)
                columns[later * d + a, row] = (0.5 if midway else 1.0) * normal
                if midway and later > 0:
                    columns[(later - 1) * d + a, row] = 0.5 * normal
                elif midway:
                    bounds[row] -= 0.5 * normal * before
            row += 1
    for m in range(limits.size):
        if not limits[m] < np.inf:
            continue
        k = m // per_step
        bounds[row] = limits[m]
        for a in range(d):
            columns[k * d + a, row] = normals[m, a]
            if k > 0:
                columns[(k - 1) * d + a, row] = -normals[m, a]
            else:
                bounds[row] += normals[m, a] * path[0, a]
        row += 1
    return out
