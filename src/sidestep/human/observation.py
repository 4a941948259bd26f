"""What is measured of a person at one instant."""

from __future__ import annotations

from dataclasses import dataclass

from sidestep.human.model import HumanModel
from sidestep.types import FloatArray, Vector, VectorLike, settled


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PersonObservation:
    """One person, as measured now.

    Not validated here: `Planner.step` takes whatever a sensor says and answers with a safe plan.

    Attributes:
        id: identity that a tracker keeps over time.
        position: (d,) m, world frame.
        velocity: (d,) m/s from the past only, or None: then differences of positions are used.
        goal: (d,) m, or None: then the goal is inferred.
        model: the model of this person, or None for the planner's.
        position_covariance: (d, d) m², or None: then the model's `measurement_noise`.
        velocity_covariance: (d, d) m²/s², or None.
    """

    id: str
    position: Vector
    velocity: Vector | None = None
    goal: Vector | None = None
    model: HumanModel | None = None
    position_covariance: FloatArray | None = None
    velocity_covariance: FloatArray | None = None

    def __init__(
        self,
        *,
        id: str,
        position: VectorLike,
        velocity: VectorLike | None = None,
        goal: VectorLike | None = None,
        model: HumanModel | None = None,
        position_covariance: FloatArray | None = None,
        velocity_covariance: FloatArray | None = None,
    ) -> None:
        keep = object.__setattr__
        keep(self, "id", id)
        keep(self, "position", settled(position))
        keep(self, "velocity", None if velocity is None else settled(velocity))
        keep(self, "goal", None if goal is None else settled(goal))
        keep(self, "model", model)
        keep(self, "position_covariance", None if position_covariance is None else settled(position_covariance))
        keep(self, "velocity_covariance", None if velocity_covariance is None else settled(velocity_covariance))
