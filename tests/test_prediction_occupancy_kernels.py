"""The kernels that move mass: their Python source against what is compiled, and both against sums written out."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.stats import ncx2

from sidestep._kernels import push, push_horizon, push_sections
from sidestep._kernels.risk_profile import blob_table, profiles
from sidestep.human.goals import DirectionGoal, PointGoal
from sidestep.human.model import HumanModel
from sidestep.prediction.occupancy import Removal, frame_of, predict

CENTRE, COLUMNS = 3, 8


def both(kernel: Any) -> list[Callable[..., Any]]:
    return [kernel, kernel.py_func]


def rows_of(d: int, width: int) -> int:
    return width ** (d - 1)


def dense(field: np.ndarray, section: int, d: int) -> np.ndarray:
    width = 2 * CENTRE + 1
    return field[section : section + rows_of(d, width), :width].reshape((width,) * d)


def random_mass(rng: np.random.Generator, d: int, radius: int) -> np.ndarray:
    """Field of one section of mass within `radius`, one empty one, and one of mid-steps."""
    width = 2 * CENTRE + 1
    rows = rows_of(d, width)
    field = np.zeros((2 * rows + 2 * rows_of(d, 4 * CENTRE + 1), COLUMNS))
    inner = (slice(CENTRE - radius, CENTRE + radius + 1),) * d
    dense(field, 0, d)[inner] = rng.random((2 * radius + 1,) * d) * (rng.random((2 * radius + 1,) * d) < 0.7)
    return field


def halves(field: np.ndarray, d: int) -> np.ndarray:
    """The section of mid-steps, columns put together again."""
    width = 2 * CENTRE + 1
    half = 4 * CENTRE + 1
    planes = field[2 * rows_of(d, width) :].reshape(rows_of(d, half), 2, COLUMNS)
    whole = np.zeros((rows_of(d, half), 2 * COLUMNS))
    whole[:, 0::2], whole[:, 1::2] = planes[:, 0], planes[:, 1]
    return whole[:, :half].reshape((half,) * d)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("factor", [1, 2])
def test_separable_moves(d: int, factor: int) -> None:
    rng = np.random.default_rng(d)
    reach, radius, width = 1, 2, 2 * CENTRE + 1
    tables = rng.random((3, 3, 5)) * (rng.random((3, 3, 1)) < 0.7)
    mass = random_mass(rng, d, radius)
    expected = np.zeros((factor * 2 * CENTRE + 1,) * d)
    for cell in itertools.product(range(-radius, radius + 1), repeat=d):
        here = dense(mass, 0, d)[tuple(np.array(cell) + CENTRE)]
        for u in itertools.product(range(-reach, reach + 1), repeat=d):
            share = np.prod([tables[3 - d + a, u[a] + reach, cell[a] + 2] for a in range(d)])
            expected[tuple(factor * (np.array(cell) + CENTRE) + u)] += 0.3 * share * here
    for kernel in both(push.push_separable):
        field = mass.copy()
        kernel(
            field, 0, radius, CENTRE, tables.reshape(9, 5), tables.any(axis=2).ravel().astype(float), 2, 0.3, d, factor,
            factor * rows_of(d, width), factor * CENTRE, np.zeros((4, COLUMNS)),
        )  # fmt: skip
        found = dense(field, rows_of(d, width), d) if factor == 1 else halves(field, d)
        np.testing.assert_allclose(found, expected, atol=1e-15)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("kind", ["bits", "bits among walls", "odds"])
def test_chosen_moves(d: int, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Masses, living masses (here all of it) and mid-steps follow the same choices."""
    rng = np.random.default_rng(d)
    radius, width, n = 2 if d < 3 else 1, 2 * CENTRE + 1, 3**d
    cells = list(itertools.product(range(-radius, radius + 1), repeat=d))
    actions = list(itertools.product((-1, 0, 1), repeat=d))
    mixture = np.repeat(np.eye(3)[None], 3, axis=0)
    mixture[2, 2] = [0.0, 0.25, 0.75]
    layers = 2 if kind == "bits among walls" else 1
    choice = rng.random((layers, len(cells), n)) < 0.3
    choice[1:] &= ~choice[:1]
    choice[0, ~choice.any(axis=(0, 2)), n // 2] = True
    odds = rng.dirichlet(np.ones(n), len(cells)) if kind == "odds" else np.zeros((0, 0))
    masks = (choice * (1 << np.arange(n))).sum(axis=2).astype(np.int64)
    mass = random_mass(rng, d, radius)
    expected, halfway = np.zeros((width,) * d), np.zeros((2 * width - 1,) * d)
    for index, cell in enumerate(cells):
        here = 0.6 * dense(mass, 0, d)[tuple(np.array(cell) + CENTRE)]
        for layer, (a, u) in itertools.product(range(layers), enumerate(actions)):
            share = odds[index, a] if kind == "odds" else choice[layer, index, a] / choice[:, index].sum()
            for v in actions:
                part = (
                    np.prod([mixture[3 - d + i, u[i] + 1, v[i] + 1] for i in range(d)]) if layer == 0 else float(u == v)
                )
                expected[tuple(np.array(cell) + CENTRE + v)] += here * share * part
                halfway[tuple(2 * (np.array(cell) + CENTRE) + v)] += here * share * part
    section = rows_of(d, width)
    for plain in (False, True):
        if plain:
            for name in ("_move", "_run", "_spans", "row_span"):
                monkeypatch.setattr(push, name, getattr(push, name).py_func)
            monkeypatch.setattr(push, "lowest_bit", lambda mask: (int(mask) & -int(mask)).bit_length() - 1)
        compiled = push.push_odds if kind == "odds" else push.push_choices
        kernel = compiled.py_func if plain else compiled
        given = (np.ascontiguousarray(odds.T),) if kind == "odds" else (masks, 1)
        field = mass.copy()
        kernel(
            field, 0, 0, radius, CENTRE, *given, 0, radius, mixture, 0.6, d, section, section, 2 * section, 2 * CENTRE
        )
        np.testing.assert_allclose(dense(field, section, d), 2 * expected, atol=1e-14)  # free and living fell together
        np.testing.assert_allclose(halves(field, d), halfway, atol=1e-14)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("spread", [False, True])
def test_what_touches_the_robot_is_removed(d: int, spread: bool) -> None:
    rng = np.random.default_rng(d)
    mass = random_mass(rng, d, 2)
    robot = np.zeros((2, 3))
    robot[1, 3 - d :] = rng.normal(size=d) * 0.2
    place = (np.stack(np.indices((7,) * d), axis=-1) - CENTRE) * 0.3
    gap = np.linalg.norm(place - robot[1, 3 - d :], axis=-1)
    share = (gap < 0.5).astype(float)
    samples, grids = np.zeros((1, 0)), np.zeros((1, 4))
    if spread:
        samples, grids = profiles(0.5, np.ones(1), np.full((2, 1), 0.2), blob_table(d))
        share = ncx2.cdf((0.5 / 0.2) ** 2, d, (gap / 0.2) ** 2)
    for tell, remove in zip(both(push_sections.contact_shares), both(push_sections.remove_contact), strict=True):
        field, boxes, shares = mass.copy(), np.zeros((2, 7), np.int64), np.zeros(5**d)
        tell(robot, 0.3, 2, d, 0.5, samples, grids, boxes, shares)
        removed = remove(field, 0, CENTRE, d, boxes, shares, 1)
        before = dense(mass, 0, d)
        np.testing.assert_allclose(dense(field, 0, d), before * (1 - share), atol=1e-3 if spread else 1e-15)
        assert removed == pytest.approx((before * share).sum(), abs=2e-3 if spread else 1e-12)
        assert remove(field, 0, CENTRE, d, boxes, shares, 0) == 0.0


@pytest.mark.parametrize("d", [1, 2, 3])
def test_sections_are_cleared_copied_and_put_together(d: int) -> None:
    rng = np.random.default_rng(d)
    mass = random_mass(rng, d, 2)
    rows = rows_of(d, 2 * CENTRE + 1)
    for clear, add in zip(both(push_sections.clear_rows), both(push_sections.add_box), strict=True):
        field, target = mass.copy(), np.zeros((rows, COLUMNS - 1))
        add(field, 0, 1, CENTRE, d, target, 0)
        inner = (slice(2, 5),) * d
        assert target.sum() == pytest.approx(dense(mass, 0, d)[inner].sum())
        clear(field, 0, 2, CENTRE, d, 1)
        assert field.sum() == 0.0
    for kernel in both(push_sections.add_planes):
        field = np.zeros_like(mass)
        field[2 * rows :] = rng.random(field[2 * rows :].shape)
        for radius in (0, 3, 2 * CENTRE):
            flat = np.ones(1 + (2 * radius + 1) ** d)
            kernel(field, 2 * rows, 2 * CENTRE, radius, d, flat, 1)
            inner = (slice(2 * CENTRE - radius, 2 * CENTRE + radius + 1),) * d
            np.testing.assert_allclose(flat[1:] - 1.0, halves(field, d)[inner].ravel())
            assert flat[0] == 1.0


@pytest.mark.parametrize("awareness", ["persistent", "resampled"])
def test_a_whole_prediction_by_the_python_source(awareness: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = HumanModel(horizon=2, awareness_over_horizon=awareness, danger_weight=20.0)  # type: ignore[arg-type]
    lattice = frame_of(model, np.zeros(2), np.array([1.1, 0.2]), 0.5)

    def masses() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        result = predict(
            model=model, lattice=lattice, goals=[DirectionGoal((1.1, 0.4)), PointGoal((3.0, -1.0))],
            weights=[[0.2, 0.3], [0.1, 0.4]], robot_path=np.tile([1.0, 0.1], (8, 1)), horizon=3, time_step=0.5,
            removal=Removal(distance=0.6), midway=True,
        )  # fmt: skip
        return result.occupancy.probability, result.contact, result.action_probabilities, result.midway[2]

    compiled = masses()
    monkeypatch.setattr("sidestep.prediction.propagation.propagate", push_horizon.propagate.py_func)
    for found, expected in zip(masses(), compiled, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-14)


def test_long_horizons_in_single_precision_agree_with_double() -> None:
    model = HumanModel(frame="world", goal_cost="squared", danger_weight=10.0, danger_rate=0.2)
    lattice = frame_of(model, np.array([-3.0, 0.1]), None, 0.5)
    path = np.stack([np.zeros(60), np.linspace(-6.0, 9.0, 60)], axis=1)
    each = [
        predict(
            model=model, lattice=lattice, goals=[PointGoal((4.0, 0.3))], weights=[[0.5, 0.5]], robot_path=path,
            horizon=26, time_step=0.5, removal=Removal(distance=0.6), dtype=dtype,
        )
        for dtype in (np.float64, np.float32, None)
    ]  # fmt: skip
    np.testing.assert_array_equal(each[1].occupancy.probability, each[2].occupancy.probability)
    np.testing.assert_allclose(each[1].occupancy.probability, each[0].occupancy.probability, atol=1e-3)
    np.testing.assert_allclose(each[1].contact, each[0].contact, atol=1e-3)


def test_finite_rationality_in_several_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    model = HumanModel(rationality=2.0, horizon=2)
    lattice = frame_of(model, np.zeros(2), np.array([1.1, 0.2]), 0.5)

    def masses() -> tuple[np.ndarray, np.ndarray]:
        result = predict(
            model=model, lattice=lattice, goals=[DirectionGoal((1.1, 0.4)), PointGoal((3.0, -1.0))],
            weights=[[0.2, 0.3], [0.1, 0.4]], robot_path=np.tile([1.0, 0.1], (9, 1)), horizon=5, time_step=0.5,
            removal=Removal(distance=0.6),
        )  # fmt: skip
        return result.occupancy.probability, result.contact

    whole = masses()
    monkeypatch.setattr("sidestep.prediction.propagation.LARGEST_ODDS", 3000)
    for found, expected in zip(masses(), whole, strict=True):
        np.testing.assert_array_equal(found, expected)
