"""The risk until the next call: people and robot move straight on, and the closest approach is found exactly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sidestep._kernels.risk_sweep import first_step_costs, sweep_risk
from sidestep.types import FloatArray, IntArray, Vector


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstStep:
    """What people may do until the next call. n rows for all people and actions together, P people.

    Attributes:
        positions: (P, d) m; sigmas: (P,) m, standard deviation of each position per axis.
        person: (n,) whose action this is, 0..P−1, rising.
        velocities: (n, d) m/s; probabilities: (n,) summing to 1 for each person.
        distances: (P,) m, closer than which counts.
        interval: s until the next call.
        limit: largest admissible probability of coming closer.
    """

    positions: FloatArray
    sigmas: FloatArray
    person: IntArray
    velocities: FloatArray
    probabilities: FloatArray
    distances: FloatArray
    interval: float
    limit: float = 0.01

    def risk(self, start: Vector, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return, for each robot velocity, the risk of coming close and how fast it approaches people already close.

        Args:
            start: (d,) m, the robot; velocities: (M, d) m/s.

        Returns:
            (M,) probability that anybody who is not yet within the distance comes closer than it at any time in the
            interval (for an uncertain position an upper bound, tight where σ is small against the distance), and
            (M,) m/s, the largest speed toward anybody who is within it already (≤ 0: no such person, or moving away).
        """
        return sweep_risk(
            np.ascontiguousarray(start, dtype=np.float64),
            np.ascontiguousarray(velocities, dtype=np.float64),
            self.positions,
            self.sigmas,
            self.person,
            self.velocities,
            self.probabilities,
            self.distances,
            self.interval,
        )

    def no_worse_than_staying(self, start: Vector) -> FirstStep:
        """Return the same with a limit that admits whatever is no riskier than to stay at `start` (d,) m."""
        staying, _ = self.risk(start, np.zeros((1, len(start))))
        return replace(self, limit=max(self.limit, float(staying[0]) * (1.0 + 1e-9)))

    def costs(self, start: Vector, velocities: FloatArray, *, graded: bool, steep: float) -> FloatArray:
        """Return (M,) 0 where a velocity is admissible, else inf, or when `graded` a cost that rises with the excess.

        Standing still is always admissible: a person who walks into a parked robot is not run over. Where somebody is
        within the distance already, the robot's own motion must not bring it closer to them.
        """
        return first_step_costs(
            start, velocities, self.positions, self.sigmas, self.person, self.velocities, self.probabilities,
            self.distances, self.interval, self.limit, graded, steep,
        )  # fmt: skip


def first_step_risk(
    start: Vector,
    velocities: FloatArray,
    *,
    position: Vector,
    actions: FloatArray,
    probabilities: FloatArray,
    sigma: float,
    distance: float,
    interval: float,
) -> FloatArray:
    """Return (M,) P(closer than `distance` m at any time in `interval` s) to one person, per robot velocity (M, d) m/s.

    Args:
        start: (d,) m, the robot; velocities: (M, d) m/s, of it.
        position: (d,) m, the person, Gaussian with `sigma` m per axis.
        actions: (n, d) m/s and probabilities: (n,), what the person may do meanwhile.
        distance: m, nearer than which counts; interval: s.
    """
    people = FirstStep(
        positions=np.atleast_2d(np.asarray(position, dtype=np.float64)),
        sigmas=np.array([sigma]),
        person=np.zeros(len(actions), dtype=np.int64),
        velocities=np.ascontiguousarray(actions, dtype=np.float64),
        probabilities=np.ascontiguousarray(probabilities, dtype=np.float64),
        distances=np.array([distance]),
        interval=interval,
    )
    risk, approach = people.risk(start, velocities)
    return np.where(approach > -np.inf, 1.0, risk)
