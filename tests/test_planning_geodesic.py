"""Distance to the goal around walls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from made_trips import Trip
from sidestep import Holonomic, Planner, RobotState
from sidestep._kernels import walls as kernels
from sidestep._kernels.ways import shortest_ways
from sidestep.obstacles import Obstacles, OccupancyGrid
from sidestep.planning.geodesic import KNIGHT, ways_to_goal
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search
from sidestep.planning.search_maps import prepare

WALL = Obstacles(polygons=[[(2.0, -3.0), (2.2, -3.0), (2.2, 2.0), (2.0, 2.0)]])
CUL_DE_SAC = Obstacles(polygons=[[(2.0, -1.5), (2.2, -1.5), (2.2, 1.5), (2.0, 1.5)],
                                 [(0.0, 1.5), (2.2, 1.5), (2.2, 1.7), (0.0, 1.7)],
                                 [(0.0, -1.7), (2.2, -1.7), (2.2, -1.5), (0.0, -1.5)]])  # fmt: skip
GOAL = (5.0, 0.0)


def around_the_corner(start, goal, margin):
    """Length of the taut string around the wall's end, rounded by the margin."""
    best = np.inf
    for turn in np.linspace(0, np.pi, 721):
        near = np.array([2.0, 2.0]) if turn > np.pi / 2 else np.array([2.2, 2.0])
        via = near + margin * np.array([np.cos(turn), np.sin(turn)])
        best = min(best, np.linalg.norm(via - start) + np.linalg.norm(goal - via))
    arcs = [np.array([2.0, 2.0]) + margin * np.array([np.cos(a), np.sin(a)]) for a in np.linspace(np.pi, np.pi / 2, 91)]
    arcs += [np.array([2.2, 2.0]) + margin * np.array([np.cos(a), np.sin(a)]) for a in np.linspace(np.pi / 2, 0, 91)]
    arcs = np.array(arcs)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(arcs, axis=0), axis=1))])
    tries = [
        np.linalg.norm(arcs[i] - start) + along[j] - along[i] + np.linalg.norm(goal - arcs[j])
        for i in range(0, 91, 2)
        for j in range(91, 182, 2)
    ]
    return min(tries)


def test_distance_is_the_length_of_the_taut_string():
    field = ways_to_goal(WALL, GOAL, margin=0.3).field()
    for start in ((0.0, 0.0), (1.0, 1.0), (-1.5, 1.0)):
        exact = around_the_corner(np.array(start), np.array(GOAL), 0.3)
        assert float(field.at(start)) == pytest.approx(exact, rel=0.05)
    assert float(field.at((3.0, 0.5))) == pytest.approx(np.hypot(2.0, 0.5), rel=0.01)  # in sight: straight


@given(x=st.floats(-10, 12), y=st.floats(-10, 10))
@options(max_examples=60)
def test_field_is_finite_and_never_below_the_straight_line(x, y):
    value = float(FIELD.at((x, y)))
    assert np.isfinite(value)
    assert value >= np.hypot(x - GOAL[0], y - GOAL[1]) - 1e-9


FIELD = ways_to_goal(WALL, GOAL, margin=0.3).field()


def test_without_walls_it_is_the_straight_line():
    field = ways_to_goal(Obstacles(), (1.0, 2.0), margin=0.3).field()
    points = np.random.default_rng(0).uniform(-4, 6, (50, 2))
    straight = np.linalg.norm(points - [1.0, 2.0], axis=1)
    assert field.at(points) == pytest.approx(straight, abs=0.02)
    assert field.at(np.zeros((2, 3, 3))).shape == (2, 3)


def test_goal_in_a_wall_moves_to_the_nearest_free_place_and_blocked_worlds_stay_finite():
    field = ways_to_goal(WALL, (2.1, 0.0), margin=0.3).field()
    assert WALL.free(field.goal, 0.29)
    assert np.linalg.norm(field.goal - [2.1, 0.0]) < 0.6
    closed = Obstacles(polygons=[[(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)]])
    nowhere = ways_to_goal(closed, (0.0, 0.0), margin=0.3, reach=0.5, cells=400).field()
    assert np.isfinite(nowhere.at(np.array([[0.0, 0.0], [10.0, 3.0]]))).all()


