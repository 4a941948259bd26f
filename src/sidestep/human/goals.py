"""What a person may be heading for: a point, a direction, a near end of their walk, or nowhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sidestep.types import Vector, VectorLike, settled


@dataclass(frozen=True, slots=True, eq=False)
class PointGoal:
    """A place the person walks to and stops at.

    Attributes:
        position: (d,) m, world frame.
    """

    position: Vector

    def __init__(self, position: VectorLike) -> None:
        object.__setattr__(self, "position", settled(position))


@dataclass(frozen=True, slots=True, eq=False)
class DirectionGoal:
    """Straight on, for ever: the limit of a far goal. Stage cost −direction·x.

    Attributes:
        velocity: (d,) m/s, world frame; the pace the person would keep if nothing was in the way.
    """

    velocity: Vector

    def __init__(self, velocity: VectorLike) -> None:
        object.__setattr__(self, "velocity", settled(velocity))


@dataclass(frozen=True, slots=True, eq=False)
class SlowingGoal:
    """The person goes straight on ever more slowly and comes to a stop, whatever the robot does.

    The velocity falls to 1/e in `time` s, so that the walk ends at velocity·time: being a rule of the place alone
    ("the nearer the end, the slower"), it needs no sweep.

    Attributes:
        velocity: (d,) m/s, world frame, now.
        time: s (> 0).
    """

    velocity: Vector
    time: float

    def __init__(self, velocity: VectorLike, time: float) -> None:
        object.__setattr__(self, "velocity", settled(velocity))
        object.__setattr__(self, "time", float(time))

    def held(self, duration: float) -> DirectionGoal:
        """Return the same way at its mean pace over `duration` s: what is made of it among walls."""
        rest = duration / self.time
        return DirectionGoal(self.velocity * (-math.expm1(-rest) / rest))


@dataclass(frozen=True, slots=True)
class StandGoal:
    """The person stays where they are, whatever the robot does."""


Goal = PointGoal | DirectionGoal | SlowingGoal | StandGoal
