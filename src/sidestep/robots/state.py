"""The robot, as measured now."""

from __future__ import annotations

from dataclasses import dataclass

from sidestep.checks import measured
from sidestep.types import Vector, VectorLike


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotState:
    """The robot, as measured now.

    Attributes:
        position: (d,) m.
        heading: rad, counter-clockwise from the x axis; needed by `DifferentialDrive`.
        velocity: (d,) m/s, or None when unknown; used where acceleration is limited, and then taken from how far the
            robot has come since the last call. For `DifferentialDrive` that of its reference, or of the axle: what
            points across the heading is taken to come from turning.

    What is masked in an array was not measured: NaN.

    Raises:
        InvalidInput: position or velocity are not numbers.
    """

    position: Vector
    heading: float | None = None
    velocity: Vector | None = None

    def __init__(
        self, *, position: VectorLike, heading: float | None = None, velocity: VectorLike | None = None
    ) -> None:
        object.__setattr__(self, "position", measured("robot.position", position))
        object.__setattr__(self, "heading", heading)
        object.__setattr__(self, "velocity", None if velocity is None else measured("robot.velocity", velocity))
