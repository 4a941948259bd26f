"""The person whom the visitor steers."""

from __future__ import annotations

from typing import Any

import numpy as np

from sidestep.simulation.people import Surroundings
from sidestep.types import Vector, VectorLike

WALKING_SPEED = 1.3  # m/s, arrow keys
HURRYING_SPEED = 2.0  # m/s, arrow keys with Shift; also the fastest that a dragged person moves
ACCELERATION = 6.0  # m/s²: people start and stop within a step
REACTION = 0.25  # s: a dragged person closes the gap to the hand at gap / REACTION


class Visitor:
    """Follows the hand (a point to go to) or the arrow keys (a direction), within what a body can do.

    Among the simulated people it is one of them (`sidestep.simulation.people.Person`), whose goal nobody knows.

    Args:
        start: (2,) m.
        radius: m.
        bounds: (x0, y0, x1, y1) m that the person does not leave.
        obstacles: walls (`sidestep.obstacles.Obstacles`), or None.
    """

    id = "you"

    def __init__(
        self, *, start: VectorLike, radius: float, bounds: tuple[float, float, float, float], obstacles: Any = None
    ) -> None:
        self.radius = radius
        self.goal: Vector | None = None
        self.told_goal: Vector | None = None
        self.awareness = float("nan")
        self.velocity: Vector = np.zeros(2)
        self.hand: Vector | None = None
        self._time = 0.0
        self._place: Vector = np.array(start, dtype=np.float64)
        self._before = self._place
        self._bounds = bounds
        self._obstacles = obstacles
        self._direction: Vector = np.zeros(2)
        self._hurry = False

    @property
    def place(self) -> Vector:
        """(2,) m, where the visitor is now."""
        return self._place

    def position(self, time: float) -> Vector | None:
        """(2,) m at `time` (s): now, one step ago, or, before the trip, on the way here at the present velocity."""
        if time >= self._time - 1e-9:
            return self._place
        return self._before if time >= 0 else self._place + time * self.velocity

    def decide(self, around: Surroundings) -> None:
        """The visitor decides."""

    def move(self, start: float, end: float) -> None:
        """Move from `start` to `end` (s). Of several worlds that hold the same visitor, the first one moves them."""
        if end > self._time + 1e-9:
            self._advance(end - start)
            self._time = end

    def new_trip(self) -> None:
        """Time begins at 0 again, here."""
        self._time = 0.0
        self._before = self._place

    def drag(self, point: VectorLike | None) -> None:
        """Go to `point` ((2,) m) for as long as it is held; None lets go."""
        self.hand = None if point is None else np.array(point, dtype=np.float64)

    def walk(self, direction: VectorLike, *, hurry: bool = False) -> None:
        """Walk along `direction` ((2,), any length; zero stands still)."""
        d = np.array(direction, dtype=np.float64)
        length = float(np.linalg.norm(d))
        self._direction = d / length if length > 1e-9 else np.zeros(2)
        self._hurry = hurry

    def _advance(self, dt: float) -> None:
        """Go on for `dt` s, along walls where one is in the way."""
        change = self._wanted() - self.velocity
        size = float(np.linalg.norm(change))
        wanted = self.velocity + change * min(1.0, ACCELERATION * dt / max(size, 1e-12))
        old = self._before = self._place
        for share in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0)):
            new = np.clip(old + wanted * np.array(share) * dt, self._bounds[:2], self._bounds[2:])
            if self._obstacles is None or self._obstacles.segment_free(old, new, margin=self.radius):
                self._place = new
                break
        self.velocity = (self._place - old) / dt

    def _wanted(self) -> Vector:
        if self.hand is not None:
            gap = (self.hand - self._place) / REACTION
            return gap * min(1.0, HURRYING_SPEED / max(float(np.linalg.norm(gap)), 1e-12))
        return self._direction * (HURRYING_SPEED if self._hurry else WALKING_SPEED)
