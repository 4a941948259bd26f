"""What is known of one person, as one frozen value."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.belief import Belief
from sidestep.human.goals import DirectionGoal, Goal, PointGoal
from sidestep.human.habits import Habits
from sidestep.human.model import HumanModel
from sidestep.human.reaction import Facing
from sidestep.lattice import identity
from sidestep.types import FloatArray, Vector

_ARRIVED = 0.3  # m from the goal, within which there is no way to it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Anchor:
    """What a person was expected to do when it was last predicted.

    Attributes:
        time: s; position: (d,) m, measured then; covariance: (d, d) m² of that measurement.
        probabilities: (G, 2, n) P(u|x; goal, β); velocities: (n, d) m/s, world frame.
        belief: before the evidence that has come since.
    """

    time: float
    position: Vector
    covariance: FloatArray
    probabilities: FloatArray
    velocities: FloatArray
    belief: Belief


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mind:
    """One person, as remembered.

    Attributes:
        id: identity; model: of this person.
        seen: s, when they were last measured; measured: (d,) m, then; covariance: (d, d) m² of it.
        told: s, the last call that was told of them: `seen`, or later by what the observation took to come.
        position: (d,) m; velocity: (d,) m/s; now, filtered and carried forward.
        habits: what was learned from the past, or None where the model switches that off.
        goals: candidates, in the order of the belief's rows.
        belief: at the last call; anchor: None until the person was predicted.
        facing: the robot's way and the person's courses, where β is learned from the clearance they gain.
        unseen: s from `seen` to the last call.
    """

    id: str
    model: HumanModel
    seen: float
    told: float
    measured: Vector
    covariance: FloatArray
    position: Vector
    velocity: Vector
    habits: Habits | None
    goals: tuple[Goal, ...]
    belief: Belief
    anchor: Anchor | None = None
    facing: Facing | None = None
    unseen: float = 0.0

    @property
    def randomness(self) -> float:
        """ω of this person: learned where the model says so."""
        learned = self.habits is not None and self.model.online_randomness
        return self.habits.randomness if learned and self.habits else self.model.randomness

    @property
    def heading_velocity(self) -> Vector:
        """(d,) m/s, along which the lattice is laid, so that this motion is exactly an action.

        Where the one goal is known: straight to it at the mean pace of the last seconds, whatever way the person steps
        just now. Otherwise the velocity that the person is expected to keep.
        """
        goal = self.goals[0]
        if len(self.goals) == 1 and isinstance(goal, PointGoal):
            way = goal.position - self.position
            distance = math.hypot(*way.tolist())
            pace = self.velocity if self.habits is None else self.habits.mean_velocity
            if distance > _ARRIVED:
                return way * (max(math.hypot(*pace.tolist()), 1e-6) / distance)
        return self.velocity if self.habits is None else self.habits.extrapolated_velocity

    @property
    def position_covariance(self) -> FloatArray:
        """(d, d) m², of `position`."""
        known = self.covariance if self.habits is None else self.habits.position_covariance
        spread = self.spread(np.zeros(1)) if self.unseen > 0.0 else None
        if spread is None:
            return known
        weights, sigmas = spread
        return known + float(weights @ np.square(sigmas[0])) * identity(self.position.size)

    def spread(self, times: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Weights (C,), sigmas (K, C) m of the Gaussians around the predicted position at `times` (K,) s, or None.

        Whoever is not seen now has been going their own way since they were.
        """
        if self.habits is None or not self.model.steadiness:
            return None
        return self.habits.spread(times + self.unseen)

    @property
    def by_clearance(self) -> bool:
        """Whether β of this person is learned from the clearance they gain, not from their last action."""
        learned = self.model.evidence == "clearance" and self.habits is not None
        return learned and isinstance(self.goals[0], DirectionGoal)
