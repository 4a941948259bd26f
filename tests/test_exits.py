"""Exits of a map: where its boundary opens, and what the planner makes of them."""

from __future__ import annotations

import logging
import math

import numpy as np
import pytest

from sidestep.errors import InvalidInput
from sidestep.exits import DEPTH, WIDEST, exits
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.io.scenarios import load_obstacles, load_scenario
from sidestep.obstacles import Obstacles, OccupancyGrid
from sidestep.planner import Planner
from sidestep.robots import Holonomic, RobotState
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.scenario import Scenario

T = 0.2  # m, thickness of walls


def box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def room(*, door=1.0, hall=()):
    """A room of 8 m by 6 m with a door in the left wall around y = 1 and one in the upper wall around x = −2."""
    half = door / 2
    return Obstacles(
        polygons=[
            box(-4, -3, -4 + T, 1 - half), box(-4, 1 + half, -4 + T, 3), box(4 - T, -3, 4, 3),
            box(-4, -3, 4, -3 + T), box(-4, 3 - T, -2 - half, 3), box(-2 + half, 3 - T, 4, 3), *hall,
        ]
    )  # fmt: skip


def as_grid(walls, yaw, origin, resolution=0.05):
    """The same walls as a map whose axes are turned by `yaw` about its corner, with a free margin around them."""
    x0, y0, x1, y1 = walls.bounds
    xs, ys = np.arange(x0 - 1, x1 + 1, resolution) + resolution / 2, np.arange(y0 - 1, y1 + 1, resolution)
    places = np.stack(np.meshgrid(xs, ys + resolution / 2, indexing="ij"), axis=-1)
    return OccupancyGrid(occupied=~walls.free(places), resolution=resolution, origin=origin, yaw=yaw)


def test_the_doors_of_a_room_are_its_exits():
    np.testing.assert_allclose(exits(room(), 0.3), [(-4 - DEPTH, 1.0), (-2.0, 3 + DEPTH)], atol=0.03)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -2.0])
def test_a_map_has_the_exits_of_the_walls_it_shows(yaw):
    grid = as_grid(room(), yaw, (2.0, -1.0))
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    corner = np.array([-5.0, -4.0])  # of the map, in the room's frame
    expected = (np.array(exits(room(), 0.3)) - corner) @ turn.T + (2.0, -1.0)
    np.testing.assert_allclose(exits(Obstacles(grid=grid), 0.3), expected, atol=0.1)


def test_unknown_surroundings_of_a_map_are_no_exit():
    """What nobody has seen counts as wall: a door that only leads there is closed."""
    grid = as_grid(room(), 0.0, (0.0, 0.0))
    occupied = np.ones_like(grid.occupied)
    occupied[20:-20, 20:-20] = grid.occupied[20:-20, 20:-20]  # all but the margin
    assert exits(Obstacles(grid=OccupancyGrid(occupied=occupied, resolution=0.05)), 0.3) == ()


def test_a_door_too_narrow_for_a_person_or_blocked_behind_is_no_exit():
    assert exits(room(door=0.5), 0.3) == ()
    assert len(exits(room(door=0.5), 0.2)) == 2
    cupboard = box(-3.7, 0.2, -3.5, 1.8)  # half a metre inside the left door
    np.testing.assert_allclose(exits(room(hall=[cupboard]), 0.3), [(-2.0, 4.0)], atol=0.03)


def test_a_closed_room_and_a_map_without_walls_have_none():
    sides = [box(-4, -3, 4, -2.8), box(-4, 2.8, 4, 3), box(-4, -3, -3.8, 3), box(3.8, -3, 4, 3)]
    assert exits(Obstacles(polygons=sides), 0.3) == ()
    assert exits(Obstacles(), 0.3) == ()
    assert exits(Obstacles(grid=OccupancyGrid(occupied=np.zeros((9, 9), dtype=np.bool_), resolution=0.1)), 0.3) == ()


def test_a_wide_gap_is_several_exits_evenly_apart():
    found = np.array(exits(Obstacles(polygons=[box(0, 0, 10, T), box(0, 5, T, 5 + T), box(0, 0, T, 5 + T)]), 0.3))
    top = found[found[:, 1] > 5.0]
    assert len(top) == math.ceil((10 - T - 0.3) / WIDEST)
    np.testing.assert_allclose(np.diff(top[:, 0]), np.diff(top[:, 0])[0], atol=1e-2)


def test_the_corridors_exits_are_those_given_by_hand():
    assert exits(load_obstacles(load_scenario("corridor")), 0.3) == ((-10.0, 0.0), (10.0, 0.0))


def plan_of(human, walls, steps=6):
    """A planner that sees somebody walk to the right along a corridor; its last plan."""
    planner = Planner(robot=Holonomic(), goal=(7.0, 0.0), human=human, obstacles=walls)
    for k in range(steps):
        person = PersonObservation(id="a", position=(-6.0 + 0.5 * k, 0.7), velocity=(1.0, 0.0))
        plan = planner.step(time=0.5 * k, robot=RobotState(position=(2.0, -0.9)), people=[person])
    return plan


def test_the_exit_that_somebody_walks_to_is_believed_and_equals_the_one_given_by_hand():
    walls = load_obstacles(load_scenario("corridor"))
    found = plan_of(HumanModel(goals="exits"), walls).people["a"]
    given = plan_of(HumanModel(goals=((-10.0, 0.0), (10.0, 0.0))), walls).people["a"]
    assert dict(found.goals) == dict(given.goals)
    assert found.goals["at (10.00, 0.00)"] > 0.95
    assert found.belief == given.belief


@pytest.mark.parametrize("walls", [None, Obstacles(polygons=[box(0, 3, 1, 4)])])
def test_without_exits_directions_are_inferred_and_the_log_says_so(walls, caplog):
    with caplog.at_level(logging.WARNING, logger="sidestep"):
        fallback = plan_of(HumanModel(goals="exits"), walls).people["a"]
    assert "no exits" in caplog.text
    plain = plan_of(HumanModel(), walls).people["a"]
    assert dict(fallback.goals) == dict(plain.goals)
    np.testing.assert_array_equal(fallback.occupancy.probability, plain.occupancy.probability)


def test_a_scenario_file_may_say_exits_and_nothing_else():
    data = {"robot": {"start": (0.0, 0.0), "goal": (5.0, 0.0)}, "human": {"goals": "exits"}}
    assert Scenario.parse(data).human.goals == "exits"
    assert Scenario.parse(Scenario.parse(data).settings()).human.goals == "exits"
    with pytest.raises(InvalidInput, match=r"human\.goals"):
        Scenario.parse(data | {"human": {"goals": "doors"}})


@pytest.mark.slow
def test_in_the_corridor_nobody_is_touched_though_nobody_says_where_they_go():
    for seed in range(2):
        numbers = measure(simulate(load_scenario("corridor", [f"seed={seed}"]), snapshots=0))
        assert numbers.reached_goal
        assert numbers.contacts_moving == 0
