"""A campaign of trips without people: among random walls every base gets to where a way leads, and touches none.

`SIDESTEP_TRIPS` sets the number of trips of each base (`make campaign` runs 100).
"""

from __future__ import annotations

import os

import numpy as np
import pytest

from sidestep import DifferentialDrive, Holonomic, Planner, RobotState
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


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["any velocity", "limited acceleration", "two wheels, limited acceleration"])
@pytest.mark.parametrize("seed", range(TRIPS))
def test_where_a_way_leads_the_base_arrives_and_touches_no_wall(kind, seed):
    rng = np.random.default_rng(seed)
    obstacles, robot = walls(rng), base(rng, kind)
    wheels = isinstance(robot, DifferentialDrive)
    places = ends(rng, obstacles, robot.planning_radius + 0.05 + (robot.offset if wheels else 0.0))
    if places is None:
        pytest.skip("no room for it between these walls")
    planner = Planner(
        robot=robot, goal=places[1], obstacles=obstacles, horizon=int(rng.choice([5, 8, 10])),
        time_step=float(rng.choice([0.4, 0.5])),
    )  # fmt: skip
    period = float(rng.choice([0.1, 0.2, 0.4]))
    state = RobotState(position=places[0], heading=float(rng.uniform(-3, 3)) if wheels else None, velocity=np.zeros(2))
    time, nearest, reason, most = 0.0, np.inf, "", 400.0
    while np.linalg.norm(robot.reference(state) - places[1]) > 0.35:
        plan = planner.step(time=time, robot=state, people=[])
        if time == 0.0:
            if "no way" in plan.reason:
                return
            most = 4.0 * 12.0 * np.sqrt(2.0) / robot.planning_speed + 25.0
        assert time < most, f"{robot} at {state.position}, {plan.status}: {plan.reason}"
        for _ in range(round(period / 0.05)):
            state = robot.follow(plan.velocity, state, 0.05)
            nearest = min(nearest, float(obstacles.distance(state.position)))
        time, reason = time + period, plan.reason
    assert nearest > robot.radius - SWAY, reason
