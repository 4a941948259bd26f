"""Distance to the goal around walls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st

from sidestep._kernels import walls as kernels
from sidestep.obstacles import Obstacles
from sidestep.planning.geodesic import distance_to_goal
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search

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
    field = distance_to_goal(WALL, GOAL, margin=0.3)
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


FIELD = distance_to_goal(WALL, GOAL, margin=0.3)


def test_without_walls_it_is_the_straight_line():
    field = distance_to_goal(Obstacles(), (1.0, 2.0), margin=0.3)
    points = np.random.default_rng(0).uniform(-4, 6, (50, 2))
    straight = np.linalg.norm(points - [1.0, 2.0], axis=1)
    assert field.at(points) == pytest.approx(straight, abs=0.02)
    assert field.at(np.zeros((2, 3, 3))).shape == (2, 3)


def test_goal_in_a_wall_moves_to_the_nearest_free_place_and_blocked_worlds_stay_finite():
    field = distance_to_goal(WALL, (2.1, 0.0), margin=0.3)
    assert WALL.free(field.goal, 0.29)
    assert np.linalg.norm(field.goal - [2.1, 0.0]) < 0.6
    closed = Obstacles(polygons=[[(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)]])
    nowhere = distance_to_goal(closed, (0.0, 0.0), margin=0.3, reach=0.5, cells=400)
    assert np.isfinite(nowhere.at(np.array([[0.0, 0.0], [10.0, 3.0]]))).all()


def test_thin_walls_are_not_jumped():
    thin = Obstacles(polygons=[[(2.0, -3.0), (2.0, 2.0)]])
    field = distance_to_goal(thin, GOAL, margin=0.0)
    assert float(field.at((1.0, 0.0))) > np.hypot(1.0, 2.0) + np.hypot(3.0, 2.0) - 0.1


def test_short_horizon_gets_out_of_a_cul_de_sac_with_the_field():
    field = distance_to_goal(CUL_DE_SAC, GOAL, margin=0.3)
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
    field = distance_to_goal(long, (1.0, 0.0), margin=0.3)
    for x in (-2.5, -6.0):  # on the raster, and off it
        assert float(field.at((x, 0.0))) > np.hypot(x, 20.0) + 20.0


def test_kernel_without_compilation_agrees():
    points = np.random.default_rng(3).uniform(-6, 9, (20, 2))
    arguments = (points, FIELD.values, FIELD.corner, FIELD.spacing, FIELD.goal)
    assert kernels.interpolate.py_func(*arguments) == pytest.approx(kernels.interpolate(*arguments))


@pytest.mark.parametrize("goal", [(30.0, 20.0), (1e4, 2.0), (0.0, 1e9)])
def test_the_raster_grows_no_finer_than_it_may_however_far_the_goal(goal):
    field = distance_to_goal(Obstacles(polygons=[[(0, 0), (1, 0), (1, 0.2)]]), goal, margin=0.3)
    assert field.values.size <= 1.5 * 40000
    assert float(field.at((0.5, -1.0))) == pytest.approx(np.hypot(goal[0] - 0.5, goal[1] + 1.0), rel=0.1)
