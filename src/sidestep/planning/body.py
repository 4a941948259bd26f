"""Where the body itself goes until it would stand, and what it would run into: walls, and people who stand.

Planning moves one point, and keeps a disc around it that covers the robot free. Somebody may be within that disc, and
so may a wall: beside a base with two wheels, whose point is ahead of its axle, that is no contact yet. Which way the
point may go then depends on the body: drawn back, it swings the axle out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.obstacles import Obstacles
from sidestep.robots import Robot, RobotState
from sidestep.robots.until_standing import until_standing
from sidestep.types import BoolArray, FloatArray

_EXACT = 1e-3  # m, that it may come too near; once it has, no more at the next call
_EQUAL = 1e-6  # m


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A base as it is now, and what stands around it.

    Attributes:
        robot: the base; state: where the middle of its body is, and how its reference moves (None: unknown).
        interval: s until the next call, from which on it brakes.
        people: (K, d) m, who stands; contacts: (K,) m between centres, that a motion must not come within.
        walls: not to be run into, or None where the disc that is planned for is free of them.
    """

    robot: Robot
    state: RobotState
    interval: float
    people: FloatArray
    contacts: FloatArray
    walls: Obstacles | None = None

    def runs_into(self, asked: FloatArray) -> BoolArray:
        """Return (M,) whether a base that is asked for (M, d) m/s, and to stop from the next call on, hits anything.

        Where it is too near already it must not come nearer.
        """
        out = np.zeros(len(asked), dtype=np.bool_)
        if self.walls is None and not len(self.people):
            return out
        places = self.places(asked)
        for person, contact in zip(self.people, self.contacts, strict=True):
            nearest = np.sqrt(np.square(places - person).sum(axis=-1)).min(axis=1)
            out |= nearest < _least(float(contact), math.dist(self.state.position, person))
        if self.walls is not None:
            room = float(self.walls.distance(self.state.position))
            out |= self.walls.distance(places).min(axis=1) < _least(self.robot.radius, room)
        return out

    def places(self, asked: FloatArray) -> FloatArray:
        """Return (M, T, d) m, where the middle of the body is from now until the base stands; see `until_standing`."""
        return until_standing(self.robot, self.state, asked, self.interval)


def _least(kept: float, now: float) -> float:
    """Metres below which it is too near, where `kept` is what it keeps and `now` is how near it is."""
    return min(kept - _EXACT, now) - _EQUAL
