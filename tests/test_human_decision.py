"""One person's decision: what their first actions cost against brute force, and the draw against numpy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alternatives import policy as twin
from made_people import TIME_STEP, draw_encounter
from sidestep._kernels import decide as kernel
from sidestep.errors import InvalidInput
from sidestep.human.cost import TIE
from sidestep.human.decision import first_action_costs
from sidestep.human.goals import PointGoal
from sidestep.human.policy import action_values

SHAPES = [(1, 2, 3), (1, 3, 2), (2, 1, 3), (2, 2, 2), (3, 1, 1)]  # d, reach, largest N_H


@given(seed=st.integers(0, 2**32 - 1), shape=st.sampled_from(SHAPES), prediction=st.integers(0, 3), walls=st.booleans())
def test_costs_equal_brute_force_and_the_values_of_the_anchor(
    seed: int, shape: tuple[int, int, int], prediction: int, walls: bool
) -> None:
    d, reach, longest = shape
    case = draw_encounter(seed, d=d, reach=reach, steps=min(prediction, longest), horizon=1, walls=walls)
    free = case.free if walls else None
    for goal in case.goals:
        for beta in (0, 1):
            given_ = (case.model, case.lattice, goal, case.path, beta, TIME_STEP)
            costs = first_action_costs(*given_, free)
            expected = twin.action_values(*given_, np.zeros(d, int), free)
            np.testing.assert_allclose(costs, expected, rtol=1e-5, atol=1e-12)
            same = action_values(case.model, case.lattice.with_radius(0), *given_[2:], free)
            np.testing.assert_allclose(costs, same.ravel(), rtol=1e-13)


@given(seed=st.integers(0, 2**32 - 1), weight=st.floats(0.0, 50.0), rate=st.floats(0.01, 3.0))
def test_a_law_of_ones_own_replaces_that_of_the_model(seed: int, weight: float, rate: float) -> None:
    case = draw_encounter(seed, d=2, reach=2, steps=2, horizon=1, walls=False)
    sharp = replace(case.model, danger_weight=weight, danger_rate=rate, perception_noise=0.0)
    for goal in case.goals:
        given_ = (case.lattice, goal, case.path, 1, TIME_STEP)
        costs = first_action_costs(case.model, *given_, law=(weight, rate))
        np.testing.assert_allclose(costs, first_action_costs(sharp, *given_), rtol=1e-13)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("squared", [False, True])
def test_compiled_and_plain_costs_agree(d: int, squared: bool) -> None:
    rng = np.random.default_rng(d)
    reach, steps = 2, 2 if d < 3 else 1
    columns = 2 * reach * steps + 1
    free = rng.random((columns ** (d - 1), columns)) < 0.8
    for walls in (np.zeros((0, 0), np.bool_), free):
        given_ = (
            rng.normal(size=(steps + 1, d)), rng.normal(size=d), np.eye(d), 0.3, 0.6, reach, steps, 1,
            rng.normal(size=d), np.ones(d), np.full(d, 0.1), squared, True, 3.0, 0.5, not squared, walls,
        )  # fmt: skip
        compiled, plain = kernel.first_action_costs(*given_), kernel.first_action_costs.py_func(*given_)
        np.testing.assert_allclose(compiled, plain, rtol=1e-13)


def test_a_path_shorter_than_the_look_ahead_is_refused() -> None:
    case = draw_encounter(1, d=2, reach=2, steps=3, horizon=1, walls=False)
    with pytest.raises(InvalidInput, match="robot_path"):
        first_action_costs(case.model, case.lattice, PointGoal((1.0, 0.0)), case.path[:2], 1, TIME_STEP)


@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 3), error=st.floats(-2.0, 2.0))
def test_a_misjudged_robot_is_off_along_the_line_of_sight(seed: int, d: int, error: float) -> None:
    rng = np.random.default_rng(seed)
    path, place = rng.normal(size=(4, d)), rng.normal(size=d)
    path[0] = place  # no line of sight
    sight = path - place
    expected = path + error * sight / np.maximum(np.linalg.norm(sight, axis=1, keepdims=True), 1e-9)
    for seen_off in (kernel.seen_off, kernel.seen_off.py_func):
        np.testing.assert_allclose(seen_off(path, place, error), expected, rtol=1e-13, atol=1e-13)


some_costs = st.lists(st.one_of(st.floats(0.0, 3.0), st.just(1.0), st.just(math.inf)), min_size=1, max_size=25)


@given(costs=some_costs, rationality=st.one_of(st.just(math.inf), st.floats(0.1, 5.0)), luck=st.floats(0.0, 0.9999))
def test_odds_and_draws_are_those_of_numpy(costs: list[float], rationality: float, luck: float) -> None:
    values = np.array(costs)
    best = values.min()
    expected = np.zeros_like(values)
    if math.isfinite(best):
        tied = values <= best + TIE * abs(best) + 1e-12
        expected = tied.astype(float) if math.isinf(rationality) else np.exp(-rationality * (values - best))
    for odds_of, drawn in (
        (kernel.odds_of, kernel.drawn),
        (kernel.odds_of.py_func, kernel.drawn.py_func),
    ):
        odds = odds_of(values, rationality, TIE)
        np.testing.assert_allclose(odds, expected, rtol=1e-13)
        if expected.sum() == 0:
            assert drawn(odds, luck) == -1
            continue
        ends = np.cumsum(expected / expected.sum())
        index = drawn(odds, luck)
        assert 0 <= index < len(costs)
        assert (ends[index - 1] if index > 0 else 0.0) - 1e-9 <= luck <= ends[index] + 1e-9
