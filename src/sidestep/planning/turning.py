"""Turning on the spot: what a base with two wheels can do beside any wall, since its body is round.

Planning moves a point ahead of the axle. Drawn back, it swings the axle out, for which there may be no room; and once
it is nearer to a wall than `wall_margin`, the way forward may lead the body into that.
"""

from __future__ import annotations

import math

import numpy as np

from sidestep.obstacles import Obstacles
from sidestep.robots import DifferentialDrive
from sidestep.types import Path, Vector

_STILL = 0.01  # m, less than which is no motion
_SPOT = 0.5e-3  # m; ℓ·angle²/8, the height of the arc above the chord that the reference is asked to follow


def waits(path: Path) -> bool:
    """Return whether a motion (N+1, d) m begins with standing."""
    return float(np.abs(path[1] - path[0]).max()) < _STILL


def turn(
    robot: DifferentialDrive, walls: Obstacles, *, middle: Vector, path: Path, velocity: Vector | None, hold: float
) -> Vector | None:
    """Return (2,) m/s, with which the base turns on the spot until the next call; None where it had better not.

    It does where the path backs up and there is no room to swing the axle out, the way that the path goes; and where a
    wall is so near ahead that the path waits, away from that. It turns by so little that its middle leaves its place by
    `_SPOT` at most.

    Args:
        robot: the base; walls: around it.
        middle: (2,) m, of its axle.
        path: (N+1, 2) m, what is planned for its reference, which is at path[0] now.
        velocity: (2,) m/s of the reference, or None where nobody knows.
        hold: s until the next call.
    """
    start, gone = path[0], path - path[0]
    room = float(walls.distance(start))
    beyond = np.square(gone).sum(axis=1) > robot.offset**2
    if room >= robot.planning_radius or not beyond.any():
        return None
    along, arm = gone[beyond.argmax()], start - middle
    aside = np.array([-arm[1], arm[0]])
    angle = min(robot.planning_speed / robot.offset * hold, math.sqrt(8.0 * _SPOT / robot.offset))
    turned = math.cos(angle) * arm + math.sin(angle) * np.array([aside, -aside])  # to the left, to the right
    if float(along @ arm) < 0.0:
        now = np.zeros(2) if velocity is None else velocity
        turns = 4.0 * abs(float(now @ arm)) < abs(float(now @ aside))  # a turn that is begun goes on as it is
        left = float((now if turns else along) @ aside) >= 0.0
    elif room < robot.wall_margin and waits(path):
        rooms = walls.distance(middle + turned)
        left = bool(rooms[0] >= rooms[1])
    else:
        return None
    return (turned[0 if left else 1] - arm) / hold
