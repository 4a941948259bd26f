"""A campaign of faults: whatever the world does, `step` answers with a finite command within the limits, and says why.

`SIDESTEP_FAULT_STEPS` sets the number of steps (`make campaign` runs 100,000).
"""

from __future__ import annotations

import os

import numpy as np
import pytest

import sidestep

STEPS = int(os.environ.get("SIDESTEP_FAULT_STEPS", "4000"))
EPISODE = 40


class World:
    """People and sensors that misbehave, drawn from one generator."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.time = 0.0
        self.robot = rng.uniform(-4, 4, 2)
        self.people = {str(i): rng.uniform(-4, 4, 2) for i in range(rng.integers(0, 5))}
        self.velocity = {i: rng.normal(size=2) for i in self.people}

    def advance(self, command: np.ndarray, dt: float) -> None:
        self.time += self.rng.choice([dt, dt, dt, dt, 0.0, 5.0, -1.0, 1e-9, float("nan")], p=[0.2] * 4 + [0.04] * 5)
        self.robot = self.robot + command * dt
        for i in self.people:
            self.people[i] = self.people[i] + self.velocity[i] * dt
            if self.rng.random() < 0.05:
                self.people[i] = self.rng.uniform(-4, 4, 2) * self.rng.choice([1, 100])  # teleports
            if self.rng.random() < 0.1:
                self.velocity[i] = self.rng.normal(size=2) * self.rng.choice([0.5, 1, 100])
        if self.people and self.rng.random() < 0.05:
            self.people.pop(next(iter(self.people)))
        if self.rng.random() < 0.1:
            new = str(self.rng.integers(6))  # may be an id that was used before
            self.people[new], self.velocity[new] = self.rng.uniform(-4, 4, 2), self.rng.normal(size=2)

    def seen(self) -> list[sidestep.PersonObservation] | None:
        if self.rng.random() < 0.05:
            return None
        out: list[sidestep.PersonObservation] = []
        for i, x in self.people.items():
            fault = self.rng.random()
            if fault < 0.05:
                continue  # missed
            position = np.full(2, np.nan) if fault < 0.07 else x + self.rng.normal(size=2) * 0.05
            velocity = None if fault < 0.3 else self.velocity[i]
            if 0.3 < fault < 0.33:
                velocity = np.array([np.inf, np.nan])
            ages = [0.0, 0.3, self.rng.uniform(), 5.0, -1.0, np.nan]
            age = float(self.rng.choice(ages, p=[0.6, 0.2, 0.14, 0.02, 0.02, 0.02]))
            out.append(sidestep.PersonObservation(id=i, position=position, velocity=velocity, age=age))
            if fault > 0.97:
                out.append(out[-1])  # twice
        return out

    def state(self) -> sidestep.RobotState:
        lost, fault = self.rng.random() < 0.02, self.rng.random()
        measured = None if fault < 0.4 else self.rng.normal(size=2) * (1e300 if fault > 0.97 else 1.0)
        if 0.4 < fault < 0.45:
            measured = np.array([np.inf, np.nan])
        return sidestep.RobotState(
            position=np.full(2, np.nan) if lost else self.robot,
            heading=float(self.rng.uniform(-4, 4)),
            velocity=measured,
        )


def robots(rng: np.random.Generator) -> sidestep.Holonomic | sidestep.DifferentialDrive:
    kind = rng.integers(3)
    if kind == 0:
        return sidestep.Holonomic(max_speed=1.0, radius=0.3)
    if kind == 1:
        return sidestep.Holonomic(max_speed=0.7, radius=0.3, shape="disc", max_acceleration=1.0)
    slowly = {"max_acceleration": 0.5, "max_turn_acceleration": 2.0} if rng.random() < 0.5 else {}
    return sidestep.DifferentialDrive(max_speed=0.7, max_turn_rate=1.5, radius=0.2, **slowly)


def check(plan: sidestep.Plan, robot: sidestep.Holonomic | sidestep.DifferentialDrive) -> None:
    check_bounds(plan, robot)
    if plan.status == "certified":
        assert (plan.risk <= plan.risk_limit + 1e-9).all()


def check_bounds(plan: sidestep.Plan, robot: sidestep.Holonomic | sidestep.DifferentialDrive) -> None:
    assert plan.status in ("certified", "least_risk", "stopped")
    assert not plan.reason.startswith("internal"), plan.reason
    for array in (plan.velocity, plan.command, plan.positions, plan.collision_probability, plan.risk):
        assert np.isfinite(array).all()
    if isinstance(robot, sidestep.Holonomic):
        assert (np.abs(plan.velocity) <= robot.max_speed + 1e-6).all()
    else:
        assert abs(plan.command[0]) <= robot.max_speed + 1e-6
        assert abs(plan.command[1]) <= robot.max_turn_rate + 1e-6
    for person in plan.people.values():
        assert 0 < person.belief < 1
    if plan.status == "stopped":
        assert not plan.velocity.any()
        assert not plan.command.any()


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_no_fault_breaks_the_planner(part: int) -> None:
    for episode in range(max(1, STEPS // (4 * EPISODE))):
        rng = np.random.default_rng([part, episode])
        robot = robots(rng)
        planner = sidestep.Planner(robot=robot, goal=rng.uniform(-4, 4, 2), horizon=int(rng.integers(1, 5)))
        world = World(rng)
        dt = float(rng.choice([0.1, 0.5]))
        for _ in range(EPISODE):
            seen = world.seen()
            plan = planner.step(time=world.time, robot=world.state(), people=seen)
            check(plan, robot)
            world.advance(plan.velocity, dt)
