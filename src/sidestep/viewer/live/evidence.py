"""What a planner's belief and plan come to, in numbers that a sentence can hold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.prediction.occupancy import Occupancy

CHANCE = 0.5  # s; evidence within this time is one chance
TELLING = 0.35  # change of the log-odds that counts as an answer (a factor of 1.4 in the odds)


@dataclass(slots=True)
class Evidence:
    """Counts answers of one person.

    Attributes:
        ignored: chances in a row that were not taken.
        taken: chances in a row that were taken.
    """

    ignored: int = 0
    taken: int = 0
    _since: float = -math.inf
    _odds: float = math.nan

    def note(self, time: float, belief: float) -> None:
        """Take in P(concerned) as of `time` (s)."""
        p = min(max(belief, 1e-9), 1.0 - 1e-9)
        odds = math.log(p / (1.0 - p))
        if math.isnan(self._odds):
            self._since, self._odds = time, odds
            return
        if time - self._since < CHANCE - 1e-6:
            return
        change = odds - self._odds
        self._since, self._odds = time, odds
        if change <= -TELLING:
            self.ignored, self.taken = self.ignored + 1, 0
        elif change >= TELLING:
            self.ignored, self.taken = 0, self.taken + 1


def smallest_expected_distance(plan: Plan, occupancy: Occupancy) -> float:
    """Metres between the planned robot and where the person is expected (the mean), smallest over k = 1..N."""
    axis, lattice = occupancy.lattice.axis(), occupancy.lattice
    smallest = math.inf
    for k in range(1, min(len(plan.positions), len(occupancy))):
        mass = occupancy[k]
        mean = np.array([float(mass.sum(axis=1) @ axis), float(mass.sum(axis=0) @ axis)])
        gap = float(np.linalg.norm(lattice.to_world(mean) - plan.positions[k]))
        smallest = min(smallest, gap)
    return smallest
