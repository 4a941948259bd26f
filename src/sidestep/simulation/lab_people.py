"""The person who crosses the lab, and how often it mattered whether they care."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sidestep.simulation.people import Surroundings
from sidestep.simulation.walkers import ModelWalker
from sidestep.types import FloatArray, Vector

if TYPE_CHECKING:
    from sidestep.simulation.scenario import Scenario


class LabWalker(ModelWalker):
    """Decides like any simulated person, and counts the decisions in which awareness made a difference.

    Arguments as for `ModelWalker`.

    Attributes:
        reactions: s, instants of the decisions in which no action is best for a concerned and for an unconcerned
            person alike.
    """

    def __init__(self, scenario: Scenario, index: int, generator: np.random.Generator) -> None:
        super().__init__(scenario, index, generator)
        self.reactions: list[float] = []

    def choose(self, around: Surroundings) -> Vector:
        """Return the velocity until the next decision."""
        if np.linalg.norm(self.target - self._place) > self.model.walking_speed:
            own = self.awareness
            best: list[FloatArray] = []
            for self.awareness in (0.0, 1.0):
                lattice = self._lattice(around.time_step)
                best.append(self._deliberate(lattice, around, self._free(lattice, around), 0.0))
            self.awareness = own
            if not np.any((best[0] > 0) & (best[1] > 0)):
                self.reactions.append(around.time)
        return super().choose(around)
