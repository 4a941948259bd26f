"""Robots (Eqs. 3, 10)."""

from __future__ import annotations

from dataclasses import dataclass

from sidestep.types import Vector, VectorLike, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotState:
    """The robot, as measured now.

    Attributes:
        position: (d,) m.
        heading: rad, counter-clockwise from the x axis; needed by `DifferentialDrive`.
        velocity: (d,) m/s, or None when unknown; used where acceleration is limited.
    """

    position: Vector
    heading: float | None = None
    velocity: Vector | None = None

    def __init__(
        self, *, position: VectorLike, heading: float | None = None, velocity: VectorLike | None = None
    ) -> None:
        object.__setattr__(self, "position", frozen_array(position))
        object.__setattr__(self, "heading", heading)
        object.__setattr__(self, "velocity", None if velocity is None else frozen_array(velocity))
