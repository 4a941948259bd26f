"""What is measured of a person at one instant, now or some time ago."""

from __future__ import annotations

from dataclasses import dataclass

from sidestep.checks import measured, measured_number
from sidestep.human.model import HumanModel
from sidestep.types import FloatArray, Vector, VectorLike


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PersonObservation:
    """One person, as measured now or `age` s ago.

    Not validated here: `Planner.step` takes whatever a sensor says and answers with a safe plan. What is masked in an
    array was not measured: NaN.

    Attributes:
        id: identity that a tracker keeps over time.
        position: (d,) m, world frame.
        velocity: (d,) m/s from the past only, or None: then differences of positions are used.
        goal: (d,) m, or None: then the goal is inferred.
        model: the model of this person, or None for the planner's.
        position_covariance: (d, d) m², or None: then the model's `measurement_noise`.
        velocity_covariance: (d, d) m²/s², or None.
        age: s since all this was measured: who is told of late is carried forward at the velocity known of them, and
            doubted accordingly. Negative counts as 0; beyond `PlannerSettings.memory`, the position was not measured.

    Raises:
        InvalidInput: something is not numbers at all.
    """

    id: str
    position: Vector
    velocity: Vector | None = None
    goal: Vector | None = None
    model: HumanModel | None = None
    position_covariance: FloatArray | None = None
    velocity_covariance: FloatArray | None = None
    age: float = 0.0

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
        age: float = 0.0,
    ) -> None:
        keep = object.__setattr__
        keep(self, "id", id)
        keep(self, "position", measured(f"person {id!r}: position", position))
        keep(self, "model", model)
        keep(self, "age", measured_number(f"person {id!r}: age", age))
        told = {
            "velocity": velocity,
            "goal": goal,
            "position_covariance": position_covariance,
            "velocity_covariance": velocity_covariance,
        }
        for name, value in told.items():
            keep(self, name, None if value is None else measured(f"person {id!r}: {name}", value))
