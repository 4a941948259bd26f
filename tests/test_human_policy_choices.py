"""From values to choices: float32 against float64, robots too far away to matter, Python against compiled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sidestep._kernels import sweep_choices, sweep_marks, sweep_near
from sidestep._kernels.sweep_choices import Choices
from sidestep._kernels.sweep_marks import WORD
from sidestep.human.cost import CostGrid, danger_terms
from sidestep.human.goals import DirectionGoal, Goal, PointGoal
from sidestep.human.intent import intent_of
from sidestep.human.model import HumanModel
from sidestep.human.policy import (
    GoalPolicy,
    action_values,
    admissible_actions,
    boxes,
    embedded_free,
    look_ahead,
    near_scratch,
    policy_of,
    value_scratch,
    words_of,
)
from sidestep.lattice import Lattice
from sidestep.prediction.occupancy import frame_of


def laid_out(
    model: HumanModel, lattice: Lattice, goal: Goal, path: np.ndarray, horizon: int, single: bool = False,
    free: np.ndarray | None = None,
) -> GoalPolicy:  # fmt: skip
    steps, lead = look_ahead(model, horizon)
    reach = model.reach
    grid = CostGrid(
        lattice=lattice, time_step=0.5, reach=reach, steps=steps, centre=reach * (horizon - 1 + steps),
        dtype=np.float32 if single else np.float64,
    )  # fmt: skip
    danger = danger_terms(model, path[: max(horizon + 1, horizon + lead * steps)], grid, horizon, lead)
    intent = intent_of(model, goal, grid, embedded_free(free, grid), reach * (horizon - 1))
    return policy_of(intent, danger)


def chosen(policy: GoalPolicy, horizon: int, lead: int = 1, everything: bool = True) -> Choices:
    reach, d = policy.intent.grid.reach, policy.intent.grid.dimension
    words = words_of(reach, d)
    choices = boxes([reach * k for k in range(horizon)], d, words, policy.intent.layers * words)
    wanted = np.ones(horizon, np.bool_) if everything else policy.differs
    policy.sweep(True, 0, horizon, lead, wanted, value_scratch(policy.intent.grid), choices)
    return choices


def bits(choices: Choices, k: int, count: int, d: int) -> np.ndarray:
    """(cells…, n) of policy k."""
    width = 2 * int(choices.radii[k]) + 1
    start = int(choices.offsets[k])
    block = choices.masks[:, start : start + width**d]
    flat = np.stack([block[a // WORD] >> (a % WORD) & 1 for a in range(count)], axis=-1)
    return flat.reshape(*(width,) * d, count).astype(bool)


@settings(max_examples=12)
@given(seed=st.integers(0, 2**32 - 1), horizon=st.sampled_from([4, 12]), cost=st.sampled_from(["squared", "distance"]))
def test_single_precision_chooses_the_same_unless_costs_are_within_1e5(seed: int, horizon: int, cost: str) -> None:
    rng = np.random.default_rng(seed)
    model = HumanModel(frame="world", goal_cost=cost, horizon=horizon, danger_weight=30.0, danger_rate=0.3)  # type: ignore[arg-type]
    lattice = Lattice(origin=rng.normal(size=2), spacing=0.25, radius=0)
    goals = [PointGoal(5 * rng.normal(size=2)), DirectionGoal(rng.normal(size=2))]
    path = np.cumsum(0.4 * rng.normal(size=(2 * horizon + 1, 2)), axis=0)
    for goal in goals:
        both = [chosen(laid_out(model, lattice, goal, path, horizon, single), horizon) for single in (False, True)]
        for k in (0, horizon // 2, horizon - 1):
            double, single = (bits(c, k, 25, 2) for c in both)
            values = action_values(model, lattice.with_radius(2 * k), goal, path[k:], 1, 0.5)
            best = values.min(axis=-1, keepdims=True)
            np.testing.assert_array_equal(double, values <= best * (1 + 1e-6) + 1e-12)
            differ = double != single
            assert np.all((values - best)[differ] <= 1e-5 * np.broadcast_to(best, values.shape)[differ])
            assert single.any(axis=-1).all()


def both_ways(policy: GoalPolicy, horizon: int) -> tuple[Choices, Choices, bool]:
    """What is chosen by sweeping everything, and where the robot makes a difference; and whether that was worth it."""
    intent = policy.intent
    words = intent.layers * words_of(intent.grid.reach, 2)
    near = boxes([intent.grid.reach * k for k in range(horizon)], 2, words // intent.layers, words)
    scratch = near_scratch(intent.grid, value_scratch(intent.grid), horizon, words)
    worth = policy.sweep_near(1, scratch, near)
    return chosen(policy, horizon, everything=False), near, worth


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    horizon=st.sampled_from([3, 9]),
    cost=st.sampled_from(["squared", "distance"]),
    rate=st.sampled_from([1.0, 2.0, 6.0]),
    single=st.booleans(),
    walls=st.booleans(),
)
def test_what_is_swept_near_the_robot_alone_is_chosen_all_the_same(
    seed: int, horizon: int, cost: str, rate: float, single: bool, walls: bool
) -> None:
    rng = np.random.default_rng(seed)
    model = HumanModel(frame="world", goal_cost=cost, danger_rate=rate, danger_weight=rng.uniform(1, 50))  # type: ignore[arg-type]
    lattice = Lattice(origin=rng.normal(size=2), spacing=0.4, radius=0)
    goal = PointGoal(4 * rng.normal(size=2)) if rng.random() < 0.6 else DirectionGoal(rng.normal(size=2))
    path = 3 * rng.normal(size=2) + np.cumsum(0.5 * rng.normal(size=(2 * horizon, 2)), axis=0)
    free = rng.random((4 * horizon + 1,) * 2) < 0.8 if walls else None
    policy = laid_out(model, lattice, goal, path, horizon, single, free)
    whole, near, worth = both_ways(policy, horizon)
    if not worth:
        assert not near.masks.any()
        return
    for k in np.flatnonzero(policy.differs):
        cells = slice(near.offsets[k], near.offsets[k] + (4 * k + 1) ** 2)
        differ = (near.masks[:, cells] != whole.masks[:, cells]).any(axis=0)
        if differ.any():  # then there is hardly a difference between the best and another
            values = action_values(model, lattice.with_radius(2 * k), goal, path[k:], 1, 0.5, free).reshape(-1, 25)
            least = np.sort(values[differ], axis=1)
            assert np.all(least[:, 1] - least[:, 0] <= 1e-5 * np.abs(least[:, 0]))


def test_most_is_left_as_it_is_and_danger_everywhere_is_not_worth_it() -> None:
    lattice = Lattice(origin=np.zeros(2), spacing=0.25, radius=0)
    path = np.stack([np.full(24, 1.5), np.linspace(-3.0, 6.0, 24)], axis=1)
    model = HumanModel(frame="world")
    policy = laid_out(model, lattice, PointGoal((5.0, 0.3)), path, 12)
    whole, near, worth = both_ways(policy, 12)
    assert worth
    np.testing.assert_array_equal(whole.masks, near.masks)
    far_reaching = laid_out(replace(model, danger_rate=0.01), lattice, PointGoal((5.0, 0.3)), path, 12)
    *_, worth = both_ways(far_reaching, 12)
    assert not worth


def test_where_there_is_no_room_for_what_differs_nothing_is_written() -> None:
    lattice = Lattice(origin=np.zeros(2), spacing=0.25, radius=0)
    policy = laid_out(HumanModel(frame="world"), lattice, PointGoal((5.0, 0.3)), np.ones((24, 2)), 12)
    near = boxes([2 * k for k in range(12)], 2, 1, 1)
    scratch = near_scratch(policy.intent.grid, value_scratch(policy.intent.grid), 12, 1)
    assert not policy.sweep_near(1, scratch._replace(pool=scratch.pool[:, :400].copy()), near)
    assert not near.masks.any()


@pytest.mark.parametrize("walls", [False, True])
def test_compiled_and_plain_sweeps_near_the_robot_agree(walls: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    lattice = Lattice(origin=np.zeros(2), spacing=0.8, radius=0)
    free = rng.random((7, 7)) < 0.8 if walls else None
    model = HumanModel(frame="world", reach=1, danger_rate=4.0)
    policy = laid_out(model, lattice, DirectionGoal((1.0, 0.3)), np.full((8, 2), 0.9), 4, free=free)
    _, compiled, worth = both_ways(policy, 4)
    assert worth
    plain = ("_find_danger", "_little_felt", "_grow", "_put", "_take", "_differing", "_take_calm", "_mark_all", "_heed")
    for name in (*plain, "mark_part"):
        monkeypatch.setattr(sweep_near, name, getattr(sweep_near, name).py_func)
    monkeypatch.setattr("sidestep.human.policy.choose_near", sweep_near.choose_near.py_func)
    _, found, worth = both_ways(policy, 4)
    assert worth
    np.testing.assert_array_equal(found.masks, compiled.masks)


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    distance=st.floats(3.0, 14.0),
    decay=st.sampled_from(["distance", "squared_distance"]),
)
def test_a_robot_that_is_said_not_to_matter_changes_no_choice(seed: int, distance: float, decay: str) -> None:
    rng = np.random.default_rng(seed)
    rate = 1.0 if decay == "squared_distance" else 3.0
    model = HumanModel(horizon=3, danger_decay=decay, danger_rate=rate, effort_weight=0.3)  # type: ignore[arg-type]
    velocity = rng.normal(size=2)
    lattice = frame_of(model, np.zeros(2), velocity, 0.5)
    way = rng.normal(size=2)
    path = distance * way / np.linalg.norm(way) + np.cumsum(0.3 * rng.normal(size=(8, 2)), axis=0)
    goal = DirectionGoal(velocity + 0.3 * rng.normal(size=2))
    policy = laid_out(model, lattice, goal, path, 4)
    for k in np.flatnonzero(~policy.differs):
        box = lattice.with_radius(2 * int(k))
        values = [action_values(model, box, goal, path[k:], beta, 0.5) for beta in (0, 1)]
        best = [v <= v.min(axis=-1, keepdims=True) * (1 + 1e-6) + 1e-12 for v in values]
        np.testing.assert_array_equal(best[0], best[1])


def test_near_robots_matter_and_far_ones_do_not() -> None:
    model = HumanModel(horizon=3)
    lattice = frame_of(model, np.zeros(2), np.array([1.2, 0.0]), 0.5)
    goal = DirectionGoal((1.2, 0.0))
    assert laid_out(model, lattice, goal, np.tile([1.0, 0.2], (8, 1)), 4).differs.all()
    assert not laid_out(model, lattice, goal, np.tile([30.0, 0.2], (8, 1)), 4).differs.any()
    between = laid_out(model, lattice, goal, np.tile([0.0, 5.0], (8, 1)), 4).differs
    assert between.any()
    assert not between[0]
    blind = replace(model, danger_weight=0.0)
    assert not laid_out(blind, lattice, PointGoal((3.0, 0.0)), np.zeros((8, 2)), 4).differs.any()


PLAIN = [
    (sweep_choices, ("mark_box", "_weigh_row", "_blocked", "heed_walls")),
    (sweep_marks, ("_least_of_row", "_least_of_rows", "_any_within", "_mark_group", "_mark_row")),
]


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("rationality", [np.inf, 0.5])
@pytest.mark.parametrize("walls", [False, True])
def test_compiled_and_plain_choices_agree(
    d: int, rationality: float, walls: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(d)
    model = HumanModel(reach=1, horizon=1, rationality=rationality, danger_weight=20.0)
    lattice = frame_of(model, np.zeros(d), rng.normal(size=d), 0.5)
    free = rng.random((5,) * d) < 0.6 if walls else None
    policy = laid_out(model, lattice, DirectionGoal(rng.normal(size=d)), rng.normal(size=(4, d)), 2, free=free)
    results: list[Choices] = []
    for plain in (False, True):
        for module, names in PLAIN if plain else ():
            for name in names:
                monkeypatch.setattr(module, name, getattr(module, name).py_func)
        if plain:
            monkeypatch.setattr(sweep_choices, "lowest_bit", lambda mask: int(mask).bit_length() - 1)
        words, cells = words_of(1, d), 1 + 3**d
        odds = np.zeros((3**d, cells)) if np.isfinite(rationality) else np.zeros((0, 0))
        choices = boxes([0, 1], d, words, policy.intent.layers * words)._replace(odds=odds)
        kernel = sweep_choices.choose.py_func if plain else sweep_choices.choose
        intent = policy.intent
        kernel(
            *policy.costs, intent.actions.taps, True, 1, 0, 2, np.ones(2, np.bool_), intent.grid.centre, d, 1e-6,
            rationality, intent.free, intent.actions.mixture, *value_scratch(intent.grid), *choices,
        )  # fmt: skip
        results.append(choices)
    if np.isinf(rationality):
        np.testing.assert_array_equal(results[0].masks, results[1].masks)
        assert results[0].masks.any(axis=0).all()
    else:
        np.testing.assert_allclose(results[0].odds, results[1].odds, atol=1e-14)
        np.testing.assert_allclose(results[0].odds.sum(axis=0), 1.0, atol=1e-12)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), shape=st.sampled_from([(1, 3), (2, 1), (2, 2), (3, 1), (3, 2)]))
def test_marks_are_the_minimisers_in_every_cell(seed: int, shape: tuple[int, int]) -> None:
    """Also where ties abound, where nothing is admissible, and in words that the actions of a row straddle."""
    d, reach = shape
    rng = np.random.default_rng(seed)
    radius, count = 2, 2 * reach + 1
    centre = radius + reach
    width = 2 * centre + 1
    cost = rng.integers(0, 3, (width,) * d).astype(np.float64)
    cost[rng.random(cost.shape) < 0.6] = np.inf
    taps = np.zeros((1, 3, count))
    taps[0, 3 - d :] = rng.integers(0, 2, (d, count))
    flat = cost.reshape(width ** (d - 1), width)
    masks = np.ones((words_of(reach, d), (2 * radius + 1) ** d), np.int64)
    sweep_marks.mark_box(
        flat, taps, radius, centre, d, 1e-6, np.zeros_like(flat), np.zeros_like(flat), np.zeros((3, width)),
        np.zeros(width, np.int32), masks, 0,
    )  # fmt: skip
    effort = np.array([sum(taps[0, 3 - d + a, u] for a, u in enumerate(us)) for us in np.ndindex((count,) * d)])
    found = np.stack([masks[a // WORD] >> (a % WORD) & 1 for a in range(count**d)], axis=-1)
    for n, index in enumerate(np.ndindex((2 * radius + 1,) * d)):
        values = effort + cost[tuple(slice(i, i + count) for i in index)].ravel()
        np.testing.assert_array_equal(found[n], np.isfinite(values) & (values == values.min()))


@pytest.mark.parametrize("d", [1, 2, 3])
def test_admissible_actions_end_in_free_cells(d: int) -> None:
    rng = np.random.default_rng(d)
    free = rng.random((7,) * d) < 0.5
    grid = CostGrid(
        lattice=Lattice(origin=np.zeros(d), spacing=0.3, radius=0), time_step=0.5, reach=2, steps=1, centre=4
    )
    marked = bits(admissible_actions(grid, embedded_free(free, grid), 2), 0, 5**d, d)  # type: ignore[arg-type]
    whole = np.pad(free, 1, constant_values=True)
    for index in np.ndindex(marked.shape[:-1]):
        near = whole[tuple(slice(i, i + 5) for i in index)].ravel()
        if not near.any():
            near = np.arange(5**d) == 5**d // 2
        np.testing.assert_array_equal(marked[index], near)
