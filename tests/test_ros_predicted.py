"""The published occupancy: the same probabilities as the planner's own, on a grid for costmaps."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.ros.predicted import occupancy_raster

RADIUS = 0.3


def plan(**model):
    planner = sidestep.Planner(
        robot=sidestep.Holonomic(max_speed=0.6, radius=0.2),
        goal=(4.0, 0.0),
        human=sidestep.HumanModel(**model),
        horizon=4,
    )
    for k in range(4):
        time = 0.2 * k
        people = [
            sidestep.PersonObservation(id="a", position=(2.0, 1.5 - time), velocity=(0.0, -1.0)),
            sidestep.PersonObservation(id="b", position=(-1.0, -1.0), velocity=(0.0, 0.0)),
        ]
        found = planner.step(time=time, robot=sidestep.RobotState(position=(0.0, 0.0)), people=people)
    return found


def exact(made, points):
    """The definition, one place after another."""
    top = np.zeros(len(points))
    for k in range(5):
        nobody = np.ones(len(points))
        for person in made.people.values():
            spread = person.spread
            mass = PersonMass.of(
                lattice=person.occupancy.lattice,
                steps=person.occupancy.probability,
                weights=None if spread is None else spread[0],
                sigmas=None if spread is None else np.repeat(spread[1], 2, axis=0)[:-1],
            )
            nobody *= 1.0 - RiskField(people=[mass], distances=np.array([RADIUS]), midway=False).at(2 * k, points)
        top = np.maximum(top, 1.0 - nobody)
    return top


@pytest.mark.parametrize("model", [{"steadiness": False, "online_randomness": False}, {}])
@pytest.mark.parametrize("cells", [60, 61])
def test_the_grid_shows_the_probability_that_a_body_covers_its_places(model, cells):
    made = plan(**model)
    corner, resolution = np.array([-2.0, -2.5]), 0.1
    grid = occupancy_raster(made, corner, resolution, cells, radius=RADIUS)
    columns, rows = np.meshgrid(np.arange(cells), np.arange(cells))
    points = corner + resolution * (np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5)
    wanted = exact(made, points).reshape(cells, cells)
    shown = grid > 0
    assert np.abs(grid - wanted)[shown].max() < 0.002
    assert wanted[~shown].max() < 0.01
    assert grid.max() > 0.9  # where they are now
    assert shown.sum() > 50


def test_nobody_is_nothing():
    planner = sidestep.Planner(robot=sidestep.Holonomic(max_speed=0.6, radius=0.2), goal=(4.0, 0.0), horizon=4)
    made = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
    assert not occupancy_raster(made, np.zeros(2), 0.1, 20, radius=RADIUS).any()
