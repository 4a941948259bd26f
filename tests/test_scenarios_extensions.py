"""The worlds beyond the paper, run as they are shipped: what holds in each of them."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.io.scenarios import load_obstacles, load_scenario
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.viewer.figures import run_figure


def _laws(record, scenario):
    """Bodies stay out of walls and of each other, and every number is one."""
    numbers = measure(record)
    assert numbers.contacts_moving == 0
    assert np.isfinite(record.robot_positions).all()
    assert set(record.status) <= {"certified", "least_risk"}
    seen = record.beliefs[np.isfinite(record.beliefs)]
    assert ((seen > 0) & (seen < 1)).all()
    walls = load_obstacles(scenario)
    if walls is not None:
        assert walls.free(record.robot_positions, margin=scenario.robot.radius - 0.02).all()
        there = record.people_positions[np.isfinite(record.people_positions).all(axis=-1)]
        assert walls.free(there, margin=0.0).all()
    return numbers


@pytest.mark.slow
@pytest.mark.parametrize("name", ["doorway", "office", "blind-corner", "changing-minds", "circle", "drone"])
def test_the_robot_arrives_and_touches_nobody(name):
    scenario = load_scenario(name)
    record = simulate(scenario, snapshots=2)
    numbers = _laws(record, scenario)
    assert numbers.reached_goal
    least = 0.6 if name == "circle" else 0.8  # among seven people at 2 Hz, 0.70 to 0.96 over eight seeds
    assert numbers.status_counts["certified"] >= least * numbers.steps
    assert run_figure(record).axes


@pytest.mark.slow
def test_in_a_lane_nobody_is_run_into():
    """Where there is no way around, a steady walker who turns is met by a robot that allowed for it."""
    scenario = load_scenario("lane")
    for seed in range(8):
        _laws(simulate(scenario, seed=seed, snapshots=0), scenario)


@pytest.mark.slow
def test_everybody_in_a_crowd_has_a_belief_of_their_own():
    scenario = load_scenario("crowd", ["duration=6.0"])
    record = simulate(scenario, snapshots=0)
    _laws(record, scenario)
    assert len(record.people) == 12
    last = record.beliefs[-1]
    assert len(np.unique(np.round(last[np.isfinite(last)], 6))) >= 3


@pytest.mark.slow
def test_the_straight_way_ends_at_a_wall_and_the_way_round_is_found():
    scenario = load_scenario("office", ["people=[]"])
    numbers = measure(simulate(scenario, snapshots=0))
    straight = float(np.linalg.norm(np.subtract(scenario.robot.goal, scenario.robot.start)))
    assert numbers.reached_goal
    assert numbers.path_length > 1.3 * straight


@pytest.mark.slow
def test_a_robot_slower_than_people_neither_freezes_nor_pretends():
    """It cannot get out of everybody's way: it goes on when it may, and who walks into it standing is told apart."""
    changes = ["robot.max_speed=0.3", "robot.goal=[0.0, 1.0]", "people.0.kind=unconcerned", "duration=60.0"]
    for seed in range(3):
        numbers = measure(simulate(load_scenario("crossing", [*changes, f"seed={seed}"]), snapshots=0))
        assert numbers.reached_goal
        assert numbers.contacts_moving == 0
