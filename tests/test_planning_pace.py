"""The horizon that fits a deadline, by a clock that is told what calls take."""

from __future__ import annotations

from copy import copy

import pytest

from sidestep import Holonomic, PersonObservation, Planner, RobotState
from sidestep.planning.pace import Pace
from sidestep.planning.settings import PlannerSettings

FEW = {n: 1e-3 * (3.0 + (n / 6.0) ** 3) for n in range(1, 51)}
"""s that a call takes among few people, by horizon."""
MANY = {n: 1e-3 * (4.0 + n**2) for n in range(1, 51)}
"""The same among twelve."""


def driven(pace, settings, costs, calls):
    """The horizons of so many calls, of which those beyond 0.8 of the deadline are late."""
    chosen = []
    for _ in range(calls):
        chosen.append(n := pace.horizon(settings))
        if costs[n] > 0.8 * settings.deadline:
            pace.late(n, costs[n])
        else:
            pace.took(n, costs[n])
    return chosen


@pytest.mark.parametrize(("deadline", "best"), [(0.02, 2), (0.05, 4), (0.1, 6), (0.41, 14)])
def test_among_many_it_keeps_to_what_fits(deadline, best):
    chosen = driven(Pace(), PlannerSettings(deadline=deadline, horizon=20), MANY, 60)[30:]
    assert set(chosen) <= {best, best + 1}


@pytest.mark.parametrize("deadline", [0.02, 0.05, 0.2])
def test_it_grows_while_there_is_time_and_again_when_people_have_gone(deadline):
    pace, settings = Pace(), PlannerSettings(deadline=deadline, horizon=50)
    best = max(n for n, cost in FEW.items() if cost <= 0.5 * deadline)
    assert max(driven(pace, settings, FEW, 60)) >= min(best, 50)
    assert min(driven(pace, settings, MANY, 60)[20:]) >= max(n for n in MANY if MANY[n] <= 0.5 * deadline)
    assert max(driven(pace, settings, FEW, 100)) >= min(best, 50)


def test_one_hiccup_is_forgotten():
    pace, settings = Pace(), PlannerSettings(deadline=0.05, horizon=8)
    assert driven(pace, settings, FEW, 10)[-1] == 8
    pace.late(8, 0.3)
    assert pace.horizon(settings) < 8
    assert driven(pace, settings, FEW, 5)[-1] == 8
    pace.took(8, 0.04)  # much longer than before, and in time
    assert set(driven(pace, settings, FEW, 5)) == {8}


@pytest.mark.parametrize(("acceleration", "steps"), [(None, 1), (1.0, 3), (0.5, 5)])
def test_however_little_time_there_is_a_plan_sees_the_base_stand(acceleration, steps):
    """At 1 m/s a plan of one step was certified, though nobody had looked where the base would stop."""
    robot = Holonomic(max_speed=1.0, radius=0.3, max_acceleration=acceleration)
    planner = Planner(robot=robot, goal=(8.0, 0.0), deadline=100.0)
    planner._pace.took(1, 80.0)
    for time in (0.0, 0.1):
        state = RobotState(position=(time, 0.0), velocity=(1.0, 0.0))
        plan = planner.step(time=time, robot=state, people=[PersonObservation(id="a", position=(4.0, 2.0))])
    assert plan.horizon_used == steps


def test_a_copy_learns_for_itself():
    pace, settings = Pace(), PlannerSettings(deadline=0.05, horizon=8)
    driven(pace, settings, FEW, 10)
    driven(copy(pace), settings, dict.fromkeys(FEW, 1.0), 10)
    assert pace.horizon(settings) == 8
