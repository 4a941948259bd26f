"""Many velocities asked at once: where the middle of a base goes until the next call, and on until it stands.

The same motion as `follow` and `executed` of one state, in slices of `SLICE` s and for all velocities together: a
planner asks for hundreds of them in a millisecond.
"""

from __future__ import annotations

import math

import numpy as np

from sidestep.robots.differential import DifferentialDrive
from sidestep.robots.holonomic import Holonomic
from sidestep.robots.state import RobotState
from sidestep.types import FloatArray, Vector

SLICE = 0.05
"""s between the places, the base's own period."""
_EXACT = 1e-3  # m
_ITERATIONS = 4  # of Newton's method


def until_standing(
    robot: Holonomic | DifferentialDrive, state: RobotState, asked: FloatArray, interval: float
) -> FloatArray:
    """Return (M, T, d) m, where the middle of the body is every `SLICE` s from now until the base stands.

    Args:
        robot: the base; state: where it is, and how its reference moves (velocity None: unknown).
        asked: (M, d) m/s, what the reference is asked for during the next `interval` s; from then on it brakes.
        interval: s.
    """
    if isinstance(robot, DifferentialDrive):
        phases = _phases(robot.planning_acceleration, robot.planning_speed, interval)
        return _driven(robot, state, asked, phases)
    return slid(state.position, state.velocity, asked, interval, robot.max_acceleration)


def _phases(acceleration: float | None, top_speed: float, interval: float) -> list[tuple[bool, float]]:
    """Whether the base still does what it was asked for, and how many s that slice lasts: then it brakes."""
    driving = slices(interval)
    braking = 1 if acceleration is None else math.ceil(1.5 * top_speed / (acceleration * SLICE))
    return [(True, interval / driving)] * driving + [(False, SLICE)] * braking


def slices(interval: float) -> int:
    """Return in how many slices a base does what it is asked for until the next call, `interval` s from now."""
    return max(1, math.ceil(interval / SLICE - 1e-9))


def slid(
    start: Vector,
    known: Vector | None,
    asked: FloatArray,
    interval: float,
    acceleration: float | None,
) -> FloatArray:
    """Return (M, T, d) m, where a point that takes any direction is every `SLICE` s from now until it stands.

    Args:
        start: (d,) m, where it is; known: (d,) m/s, its velocity, or None.
        asked: (M, d) m/s, what it is asked for during the next `interval` s; from then on it brakes.
        interval: s.
        acceleration: m/s² at most, or None: it can do anything at once.
    """
    fastest = max(float(np.linalg.norm(v, axis=-1).max(initial=0.0)) for v in (asked, known) if v is not None)
    place = np.broadcast_to(start, asked.shape)
    velocity = asked if known is None or acceleration is None else np.broadcast_to(known, asked.shape)
    places = [place]
    for driving, step in _phases(acceleration, fastest, interval):
        goal = asked if driving else np.zeros_like(asked)
        change = goal - velocity
        if acceleration is not None and known is not None:
            size = np.sqrt(np.square(change).sum(axis=1, keepdims=True))
            change = change * np.minimum(acceleration * step / np.maximum(size, 1e-12), 1.0)
            place = place + (velocity + 0.5 * change) * step
        else:
            place = place + goal * step
        velocity = velocity + change
        places.append(place)
        if not (driving or velocity.any()):
            break
    return np.stack(places, axis=1)


def _driven(
    robot: DifferentialDrive, state: RobotState, asked: FloatArray, phases: list[tuple[bool, float]]
) -> FloatArray:
    """Of a base with two wheels, whose own loop makes the reference follow (`DifferentialDrive.follow`)."""
    count, offset = len(asked), robot.offset
    assert state.heading is not None
    heading = np.full(count, state.heading)
    place = np.broadcast_to(state.position, (count, 2))
    target = place + offset * _directions(heading)
    known = state.velocity
    along, turn = np.zeros(count), np.zeros(count)
    if known is not None:
        along, turn = _twist(np.broadcast_to(known, (count, 2)), heading, offset)
    limits = robot.max_acceleration if known is not None else None, robot.max_turn_acceleration
    places = [place]
    for driving, step in phases:
        wanted = np.zeros(count), np.zeros(count)
        if driving:
            target = target + asked * step
            wanted = _arcs(target - place - offset * _directions(heading), heading, offset, step)
            excess = np.maximum(np.abs(wanted[0]) / robot.max_speed, np.abs(wanted[1]) / robot.max_turn_rate)
            wanted = wanted[0] / np.maximum(excess, 1.0), wanted[1] / np.maximum(excess, 1.0)
        changes = wanted[0] - along, wanted[1] - turn
        excess = np.ones(count)
        for change, limit in zip(changes, limits, strict=True):
            if limit is not None and known is not None:
                excess = np.maximum(excess, np.abs(change) / (limit * step))
        along, turn = along + changes[0] / excess, turn + changes[1] / excess
        place = place + (along * step)[:, None] * _directions(heading + 0.5 * turn * step)
        heading = heading + turn * step
        places.append(place)
        if not (driving or along.any() or turn.any()):
            break
    return np.stack(places, axis=1)


def _twist(velocities: FloatArray, heading: FloatArray, offset: float) -> tuple[FloatArray, FloatArray]:
    """(M,) m/s and (M,) rad/s, v and ω, that give the reference velocities (M, 2) m/s (Eq. 10)."""
    cosine, sine = np.cos(heading), np.sin(heading)
    x, y = velocities[:, 0], velocities[:, 1]
    return x * cosine + y * sine, (y * cosine - x * sine) / offset


def _arcs(aims: FloatArray, heading: FloatArray, offset: float, step: float) -> tuple[FloatArray, FloatArray]:
    """(M,) m/s, (M,) rad/s that, held for `step` s, move the reference by `aims` (M, 2) m: `differential._arc`."""
    v, turn = guess = _twist(aims / step, heading, offset)
    along, across = v * step, turn * step * offset
    x = y = np.zeros(len(aims))
    with np.errstate(all="ignore"):  # what does not settle is not used
        for _ in range(_ITERATIONS):
            a = turn * step
            bent = np.where(np.abs(a) < 1e-4, 1e-4, a)
            sine, cosine = np.sin(bent), np.cos(bent)
            s, c = sine / bent, (1.0 - cosine) / bent
            ds, dc = (cosine - s) / bent, (sine - c) / bent
            x = v * step * s + offset * (cosine - 1.0) - along
            y = v * step * c + offset * sine - across
            j11, j12 = step * s, (v * step * ds - offset * sine) * step
            j21, j22 = step * c, (v * step * dc + offset * cosine) * step
            determinant = j11 * j22 - j12 * j21
            v, turn = v - (j22 * x - j12 * y) / determinant, turn - (j11 * y - j21 * x) / determinant
    settled = (np.abs(x) + np.abs(y) < _EXACT) & (np.abs(turn * step) < math.pi)
    return np.where(settled, v, guess[0]), np.where(settled, turn, guess[1])


def _directions(heading: FloatArray) -> FloatArray:
    """(M, 2)."""
    return np.stack([np.cos(heading), np.sin(heading)], axis=1)
