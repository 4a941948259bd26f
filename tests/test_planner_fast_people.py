"""People who are faster than anybody walks: runners, and whoever stands on a scooter."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep
from sidestep.simulation.metrics import measure


@pytest.mark.parametrize("speed", [1.4, 3.0, 5.0])
def test_people_are_predicted_as_fast_as_they_are(speed: float) -> None:
    planner = sidestep.Planner(robot=sidestep.Holonomic(), goal=(0.0, 5.0))
    place, velocity = np.array([-8.0, 0.0]), np.array([speed, 0.0])
    seen = sidestep.PersonObservation(id="a", position=place, velocity=velocity)
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, -5.0)), people=[seen])
    occupancy = plan.people["a"].occupancy
    likeliest = np.unravel_index(occupancy[2].argmax(), occupancy.shape[1:])
    np.testing.assert_allclose(occupancy.lattice.positions()[likeliest], place + velocity * 1.0, atol=1e-6)


@pytest.mark.slow
def test_nobody_on_a_scooter_is_driven_into() -> None:
    for seed, angle in enumerate(np.linspace(0.3, 5.9, 12)):
        along = np.array([np.cos(angle), np.sin(angle)])
        scenario = sidestep.Scenario.parse(
            {
                "name": "scooter",
                "seed": seed,
                "duration": 12.0,
                "planning_period": 0.1,
                "robot": {"start": (0.0, 0.0), "goal": (6.0, 0.0)},
                "people": [
                    {
                        "kind": "straight",
                        "speed": 5.0,
                        "goal_known": False,
                        "start": (np.array([4.0, 0.0]) - 20.0 * along).tolist(),
                        "goal": (np.array([4.0, 0.0]) + 40.0 * along).tolist(),
                        "arrives_with": (5.0 * along).tolist(),
                    }
                ],
            }
        )
        met = measure(sidestep.simulate(scenario, snapshots=0))
        assert met.contacts_moving == 0, angle
        assert met.reached_goal
