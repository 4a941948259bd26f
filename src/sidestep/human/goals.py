"""What a person may be heading for: a point, a direction, or nowhere."""

from __future__ import annotations

from dataclasses import dataclass

from sidestep.types import Vector, VectorLike, frozen_array


@dataclass(frozen=True, slots=True, eq=False)
class PointGoal:
    """A place the person walks to and stops at.

    Attributes:
        position: (d,) m, world frame.
    """

    position: Vector

    def __init__(self, position: VectorLike) -> None:
        object.__setattr__(self, "position", frozen_array(position))


@dataclass(frozen=True, slots=True, eq=False)
class DirectionGoal:
    """Straight on, for ever: the limit of a far goal. Stage cost −direction·x.

    Attributes:
        velocity: (d,) m/s, world frame; the pace the person would keep if nothing was in the way.
    """

    velocity: Vector

    def __init__(self, velocity: VectorLike) -> None:
        object.__setattr__(self, "velocity", frozen_array(velocity))


@dataclass(frozen=True, slots=True)
class StandGoal:
    """The person stays where they are, whatever the robot does."""


Goal = PointGoal | DirectionGoal | StandGoal
