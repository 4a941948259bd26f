"""How close robot and people came, between the samples too, and which contacts the robot had a part in."""

from __future__ import annotations

import numpy as np

from sidestep.simulation.record import Record
from sidestep.types import BoolArray, FloatArray

STANDING = 0.05  # m/s, a robot slower than this stands


def lengths(vectors: FloatArray) -> FloatArray:
    """(…, d) → (…), of vectors along the last axis; what `np.linalg.norm` takes longer for."""
    return np.sqrt((vectors * vectors).sum(axis=-1))


def closest_within_steps(robot: FloatArray, people: FloatArray) -> FloatArray:
    """Least distance during each step, exact for motions that are straight between the samples.

    Args:
        robot: (T+1, d) m.
        people: (T+1, P, d) m, NaN where absent.

    Returns:
        (T, P) m; the distance at the one end that is known where someone comes or goes; NaN where absent throughout.
    """
    relative = people - robot[:, None]
    first, last = relative[:-1], relative[1:]
    if np.isnan(relative).any():
        first, last = np.where(np.isnan(first), last, first), np.where(np.isnan(last), first, last)
    move = last - first
    square = (move**2).sum(axis=-1)
    moved = square > 0
    share = np.where(moved, -(first * move).sum(axis=-1) / np.where(moved, square, 1.0), 0.0)
    return lengths(first + np.minimum(np.maximum(share, 0.0), 1.0)[..., None] * move)


def contacts(record: Record, gaps: FloatArray) -> tuple[int, int]:
    """Count contacts, each an unbroken stretch in which a body overlaps the robot's.

    Args:
        record: the run.
        gaps: (T, P) m, from `closest_within_steps`.

    Returns:
        (moving, standing): contacts in which the robot moved when they began, or moved toward the person while they
        lasted; and those in which a person walked into a robot that stood or drew back.
    """
    touching = gaps < record.robot_radius + record.people_radii  # NaN compares false
    if not touching.any():
        return 0, 0
    speed = lengths(record.robot_velocities)
    moving = standing = 0
    for person in range(touching.shape[1]):
        for begin, end in _stretches(touching[:, person]):
            toward = record.people_positions[begin:end, person] - record.robot_positions[begin:end]
            closing = (record.robot_velocities[begin:end] * toward).sum(axis=-1) > 0  # NaN compares false
            driven = (speed[begin:end] > STANDING) & closing
            if speed[begin] > STANDING or driven.any():
                moving += 1
            else:
                standing += 1
    return moving, standing


def among_robots(record: Record) -> tuple[int, float]:
    """Return how often the robot touched another one, and the least distance (m) between centres; NaN if alone."""
    if not record.other_robots.size:
        return 0, float("nan")
    gaps = closest_within_steps(record.robot_positions, record.other_robots)
    touching = gaps < record.robot_radius + record.other_radii
    return sum(len(_stretches(column)) for column in touching.T), float(gaps.min())


def _stretches(flags: BoolArray) -> list[tuple[int, int]]:
    """Half-open ranges of consecutive True values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
