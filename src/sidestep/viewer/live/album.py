"""Predictions kept while a trip lasts, so that its record can be played back with them from end to end."""

from __future__ import annotations

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.simulation.record import Snapshot
from sidestep.simulation.recorder import snapshot
from sidestep.types import Vector

MOST_PAGES = 160  # planning steps whose predictions are held
NEAREST = 2  # people of each


class Album:
    """Keeps the predictions of the nearest people at every planning step; in long trips, at every second one."""

    def __init__(self) -> None:
        self._pages: list[tuple[int, tuple[Snapshot, ...]]] = []
        self._planned = 0
        self._stride = 1

    def add(self, step: int, plan: Plan, columns: dict[str, int], robot: Vector) -> None:
        """Keep the predictions of a plan.

        Args:
            step: of the record.
            plan: made at this step.
            columns: person's id → index in the record.
            robot: (d,) m, where it is.
        """
        count, self._planned = self._planned, self._planned + 1
        if count % self._stride:
            return
        by_distance = sorted(plan.people.items(), key=lambda item: float(np.linalg.norm(item[1].position - robot)))
        near = [(columns[name], person) for name, person in by_distance if name in columns][:NEAREST]
        self._pages.append((count, tuple(snapshot(step, column, person) for column, person in near)))
        if len(self._pages) > MOST_PAGES:
            self._stride *= 2
            self._pages = [page for page in self._pages if page[0] % self._stride == 0]

    def snapshots(self, steps: int) -> tuple[Snapshot, ...]:
        """Return what is kept of the first `steps` steps."""
        return tuple(shot for _, shots in self._pages for shot in shots if shot.step < steps)
