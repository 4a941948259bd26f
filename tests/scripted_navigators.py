"""Navigators for tests of what surrounds them: cheap, and known beforehand."""

from __future__ import annotations

import numpy as np

from sidestep.lattice import Lattice
from sidestep.planning.plan import PersonPlan, Plan
from sidestep.prediction.occupancy import Occupancy
from sidestep.simulation.navigators import steering

HORIZON = 3


class Blind:
    """Straight to the goal."""

    def __init__(self, scenario):
        self.scenario = scenario
        self.seen = []

    def reset(self):
        self.seen = []

    def step(self, *, time, robot, people):
        self.seen.append((time, {p.id: (np.array(p.position), np.array(p.velocity)) for p in people}))
        robot_settings = self.scenario.robot
        gap = np.array(robot_settings.goal) - robot.position
        wanted = gap * min(robot_settings.max_speed / max(np.linalg.norm(gap), 1e-9), 1.0 / self.scenario.period)
        return steering(wanted, robot_settings.max_speed)


class Pondering(Blind):
    """The same way as `Blind`, told as a `Plan`; believes less of everybody at each step."""

    def step(self, *, time, robot, people):
        velocity = super().step(time=time, robot=robot, people=people).velocity
        s = self.scenario.planner
        n = s.horizon
        ahead = np.arange(n + 1)[:, None]
        belief = 0.5 * 0.8 ** len(self.seen)
        return Plan(
            time=time, time_step=s.time_step, velocity=velocity, command=velocity,
            positions=robot.position + ahead * s.time_step * velocity, velocities=np.tile(velocity, (n, 1)),
            collision_probability=np.full(n, 0.001), risk=np.full(n, 0.004), risk_limit=s.risk_limit,
            status="certified", reason="", people={p.id: _person(p, belief, n, s.time_step) for p in people},
            horizon_used=n, rounds=1, cost=0.0, duration=0.0,
        )  # fmt: skip


def _person(observation, belief, n, time_step):
    lattice = Lattice(origin=observation.position, spacing=0.25, radius=2 * n)
    mass = np.zeros((n + 1, *lattice.shape))
    mass[:, 2 * n, 2 * n] = 1.0
    return PersonPlan(
        belief=belief, foretell=lambda: Occupancy(lattice=lattice, probability=mass, time_step=time_step),
        collision_probability=np.zeros(n), goals={}, randomness=0.1,
        position=observation.position, velocity=np.zeros(2),
    )  # fmt: skip
