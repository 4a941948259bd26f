"""A planner that drives a base, among people who stand: the closed loop that tests of behaviour share."""

from __future__ import annotations

import numpy as np

from sidestep import DifferentialDrive, Holonomic, Obstacles, PersonObservation, RobotState

SLICE = 0.05
"""s between the places of a trip."""

ROOMS = Obstacles(
    polygons=[
        [(4.0, -6.0), (4.1, -6.0), (4.1, -0.7), (4.0, -0.7)],
        [(4.0, 0.7), (4.1, 0.7), (4.1, 4.0), (4.0, 4.0)],
        [(4.0, 5.6), (4.1, 5.6), (4.1, 6.0), (4.0, 6.0)],
        [(-2.0, 6.0), (10.0, 6.0), (10.0, 6.1), (-2.0, 6.1)],
        [(-2.0, -6.1), (10.0, -6.1), (10.0, -6.0), (-2.0, -6.0)],
        [(-2.1, -6.1), (-2.0, -6.1), (-2.0, 6.1), (-2.1, 6.1)],
        [(10.0, -6.1), (10.1, -6.1), (10.1, 6.1), (10.0, 6.1)],
    ]
)
"""Two rooms, a door of 1.4 m in the middle and one of 1.6 m at the side."""


def bases(*, radius, turning):
    """Every kind of base at 1 m/s, with `radius` m; limits are 1 m/s² and `turning` rad/s²."""
    return {
        "any velocity": Holonomic(max_speed=1.0, radius=radius),
        "limited acceleration": Holonomic(max_speed=1.0, radius=radius, max_acceleration=1.0),
        "two wheels": DifferentialDrive(max_speed=1.0, radius=radius),
        "two wheels, limited acceleration": DifferentialDrive(
            max_speed=1.0, radius=radius, max_acceleration=1.0, max_turn_acceleration=turning
        ),
    }


class Trip:
    """A base that does what its planner asks for, called every `period` s.

    Attributes:
        planner: what drives; people: (K, d) m, where people stand, and state: the base; both may be set between steps.
        time: s; path: (d,) m, where the base was every `SLICE` s; plans: all of them.
        nearest: m from the base to a person, the least so far.
        within: m from the goal, where it has arrived.
    """

    def __init__(self, planner, start=(0.0, 0.0), *, heading=0.0, people=(), period=0.2, within=0.35):
        self.planner, self.period, self.within = planner, period, within
        self.people = np.array(people, dtype=float).reshape(-1, len(start))
        self.state = RobotState(position=np.array(start), heading=heading, velocity=np.zeros(len(start)))
        self.time, self.nearest, self.plans, self.path = 0.0, np.inf, [], [self.state.position]

    @property
    def robot(self):
        return self.planner.robot

    @property
    def plan(self):
        return self.plans[-1]

    @property
    def arrived(self):
        return np.linalg.norm(self.robot.reference(self.state) - self.planner.goal) < self.within

    def to_walls(self):
        """m from the base to a wall, the least so far."""
        return self.planner.obstacles.distance(np.array(self.path)).min()

    def step(self):
        still = np.zeros_like(self.state.position)
        seen = [PersonObservation(id=str(n), position=p, velocity=still) for n, p in enumerate(self.people)]
        self.plans.append(self.planner.step(time=self.time, robot=self.state, people=seen))
        for _ in range(round(self.period / SLICE)):
            self.state = self.robot.follow(self.plan.velocity, self.state, SLICE)
            self.path.append(self.state.position)
            self.nearest = min([self.nearest, *np.linalg.norm(self.people - self.state.position, axis=1)])
        self.time += self.period
        return self.plan

    def run(self, most):
        """Drive until it has arrived, or `most` s are over."""
        while not self.arrived and self.time < most:
            self.step()
        return self

    def __str__(self):
        return f"{self.robot} at {self.state.position}, {self.plan.status}: {self.plan.reason}"
