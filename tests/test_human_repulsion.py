"""Beyond the paper: concerned people keep away from other people, too, where the model says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alternatives import policy as twin
from blind_driver import BlindDriver, crossing
from made_people import TIME_STEP, draw_encounter, predicted
from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.policy import action_values
from sidestep.planner import Planner
from sidestep.robots import Holonomic, RobotState
from sidestep.simulation.loop import simulate

SHAPES = [(1, 2, 3), (2, 2, 2), (2, 1, 3), (3, 1, 1)]  # d, reach, largest N_H


def company(rng: np.random.Generator, path: np.ndarray, people: int = 2) -> np.ndarray:
    """(P, T, d) m, people who walk about where the robot does."""
    return path + np.cumsum(0.3 * rng.normal(size=(people, *path.shape)), axis=1)


@given(seed=st.integers(0, 2**32 - 1), shape=st.sampled_from(SHAPES), prediction=st.integers(0, 3))
def test_what_others_cost_equals_brute_force_in_every_cell(seed, shape, prediction):
    d, reach, longest = shape
    case = draw_encounter(seed, d=d, reach=reach, steps=min(prediction, longest), horizon=1, walls=True)
    rng = np.random.default_rng(seed)
    model = replace(case.model, repulsion_weight=float(rng.uniform(0.1, 8)), repulsion_rate=float(rng.uniform(0.1, 2)))
    others, lattice = company(rng, case.path), case.lattice.with_radius(1)
    for beta in (0, 1):
        given_ = (model, lattice, case.goals[0], case.path, beta, TIME_STEP)
        values = action_values(*given_, case.free, others)
        for index in np.ndindex(lattice.shape):
            expected = twin.action_values(*given_, np.array(index) - 1, case.free, others)
            np.testing.assert_allclose(values[index], expected, rtol=1e-5, atol=1e-12)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_without_a_weight_other_people_change_no_bit(seed):
    case = draw_encounter(seed, d=2, reach=2, steps=3, horizon=3, walls=True)
    alone, among = predicted(case), predicted(case, others=company(np.random.default_rng(seed), case.path))
    np.testing.assert_array_equal(alone.occupancy.probability, among.occupancy.probability)
    np.testing.assert_array_equal(alone.action_probabilities, among.action_probabilities)
    np.testing.assert_array_equal(alone.contact, among.contact)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_somebody_far_away_changes_no_bit(seed):
    case = draw_encounter(seed, d=2, reach=2, steps=3, horizon=3, walls=True)
    model = replace(case.model, danger_decay="squared_distance", repulsion_weight=5.0, repulsion_rate=1.0)
    far = case.path[None] + 1000.0
    alone, among = predicted(case, model=model), predicted(case, model=model, others=far)
    np.testing.assert_array_equal(alone.occupancy.probability, among.occupancy.probability)


def test_only_the_concerned_are_predicted_to_keep_away_from_others():
    case = draw_encounter(5, d=2, reach=2, steps=4, horizon=4, walls=False)
    model = replace(HumanModel(frame="world", horizon=4), repulsion_weight=20.0, repulsion_rate=1.0)
    goal = PointGoal(case.lattice.origin + np.array([6.0, 0.0]))
    ahead = case.lattice.origin + np.array([1.5, 0.2])
    others = np.repeat(ahead[None], len(case.path), axis=0)[None]
    far = np.full_like(case.path, 500.0)

    def mass_near(weights, others):
        seen = predicted(case, model=model, goals=[goal], weights=[weights], robot_path=far, others=others)
        cells = seen.occupancy.lattice.positions()
        near = np.linalg.norm(cells - ahead, axis=-1) < 0.8
        return sum(float(seen.occupancy[k][near].sum()) for k in range(1, 5))

    unconcerned, concerned = (1.0, 0.0), (0.0, 1.0)
    assert mass_near(unconcerned, others) == mass_near(unconcerned, None)
    assert mass_near(concerned, others) < 0.5 * mass_near(concerned, None)


def _least_gap(**behaviour):
    """Least distance of two people who walk toward each other, the robot far away."""
    people = [
        {"id": "a", "kind": "concerned", "start": (-4.0, 0.1), "goal": (4.0, 0.1), "behaviour": behaviour},
        {"id": "b", "kind": "concerned", "start": (4.0, 0.0), "goal": (-4.0, 0.0), "behaviour": behaviour},
    ]
    human = {"randomness": 0.0, "walking_speed": 0.6}
    robot = {"start": (0.0, -60.0), "goal": (0.0, -50.0)}
    scenario = crossing(people=people, human=human, robot=robot, duration=9.0, stop_at_goal=False, control_step=0.1)
    record = simulate(scenario, navigator=BlindDriver(goal=(0.0, -50.0)), snapshots=0)
    a, b = record.people_positions[:, 0], record.people_positions[:, 1]
    assert np.linalg.norm(a[-1] - (4.0, 0.1)) < 1.0  # both arrive all the same
    assert np.linalg.norm(b[-1] - (-4.0, 0.0)) < 1.0
    return float(np.linalg.norm(a - b, axis=1).min())


def test_two_concerned_people_who_meet_keep_a_larger_distance_than_without():
    assert _least_gap() < 0.3
    assert _least_gap(repulsion_weight=6.0) > 0.6
    assert _least_gap(repulsion_weight=0.0) == _least_gap()


def test_the_planner_expects_people_who_mind_each_other_to_part():
    """The same two people, as the planner predicts them: less of their mass meets where the weight is on."""

    def together(weight):
        planner = Planner(
            robot=Holonomic(), goal=(3.0, 0.0), human=HumanModel(prior_concerned=0.95, repulsion_weight=weight)
        )
        people = [
            PersonObservation(id="a", position=(-2.0, 1.0), velocity=(1.0, 0.0), goal=(4.0, 1.0)),
            PersonObservation(id="b", position=(2.0, 1.0), velocity=(-1.0, 0.0), goal=(-4.0, 1.0)),
        ]
        plan = planner.step(time=0.0, robot=RobotState(position=(-3.0, -3.0)), people=people)
        occupancy = plan.people["a"].occupancy
        lane = np.abs(occupancy.lattice.positions()[..., 1] - 1.0) < 0.3
        return float(occupancy[4][lane].sum())

    assert together(6.0) < together(0.0) - 0.2


@pytest.mark.parametrize("name", ["repulsion_weight", "repulsion_rate"])
def test_a_negative_number_is_refused_by_name(name):
    with pytest.raises(ValueError, match=f"human.{name}"):
        HumanModel(**{name: -1.0})
