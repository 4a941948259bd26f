"""Campaigns of trips among random walls: every base gets to where a way leads, and touches no wall.

Without people, and with people who stand somewhere: then it gets there, or says that they stand in every way. And
through gaps that are hardly wider than the base.

`SIDESTEP_TRIPS` sets the number of trips of each base (`make campaign` runs 100).
"""

from __future__ import annotations

import os

import numpy as np
import pytest

from made_trips import Trip, bases
from sidestep import DifferentialDrive, Holonomic, Planner
from sidestep.obstacles import Obstacles, OccupancyGrid

TRIPS = int(os.environ.get("SIDESTEP_TRIPS", "6"))
CELLS, CELL = 240, 0.05  # m
SWAY = 0.01  # m, by which a base whose velocity ramps may leave its plan beside a wall


def walls(rng):
    """12 m by 12 m: rooms with doors of 0.85 m or wider, boxes, or crooked thin walls."""
    cells = np.zeros((CELLS, CELLS), dtype=np.bool_)
    cells[:2] = cells[-2:] = cells[:, :2] = cells[:, -2:] = True
    kind = rng.choice(["rooms", "boxes", "lines"])
    if kind == "rooms":
        for i in (80, 160):
            cells[i - 1 : i + 2] = cells[:, i - 1 : i + 2] = True
        for i in (80, 160):
            for room in range(3):
                for along in (cells, cells.T):
                    width = int(rng.uniform(0.85, 1.4) / CELL)
                    at = 80 * room + rng.integers(8, 72 - width)
                    along[i - 1 : i + 2, at : at + width] = False
    elif kind == "boxes":
        for _ in range(rng.integers(5, 22)):
            (i, j), (h, w) = rng.integers(5, CELLS - 40, 2), rng.integers(4, 35, 2)
            cells[i : i + h, j : j + w] = True
    else:
        for _ in range(rng.integers(4, 12)):
            begin, angle, length = rng.uniform(10, CELLS - 10, 2), rng.uniform(0, np.pi), rng.uniform(20, 90)
            line = begin + np.linspace(0, length, 300)[:, None] * [np.cos(angle), np.sin(angle)]
            for i, j in line[((line >= 1) & (line < CELLS - 2)).all(axis=1)].astype(int):
                cells[i : i + 2, j : j + 2] = True
    return Obstacles(grid=OccupancyGrid(occupied=cells, resolution=CELL))


def base(rng, kind):
    radius, speed = rng.choice([0.2, 0.25, 0.3]), rng.choice([0.5, 1.0, 1.5])
    slow = rng.choice([0.5, 1.0, 2.0])
    if kind == "any velocity":
        return Holonomic(max_speed=speed, radius=radius)
    if kind == "limited acceleration":
        return Holonomic(max_speed=speed, radius=radius, max_acceleration=slow)
    turning = rng.choice([1.0, 2.0, 4.0])
    return DifferentialDrive(max_speed=speed, radius=radius, max_acceleration=slow, max_turn_acceleration=turning)


def ends(rng, obstacles, room):
    """Start and goal (2, 2) m, 4 m apart and `room` m from all walls, or None."""
    for _ in range(200):
        both = rng.uniform(0.3, 11.7, (2, 2))
        if np.linalg.norm(both[0] - both[1]) > 4.0 and obstacles.free(both, room).all():
            return both
    return None


def drawn(rng, kind, standing):
    """A base among walls, and up to so many people who stand; the generator decides on all of it."""
    obstacles, robot = walls(rng), base(rng, kind)
    wheels = isinstance(robot, DifferentialDrive)
    places = ends(rng, obstacles, robot.planning_radius + 0.05 + (robot.offset if wheels else 0.0))
    if places is None:
        pytest.skip("no room for it between these walls")
    start, goal = places
    people = somewhere(rng, standing, places, obstacles)
    planner = Planner(
        robot=robot, goal=goal, obstacles=obstacles, horizon=int(rng.choice([5, 8, 10])),
        time_step=float(rng.choice([0.4, 0.5])),
    )  # fmt: skip
    period = float(rng.choice([0.1, 0.2, 0.4]))
    return Trip(planner, start, heading=float(rng.uniform(-3, 3)) if wheels else None, people=people, period=period)


