"""Eq. 2a term by term: closed forms against quadrature, layouts against their definitions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from sidestep.errors import InvalidInput
from sidestep.human.actions import ActionSet
from sidestep.human.cost import CostGrid, action_terms, danger_law, danger_terms, goal_terms, per_axis
from sidestep.human.goals import DirectionGoal, PointGoal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice, heading_rotation


def grid_of(lattice: Lattice, *, steps: int = 3, centre: int = 6, reach: int = 2) -> CostGrid:
    return CostGrid(lattice=lattice, time_step=0.5, reach=reach, steps=steps, centre=centre)


def dense(values: np.ndarray, grid: CostGrid) -> np.ndarray:
    return values.reshape((2 * grid.centre + 1,) * grid.dimension)


@given(
    rate=st.floats(0.01, 2.0),
    noise=st.floats(0.01, 0.8),
    distance=st.floats(0.0, 5.0),
    decay=st.sampled_from(["distance", "squared_distance"]),
)
def test_the_danger_under_perception_noise_is_the_expectation(
    rate: float, noise: float, distance: float, decay: str
) -> None:
    model = HumanModel(danger_rate=rate, perception_noise=noise, danger_decay=decay, danger_weight=3.0)  # type: ignore[arg-type]
    weight, widened = danger_law(model)
    power = 1 if decay == "distance" else 2

    def judged(error: float) -> float:
        normal = math.exp(-0.5 * (error / noise) ** 2) / (noise * math.sqrt(2 * math.pi))
        return normal * 3.0 * math.exp(-rate * (distance + error) ** power)

    expected, _ = quad(judged, -12 * noise, 12 * noise, limit=200)
    assert weight * math.exp(-widened * distance**power) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("decay", ["distance", "squared_distance"])
def test_the_danger_of_every_cell_and_instant(d: int, decay: str) -> None:
    rng = np.random.default_rng(d)
    model = HumanModel(danger_decay=decay, danger_weight=2.0, danger_rate=0.4)  # type: ignore[arg-type]
    lattice = Lattice(origin=rng.normal(size=d), spacing=0.3, radius=0, rotation=heading_rotation(rng.normal(size=d)))
    grid = grid_of(lattice)
    path = rng.normal(size=(4, d))
    terms = danger_terms(model, path, grid, 1, 1)
    cells = lattice.with_radius(grid.centre).positions()
    for t in range(4):
        distance = np.linalg.norm(cells - path[t], axis=-1)
        expected = 2.0 * np.exp(-0.4 * distance ** (1 if decay == "distance" else 2))
        if decay == "distance":
            rows = grid.shape[0]
            found = dense(terms.table[t * rows : (t + 1) * rows], grid)
            inside = np.max(np.abs(np.indices(found.shape) - grid.centre), axis=0) <= min(2 * t, grid.centre)
        else:
            found = np.ones((1,) * d)
            for a in range(d):
                factor = terms.axes[3 * t + 3 - d + a]
                shape = [1] * d
                shape[a] = -1
                found = found * factor.reshape(shape)
            for a in range(3 - d):
                found = found * terms.axes[3 * t + a, 0]
            inside = np.ones(found.shape, dtype=bool)
        np.testing.assert_allclose(found[inside], expected[inside], rtol=1e-12)


def test_no_walk_meets_more_danger_than_its_bound() -> None:
    rng = np.random.default_rng(3)
    for lead in (0, 1):
        model = HumanModel(danger_weight=5.0, danger_rate=0.8)
        grid = grid_of(Lattice(origin=np.zeros(2), spacing=0.25, radius=0), steps=3 if lead else 1, centre=20)
        path = np.cumsum(rng.normal(size=(9, 2)), axis=0)
        bounds = danger_terms(model, path, grid, 4, lead).bounds
        for k in range(4):
            for _ in range(200):
                walk = np.cumsum(rng.integers(-2, 3, size=(k + grid.steps, 2)), axis=0)[k:] * 0.25
                seen = path[k + lead : k + lead + grid.steps]
                met = np.sum(5.0 * np.exp(-0.8 * np.sum((walk - seen) ** 2, axis=1)))
                assert met <= bounds[k] * (1 + 1e-12)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("cost", ["squared", "distance"])
def test_the_goal_term_of_every_cell(d: int, cost: str) -> None:
    rng = np.random.default_rng(d)
    weight = tuple(rng.uniform(0.5, 2.0, d))
    model = HumanModel(goal_cost=cost, goal_weight=weight)  # type: ignore[arg-type]
    lattice = Lattice(origin=rng.normal(size=d), spacing=0.3, radius=0, rotation=heading_rotation(rng.normal(size=d)))
    grid = grid_of(lattice)
    goal = PointGoal(rng.normal(size=d))
    free = rng.random((13,) * d) < 0.8
    local = (lattice.with_radius(6).positions() - goal.position) @ lattice.rotation
    expected = np.sum(np.array(weight) * local**2, axis=-1)
    if cost == "distance":
        expected = np.sqrt(np.sum((np.array(weight) * local) ** 2, axis=-1))
    axes, table = goal_terms(model, goal, grid)
    if cost == "squared":
        assert table.size == 0
        table = sum(axes[3 - d + a].reshape([-1 if b == a else 1 for b in range(d)]) for a in range(d))
    np.testing.assert_allclose(dense(np.asarray(table), grid), expected, rtol=1e-12, atol=1e-12)
    _, walled = goal_terms(model, goal, grid, free.reshape(grid.shape))
    np.testing.assert_allclose(dense(walled, grid), np.where(free, expected, np.inf), rtol=1e-12, atol=1e-12)


def test_a_fast_walk_along_an_axis_costs_the_linear_term_itself() -> None:
    """The pull of a direction differs from −θ1·d̂·x, summed over the charged instants, by a constant."""
    model = HumanModel(goal_weight=1.7, effort_weight=0.3)
    grid = grid_of(Lattice(origin=np.zeros(2), spacing=0.25, radius=0), steps=4)
    taps = action_terms(model, DirectionGoal((1.0, 0.0)), grid, 1).taps  # 1 m/s is 2v
    rng = np.random.default_rng(0)
    offsets = []
    for _ in range(50):
        actions = rng.integers(-2, 3, size=(4, 2))
        charged = sum(taps[j, 1, actions[j, 0] + 2] + taps[j, 2, actions[j, 1] + 2] for j in range(4))
        progress = np.cumsum(actions[:, 0]) * 0.25
        literal = np.sum(-1.7 * progress) + 0.3 * np.sum((actions * 0.5) ** 2)
        offsets.append(charged - literal)
    np.testing.assert_allclose(offsets, offsets[0], atol=1e-12)


@given(angle=st.floats(0.0, 2 * math.pi), speed=st.floats(0.0, 1.3))
def test_undisturbed_people_keep_the_velocity_they_intend(angle: float, speed: float) -> None:
    velocity = speed * np.array([math.cos(angle), math.sin(angle)])
    grid = grid_of(Lattice(origin=np.zeros(2), spacing=0.25, radius=0))
    tables = action_terms(HumanModel(), DirectionGoal(velocity), grid, 1).tables[:, 0].reshape(3, 5)
    multiples = np.arange(-2, 3)
    mean = np.array([tables[1] @ multiples, tables[2] @ multiples]) * 0.5
    np.testing.assert_allclose(mean, np.clip(velocity, -1.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(tables.sum(axis=1), 1.0, atol=1e-12)
    assert np.all(np.count_nonzero(tables, axis=1) <= 2)


def test_people_who_stand_have_no_pull() -> None:
    grid = grid_of(Lattice(origin=np.zeros(1), spacing=0.25, radius=0))
    taps = action_terms(HumanModel(effort_weight=1.0), StandGoal(), grid, 1).taps
    np.testing.assert_allclose(taps[0, 2], [1.0, 0.25, 0.0, 0.25, 1.0])
    np.testing.assert_allclose(taps[:, :2], 0.0)


def test_weights_are_one_number_or_one_per_axis() -> None:
    np.testing.assert_allclose(per_axis("human.goal_weight", 2.0, 3), [2.0, 2.0, 2.0])
    np.testing.assert_allclose(per_axis("human.goal_weight", (1.0, 2.0), 2), [1.0, 2.0])
    np.testing.assert_allclose(per_axis("human.goal_weight", (4.0,), 2), [4.0, 4.0])
    with pytest.raises(InvalidInput, match=r"human.goal_weight.*3, one per axis"):
        per_axis("human.goal_weight", (1.0, 2.0), 3)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_actions_are_all_combinations_with_the_last_axis_fastest(d: int) -> None:
    actions = ActionSet(speed=0.5, reach=2, dimension=d)
    assert len(actions) == 5**d
    assert len({tuple(m) for m in actions.multiples.tolist()}) == 5**d
    np.testing.assert_allclose(actions.velocities, actions.multiples * 0.5)
    assert actions.multiples[0].tolist() == [-2] * d
    assert actions.multiples[1].tolist() == [-2] * (d - 1) + [-1]


@pytest.mark.parametrize(
    ("field", "values"), [("speed", {"speed": 0.0}), ("reach", {"reach": 0}), ("dimension", {"dimension": 4})]
)
def test_impossible_actions_are_refused(field: str, values: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match=f"actions.{field}"):
        ActionSet(**({"speed": 0.5} | values))  # type: ignore[arg-type]
