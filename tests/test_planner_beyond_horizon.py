"""What is left of the way after the horizon: a plan waits, or goes around, where that pays only then."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep import Holonomic, Obstacles, PersonObservation, Planner, RobotState, SafetyFilter

COMING = [((0.5, 3.5), (-0.8, -0.6)), ((1.4, 2.0), (-0.4, -0.4)), ((-0.3, 2.0), (-0.4, 0.2))]
"""m and m/s: three who close the way for a while and leave it then."""
ASIDE = [((4.0, y), (0.0, 0.0)) for y in (0.0, 1.0, 2.0)]
"""Three who stand where they matter and change nothing."""


def planned(people, *, goal=(0.0, 10.0), speed=1.0, **settings):
    planner = Planner(robot=Holonomic(max_speed=speed, radius=0.3), goal=goal, **settings)
    return planner.step(time=0.0, robot=RobotState(position=(0.0, 0.0)), people=observed(people))


def observed(people):
    return [PersonObservation(id=str(n), position=p, velocity=v) for n, (p, v) in enumerate(people)]


def left(plan, goal=(0.0, 10.0)):
    """m from where a plan ends to the goal."""
    return float(np.linalg.norm(plan.positions[-1] - goal))


def test_a_gap_that_pays_after_the_horizon_is_waited_for():
    short, far = (planned(COMING, terminal_weight=weight) for weight in (0.0, 1.0))
    assert {short.status, far.status} == {"certified"}
    assert left(far) < left(short) - 1.0
    assert left(planned(COMING)) == left(far)  # as it is by default


CORRIDORS = Obstacles(polygons=[[(x, y), (9 * x, y), (9 * x, 9 * y), (x, 9 * y)] for x in (-1, 1) for y in (-1, 1)])
"""Two of 2 m that cross."""


def time_across(**settings):
    """s that a robot takes along one corridor, past somebody who comes out of the other and is hidden before."""
    planner = Planner(robot=Holonomic(max_speed=1.0, radius=0.3), goal=(5.0, 0.0), obstacles=CORRIDORS, **settings)
    state, place, velocity, time = (
        RobotState(position=(-5.0, 0.0), velocity=(0.0, 0.0)),
        (-0.05, -4.16),
        (0.0, 0.82),
        0.0,
    )
    while np.linalg.norm(state.position - planner.goal) > 0.2 and time < 40.0:
        people = observed([(place, velocity)]) if CORRIDORS.segment_free(state.position, place) else []
        plan = planner.step(time=time, robot=state, people=people)
        state = planner.robot.follow(plan.velocity, state, 0.1)
        place, time = np.add(place, np.multiply(velocity, 0.1)), time + 0.1
        assert np.linalg.norm(state.position - place) > 0.6
    return time


def test_nobody_drives_the_robot_up_the_corridor_that_they_walk_along():
    assert time_across() < 13.0
    assert time_across(terminal_weight=0.0) > 20.0  # along with them for nine metres


@pytest.mark.parametrize("people", [COMING[:2], [], ASIDE], ids=["two", "nobody", "nobody in the way"])
def test_where_few_are_near_or_the_way_is_free_the_motion_is_the_same(people):
    short, far = (planned(people, terminal_weight=weight) for weight in (0.0, 1.0))
    np.testing.assert_allclose(far.positions, short.positions, atol=1e-6)


@pytest.mark.parametrize(
    ("goal", "cost", "last"),
    [
        (3.0, "distance", 0.0),  # within the horizon
        (6.0, "distance", 4 * 2.0),  # four steps beyond it, and 2 m
        (10.0, "distance", 8 * 6.0),  # twelve: as many as the horizon has are counted
        (30.0, "distance", 8 * 26.0),
        (6.0, "squared", 0.5 * 4 * 4.0),
    ],
)
def test_what_is_left_costs_what_going_on_at_full_speed_does_at_the_margin(goal, cost, last):
    given = {"goal": (0.0, goal), "goal_cost": cost, "soft_risk_weight": 0.0}
    short, far, double = (planned(ASIDE, terminal_weight=weight, **given) for weight in (0.0, 1.0, 2.0))
    np.testing.assert_allclose(far.positions, short.positions, atol=1e-6)
    assert far.cost - short.cost == pytest.approx(last, abs=1e-3)
    assert double.cost - short.cost == pytest.approx(2 * last, abs=2e-3)


def test_what_is_left_is_counted_in_steps_of_the_robot():
    short, far = (planned(ASIDE, terminal_weight=w, speed=0.5, soft_risk_weight=0.0) for w in (0.0, 1.0))
    assert far.cost - short.cost == pytest.approx(8 * 8.0, abs=1e-3)  # 2 m are done, 8 m and 32 steps are left


def test_a_wish_comes_before_what_is_left():
    wishes = []
    for weight in (0.0, 5.0):
        planner = Planner(robot=Holonomic(max_speed=1.0, radius=0.3), goal=(0.0, 10.0), terminal_weight=weight)
        here = RobotState(position=(0.0, 0.0))
        told = SafetyFilter(planner).filter((0.3, 0.6), time=0.0, robot=here, people=observed(COMING))
        wishes.append(told.velocity)
    np.testing.assert_array_equal(*wishes)


def test_where_no_limit_can_be_kept_nothing_is_risked_for_what_is_left():
    """Somebody runs at the robot, two others stand about: the least risk is the same."""
    besieged = [((0.0, 1.0), (0.0, -1.8)), ((1.0, 0.3), (0.0, 0.0)), ((-1.0, 0.3), (0.0, 0.0))]
    short, far = (planned(besieged, terminal_weight=weight, recourse=None) for weight in (0.0, 50.0))
    assert {short.status, far.status} == {"least_risk"}
    assert far.risk.max() <= short.risk.max() + 1e-6
