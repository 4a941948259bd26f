"""What the body runs into: against small steps of the base itself, and beside walls and people who stand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from made_trips import SLICE, Trip, bases
from sidestep import DifferentialDrive, Holonomic, Obstacles, PersonObservation, Planner, RobotState, SafetyFilter
from sidestep.planning.body import Body

BASES = bases(radius=0.25, turning=2.0)


def of(robot, rng, *, people=(), walls=None):
    """A body somewhere near the origin, under way."""
    heading = float(rng.uniform(-3, 3)) if isinstance(robot, DifferentialDrive) else None
    velocity = rng.uniform(-0.5, 0.5, 2) * robot.planning_speed
    state = RobotState(position=rng.uniform(-0.1, 0.1, 2), heading=heading, velocity=velocity)
    places = np.array(people, dtype=float).reshape(-1, 2)
    return Body(
        robot=robot, state=state, interval=float(rng.choice([0.1, 0.2, 0.5])), people=places,
        contacts=np.full(len(places), 0.55), walls=walls,
    )  # fmt: skip


def by_small_steps(body, asked):
    """(T, 2) m, where the base is while it does as asked until the next call, and brakes from then on."""
    robot, slices = body.robot, np.arange(1, round(body.interval / SLICE) + 1)
    driven = [robot.follow(asked, body.state, float(n * SLICE)) for n in slices]
    state, places = driven[-1], [body.state.position, *(after.position for after in driven)]
    if robot.planning_acceleration is None:
        return np.array(places)
    for _ in range(60):
        state = robot.executed(np.zeros(2), state, SLICE)
        places.append(state.position)
    return np.array(places)


@given(st.integers(0, 10_000))
@pytest.mark.parametrize("name", BASES)
def test_the_body_goes_where_small_steps_of_the_base_lead(name, seed):
    rng = np.random.default_rng(seed)
    body = of(BASES[name], rng)
    asked = rng.uniform(-0.7, 0.7, (3, 2)) * body.robot.planning_speed
    for places, velocity in zip(body.places(asked), asked, strict=True):
        expected = by_small_steps(body, velocity)
        count = min(len(places), len(expected))
        assert places[:count] == pytest.approx(expected[:count], abs=0.035)
        assert places[-1] == pytest.approx(expected[-1], abs=0.035)


@given(st.integers(0, 10_000))
@pytest.mark.parametrize("name", BASES)
def test_it_runs_into_what_its_places_come_too_near_to(name, seed):
    rng = np.random.default_rng(seed)
    walls = Obstacles(polygons=[[(0.4, -1.0), (0.5, -1.0), (0.5, 1.0), (0.4, 1.0)]])
    people = rng.uniform(-1.0, 1.0, (3, 2))
    body = of(BASES[name], rng, people=people, walls=walls)
    asked = rng.uniform(-0.7, 0.7, (8, 2))
    for places, hit in zip(body.places(asked), body.runs_into(asked), strict=True):
        apart = np.linalg.norm(places[:, None] - people, axis=2)
        near = apart.min(axis=0) < np.minimum(0.549, apart[0]) - 1e-6
        room = walls.distance(places)
        assert hit == (near.any() or room.min() < min(0.249, room[0]) - 1e-6)


def test_nothing_near_is_nothing_to_run_into():
    body = of(BASES["two wheels"], np.random.default_rng(0))
    assert not body.runs_into(np.ones((4, 2))).any()


WALL = Obstacles(polygons=[[(-30.0, -0.2), (30.0, -0.2), (30.0, 0.0), (-30.0, 0.0)]])


@pytest.mark.parametrize("name", ["two wheels", "two wheels, limited acceleration"])
@pytest.mark.parametrize("gap", [0.02, 0.1, 0.2])
@pytest.mark.parametrize("aside", [0.0, 0.5])
def test_two_wheels_beside_a_wall_turn_back_without_swinging_into_it(name, gap, aside):
    robot = BASES[name]
    goal = (-4.0, max(robot.radius + gap + aside, robot.planning_radius + 0.05))
    trip = Trip(Planner(robot=robot, goal=goal, obstacles=WALL), (0.0, robot.radius + gap), period=0.1).run(20.0)
    assert trip.arrived, str(trip)
    assert trip.to_walls() > robot.radius - 0.005


def hemmed_in(rng):
    """(1–4, 2) m, people around the origin, nobody nearer than 8 cm to a body of 0.25 m."""
    people = []
    while len(people) < 1 + rng.integers(4):
        angle, away = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.58, 0.95)
        place = away * np.array([np.cos(angle), np.sin(angle)])
        if all(np.linalg.norm(place - other) > 0.5 for other in people):
            people.append(place)
    return people


@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("seed", range(5))
def test_who_stands_around_the_robot_is_not_driven_into(name, seed):
    rng = np.random.default_rng(seed)
    trip = Trip(Planner(robot=BASES[name], goal=(5.0, 0.0)), heading=rng.uniform(-3, 3), people=hemmed_in(rng))
    trip.run(8.0)
    assert trip.nearest > 0.5


@pytest.mark.parametrize("measured", [(np.nan, np.nan), (0.0, np.inf), (0.0, 0.0, 0.0), (0.0,)])
@pytest.mark.parametrize("name", BASES)
def test_a_velocity_that_is_none_counts_as_not_measured(name, measured):
    """The body of a base with two wheels went nowhere that is a place, so that it ran into nobody."""
    person = PersonObservation(id="a", position=(0.0, 0.58), velocity=(0.0, 0.0))
    answers = []
    for velocity in (None, measured):
        planner = Planner(robot=BASES[name], goal=(0.0, 3.0))
        state = RobotState(position=(0.0, 0.0), heading=2.5, velocity=velocity)
        answers.append([planner.step(time=0.2 * n, robot=state, people=[person]) for n in range(3)])
    for expected, plan in zip(*answers, strict=True):
        assert plan.status == expected.status, plan.reason
        assert np.array_equal(plan.positions, expected.positions)


@pytest.mark.parametrize("name", BASES)
@pytest.mark.parametrize("wish", [(1.0, 0.0), (0.0, 0.0), (-1.0, 0.0)])
def test_a_filter_never_drives_into_who_stands_before_a_dead_end(name, wish):
    robot = BASES[name]
    half, back = max(0.6, robot.planning_radius + 0.03), -0.6
    walls = Obstacles(
        polygons=[
            [(back, half), (3.0, half), (3.0, half + 0.2), (back, half + 0.2)],
            [(back, -half - 0.2), (3.0, -half - 0.2), (3.0, -half), (back, -half)],
            [(back - 0.2, -half), (back, -half), (back, half), (back - 0.2, half)],
        ]
    )
    trip = Trip(Planner(robot=robot, goal=(5.0, 0.0), obstacles=walls), people=[(0.6, 0.03)], period=0.1)
    screen = SafetyFilter(trip.planner)
    person = PersonObservation(id="a", position=trip.people[0], velocity=(0.0, 0.0))
    for call in range(20):
        answer = screen.filter(wish, time=0.1 * call, robot=trip.state, people=[person])
        for _ in range(2):
            trip.state = robot.follow(answer.velocity, trip.state, SLICE)
            assert np.linalg.norm(trip.state.position - trip.people[0]) > 0.5
            assert walls.distance(trip.state.position) > robot.radius - 0.005


@pytest.mark.parametrize("speed", [0.1, 0.2])
def test_a_slow_base_leaves_who_stands_beside_it(speed):
    """To stand was charged less than to go, at any risk, and what each step gains of the way was too little."""
    trip = Trip(Planner(robot=Holonomic(max_speed=speed, radius=0.11), goal=(3.0, 0.0)), people=[(0.42, 0.0)]).run(8.0)
    assert np.linalg.norm(trip.state.position) > 0.25, str(trip)
    assert trip.nearest > 0.41
