"""Plans can be kept and sent to other processes; a planner can be copied, and goes on from where it was."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import sidestep
from sidestep import Announced, FleetPlanner, PersonObservation, Plan, Planner, RobotState, SafetyFilter

STEP = 0.25


def pickled(value):
    return pickle.loads(pickle.dumps(value))


COPIES = pytest.mark.parametrize("copied", [copy.deepcopy, pickled])


def walled() -> Planner:
    walls = sidestep.Obstacles(polygons=[[(-6.0, 1.4), (6.0, 1.4), (6.0, 1.6), (-6.0, 1.6)]])
    robot = sidestep.DifferentialDrive(max_speed=1.0, max_turn_rate=2.0, radius=0.25)
    return Planner(robot=robot, goal=(4.0, 0.0), obstacles=walls)


def braked() -> Planner:
    return Planner(
        robot=sidestep.Holonomic(max_speed=1.0, radius=0.25, max_acceleration=1.0), goal=(4.0, 0.0), threads=2
    )


def fleet() -> FleetPlanner:
    planner = FleetPlanner(robot=sidestep.Holonomic(max_speed=1.0, radius=0.25), goal=(4.0, 0.0))
    planner.announce([Announced(path=[(2.0, -2.0), (2.0, -1.6)], radius=0.3, settled=True)])
    return planner


def drive(planner: Planner, calls: range) -> list[Plan]:
    """Plans past one who comes, one who stands in the way, and one far away, as the robot goes on."""
    plans = []
    for k in calls:
        t = STEP * k
        people = [
            PersonObservation(id="comes", position=(3.0 - t, 0.6), velocity=(-1.0, 0.0)),
            PersonObservation(id="stands", position=(1.0, -0.1), velocity=(0.0, 0.0)),
            PersonObservation(id="far", position=(40.0, t), velocity=(0.0, 1.0)),
        ]
        here = RobotState(position=(-2.0 + 0.3 * t, 0.0), heading=0.0)
        plans.append(planner.step(time=t, robot=here, people=people))
    return plans


def same(one: Plan, other: Plan) -> bool:
    equal = one.status == other.status and one.reason == other.reason and one.people.keys() == other.people.keys()
    arrays = ("velocity", "command", "positions", "collision_probability", "risk")
    equal = equal and all(np.array_equal(getattr(one, name), getattr(other, name)) for name in arrays)
    return equal and all(
        one.people[name].belief == other.people[name].belief
        and np.array_equal(one.people[name].occupancy.probability, other.people[name].occupancy.probability)
        for name in one.people
    )


@COPIES
def test_a_plan_can_be_copied_and_stays_frozen(copied: Callable[[Plan], Plan]):
    plan = drive(braked(), range(3))[-1]
    again = copied(plan)
    assert same(again, plan)
    assert again.people["far"].occupancy.lattice.radius == plan.people["far"].occupancy.lattice.radius
    with pytest.raises(ValueError, match="read-only"):
        again.positions[0] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        again.people["comes"].occupancy.probability[0] = 0.0
    with pytest.raises(TypeError):
        again.people["somebody"] = again.people["far"]  # type: ignore[index]


@COPIES
@pytest.mark.parametrize("made", [walled, braked, fleet])
def test_a_copy_of_a_planner_goes_on_from_where_it_was(
    made: Callable[[], Planner], copied: Callable[[Planner], Planner]
):
    planner = made()
    drive(planner, range(12))
    other = copied(planner)
    before = pickle.dumps([m.belief.concerned for m in planner._minds.values()])
    ahead = drive(other, range(12, 18))
    assert pickle.dumps([m.belief.concerned for m in planner._minds.values()]) == before  # each learns for itself
    assert all(same(a, b) for a, b in zip(ahead, drive(planner, range(12, 18)), strict=True))
    assert {plan.status for plan in ahead} <= {"certified", "least_risk"}


def test_a_filter_can_be_copied():
    mine = SafetyFilter(braked())
    other = copy.deepcopy(mine)
    assert other.planner is not mine.planner
    asked = {"time": 0.0, "robot": RobotState(position=(0.0, 0.0), velocity=(0.0, 0.0)), "people": []}
    assert np.array_equal(other.filter((0.5, 0.0), **asked).velocity, mine.filter((0.5, 0.0), **asked).velocity)


def test_a_planner_can_be_sent_to_another_process_and_its_plans_back():
    planner = braked()
    drive(planner, range(4))
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = pool.submit(drive, planner, range(4, 6)).result()
    assert all(same(a, b) for a, b in zip(there, drive(planner, range(4, 6)), strict=True))
