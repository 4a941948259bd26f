"""Faults in any order, found and shrunk by hypothesis: no exception, no NaN, no command outside the limits.

`SIDESTEP_FAULT_EXAMPLES` sets how many histories are tried (`make campaign` tries many more).
"""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

import sidestep
from test_planner_faults import check

EXAMPLES = int(os.environ.get("SIDESTEP_FAULT_EXAMPLES", "8"))
STEPS = 30
coordinate = st.floats(-4.0, 4.0)
place = st.tuples(coordinate, coordinate)
name = st.sampled_from("abc")
WALLS = (
    None,
    sidestep.Obstacles(polygons=[[(-6.0, 5.0), (6.0, 5.0), (6.0, 5.2), (-6.0, 5.2)]]),
    sidestep.Obstacles(polygons=[[(-6.0, -5.2), (6.0, -5.2), (6.0, -5.0), (-6.0, -5.0)]]),
)


class Faults(RuleBasedStateMachine):
    """A planner in a world that goes wrong; every rule ends with a call."""

    @initialize(seed=st.integers(0, 2**16), kind=st.integers(0, 2), horizon=st.integers(1, 3), goal=place)
    def begin(self, seed, kind, horizon, goal):
        robots = (
            sidestep.Holonomic(max_speed=1.0, radius=0.3),
            sidestep.Holonomic(max_speed=0.7, radius=0.3, shape="disc", max_acceleration=1.0),
            sidestep.DifferentialDrive(max_speed=0.7, max_turn_rate=1.5, radius=0.2),
        )
        self.robot = robots[kind]
        self.planner = sidestep.Planner(robot=self.robot, goal=goal, horizon=horizon)
        self.generator = np.random.default_rng(seed)
        self.time, self.position = 0.0, self.generator.uniform(-4, 4, 2)
        self.people = {"a": (np.array([1.0, 1.0]), np.array([0.5, 0.0]))}
        self.seen_at = 0.0
        self.before = self.now()
        self.call(self.now())  # time can only run backwards where it has been told

    def now(self):
        return [sidestep.PersonObservation(id=i, position=x, velocity=v) for i, (x, v) in self.people.items()]

    def call(self, people, *, dt=0.2):
        self.time += dt
        self.people = {i: (x + dt * v, v) for i, (x, v) in self.people.items()}
        heading = float(self.generator.uniform(-4, 4))
        state = sidestep.RobotState(position=self.position, heading=heading)
        plan = self.planner.step(time=self.time, robot=state, people=people)
        check(plan, self.robot)
        self.position = np.clip(self.position + 0.2 * plan.velocity, -4, 4)
        self.before = self.now()
        self.seen_at = self.seen_at if people is None else self.time
        return plan

    @rule()
    def nothing_is_wrong(self):
        self.call(self.now())

    @rule(who=name, where=place, velocity=place)
    def somebody_appears_or_teleports_under_a_used_name(self, who, where, velocity):
        self.people[who] = (np.array(where), np.array(velocity))
        self.call(self.now())

    @rule(who=name)
    def somebody_vanishes(self, who):
        self.people.pop(who, None)
        self.call(self.now())

    @rule(who=name, factor=st.sampled_from([20.0, 100.0]))
    def a_velocity_is_absurd(self, who, factor):
        seen = self.now()
        seen.append(sidestep.PersonObservation(id=who, position=(1.0, 0.0), velocity=(factor, -factor)))
        self.call(seen)

    @rule(value=st.sampled_from([np.nan, np.inf, -np.inf]))
    def a_number_is_none(self, value):
        self.call([*self.now(), sidestep.PersonObservation(id="a", position=(value, 0.0), velocity=(0.0, value))])

    @rule()
    def observations_come_twice(self):
        self.call(self.now() * 2)

    @rule()
    def observations_come_late(self):
        self.call(self.before)

    @rule(age=st.floats(0.0, 1.5) | st.sampled_from([np.nan, np.inf, -np.inf]))
    def observations_come_late_and_say_so(self, age):
        self.call([replace(seen, age=age) for seen in self.before])

    @rule(dt=st.sampled_from([0.0, 1e-9, 7.0]))
    def time_stalls_or_jumps(self, dt):
        self.call(self.now(), dt=dt)

    @rule()
    def time_runs_backwards(self):
        assert self.call(self.now(), dt=-0.3).status == "stopped"

    @rule(goal=place)
    def the_goal_moves(self, goal):
        self.planner.goal = goal
        self.call(self.now())

    @rule(which=st.integers(0, 2))
    def the_map_changes(self, which):
        self.planner.obstacles = WALLS[which]
        self.planner.goal = self.planner.goal
        self.call(self.now())

    @rule(calls=st.integers(1, 8))
    def observations_are_lost(self, calls):
        for _ in range(calls):
            plan = self.call(None)
            if self.time - self.seen_at > self.planner.settings.timeout + 1e-9:
                assert plan.status == "stopped"


TestFaults = Faults.TestCase
TestFaults.settings = settings(
    max_examples=EXAMPLES, stateful_step_count=STEPS, deadline=None, suppress_health_check=list(HealthCheck)
)
TestFaults.pytestmark = [pytest.mark.slow]