def test_thin_walls_are_not_jumped():
    thin = Obstacles(polygons=[[(2.0, -3.0), (2.0, 2.0)]])
    field = ways_to_goal(thin, GOAL, margin=0.0).field()
    assert float(field.at((1.0, 0.0))) > np.hypot(1.0, 2.0) + np.hypot(3.0, 2.0) - 0.1


def test_short_horizon_gets_out_of_a_cul_de_sac_with_the_field():
    field = ways_to_goal(CUL_DE_SAC, GOAL, margin=0.3).field()
    position = np.array([1.2, 0.0])
    for _ in range(40):
        problem = PlanningProblem(
            start=position, goal=np.array(GOAL), time_step=0.5, horizon=3, max_speed=1.0, shape="disc",
            obstacles=CUL_DE_SAC, margin=0.3, distance_to_goal=field,
        )  # fmt: skip
        found = search(problem)
        assert found.feasible
        assert CUL_DE_SAC.segment_free(position, found.path[1], 0.295)
        position = found.path[1]
    assert position == pytest.approx(GOAL, abs=0.11)


def by_the_facing_edges(point, field):
    """Shortest straight way to every second cell of the edges that face a place off the raster, and on from there."""
    last = np.array(field.values.shape) - 1
    where = (np.asarray(point) - field.corner) / field.spacing
    ways = []
    for axis in (0, 1):
        if 0 <= where[axis] <= last[axis]:
            continue
        cells = np.zeros((last[1 - axis] // 2 + 1, 2), dtype=int)
        cells[:, 1 - axis] = np.arange(0, last[1 - axis] + 1, 2)
        cells[:, axis] = 0 if where[axis] < 0 else last[axis]
        ways.append((field.spacing * np.linalg.norm(cells - where, axis=1) + field.values[tuple(cells.T)]).min())
    return max(min(ways), np.hypot(*(point - field.goal)))


@given(x=st.floats(-30, 30), y=st.floats(-30, 30))
@options(max_examples=60)
def test_off_the_raster_the_way_leads_over_an_edge_that_faces_the_place(x, y):
    place = np.array([x, y])
    inside = (place >= FIELD.corner) & (place <= FIELD.corner + FIELD.spacing * (np.array(FIELD.values.shape) - 1))
    if not inside.all():
        assert float(FIELD.at(place)) == pytest.approx(by_the_facing_edges(place, FIELD), abs=1e-9)


def test_no_way_leads_through_the_raster_and_its_walls():
    long = Obstacles(polygons=[[(0.0, -20.0), (0.2, -20.0), (0.2, 20.0), (0.0, 20.0)]])
    field = ways_to_goal(long, (1.0, 0.0), margin=0.3).field()
    for x in (-2.5, -6.0):  # on the raster, and off it
        assert float(field.at((x, 0.0))) > np.hypot(x, 20.0) + 20.0


def test_kernel_without_compilation_agrees():
    points = np.random.default_rng(3).uniform(-6, 9, (20, 2))
    arguments = (points, FIELD.values, FIELD.corner, FIELD.spacing, FIELD.goal)
    assert kernels.interpolate.py_func(*arguments) == pytest.approx(kernels.interpolate(*arguments))


@pytest.mark.parametrize("goal", [(30.0, 20.0), (1e4, 2.0), (0.0, 1e9)])
def test_the_raster_grows_no_finer_than_it_may_however_far_the_goal(goal):
    field = ways_to_goal(Obstacles(polygons=[[(0, 0), (1, 0), (1, 0.2)]]), goal, margin=0.3, cells=40000).field()
    assert field.values.size <= 1.5 * 40000
    assert float(field.at((0.5, -1.0))) == pytest.approx(np.hypot(goal[0] - 0.5, goal[1] + 1.0), rel=0.1)


def by_heap(values, free, shut, flanks, spacing):
    """The same ways by SciPy's Dijkstra, from one more node that leads to every cell whose value is given."""
    w, h = free.shape
    ends = [(w * h, i * h + j, values[i, j]) for i, j in np.argwhere(np.isfinite(values))]
    for i, j in np.argwhere(free):
        for m, (a, b) in enumerate(KNIGHT):
            inside = 0 <= i + a < w and 0 <= j + b < h
            if inside and free[i + a, j + b] and all(free[i + u, j + v] for u, v in flanks[m]) and not shut[m, i, j]:
                ends.append((i * h + j, (i + a) * h + j + b, spacing * np.hypot(a, b)))
    here, there, lengths = zip(*ends, strict=True)
    graph = coo_array((lengths, (here, there)), shape=(w * h + 1, w * h + 1)).tocsr()
    return dijkstra(graph, directed=False, indices=w * h)[:-1].reshape(w, h)


@given(seed=st.integers(0, 10**6), shape=st.tuples(st.integers(1, 14), st.integers(1, 14)), guarded=st.booleans())
@options(max_examples=60, deadline=None)
def test_ways_over_a_raster_are_those_of_a_heap(seed, shape, guarded):
    rng = np.random.default_rng(seed)
    free = rng.random(shape) < rng.choice([0.5, 0.8, 1.0])
    spacing = rng.uniform(0.05, 0.5)
    values = np.where(free & (rng.random(shape) < 0.1), rng.uniform(1e-9, rng.choice([1.0, 30.0]), shape), np.inf)
    shut = rng.random((len(KNIGHT), *shape)) < 0.2
    beside = {(1, 1): ((1, 0), (0, 1)), (1, -1): ((1, 0), (0, -1)), (2, 1): ((1, 0), (1, 1)), (1, 2): ((0, 1), (1, 1)),
              (2, -1): ((1, 0), (1, -1)), (1, -2): ((0, -1), (1, -1))}  # fmt: skip
    alone = ((0, 0), (0, 0))
    flanks = np.array([beside.get(move, alone) if guarded else alone for move in KNIGHT])
    for run in (shortest_ways, shortest_ways.py_func):
        found = values.copy()
        run(found, free, shut, np.array(KNIGHT), flanks, spacing)
        if np.isfinite(values).any():
            assert found == pytest.approx(by_heap(values, free, shut, flanks, spacing), rel=1e-12)
        else:
            assert np.isinf(found).all()
    found, nowhere = values.copy(), np.zeros((0, 0, 0), dtype=np.bool_)
    shortest_ways(found, free, nowhere, np.array(KNIGHT), flanks, spacing)
    if np.isfinite(values).any():
        assert found == pytest.approx(by_heap(values, free, np.zeros_like(shut), flanks, spacing), rel=1e-12)


def rooms(side, door, resolution=0.1, room=10.0):
    """A building of square rooms in rows that one way leads through, there and back, through doors of this width."""
    n, step, width = round(side / resolution), round(room / resolution), round(door / resolution)
    rng, count = np.random.default_rng(0), round(side / room)
    walls = np.zeros((n, n), dtype=np.bool_)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    for i in range(step, n, step):
        walls[i], walls[:, i] = True, True
    for row in range(count):
        for i in range(step, n, step):
            at = row * step + rng.integers(15, step - 15 - width)
            walls[i, at : at + width] = False
    for row in range(count - 1):
        at = (count - 1 if row % 2 == 0 else 0) * step + rng.integers(15, step - 15 - width)
        walls[at : at + width, (row + 1) * step] = False
    return Obstacles(grid=OccupancyGrid(occupied=walls, resolution=resolution))


def test_doors_are_found_in_a_large_building():
    """Rows of ten rooms, gone through to and fro: a raster too coarse for the doors would send the robot to a wall."""
    field = ways_to_goal(rooms(100.0, 0.9), (5.0, 95.0), margin=0.3).field()
    assert 850.0 < float(field.at((5.0, 5.0))) < 1100.0
    assert field.reaches(np.array([5.0, 5.0]))


@pytest.mark.parametrize("margin", [0.02, 0.1, 0.25])
@pytest.mark.parametrize("thick", [False, True])
def test_coarse_rasters_lead_through_no_wall(margin, thick):
    """By looking at every long move, or at the cells beside it."""
    wall = np.array([(-9.0, 0.3), (9.0, 0.7), *([(9.0, 0.8), (-9.0, 0.4)] if thick else [])])
    field = ways_to_goal(Obstacles(polygons=[wall]), (0.0, 3.0), margin=margin, cells=4000).field()
    assert np.sqrt(5.0) * field.spacing > margin
    for x in (-3.0, 0.13, 4.0):
        assert float(field.at((x, -1.0))) > 10.0


def test_a_goal_without_a_way_is_told():
    closed = Obstacles(polygons=[[(3, 3), (7, 3)], [(7, 3), (7, 7)], [(7, 7), (3, 7)], [(3, 7), (3, 3)]])
    planner = Planner(robot=Holonomic(max_speed=1.0, radius=0.3), goal=(5.0, 5.0), obstacles=closed, horizon=4)
    outside = planner.step(time=0.0, robot=RobotState(position=(0.0, 0.0)), people=[])
    assert outside.reason.endswith("; no way on the map leads to the goal with 0.3 m to the walls")
    for time, inside in ((0.1, (4.0, 6.0)), (0.2, (3.35, 3.35)), (0.3, (3.32, 5.0))):
        assert "no way" not in planner.step(time=time, robot=RobotState(position=inside), people=[]).reason
    planner.goal = (0.0, 5.0)
    assert "no way" not in planner.step(time=0.4, robot=RobotState(position=(0.0, 0.0)), people=[]).reason


PILLAR = Obstacles(polygons=[[(1.5, -1.0), (2.5, -1.0), (2.5, 1.0), (1.5, 1.0)]])


def test_among_walls_a_goal_has_a_height():
    field = ways_to_goal(PILLAR, (4.0, 0.0, 3.0), margin=0.3).field()
    plane = ways_to_goal(PILLAR, (4.0, 0.0), margin=0.3).field()
    points = np.array([(0.0, 0.0, 0.0), (0.0, 0.5, 3.0), (3.5, 0.0, -1.0)])
    assert field.at(points) == pytest.approx(np.hypot(plane.at(points[:, :2]), points[:, 2] - 3.0))


@pytest.mark.parametrize("goal_cost", ["distance", "squared"])
def test_the_lattice_of_a_drone_among_walls_has_the_costs_of_its_places(goal_cost):
    goal = np.array([4.0, 0.0, 3.0])
    problem = PlanningProblem(
        start=np.array([0.2, 0.3, 0.9]), goal=goal, time_step=0.5, horizon=3, max_speed=1.0, goal_cost=goal_cost,
        goal_weight=1.3, obstacles=PILLAR, distance_to_goal=ways_to_goal(PILLAR, goal, margin=0.3).field(),
    )  # fmt: skip
    maps = prepare(problem)
    cells = np.array([(0, 0, 0), (1, -2, 3), (-3, 2, -1), (4, 4, 4)])
    costs = problem.goal_costs(problem.start + maps.spacing * cells)
    half = np.array(maps.stage.shape) // 2
    found = [float(maps.stage[tuple(half + cell)]) for cell in cells]
    assert np.diff(found) == pytest.approx(np.diff(costs), rel=1e-4, abs=1e-4)


def test_a_drone_flies_up_to_its_goal_around_a_wall():
    robot = Holonomic(max_speed=1.0, radius=0.3)
    trip = Trip(Planner(robot=robot, goal=(4.0, 0.0, 3.0), obstacles=PILLAR, horizon=5), (0.0, 0.0, 0.0)).run(15.0)
    assert trip.arrived, str(trip)
    assert trip.to_walls() > robot.radius - 0.01


@pytest.mark.parametrize("far", [1e3, 1e6])
def test_what_stands_in_the_far_distance_closes_no_door_here(far):
    """Its raster would have cells of up to a kilometre; what is so far from the goal is left out of it."""
    door = [[(3.0, -6.0), (3.1, -6.0), (3.1, -0.6), (3.0, -0.6)], [(3.0, 0.6), (3.1, 0.6), (3.1, 6.0), (3.0, 6.0)]]
    there = [(far, far), (far + 1.0, far), (far, far + 1.0)]
    alone, both = (
        ways_to_goal(Obstacles(polygons=walls), (6.0, 0.0), margin=0.25).field() for walls in (door, [*door, there])
    )
    here = np.array([(0.0, 2.0), (2.0, -3.0), (-50.0, 1.0)])
    assert both.spacing < 0.2
    assert both.at(here) == pytest.approx(alone.at(here), rel=0.03)
    assert all(both.reaches(place) for place in here)
