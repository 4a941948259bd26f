"""Laws of predicted masses: conservation, walls, symmetry, mean velocity, and where awareness cannot matter."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from made_people import draw_encounter, predicted
from sidestep.human.goals import DirectionGoal, PointGoal
from sidestep.human.model import HumanModel
from sidestep.prediction.occupancy import frame_of, predict


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 3), prediction=st.sampled_from([None, 0, 1, 4]))
def test_mass_is_conserved_at_every_instant(seed: int, d: int, prediction: int | None) -> None:
    horizon = 7 if d < 3 else 3
    case = draw_encounter(seed, d=d, reach=2, steps=horizon, horizon=horizon, walls=True)
    case = replace(case, model=replace(case.model, horizon=prediction))
    result = predicted(case)
    total = result.occupancy.probability.reshape(horizon + 1, -1).sum(axis=1)
    np.testing.assert_allclose(total, 1.0, atol=1e-12)
    np.testing.assert_allclose([h.sum() for h in result.midway], 1.0, atol=1e-12)
    np.testing.assert_allclose(result.action_probabilities.sum(axis=2), 1.0, atol=1e-12)
    assert result.occupancy.probability.min() >= 0.0
    assert np.all(result.contact >= 0.0)
    assert result.contact.sum() <= 1.0 + 1e-12


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_nobody_is_inside_a_wall(seed: int) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=3, horizon=4, walls=False)
    rng = np.random.default_rng(seed)
    free = rng.random((17, 17)) < 0.6
    free[8, 8] = True
    result = predicted(replace(case, free=free))
    assert np.all(result.occupancy.probability[:, ~free] == 0.0)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_mirrored_turned_and_shifted_worlds_give_the_same_masses_there(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = HumanModel(
        frame="world", goal_cost="squared", horizon=3, danger_weight=20.0, danger_rate=0.3, randomness=0.2
    )
    goal, path = 3 * rng.normal(size=2), np.cumsum(rng.normal(size=(8, 2)), axis=0)

    def masses(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
        return predict(
            model=model,
            lattice=frame_of(model, shift, None, 0.5),
            goals=[PointGoal(goal @ turn.T + shift)],
            weights=[[0.4, 0.6]],
            robot_path=path @ turn.T + shift,
            horizon=4,
            time_step=0.5,
        ).occupancy.probability

    usual = masses(np.eye(2), np.zeros(2))
    np.testing.assert_allclose(masses(np.diag([-1.0, 1.0]), np.zeros(2)), usual[:, ::-1], atol=1e-12)
    turned = masses(np.array([[0.0, -1.0], [1.0, 0.0]]), np.zeros(2))
    np.testing.assert_allclose(turned, usual.transpose(0, 2, 1)[:, ::-1], atol=1e-12)
    np.testing.assert_allclose(masses(np.eye(2), rng.integers(-8, 9, size=2) * 1.0), usual, atol=1e-12)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), angle=st.floats(0.0, 6.28))
def test_the_persons_own_frame_turns_with_the_person(seed: int, angle: float) -> None:
    rng = np.random.default_rng(seed)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    model = HumanModel(horizon=3, danger_weight=5.0)
    velocity, path = rng.normal(size=2) + 1e-3, np.cumsum(rng.normal(size=(8, 2)), axis=0)

    def masses(rotation: np.ndarray) -> np.ndarray:
        walk = rotation @ velocity
        return predict(
            model=model,
            lattice=frame_of(model, np.zeros(2), walk, 0.5),
            goals=[DirectionGoal(walk)],
            weights=[[0.5, 0.5]],
            robot_path=path @ rotation.T,
            horizon=4,
            time_step=0.5,
        ).occupancy.probability

    np.testing.assert_allclose(masses(turn), masses(np.eye(2)), atol=1e-9)


@given(
    angle=st.floats(0.0, 6.28),
    speed=st.floats(0.1, 1.4),
    randomness=st.floats(0.0, 1.0),
    frame=st.sampled_from(["world", "heading"]),
)
def test_unconcerned_people_go_on_at_their_mean_velocity(
    angle: float, speed: float, randomness: float, frame: str
) -> None:
    velocity = speed * np.array([math.cos(angle), math.sin(angle)])
    heading = velocity + np.array([0.2, -0.1])  # the frame need not be the direction
    model = HumanModel(frame=frame, walking_speed=0.7, randomness=randomness)  # type: ignore[arg-type]
    lattice = frame_of(model, np.array([1.0, 2.0]), heading, 0.5)
    local = velocity @ lattice.rotation
    kept = np.clip(local, -2 * lattice.spacing / 0.5, 2 * lattice.spacing / 0.5) @ lattice.rotation.T
    result = predict(
        model=model, lattice=lattice, goals=[DirectionGoal(velocity)], weights=[[1.0, 0.0]],
        robot_path=np.zeros((20, 2)), horizon=5, time_step=0.5,
    )  # fmt: skip
    positions = result.occupancy.lattice.positions()
    for k in range(6):
        mean = np.einsum("ij,ijd->d", result.occupancy[k], positions)
        np.testing.assert_allclose(mean, [1.0, 2.0] + 0.5 * k * (1 - randomness) * kept, atol=1e-9)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), prediction=st.sampled_from([0, 1, 5]))
def test_where_the_robot_does_not_matter_awareness_does_not(seed: int, prediction: int) -> None:
    """Far away the two are equal to the last bit; near, they differ in some of the cases."""
    rng = np.random.default_rng(seed)
    model = HumanModel(horizon=prediction, randomness=0.1)
    velocity = rng.normal(size=2)
    far = rng.normal(size=2)
    far *= 40.0 / np.linalg.norm(far)
    both = [
        predict(
            model=model, lattice=frame_of(model, np.zeros(2), velocity, 0.5), goals=[DirectionGoal(1.3 * velocity)],
            weights=[weights], robot_path=far + np.cumsum(rng.normal(size=(12, 2)), axis=0), horizon=5, time_step=0.5,
        ).occupancy.probability
        for weights in ([1.0, 0.0], [0.0, 1.0])
    ]  # fmt: skip
    np.testing.assert_array_equal(both[0], both[1])
