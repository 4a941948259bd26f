"""How far a planner with a deadline looks ahead, by a clock that is told what calls take."""

from __future__ import annotations

import pytest

import sidestep
from sidestep.ladder import climb

DEADLINE = 0.2
"""s"""


class Clock:
    """Stands still but for what a call is said to take, s."""

    def __init__(self) -> None:
        self.now, self.cost = 1000.0, 0.0

    def __call__(self) -> float:
        return self.now

    def climb(self, now, anticipated):
        self.now += self.cost
        return climb(now, anticipated)


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    for module in ("planner", "situation"):
        monkeypatch.setattr(f"sidestep.{module}.perf_counter", made)
    monkeypatch.setattr("sidestep.planner.climb", made.climb)
    return made


class Calls:
    """A planner that is called every 0.1 s, of which each takes what it is said to, s."""

    def __init__(self, clock):
        robot = sidestep.Holonomic(max_speed=1.0, radius=0.3)
        self.planner = sidestep.Planner(robot=robot, goal=(0.0, 5.0), horizon=8, deadline=DEADLINE)
        self.clock, self.time = clock, 0.0

    def __call__(self, *costs):
        plans = []
        for self.clock.cost in costs:
            person = sidestep.PersonObservation(id="a", position=(-2.0, 1.0), velocity=(1.0, 0.0))
            here = sidestep.RobotState(position=(0.0, -1.0))
            plans.append(self.planner.step(time=self.time, robot=here, people=[person]))
            self.time += 0.1
        return plans


def test_a_call_that_is_late_is_a_stop_and_the_next_look_less_far(clock):
    calls = Calls(clock)
    assert [plan.horizon_used for plan in calls(*[0.02] * 5)] == [4, 5, 6, 7, 8]
    (late,) = calls(0.17)  # more than four fifths of the deadline
    assert (late.status, late.reason) == ("stopped", "no plan within the deadline of 0.2 s")
    assert late.velocity.tolist() == [0.0, 0.0]
    assert late.duration == pytest.approx(0.17)
    after = calls(*[0.02] * 5)
    assert {plan.status for plan in after} <= {"certified", "least_risk"}
    assert [plan.horizon_used for plan in after] == [5, 6, 7, 8, 8]
    assert after[0].duration == pytest.approx(0.02)


def test_a_first_call_that_is_late_is_soon_made_up_for(clock):
    calls = Calls(clock)
    assert [plan.status for plan in calls(0.3)] == ["stopped"]
    assert calls(*[0.01] * 40)[-1].horizon_used == 8
