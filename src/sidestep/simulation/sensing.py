"""What the sensor tells the planner about people: noisy positions, and velocities from the past only."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.simulation.people import Person, Recorded
from sidestep.simulation.settings import MeasurementSettings
from sidestep.types import FloatArray, Vector, frozen_array, sealed

_STEADY_WINDOW = 0.3  # s, shortest stretch over which noisy positions give a velocity worth having
_FORGOTTEN = 1.5  # s, measurements older than this do not enter a velocity


class Sensor:
    """Measures people once per control step and remembers what it measured.

    Noise and drop-outs are drawn for every person at every step, seen or not: two runs with the same seed have the
    same luck, whatever the robot does.

    Args:
        settings: noise, drop-outs, range, occlusion.
        step: s, control step.
        dimension: d.
        generator: the sensor's own.
        noisy: positions are noisy even where `position_noise` is 0 (recordings).
        obstacles: walls (`sidestep.obstacles.Obstacles`), or None.
    """

    def __init__(
        self,
        settings: MeasurementSettings,
        *,
        step: float,
        dimension: int,
        generator: np.random.Generator,
        noisy: bool = False,
        obstacles: Any = None,
    ) -> None:
        self.settings = settings
        self._dimension = dimension
        self._generator = generator
        self._obstacles = obstacles if settings.occlusion else None
        noisy = noisy or settings.position_noise > 0
        self.window = settings.velocity_window or (max(step, _STEADY_WINDOW) if noisy else step)
        self._past: dict[str, deque[tuple[float, Vector]]] = {}
        variance = settings.position_noise**2
        self._covariance = frozen_array(variance * np.eye(dimension)) if variance > 0 else None
        self._silence = frozen_array(np.zeros(dimension))

    def warm_up(self, people: Sequence[Person], step: float) -> None:
        """Measure people during the last instants before the run, where it is known where they came from."""
        for k in range(-max(round(self.window / step), 1), 0):
            for person in people:
                noise, seen = self._luck()
                place = person.position(k * step)
                if place is not None and seen:
                    self._remember(person.id, k * step, place + noise)

    def observe(self, time: float, robot: Vector, people: Sequence[Person]) -> list[PersonObservation]:
        """Observations of the people who are seen at `time` (s) from the robot's position (d,) m."""
        observations: list[PersonObservation] = []
        for person in people:
            noise, seen = self._luck()
            place = person.position(time)
            if place is None or not seen or not self._visible(robot, place):
                continue
            measured = sealed(place + noise)
            self._remember(person.id, time, measured)
            velocity, covariance = self._velocity(person, time) if self.settings.velocity else (None, None)
            observations.append(
                PersonObservation(
                    id=person.id,
                    position=measured,
                    velocity=velocity,
                    goal=person.told_goal,
                    position_covariance=self._covariance,
                    velocity_covariance=covariance,
                )
            )
        return observations

    def _luck(self) -> tuple[Vector, bool]:
        s = self.settings
        noise = self._silence
        if s.position_noise > 0:
            noise = s.position_noise * self._generator.standard_normal(self._dimension)
        return noise, not (s.dropout > 0 and self._generator.random() < s.dropout)

    def _visible(self, robot: Vector, place: Vector) -> bool:
        if self.settings.range is not None and math.dist(place, robot) > self.settings.range:
            return False
        return self._obstacles is None or bool(self._obstacles.segment_free(robot[None], place[None], margin=0.0)[0])

    def _remember(self, name: str, time: float, measured: Vector) -> None:
        past = self._past.setdefault(name, deque())
        past.append((time, measured))
        while past[0][0] < time - max(_FORGOTTEN, self.window) - 1e-9:
            past.popleft()

    def _velocity(self, person: Person, time: float) -> tuple[Vector | None, FloatArray | None]:
        """Mean velocity over the window up to now, and its covariance; None where the person is new.

        Of recorded people only samples up to now enter: between two samples, the position knows of the next one.
        """
        if isinstance(person, Recorded) and self._covariance is None:
            return person.velocity_before(time, self.window), None
        past = self._past[person.id]
        now, here = past[-1]
        if len(past) < 2:
            return None, None
        then, there = past[0]
        for t, place in past:
            if t > now - self.window + 1e-6:
                break
            then, there = t, place
        elapsed = now - then
        covariance = None if self._covariance is None else 2 * self._covariance / elapsed**2
        return sealed((here - there) / elapsed), covariance
