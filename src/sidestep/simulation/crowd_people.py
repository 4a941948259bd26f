"""People who behave by other models than the predictor's: social force, ORCA, half random.

The planner's own model would grade itself if simulated people followed it; these do not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sidestep.simulation import peers_navground as navground
from sidestep.simulation.assembly import walls_of
from sidestep.simulation.people import Builder, Surroundings
from sidestep.simulation.walkers import Walker
from sidestep.types import Vector

if TYPE_CHECKING:
    from sidestep.simulation.scenario import Scenario

MODELS = {"social-force": "SocialForce", "orca": "ORCA"}
UNCONCERNED = "-unconcerned"
PERSONAL_MARGIN = 0.1  # m, that a person keeps beyond bodies
LOOK_AHEAD = 5.0  # m
PACE_IN_A_HURRY = 1.3  # times the preferred pace, at most


class CrowdWalker(Walker):
    """Walks by a model of navground's, among the others; the robot counts only while the person is concerned.

    Kinds "social-force" and "orca" begin concerned, "social-force-unconcerned" and "orca-unconcerned" do not;
    `switch_times`, where given, turn awareness over: somebody who looks up late, or is distracted.
    """

    def __init__(self, scenario: Scenario, index: int, generator: np.random.Generator) -> None:
        super().__init__(scenario, index, generator)
        kind = self.settings.kind
        self.awareness = 0.0 if kind.endswith(UNCONCERNED) else 1.0
        if "switch_times" in self.settings.model_fields_set:
            self._switches = sorted(self.settings.switch_times)
        self._core = navground.load_navground()
        self._behavior = navground.new_behavior(
            self._core,
            MODELS[kind.removesuffix(UNCONCERNED)],
            PACE_IN_A_HURRY * self.pace,
            self.radius,
            list(walls_of(scenario)),
        )
        self._behavior.horizon = LOOK_AHEAD
        self._behavior.safety_margin = PERSONAL_MARGIN
        if self.settings.arrives_with is not None:
            self.velocity = np.array(self.settings.arrives_with)

    def choose(self, around: Surroundings) -> Vector:
        """What the model commands, given those whom the person heeds."""
        behavior, target = self._behavior, self.target
        behavior.position = self._place
        behavior.velocity = self.velocity
        present = around.company()
        where, pace = around.others[present], around.velocities[present]
        if self.awareness > 0:
            where = np.concatenate([where, around.robot_path[:1]])
            pace = np.concatenate([pace, around.robot_velocity[None]])
        behavior.environment_state.neighbors = navground.neighbours(self._core, where, pace, self.radius)
        behavior.target = self._core.Target.Point(target)
        behavior.optimal_speed = min(self.pace, float(np.linalg.norm(target - self._place)) / self._interval)
        velocity = navground.command(behavior, self._interval)
        return velocity if np.isfinite(velocity).all() else np.zeros(2)


class HalfRandom(Walker):
    """Walks straight to the goal, but at each decision, with probability ω, does anything instead.

    ω is the person's `randomness` where that is given, else one half; "anything" is any of the velocities
    {−v, −v/2, 0, v/2, v}^d, v the person's pace.
    """

    def choose(self, around: Surroundings) -> Vector:
        """Straight on, or anything."""
        del around
        omega = 0.5 if self.settings.randomness is None else self.settings.randomness
        lucky = self.generator.random() >= omega
        anything = self.generator.integers(-2, 3, size=self._place.size).astype(np.float64) * (0.5 * self.pace)
        return self.straight_on() if lucky else anything


def crowd_kinds() -> Mapping[str, Builder]:
    """Kinds of people of this room, by name; to be passed to `simulate`."""
    models = dict.fromkeys((kind + suffix for kind in MODELS for suffix in ("", UNCONCERNED)), CrowdWalker)
    return {**models, "half-random": HalfRandom}