def somewhere(rng, count, places, obstacles):
    """(≤ count, 2) m, off the walls and neither where the trip begins nor where it ends."""
    points = rng.uniform(0.4, 11.6, (5 * count, 2))
    apart = np.linalg.norm(points[:, None] - places, axis=2).min(axis=1)
    return points[obstacles.free(points, 0.3) & (apart > 2.0)][:count]


def longest(robot):
    """s that a trip may take."""
    return 4.0 * 12.0 * np.sqrt(2.0) / robot.planning_speed + 25.0


KINDS = ["any velocity", "limited acceleration", "two wheels, limited acceleration"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(TRIPS))
def test_where_a_way_leads_the_base_arrives_and_touches_no_wall(kind, seed):
    trip = drawn(np.random.default_rng(seed), kind, standing=0)
    while not trip.arrived:
        if "no way" in trip.step().reason:
            return
        assert trip.time < longest(trip.robot), str(trip)
    assert trip.to_walls() > trip.robot.radius - SWAY, str(trip)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(TRIPS))
def test_among_people_who_stand_it_arrives_too_or_says_that_they_stand_in_every_way(kind, seed):
    trip = drawn(np.random.default_rng(1000 + seed), kind, standing=5)
    said = 0  # how many times in a row
    while not trip.arrived and trip.time < longest(trip.robot) and said < 100:
        reason = trip.step().reason
        if "no way" in reason:
            return
        said = said + 1 if "people stand in every way" in reason else 0
    assert trip.arrived or said, str(trip)
    assert trip.to_walls() > trip.robot.radius - SWAY, str(trip)
    assert trip.nearest > trip.robot.radius + 0.3, str(trip)


NARROW = {
    "any velocity": Holonomic(max_speed=1.0, radius=0.3),
    "any velocity, fast": Holonomic(max_speed=1.5, radius=0.3, shape="disc"),
    "limited acceleration": Holonomic(max_speed=1.5, radius=0.3, max_acceleration=1.0),
    "two wheels": DifferentialDrive(max_speed=1.0, radius=0.2),
    "two wheels, limited acceleration": DifferentialDrive(
        max_speed=1.0, radius=0.2, max_acceleration=1.0, max_turn_acceleration=4.0
    ),
}


def before_a_gap(rng, robot, play):
    """A trip to a goal behind two walls with a gap between them, `play` m wider than the planning radius asks for."""
    half, heading, origin = robot.planning_radius + play / 2, rng.uniform(-3, 3), rng.uniform(-5, 5, 2)
    across = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    wall = np.array([(3, half), (3.2, half), (3.2, 15), (3, 15)])
    start, goal = np.array([(0.5, rng.uniform(-1, 1)), (6.0, rng.uniform(-1, 1))]) @ across + origin
    obstacles = Obstacles(polygons=[wall @ across + origin, wall * [1, -1] @ across + origin])
    planner = Planner(robot=robot, goal=goal, obstacles=obstacles, horizon=8)
    return Trip(planner, start, heading=heading + rng.uniform(-1, 1))


