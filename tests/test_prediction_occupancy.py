"""Eqs. 4, 6 and 7 against exhaustive enumeration of everything a person may do; what comes with the masses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import ncx2

from alternatives import occupancy as twin
from made_people import TIME_STEP, Encounter, draw_encounter, predicted
from sidestep.errors import InvalidInput
from sidestep.human.goals import SlowingGoal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.prediction.occupancy import (
    Prediction,
    Removal,
    Workspace,
    first_action_probabilities,
    frame_of,
    predict,
)

SHAPES = [(1, 2, 3, 3), (1, 3, 2, 2), (2, 1, 2, 3), (2, 2, 2, 2), (3, 1, 1, 2)]  # d, reach, largest N_H, N


def enumerated(case: Encounter, removal: Removal) -> tuple[list, list, np.ndarray]:
    return twin.enumerate_behaviours(
        case.model, case.lattice, case.goals, case.weights, case.path, case.horizon, TIME_STEP, removal, case.free
    )


def compare(case: Encounter, prediction: Prediction, removal: Removal) -> None:
    masses, halves, contact = enumerated(case, removal)
    d, reach, horizon = case.lattice.dimension, case.model.reach, case.horizon
    for k in range(horizon + 1):
        np.testing.assert_allclose(prediction.occupancy[k], twin.dense(masses[k], reach * horizon, d), atol=1e-6)
    for k in range(horizon):
        np.testing.assert_allclose(prediction.midway[k], twin.dense(halves[k], reach * (2 * k + 1), d), atol=1e-6)
        assert prediction.midway_lattice(k).shape == prediction.midway[k].shape
    np.testing.assert_allclose(prediction.contact, contact, atol=1e-6)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), shape=st.sampled_from(SHAPES), prediction=st.integers(0, 3))
def test_masses_equal_the_enumeration_of_all_behaviours(
    seed: int, shape: tuple[int, int, int, int], prediction: int
) -> None:
    d, reach, longest, horizon = shape
    case = draw_encounter(seed, d=d, reach=reach, steps=min(prediction, longest), horizon=horizon, walls=True)
    compare(case, predicted(case), Removal(distance=1.0))


@pytest.mark.slow
@settings(max_examples=4)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_papers_action_set_over_three_steps(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=2, horizon=3, walls=False)
    compare(case, predicted(case), Removal(distance=1.0))


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_resampled_awareness_with_certainty_is_persistent(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=2, horizon=4, walls=True)
    case = replace(case, weights=np.array([[0.7, 0.0], [0.0, 0.3]]))
    each = [
        predicted(replace(case, model=replace(case.model, awareness_over_horizon=kind))).occupancy.probability
        for kind in ("persistent", "resampled")
    ]
    np.testing.assert_allclose(each[0], each[1], atol=1e-13)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_hypotheses_add_up_and_first_actions_are_theirs(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=3, horizon=3, walls=True)
    case = replace(case, model=replace(case.model, awareness_over_horizon="persistent"))
    result = predicted(case, keep_hypotheses=True)
    assert result.hypotheses is not None
    np.testing.assert_allclose(result.hypotheses.sum(axis=(0, 1)), result.occupancy.probability, atol=1e-14)
    np.testing.assert_allclose(result.hypotheses.sum(axis=(3, 4))[..., -1], case.weights, atol=1e-12)
    centre = result.occupancy.lattice.radius
    near = result.hypotheses[:, :, 1, centre - 2 : centre + 3, centre - 2 : centre + 3].reshape(2, 2, 25)
    np.testing.assert_allclose(near, result.action_probabilities * case.weights[..., None], atol=1e-12)
    alone = first_action_probabilities(
        model=case.model, lattice=case.lattice, goals=case.goals, robot_path=case.path, horizon=case.horizon,
        time_step=TIME_STEP, free=case.free,
    )  # fmt: skip
    np.testing.assert_allclose(alone, result.action_probabilities, atol=1e-12)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_walls_that_nobody_can_reach_change_nothing(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=1, steps=3, horizon=2, walls=False)
    goals = [g.held(1.0) if isinstance(g, SlowingGoal) else g for g in case.goals]  # who slows down knows no walls
    around = predicted(replace(case, goals=goals, free=np.ones((13, 13), dtype=bool)))
    without = predicted(replace(case, goals=goals, free=None))
    np.testing.assert_allclose(around.occupancy.probability, without.occupancy.probability, atol=1e-9)
    np.testing.assert_allclose(around.contact, without.contact, atol=1e-9)


def test_actions_are_told_for_hypotheses_without_weight_too() -> None:
    case = draw_encounter(5, d=2, reach=2, steps=3, horizon=3, walls=False)
    sure = predicted(replace(case, weights=np.array([[1.0, 0.0], [0.0, 0.0]])))
    np.testing.assert_allclose(sure.action_probabilities, predicted(case).action_probabilities, atol=1e-12)
    np.testing.assert_allclose(sure.velocities @ case.lattice.rotation, sure.velocities @ case.lattice.rotation)
    step = case.lattice.to_local(case.lattice.origin + sure.velocities * TIME_STEP) / case.lattice.spacing
    np.testing.assert_allclose(step[0], [-2.0, -2.0], atol=1e-12)
    np.testing.assert_allclose(step[1], [-2.0, -1.0], atol=1e-12)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 3))
def test_contact_of_a_spread_person_at_the_first_instant(seed: int, d: int) -> None:
    """Σ_x mass(x)·P(‖x + σn − robot‖ < r) by the noncentral chi-squared distribution."""
    rng = np.random.default_rng(seed)
    case = draw_encounter(seed, d=d, reach=1, steps=1, horizon=2, walls=False)
    weights, sigmas = rng.dirichlet(np.ones(3)), rng.uniform(0.02, 0.8, (3, 3))
    removal = Removal(distance=0.9, weights=weights, sigmas=sigmas)
    result = predicted(case, removal=removal)
    gap = np.linalg.norm(result.occupancy.lattice.positions() - case.path[1], axis=-1)
    share = sum(w * ncx2.cdf((0.9 / s) ** 2, d, (gap / s) ** 2) for w, s in zip(weights, sigmas[1], strict=True))
    assert result.contact[0] == pytest.approx(float(np.sum(result.occupancy[1] * share)), abs=1e-3)
    assert result.contact.sum() <= 1.0


def test_first_contact_is_counted_once() -> None:
    """A person who stands beside a robot that stands touches it at once, and then never again."""
    model = HumanModel(frame="world", randomness=0.0)
    result = predict(
        model=model, lattice=frame_of(model, np.zeros(2), None, 0.5), goals=[StandGoal()], weights=[[1.0, 0.0]],
        robot_path=np.full((12, 2), 0.2), horizon=5, time_step=0.5, removal=Removal(distance=0.5),
    )  # fmt: skip
    np.testing.assert_allclose(result.contact, [1.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(result.occupancy.probability[:, 10, 10], 1.0)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_smaller_body_is_touched_less(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=3, horizon=5, walls=True)
    sums = [predicted(case, removal=Removal(distance=r)).contact.sum() for r in (0.3, 0.8, 1.6)]
    assert sums[0] <= sums[1] + 1e-12
    assert sums[1] <= sums[2] + 1e-12


def test_frames_follow_the_walk_or_the_world() -> None:
    heading = frame_of(HumanModel(speed_range=(1.0, 2.0)), np.zeros(2), np.array([0.0, 1.6]), 0.5)
    np.testing.assert_allclose(heading.rotation[:, 0], [0.0, 1.0], atol=1e-15)
    assert heading.spacing == pytest.approx(1.6 / 2 * 0.5)
    assert frame_of(HumanModel(speed_range=(1.0, 2.0)), np.zeros(2), np.array([3.0, 0.0]), 0.5).spacing == 0.5
    standing = frame_of(HumanModel(speed_range=(1.0, 2.0)), np.zeros(2), None, 0.5)
    np.testing.assert_allclose(standing.rotation, np.eye(2))
    assert standing.spacing == 0.25
    world = frame_of(HumanModel(frame="world", walking_speed=0.5), np.zeros(2), np.array([0.0, 1.6]), 0.5)
    np.testing.assert_allclose(world.rotation, np.eye(2))
    assert world.spacing == 0.25


def test_results_are_read_only_and_arguments_are_checked() -> None:
    case = draw_encounter(1, d=2, reach=2, steps=3, horizon=3, walls=False)
    result = predicted(case)
    for array in (result.occupancy.probability, result.contact, result.action_probabilities, result.midway[0]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(InvalidInput, match="weights"):
        predicted(case, weights=[[1.0, 0.0]])
    with pytest.raises(InvalidInput, match="robot_path"):
        predicted(case, robot_path=case.path[:4])
    with pytest.raises(InvalidInput, match=r"removal\.sigmas"):
        predicted(case, removal=Removal(distance=1.0, weights=np.ones(1), sigmas=np.ones((2, 1))))


@pytest.mark.parametrize("seed", range(3))
def test_randomness_that_is_given_replaces_that_of_the_model(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=2, horizon=3, walls=False)
    given_ = predicted(case, randomness=0.37)
    own = predicted(replace(case, model=replace(case.model, randomness=0.37)))
    np.testing.assert_array_equal(given_.occupancy.probability, own.occupancy.probability)
    np.testing.assert_array_equal(given_.action_probabilities, own.action_probabilities)


def test_a_workspace_changes_nothing_and_keeps_no_result() -> None:
    space = Workspace()
    cases = [draw_encounter(s, d=2, reach=2, steps=3, horizon=4 + s % 2, walls=True) for s in range(8)]
    kept = [(predicted(case, workspace=space), predicted(case)) for case in cases]
    for shared, alone in kept:
        np.testing.assert_array_equal(shared.occupancy.probability, alone.occupancy.probability)
        np.testing.assert_array_equal(shared.contact, alone.contact)
        np.testing.assert_array_equal(shared.action_probabilities, alone.action_probabilities)
        for a, b in zip(shared.midway, alone.midway, strict=True):
            np.testing.assert_array_equal(a, b)


def test_hypotheses_that_next_to_nobody_believes_in_are_not_followed_but_still_told() -> None:
    case = draw_encounter(5, d=2, reach=2, steps=3, horizon=4, walls=False)
    case = replace(case, model=replace(case.model, awareness_over_horizon="persistent", randomness=0.2))
    some = np.array([[0.3, 0.7 - 4e-10], [3e-10, 1e-10]])
    few, whole = (predicted(replace(case, weights=some), keep_hypotheses=kept) for kept in (False, True))
    np.testing.assert_allclose(few.occupancy.probability, whole.occupancy.probability, atol=2e-9, rtol=0)
    np.testing.assert_allclose(few.occupancy.probability.sum(axis=(1, 2)), 1.0, atol=1e-14)
    np.testing.assert_allclose(few.contact, whole.contact, atol=2e-9, rtol=0)
    np.testing.assert_allclose(few.action_probabilities, whole.action_probabilities, atol=1e-14)


def test_who_slows_down_is_on_average_where_a_falling_pace_leads() -> None:
    model = HumanModel(randomness=0.0)
    velocity, time, step = np.array([0.9, 0.6]), 1.7, 0.4
    prediction = predict(
        model=model, lattice=frame_of(model, np.zeros(2), velocity, step), goals=[SlowingGoal(velocity, time)],
        weights=[[0.3, 0.7]], robot_path=np.zeros((23, 2)), horizon=10, time_step=step,
    )  # fmt: skip
    places = prediction.occupancy.lattice.positions()
    for k, mass in enumerate(prediction.occupancy.probability):
        gone = velocity * time * (1.0 - np.exp(-k * step / time))
        np.testing.assert_allclose((mass[..., None] * places).sum(axis=(0, 1)), gone, atol=1e-9)
    np.testing.assert_allclose(prediction.occupancy.probability.sum(axis=(1, 2)), 1.0, atol=1e-12)
