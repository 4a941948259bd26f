"""People who stand: the way leads around them, and a robot beside them leaves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sidestep
from made_trips import ROOMS, Trip, bases
from sidestep import Holonomic, HumanModel, Obstacles, PersonObservation, Planner, PlannerSettings, RobotState
from sidestep._kernels import ways as kernels
from sidestep.detour import PATIENCE, Detours, Disc, Trial
from sidestep.planning.geodesic import open_ways, way_to, ways_to_goal
from sidestep.site import site_of

GOAL = (8.0, 0.0)
BASES = bases(radius=0.3, turning=4.0)


def a_row(count, x=4.0, apart=0.9):
    """(count, 2) m, people side by side across the way."""
    return np.stack([np.full(count, x), (np.arange(count) - (count - 1) / 2) * apart + 0.03], axis=1)


def trip_of(robot, people, *, goal=GOAL, **settings):
    return Trip(Planner(robot=robot, goal=goal, **settings), people=people)


@pytest.mark.parametrize("robot", BASES.values(), ids=BASES)
@pytest.mark.parametrize("count", [4, 6])
def test_a_row_of_people_who_stand_is_gone_around(robot, count):
    trip = trip_of(robot, a_row(count), horizon=5).run(25.0)
    assert trip.arrived, f"{trip.state.position}, {trip.plans[-1].reason}"
    assert trip.nearest > robot.radius + 0.3
    assert any("going around" in plan.reason for plan in trip.plans)


def test_without_detours_the_robot_waits_for_as_long_as_they_stand():
    trip = trip_of(BASES["any velocity"], a_row(6), horizon=5, detour_after=None).run(25.0)
    assert not trip.arrived
    assert not any("around" in plan.reason for plan in trip.plans)


def test_somebody_in_the_door_is_waited_for_and_then_the_other_door_is_taken():
    trip = trip_of(BASES["any velocity"], [(4.05, 0.1)], obstacles=ROOMS, horizon=5)
    for _ in range(20):
        trip.step()
    assert np.abs(trip.state.position[1]) < 0.8  # 4 s: before the door
    assert "waiting for people who stand" in trip.plans[-1].reason
    trip.run(40.0)
    assert trip.arrived
    assert np.max(trip.path, axis=0)[1] > 4.0
    assert trip.nearest > 0.6


@pytest.mark.parametrize("name", ["any velocity", "limited acceleration"])
def test_a_gap_does_not_close_while_it_is_waited_for_or_gone_to(name):
    trip = trip_of(BASES[name], [(4.05, 0.1), (4.5, 5.4)], obstacles=ROOMS, horizon=5).run(30.0)
    assert trip.arrived, trip.plans[-1].reason
    assert trip.nearest > 0.6


def test_a_way_on_which_the_robot_does_not_get_on_needs_more_room_and_one_on_which_it_does_no_more():
    near, far = (open_ways(np.array([x, 0.0]), np.full(2, -5.0), np.full(2, 15.0)).field() for x in (6.0, 9.0))
    trial = Trial()
    for here in np.arange(20)[:, None] * [0.25, 0.0]:
        trial = trial.along(near, way_to(near.goal, here, near), here, 2.0)
    assert trial.failed == 0
    for k in range(2 * (int(PATIENCE) + 1)):  # s; after each failure one to begin anew
        way = far if k % 2 else near  # another goal is no progress
        trial = trial.along(way, way_to(way.goal, here, way), here, 1.0)
    assert trial.failed == 2


def test_who_has_stood_for_long_when_the_robot_comes_is_not_waited_for():
    trip = trip_of(BASES["any velocity"], [(4.05, 0.1)], obstacles=ROOMS, horizon=5)
    held = trip.state
    for _ in range(50):
        trip.step()
        trip.state = held
    trip.path = [held.position]
    trip.run(60.0)
    assert trip.arrived
    assert np.max(trip.path, axis=0)[1] > 4.0
    assert trip.time < 10.0 + 16.0
    beside = [place for place in trip.path if np.abs(place[0] - 4.0) < 1.5 and np.abs(place[1]) < 1.0]
    assert not beside  # it never went up to the door


def test_whoever_goes_away_is_not_gone_around_any_more():
    trip = trip_of(BASES["any velocity"], [(4.05, 0.1)], obstacles=ROOMS, horizon=5)
    for _ in range(20):
        trip.step()
    trip.people = np.zeros((0, 2))
    trip.run(15.0)
    assert trip.arrived
    assert np.max(np.abs(trip.path), axis=0)[1] < 1.0


def test_where_people_stand_in_every_way_the_reason_says_so():
    trip = trip_of(BASES["any velocity"], [(4.05, 0.1), (4.05, 4.8)], obstacles=ROOMS, horizon=5).run(12.0)
    assert not trip.arrived
    assert "people stand in every way to the goal" in trip.plans[-1].reason
    assert trip.nearest > 0.6


def test_who_walks_is_never_taken_to_stand():
    trip = trip_of(BASES["any velocity"], a_row(6, x=5.0), horizon=5)
    for _ in range(20):
        trip.people[:, 1] += 0.08 if trip.time <= 2.0 else -0.08  # 0.4 m/s, there and back
        assert "around" not in trip.step().reason


def test_a_twin_goes_its_own_way_and_a_reset_forgets():
    trip = trip_of(BASES["any velocity"], a_row(6), horizon=5)
    for _ in range(15):
        trip.step()
    twin = trip.planner.twin()
    mine = trip.planner.step(time=3.2, robot=trip.state, people=[])
    theirs = twin.step(time=3.2, robot=trip.state, people=[])
    assert mine.velocity == pytest.approx(theirs.velocity, abs=0.0)
    assert mine.reason == theirs.reason
    row = [PersonObservation(id=str(n), position=p, velocity=(0.0, 0.0)) for n, p in enumerate(trip.people)]
    assert "around" in trip.planner.step(time=3.4, robot=trip.state, people=row).reason
    for time in (3.6, 0.0):
        trip.planner.reset()
        assert "around" not in trip.planner.step(time=time, robot=trip.state, people=row).reason  # met anew


def test_with_a_deadline_the_way_is_laid_aside_and_taken():
    trip = trip_of(BASES["any velocity"], a_row(5), horizon=5, deadline=1.0).run(30.0)
    assert trip.arrived


@pytest.mark.parametrize("changes", [{"goal_weight": (1.0, 1.0)}, {"goal": (8.0,)}, {"goal": (8.0, 0.0, 1.0)}])
def test_where_no_way_can_be_laid_people_who_stand_are_planned_for_as_before(changes):
    goal = changes.pop("goal", GOAL)
    plans = []
    for after in (None, 0.2):
        planner = Planner(robot=Holonomic(), goal=goal, horizon=2, detour_after=after, **changes)
        place = np.array([2.0, 0.1, 0.0])[: len(goal)]
        seen = [PersonObservation(id="a", position=place, velocity=np.zeros(len(goal)))]
        for k in range(6):
            plan = planner.step(time=0.2 * k, robot=RobotState(position=np.zeros(len(goal))), people=seen)
        plans.append(plan)
    assert plans[0].positions == pytest.approx(plans[1].positions, abs=0.0)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), "soon"])
def test_detour_after_is_a_positive_time_or_none(value):
    with pytest.raises(sidestep.InvalidInput, match="detour_after"):
        Planner(robot=Holonomic(), goal=GOAL, detour_after=value)


@pytest.mark.parametrize("robot", BASES.values(), ids=BASES)
@pytest.mark.parametrize("apart", [0.62, 0.75, 0.9])
@pytest.mark.parametrize("behind", [False, True], ids=["before it", "behind it"])
def test_a_robot_beside_somebody_who_stands_leaves_without_coming_nearer(robot, apart, behind):
    place = np.array([-apart if behind else apart, 0.03])
    trip = trip_of(robot, [place], goal=(4.0, 0.0)).run(12.0)
    assert trip.arrived, f"{trip.state.position}, {trip.plans[-1].status}: {trip.plans[-1].reason}"
    assert trip.nearest > min(apart, 0.8) - 0.03


def test_who_comes_into_the_robot_is_let_come():
    """Somebody walks up to a robot that others stand beside: it had better stand."""
    trip = trip_of(BASES["limited acceleration"], [(0.7, 0.0), (-2.0, 0.0)], goal=(4.0, 0.0))
    walking = PersonObservation(id="w", position=(-1.2, 0.0), velocity=(1.2, 0.0))
    standing = PersonObservation(id="s", position=(0.9, 0.0), velocity=(0.0, 0.0))
    plan = trip.planner.step(time=0.0, robot=trip.state, people=[walking, standing])
    assert np.linalg.norm(plan.velocity) < 1e-6


@pytest.mark.parametrize("name", ["limited acceleration", "two wheels"])
def test_who_has_just_come_up_to_the_robot_is_waited_for_a_while(name):
    trip, moved = trip_of(BASES[name], [(3.0, 0.03)], goal=(4.0, 0.0)), []
    for k in range(40):
        away = max(3.0 - 0.2 * k, 0.62)  # m/s 1, until they stand before the robot
        seen = [PersonObservation(id="a", position=(away, 0.03), velocity=(-float(away > 0.62), 0.0))]
        plan = trip.planner.step(time=0.2 * k, robot=trip.state, people=seen)
        moved.append(np.linalg.norm(plan.velocity) > 0.05)  # it is held where it is
    assert not any(moved[12:16])  # 2.4 s: they are there
    assert all(moved[30:])  # 6 s: they stay


def by_every_line(ways, centres, radii):
    """What `shade` leaves: cells outside all discs, and straight ways that no disc is in."""
    w, h = ways.free.shape
    free, values = ways.free.copy(), ways.straight.copy()
    for i in range(w):
        for j in range(h):
            place = ways.corner + ways.spacing * np.array([i, j])
            along = np.linspace(0.0, 1.0, 2001)[:, None]
            line = place + along * (ways.goal - place)
            for centre, radius in zip(centres, radii, strict=True):
                if np.linalg.norm(place - centre) < radius:
                    free[i, j], values[i, j] = False, np.inf
                elif np.linalg.norm(line - centre, axis=1).min() < radius:
                    values[i, j] = np.inf
    return free, values


@given(st.integers(0, 10_000))
@pytest.mark.parametrize("shade", [kernels.shade, kernels.shade.py_func], ids=["compiled", "plain"])
def test_shade_agrees_with_looking_along_every_line(shade, seed):
    rng = np.random.default_rng(seed)
    ways = open_ways(rng.uniform(-3.0, 3.0, 2), (-1.0, -1.0), (1.0, 1.2), spacing=0.4)
    centres, radii = rng.uniform(-1.5, 1.5, (3, 2)), rng.uniform(0.1, 0.6, 3)
    radii = np.minimum(radii, np.linalg.norm(centres - ways.goal, axis=1) - 0.05).clip(0.01)
    free, values = ways.free.copy(), ways.straight.copy()
    shade(values, free, ways.corner, ways.spacing, ways.goal, centres, radii)
    expected_free, expected = by_every_line(ways, centres, radii)
    assert (free == expected_free).all()
    close = np.isfinite(values) != np.isfinite(expected)  # the sampled line may just miss what the exact one touches
    for i, j in np.argwhere(close):
        place = ways.corner + ways.spacing * np.array([i, j])
        along = (ways.goal - place) / np.linalg.norm(ways.goal - place)
        offsets = centres - place
        across = np.abs(offsets[:, 0] * along[1] - offsets[:, 1] * along[0])
        assert np.abs(across - radii).min() < 1e-3


def test_around_a_disc_the_way_is_that_of_a_taut_string():
    radius = 1.0
    field = open_ways((4.0, 0.0), (-5.0, -4.0), (5.0, 4.0)).field(np.array([[0.0, 0.0]]), np.array([radius]))
    tangent = np.sqrt(4.0**2 - radius**2)
    arc = np.pi - 2.0 * np.arccos(radius / 4.0)
    assert float(field.at((-4.0, 0.0))) == pytest.approx(2.0 * tangent + arc * radius, rel=0.03)
    assert float(field.at((-4.0, 3.9))) == pytest.approx(np.hypot(8.0, 3.9), rel=1e-3)  # in sight
    assert field.reaches(np.array([0.0, 0.0]))


def test_a_goal_at_the_end_of_the_world_takes_no_more_room_than_a_near_one():
    field = open_ways((1e9, 0.0), (-5.0, -4.0), (5.0, 4.0)).field(np.array([[0.0, 0.0]]), np.array([1.0]))
    assert float(field.at((-2.0, 0.0))) - float(field.at((-2.0, 1.5))) == pytest.approx(0.3, abs=0.15)
    trip = trip_of(BASES["any velocity"], a_row(6), horizon=5, goal=(1e9, 0.0))
    while trip.state.position[0] < 5.5 and trip.time < 25.0:
        assert "internal error" not in trip.step().reason
    assert trip.state.position[0] >= 5.5


def test_discs_and_walls_close_a_way_together():
    ways = ways_to_goal(ROOMS, GOAL, margin=0.3)
    open_field = ways.field()
    door = ways.field(np.array([[4.05, 0.0]]), np.array([1.0]))
    both = ways.field(np.array([[4.05, 0.0], [4.05, 4.8]]), np.array([1.0, 1.0]))
    here = np.array([1.0, 0.0])
    assert float(open_field.at(here)) == pytest.approx(7.0, rel=0.01)
    assert door.reaches(here)
    assert float(door.at(here)) > 11.0
    assert not both.reaches(here)
    assert np.isfinite(both.at(here))


def test_a_new_map_every_second_is_no_progress():
    trip = trip_of(BASES["any velocity"], [(4.05, 0.1), (4.05, 4.8)], obstacles=ROOMS, horizon=5)
    for call in range(60):
        if call % 5 == 0:
            trip.planner.obstacles = Obstacles(polygons=ROOMS.polygons)
        trip.step()
    assert "people stand in every way to the goal" in trip.plan.reason


def test_a_pause_is_no_waiting():
    robot, settings = BASES["any velocity"], PlannerSettings(horizon=5)
    site = site_of(GOAL, ROOMS, robot=robot, human=HumanModel(), settings=settings)
    detours, here, stander = Detours(robot, settings), np.array([3.0, 0.0]), {"a": Disc(np.array([4.05, 0.1]), 0.3)}
    waited = [detours.course(site, stander, here=here, time=t).waited for t in (0.0, 0.5, 1.0, 600.0, 600.5)]
    assert waited == pytest.approx([0.0, 0.5, 1.0, 1.0 + settings.timeout, 1.5 + settings.timeout])


def test_a_goal_that_is_moved_a_little_is_waited_for_as_before():
    trip = trip_of(BASES["any velocity"], [(4.05, 0.1), (4.05, 4.8)], obstacles=ROOMS, horizon=5)
    for call in range(60):
        if call % 5 == 0:
            trip.planner.goal = GOAL + 0.02 * np.array([np.cos(call), np.sin(call)])
        trip.step()
    assert "people stand in every way to the goal" in trip.plan.reason


@pytest.mark.parametrize("what", ["map", "goal", "goal without a map"])
def test_with_a_deadline_goal_and_map_may_be_set_before_every_call(what):
    """A thread that lays the way around people is done after the next call: it was thrown away every time."""
    wall = None if what == "goal without a map" else Obstacles(polygons=[[(2.0, -3.0), (2.1, -3.0), (2.1, -2.9)]])
    trip = trip_of(BASES["any velocity"], a_row(4), goal=(7.0, 0.0), obstacles=wall, horizon=5, deadline=1.0)
    while not trip.arrived and trip.time < 15.0:
        if what == "map":
            trip.planner.obstacles = Obstacles(polygons=trip.planner.obstacles.polygons)
        else:
            trip.planner.goal = (7.0, 0.01 * np.sin(trip.time))
        trip.step()
    assert trip.arrived, trip
    trip.planner.goal = (7.0, 0.0, 1.0)  # in space there are no detours
    trip.planner.goal = (7.0,) if wall is None else (7.0, 0.0)


@pytest.mark.parametrize("width", [1.55, 1.6])
@pytest.mark.parametrize("aside", [0.44, 0.5])
def test_a_plan_that_waits_for_one_step_and_goes_then_is_not_made_for_ever(width, aside):
    """Somebody stands in the door, at its side: what may be done a step later may not be begun, at every call."""
    door = width / 2.0
    walls = [
        [(3.0, -4.0), (3.2, -4.0), (3.2, -door), (3.0, -door)],
        [(3.0, door), (3.2, door), (3.2, 3.2), (3.0, 3.2)],
        [(3.0, 5.0), (3.2, 5.0), (3.2, 6.0), (3.0, 6.0)],
        [(-1.0, -4.2), (8.0, -4.2), (8.0, -4.0), (-1.0, -4.0)],
        [(-1.0, 6.0), (8.0, 6.0), (8.0, 6.2), (-1.0, 6.2)],
    ]
    robot = Holonomic(max_speed=1.0, radius=0.25, shape="disc", max_acceleration=1.0)
    trip = trip_of(robot, [(3.1, aside)], goal=(6.0, 0.0), obstacles=Obstacles(polygons=walls)).run(30.0)
    assert trip.arrived, str(trip)
    assert trip.nearest > robot.radius + 0.25


def test_a_base_between_a_pillar_and_somebody_who_stands_leaves():
    angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    pillar = Obstacles(polygons=[np.stack([0.04 + 0.3 * np.cos(angles), 0.99 + 0.3 * np.sin(angles)], axis=1)])
    robot = Holonomic(max_speed=1.0, radius=0.3, shape="disc", max_acceleration=0.5)
    planner = Planner(robot=robot, goal=(0.6, -0.3), obstacles=pillar, horizon=5)
    trip = Trip(planner, (-0.5, 0.58), people=[(-1.0861, -0.3632)]).run(10.0)
    assert trip.arrived, str(trip)
    assert trip.nearest > robot.radius + 0.3
