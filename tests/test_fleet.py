"""Several robots: each makes room for what the others have announced, and may always stop."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sidestep
from made_trips import ROOMS, Trip, bases
from sidestep.errors import InvalidInput
from sidestep.fleet import LEAST_MARGIN, AmongRobots, Announced, FleetPlanner, _nearest, _numbered
from sidestep.io.records import read_record, write_record
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.team import TeamRun

ROBOT = sidestep.Holonomic(max_speed=1.0, radius=0.3, shape="disc")
BASES = bases(radius=0.3, turning=3.0)
coordinate = st.floats(-3.0, 3.0)
pace = st.floats(-1.0, 1.0)


def _path(start, velocity, steps=8):
    return np.array(start) + 0.5 * np.arange(steps + 1)[:, None] * np.array(velocity)


def _least(start, velocity, other, theirs, interval=0.5):
    times = np.linspace(0.0, interval, 201)[:, None]
    return np.linalg.norm(start + times * velocity - other - times * theirs, axis=1).min()


@settings(max_examples=60, deadline=None)
@given(x=coordinate, y=coordinate, vx=pace, vy=pace, settled=st.booleans())
def test_the_first_motion_clears_whatever_the_other_may_do(x, y, vx, vy, settled):
    start, there = np.zeros(2), np.array([x, y])
    if np.hypot(x, y) < 0.6 + LEAST_MARGIN:
        return
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4)
    planner.announce([Announced(path=_path(there, (vx, vy)), radius=0.3, settled=settled)])
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=start), people=[])
    if not plan.velocity.any():
        return  # a robot that stands is run into by nobody who plans with it
    for theirs in [(vx, vy)] if settled else [(vx, vy), (0.0, 0.0)]:
        assert _least(start, plan.velocity, there, np.array(theirs)) >= 0.6 - 1e-9


def test_how_near_two_robots_come_is_looked_for_between_the_instants_too():
    across, up = np.array([[-1.0, 0.0], [1.0, 0.0], [3.0, 0.0]]), np.array([[0.0, -1.0], [0.0, 1.0]])
    assert _nearest(across, up) == pytest.approx(0.0)
    for x, least in ((0.5, 0.3), (2.5, 0.3), (3.4, 0.5)):  # who stands, stands for as long as the other moves
        parked = np.array([[x, 0.3]])
        assert _nearest(parked, across) == _nearest(across, parked) == pytest.approx(least)


def test_a_whole_plan_keeps_clear_of_an_announced_one():
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=8)
    crossing = _path((-2.0, 2.0), (1.0, 0.0))
    planner.announce([Announced(path=crossing, radius=0.3, settled=True)])
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
    assert plan.status == "certified"
    assert (np.linalg.norm(plan.positions - crossing, axis=1) >= 0.7 - 1e-9).all()
    alone = sidestep.Planner(robot=ROBOT, goal=(0.0, 4.0), horizon=8)
    straight = alone.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
    assert np.linalg.norm(straight.positions - crossing, axis=1).min() < 0.6  # there was something to avoid


@pytest.mark.parametrize("age", [0.2, 0.5, 0.8])
def test_a_late_announcement_is_carried_forward(age):
    """It was taken for one of now: of eight runs of four robots told 0.2 s late two touched, by up to 1.4 cm."""

    def plan_for(told):
        planner = FleetPlanner(robot=BASES["limited acceleration"], goal=(0.0, 4.0), horizon=4)
        planner.announce([told])
        state = sidestep.RobotState(position=(0.0, 0.0), velocity=(0.0, 0.0))
        return planner.step(time=1.0, robot=state, people=[])

    crossing = {"radius": 0.3, "acceleration": 1.0, "settled": False, "velocity": (1.0, 0.0)}
    now = plan_for(Announced(path=_path((-2.0 + age, 1.5), (1.0, 0.0)), **crossing))
    late = plan_for(Announced(path=_path((-2.0, 1.5), (1.0, 0.0)), age=age, **crossing))
    np.testing.assert_allclose(late.positions, now.positions, atol=1e-9)


@pytest.mark.parametrize(("age", "x", "pace"), [(0.25, 0.25, 1.0), (0.75, 0.5, 0.0), (0.5, 0.5, 0.0), (9.0, 0.5, 0.0)])
def test_what_was_announced_late_is_where_the_path_has_led_by_now(age, x, pace):
    """Half a metre, and there it stands; until then the velocity told is the best that is known."""
    path = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.0], [0.5, 0.0]]
    told = Announced(path=path, radius=0.3, settled=True, velocity=(1.0, 0.0), age=age).carried(0.5)
    assert told.path[0] == pytest.approx((x, 0.0))
    assert told.path[-1] == pytest.approx((0.5, 0.0))
    assert told.velocity == pytest.approx((pace, 0.0))
    assert not told.settled  # nobody knows what it has decided since


@pytest.mark.parametrize("age", [1.5, np.nan, np.inf])
def test_an_announcement_that_is_too_old_tells_nothing_of_now(age):
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4)
    planner.announce([Announced(path=_path((-2.0, 1.5), (1.0, 0.0)), radius=0.3, settled=True, age=age)])
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
    assert plan.status == "stopped"
    assert f"{age} s old" in plan.reason


def test_nobody_announced_is_the_planner_itself():
    person = sidestep.PersonObservation(id="a", position=(-1.5, 1.5), velocity=(1.0, 0.0))
    plans = [
        kind(robot=ROBOT, goal=(0.0, 4.0), horizon=4).step(
            time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[person]
        )
        for kind in (sidestep.Planner, FleetPlanner)
    ]
    np.testing.assert_array_equal(plans[0].positions, plans[1].positions)


def test_a_robot_that_is_stopped_for_another_is_known_to_stand(monkeypatch):
    """The next call took it to move as it would have, had it not been stopped."""
    planners = [FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4) for _ in range(2)]
    calls = [{"time": 0.5 * k, "robot": sidestep.RobotState(position=(0.0, 0.0)), "people": []} for k in range(2)]
    with monkeypatch.context() as patch:
        patch.setattr(AmongRobots, "collides", lambda *_: True)
        stopped = planners[0].step(**calls[0])
    assert (stopped.status, stopped.reason) == ("stopped", "another robot has the way")
    planners[1].step(time=0.0, robot=calls[0]["robot"], people=None)  # no data: a stop, too
    for planner in planners:
        planner.goal = (0.0, -4.0)  # to turn round costs more for who moves
    costs = [planner.step(**calls[1]).cost for planner in planners]
    assert costs[0] == costs[1]


def test_forgetting_everybody_forgets_robots():
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4)
    planner.announce([Announced(path=_path((0.0, 0.8), (0.0, -1.0)), radius=0.3, settled=True)])
    planner.reset()
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
    np.testing.assert_allclose(plan.velocity, (0.0, 1.0), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_both_robots_arrive_without_touching(seed, tmp_path):
    records = TeamRun(load_scenario("two-robots", [f"seed={seed}"]), snapshots=0).finish()
    for i, record in enumerate(records):
        numbers = measure(record)
        assert record.reached_goal
        assert numbers.robot_contacts == 0
        assert numbers.robot_min_distance >= 0.6
        assert numbers.contacts_moving == 0
        np.testing.assert_array_equal(record.other_robots[:, 0], records[1 - i].robot_positions)
    again = read_record(write_record(records[0], tmp_path / "record.npz"))
    assert measure(again).robot_min_distance == measure(records[0]).robot_min_distance


@pytest.mark.parametrize("heading", [0.0, 3.0])
@pytest.mark.parametrize("gap", [0.02, 0.12])
@pytest.mark.parametrize("name", BASES)
def test_a_robot_leaves_another_that_is_parked_beside_it(name, gap, heading):
    """To stand was charged a third of what it costs to go: with its point ahead of the axle it stood for ever."""
    robot, parked = BASES[name], np.array([-0.6 - gap, 0.0])
    trip = Trip(FleetPlanner(robot=robot, goal=(3.0, 0.0)), heading=heading, period=0.1)
    while not trip.arrived and trip.time < 9.0:
        trip.planner.announce([Announced(path=[parked, parked], radius=0.3, settled=True)])
        trip.step()
    assert trip.arrived, str(trip)
    assert np.linalg.norm(np.array(trip.path) - parked, axis=1).min() > 0.6 + min(gap, LEAST_MARGIN) - 1e-3


@pytest.mark.parametrize(
    "starts",
    [
        [(2.9, -0.77), (-0.95, 2.84), (-2.0, -2.24)],
        [(2.89, 0.81), (-0.19, 2.99), (-1.11, -2.79)],
        [(2.99, -0.25), (-1.07, 2.8), (-1.07, -2.8)],
    ],
)
def test_robots_that_cannot_stop_at_once_reckon_with_each_others_ways_to_a_stop(starts):
    """Each was told that the others might stop where they were: three that met in the middle touched by up to 37 cm."""
    base = {"radius": 0.3, "max_acceleration": 1.0, "shape": "box"}
    first, *others = (base | {"start": x, "goal": (-x[0], -x[1])} for x in starts)
    scenario = sidestep.Scenario(robot=first, robots=others, duration=20.0, planner={"horizon": 5})
    for record in TeamRun(scenario, snapshots=0).finish():
        numbers = measure(record)
        assert record.reached_goal
        assert numbers.robot_contacts == 0
        assert numbers.robot_min_distance >= 0.6


def test_a_base_with_two_wheels_does_not_swing_its_axle_into_another_robot():
    """Of a certified plan only the point was known to come to stand clear: drawn backwards, the axle swung into it."""
    robot, other, velocity = BASES["two wheels, limited acceleration"], np.array([0.5021, 0.5997]), (0.6637, -0.6093)
    planner = FleetPlanner(robot=robot, goal=(1.991, -1.828), horizon=5)
    for time in (0.0, 0.2):
        here = sidestep.RobotState(position=(time - 0.2) * np.array(velocity), heading=-3.103, velocity=velocity)
        planner.announce([Announced(path=[other, other], radius=0.2, settled=True)])
        plan = planner.step(time=time, robot=here, people=[])
    for asked in [plan.velocity] * 4 + [np.zeros(2)] * 40:
        here = robot.follow(asked, here, 0.05)
        assert np.linalg.norm(here.position - other) > 0.5


def test_a_robot_that_rolls_on_is_given_the_way():
    """Whoever announces a stop is not where it stands yet."""
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4)
    here = sidestep.RobotState(position=(0.0, 0.0))
    stop = np.tile((-1.4, 0.75), (5, 1))
    planner.announce([Announced(path=stop, radius=0.3, settled=True)])
    assert planner.step(time=0.0, robot=here, people=[]).velocity[1] > 0.5
    planner.reset()
    planner.announce([Announced(path=stop, radius=0.3, settled=True, velocity=(1.5, 0.0), acceleration=1.0)])
    plan = planner.step(time=0.0, robot=here, people=[])
    assert plan.velocity[1] <= 0.15 / 0.5


def test_robots_that_would_stand_in_each_other_are_refused():
    with pytest.raises(InvalidInput, match=r"robots\.0\.start"):
        load_scenario("two-robots", ["robots.0.start=[0.0, -4.8]"])


def test_people_react_to_the_robot_that_is_nearest():
    scenario = load_scenario("two-robots", ["duration=4.0"])
    team = TeamRun(scenario, snapshots=0)
    seen = []
    person = team.runs[0].people[0]
    decide = person.decide
    person.decide = lambda around: (seen.append(around), decide(around))[1]
    for _ in range(8):
        gaps = [np.linalg.norm(run.places[0] - run.state.position) for run in team.runs]
        before = [run.robot.reference(run.state) for run in team.runs]
        team.advance()
        np.testing.assert_allclose(seen[-1].robot_path[0], before[int(np.argmin(gaps))])


def test_a_run_of_one_robot_has_no_others():
    record = simulate(load_scenario("crossing", ["duration=1.0"]), snapshots=0)
    assert record.other_robots.size == 0
    assert measure(record).robot_contacts == 0


GOOD = Announced(path=_path((2.0, 2.0), (0.5, 0.0)), radius=0.3, settled=True)


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (Announced(path=np.zeros(2), radius=0.3, settled=True), r"path of shape \(2,\), not \(K \+ 1, 2\)"),
        (Announced(path=np.zeros((1, 2)), radius=0.3, settled=True), r"path of shape \(1, 2\)"),
        (Announced(path=np.zeros((4, 3)), radius=0.3, settled=False), r"path of shape \(4, 3\)"),
        (Announced(path=[[0.0, 1.0], [np.nan, 1.0]], radius=0.3, settled=False), "not finite"),
        (Announced(path=[[0.0, 1.0], [1e300, 1.0]], radius=0.3, settled=False), "beyond 1e9 m"),
        (Announced(path=np.ones((4, 2)), radius=np.nan, settled=False), "radius of nan m"),
        (Announced(path=np.ones((4, 2)), radius=-1.0, settled=False), "radius of -1.0 m"),
        (Announced(path=np.ones((4, 2)), radius=0.3, settled=False, velocity=(1.0,)), r"velocity of \[1.0\], not 2"),
        (
            Announced(path=np.ones((4, 2)), radius=0.3, settled=False, velocity=(0.0, np.inf)),
            r"velocity of \[0.0, inf\]",
        ),
        (Announced(path=np.ones((4, 2)), radius=0.3, settled=False, acceleration=0.0), "acceleration of 0.0 m/s²"),
    ],
)
def test_a_robot_stops_where_nobody_can_tell_what_another_will_do(wrong, why):
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4)
    planner.announce([GOOD, wrong])
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
    assert plan.status == "stopped"
    assert not plan.velocity.any()
    assert re.search(why, plan.reason)
    planner.announce([GOOD])
    assert planner.step(time=0.5, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[]).velocity.any()


def test_what_is_no_announcement_is_refused_in_one_line():
    planner = FleetPlanner(robot=ROBOT, goal=(0.0, 4.0), horizon=4)
    with pytest.raises(InvalidInput, match=r"announce\.others.*Announced"):
        planner.announce(["here"])
    with pytest.raises(InvalidInput, match=r"announced\.radius: got 'wide'; allowed: a number"):
        Announced(path=[[0.0, 1.0], [2.0, 1.0]], radius="wide", settled=True)
    with pytest.raises(InvalidInput, match=r"announced\.acceleration: got \[1.0\]; allowed: a number"):
        Announced(path=[[0.0, 1.0], [2.0, 1.0]], radius=0.3, settled=True, acceleration=[1.0])
    told = Announced(path=[[0.0, 1.0], [2.0, 1.0]], radius=Decimal("0.3"), settled=True, acceleration=Fraction(1, 2))
    assert (told.radius, told.acceleration) == (0.3, 0.5)
    with pytest.raises(InvalidInput, match=r"announced\.path.*\(K \+ 1, d\) numbers"):
        Announced(path=[[0.0, 1.0], [2.0]], radius=0.3, settled=True)


def test_a_robot_that_stands_in_the_door_is_waited_for_and_then_gone_around():
    robot = sidestep.Holonomic(max_speed=1.0, radius=0.3)
    planner = FleetPlanner(robot=robot, goal=(8.0, 0.0), obstacles=ROOMS, horizon=5)
    parked = Announced(path=np.tile([4.05, 0.1], (6, 1)), radius=0.3, settled=True)
    planner.announce([parked])
    trip = Trip(planner).run(5.0)
    assert "waiting for robots" in trip.plan.reason
    trip.run(40.0)
    assert trip.arrived
    assert np.max(trip.path, axis=0)[1] > 4.0
    assert np.linalg.norm(np.array(trip.path) - parked.path[0], axis=1).min() > 0.6


@pytest.mark.parametrize("robots", [[(4.05, 0.1), (9.5, -5.0)], [(9.5, -5.0), (4.05, 0.1)]])
def test_a_robot_that_stands_is_known_to_stand_whatever_the_order_in_which_robots_are_told_of(robots):
    """They were told apart by their place in the list: where that changed, nobody stood for as long as a call."""
    parked = [Announced(path=np.tile(place, (6, 1)), radius=0.3, settled=True) for place in robots]
    planner = FleetPlanner(robot=BASES["any velocity"], goal=(8.0, 0.0), obstacles=ROOMS, horizon=5)
    reasons = []
    for call in range(6):
        planner.announce(parked[:: -1 if call % 2 else 1])
        reasons.append(
            planner.step(time=0.5 * call, robot=sidestep.RobotState(position=(3.7, -0.53)), people=[]).reason
        )
    assert "waiting for robots who stand in the way" in reasons[-1]
    assert not any("too narrow" in reason for reason in reasons)  # it is the robot that is in the way


@given(st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=4, unique=True), st.randoms())
def test_robots_keep_their_numbers_in_any_order(places, rng):
    known = {number: np.array(place) for number, place in enumerate(places)}
    order = list(known)
    rng.shuffle(order)
    assert _numbered([known[number] for number in order], known) == order
    more = _numbered([*known.values(), np.array([9.0, 9.0])], known)
    assert more == [*known, len(known)]
    assert _numbered([np.zeros(3)], known) == [0]  # in another world