@pytest.mark.slow
@pytest.mark.parametrize("kind", NARROW)
@pytest.mark.parametrize("seed", range(max(TRIPS // 3, 1)))
def test_a_gap_ten_centimetres_wider_than_it_needs_is_passed(kind, seed):
    trip = before_a_gap(np.random.default_rng(seed), NARROW[kind], play=0.1).run(12.0)
    assert trip.arrived, str(trip)
    assert trip.to_walls() > trip.robot.radius - SWAY


def test_a_gap_that_is_too_narrow_is_told(monkeypatch):
    monkeypatch.setattr("sidestep.ladder._CREEP", ())
    trip = before_a_gap(np.random.default_rng(0), NARROW["limited acceleration"], play=0.06).run(8.0)
    assert not trip.arrived
    assert "the way may be too narrow" in trip.plan.reason


def two_doors(shift):
    """Walls at x = 1 and 4 m with doors of 1.8 and 1.6 m, whose middles lie `shift` m to either side."""
    walls = [(1.0, 0.9, shift), (4.0, 0.8, -shift)]
    sides = [(x, *side) for x, half, y in walls for side in ((-6.0, y - half), (y + half, 6.0))]
    return Obstacles(polygons=[[(x, low), (x + 0.2, low), (x + 0.2, high), (x, high)] for x, low, high in sides])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["any velocity", "limited acceleration"])
def test_calls_that_come_more_seldom_than_steps_lead_into_no_wall(kind, seed):
    """A base that is asked for something new every second goes on for a second, not for a step of 0.5 s."""
    doors = two_doors(0.8 * np.sin(seed))
    planner = Planner(robot=bases(radius=0.3, turning=4.0)[kind], goal=(8.0, 0.0), obstacles=doors)
    start = (-2.0, np.random.default_rng(seed).uniform(-2.0, 2.0))
    trip = Trip(planner, start, period=1.0).run(30.0)
    assert trip.arrived, trip
    assert trip.to_walls() > 0.3 - SWAY, trip


@pytest.mark.parametrize("aside", [1.11, 1.85])
def test_calls_that_come_more_seldom_than_steps_lead_to_the_goal_and_not_past_it(aside):
    robot = bases(radius=0.3, turning=4.0)["any velocity"]
    trip = Trip(Planner(robot=robot, goal=(3.3, aside)), period=1.0, within=0.1).run(20.0)
    assert trip.arrived, trip


@pytest.mark.parametrize("room", [0.02, 0.1])
@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_a_base_with_two_wheels_that_faces_a_wall_turns_away(speed, room):
    """The disc around its point, which is ahead of the axle, is so far in the wall that no step leads out of it."""
    robot = DifferentialDrive(max_speed=speed, max_turn_rate=2.0, radius=0.2)
    wall = Obstacles(polygons=[[(0.0, -6.0), (0.2, -6.0), (0.2, 6.0), (0.0, 6.0)]])
    trip = Trip(Planner(robot=robot, goal=(2.5, 1.0), obstacles=wall), (0.4 + room, 0.0), heading=np.pi).run(15.0)
    assert trip.arrived, trip
    assert trip.to_walls() > robot.radius - SWAY, trip


@pytest.mark.parametrize("acceleration", [None, 1.0])
@pytest.mark.parametrize("gap", [0.4, 0.6])
def test_out_of_what_the_map_has_where_the_robot_is_no_way_leads_through_another_wall(acceleration, gap):
    """A map with the robot's own outline on it, as costmaps have it: a wall beside it is there all the same."""
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    outline = 0.35 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    wall = Obstacles(polygons=[[(gap, -3.0), (gap + 0.1, -3.0), (gap + 0.1, 2.0), (gap, 2.0)]])
    obstacles = Obstacles(polygons=[*wall.polygons, outline])
    robot = Holonomic(max_speed=1.5, radius=0.2, shape="disc", max_acceleration=acceleration)
    trip = Trip(Planner(robot=robot, goal=(2.5, 0.0), obstacles=obstacles, horizon=6))
    assert "on the map the robot is inside a wall" in trip.step().reason
    trip.run(4.0)
    assert wall.distance(np.array(trip.path)).min() > 0.0, trip


@pytest.mark.parametrize(("room", "said"), [(0.27, True), (0.7, False)])
def test_a_goal_so_near_to_a_wall_that_the_robot_stays_short_of_it_is_told(room, said):
    robot = DifferentialDrive(max_speed=1.0, radius=0.25)  # its point is 0.3 m ahead of the axle
    wall = Obstacles(polygons=[[(3.0, -3.0), (3.2, -3.0), (3.2, 3.0), (3.0, 3.0)]])
    trip = Trip(Planner(robot=robot, goal=(3.0 - room, 0.0), obstacles=wall), within=0.05).run(8.0)
    assert trip.arrived != said, trip
    assert ("walls keep the robot 0.2" in trip.plan.reason) == said


WHEELS = {
    "default": DifferentialDrive(),
    "fast": DifferentialDrive(max_speed=1.0, radius=0.3),
    "limited acceleration": DifferentialDrive(radius=0.2, max_acceleration=1.0, max_turn_acceleration=4.0),
}


def corridor(width, length):
    """Two walls along x, around the origin."""
    far, near, outer = length / 2, width / 2, width / 2 + 5.0
    return Obstacles(
        polygons=[[(-far, s * near), (far, s * near), (far, s * outer), (-far, s * outer)] for s in (-1, 1)]
    )


@pytest.mark.parametrize("name", WHEELS)
@pytest.mark.parametrize("askew", [0.0, 0.8])
def test_two_wheels_drive_through_a_door_that_the_body_fits_through(name, askew):
    """Not only through one that is wide enough to turn around in with the point ahead of the axle."""
    robot = WHEELS[name]
    door = corridor(2 * robot.wall_margin + 0.05, 0.2)
    trip = Trip(Planner(robot=robot, goal=(3.0, -0.5), obstacles=door), (-3.0, 0.8), heading=askew).run(15.0)
    assert trip.arrived, str(trip)
    assert trip.to_walls() > robot.radius - 0.002


@pytest.mark.parametrize("name", WHEELS)
@pytest.mark.parametrize("askew", [0.0, 0.5, 2.5])
@pytest.mark.parametrize("play", [0.04, 0.12])
def test_two_wheels_turn_on_the_spot_where_there_is_no_room_to_swing_around(name, askew, play):
    robot = WHEELS[name]
    walls = corridor(2 * robot.wall_margin + play, 12.0)
    trip = Trip(Planner(robot=robot, goal=(-3.5, 0.0), obstacles=walls), heading=askew, period=0.1).run(18.0)
    assert trip.arrived, str(trip)
    assert trip.to_walls() > robot.radius - 0.002
    turned = [k for k, plan in enumerate(trip.plans) if "turning on the spot" in plan.reason]
    assert turned or askew > 2.0
    for k in turned:  # two slices to a call
        assert np.linalg.norm(trip.path[2 * k + 2] - trip.path[2 * k]) < 0.002


def test_two_wheels_that_touch_a_corner_ahead_get_away_from_it():
    """Forward leads into the corner, and the way ahead is forward: it had stood there for good."""
    robot = WHEELS["fast"]
    planner = Planner(robot=robot, goal=(4.0, 0.0), obstacles=corridor(2.2, 16.0))
    trip = Trip(planner, (-8.26, -0.95), heading=np.radians(37.0), period=0.1).run(20.0)
    assert trip.arrived, str(trip)
    assert trip.to_walls() > min(robot.radius, planner.obstacles.distance((-8.26, -0.95))) - 0.002
    assert any("turning on the spot" in plan.reason for plan in trip.plans)


@pytest.mark.parametrize(("speed", "weight"), [(2.0, 0.05), (2.0, 0.2), (2.0, 1.0), (1.0, 1.0)])
def test_whatever_changing_the_velocity_costs_it_stops_at_its_goal(speed, weight):
    goal = np.array([2.2, 1.0])
    planner = Planner(robot=Holonomic(max_speed=speed), goal=goal, time_step=0.2, acceleration_weight=weight)
    trip = Trip(planner, period=0.1, within=0.0).run(6.0)
    beyond = (np.array(trip.path) - goal) @ goal / np.linalg.norm(goal)
    assert beyond.max() < 0.2, trip
    assert np.linalg.norm(trip.state.position - goal) < 0.1, trip


@pytest.mark.parametrize("resolution", [1, None])
def test_without_polish_a_dear_acceleration_does_not_keep_it_from_stopping_at_its_goal(resolution):
    """The least change of velocity is one cell per step then; dearer than what it gains, it was put off for good."""
    robot, goal = bases(radius=0.3, turning=4.0)["any velocity"], np.array([5.0, 3.0])
    planner = Planner(robot=robot, goal=goal, polish=False, search_resolution=resolution, acceleration_weight=1.0)
    trip = Trip(planner, period=0.1, within=0.0).run(15.0)
    assert np.linalg.norm(trip.state.position - goal) < 0.6, trip  # m; cells lie 0.5 m apart
