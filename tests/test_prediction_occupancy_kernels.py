"""The kernels that move mass: their Python source against what is compiled, and both against sums written out."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import ncx2

from sidestep._kernels import push, push_evenly, push_horizon, push_sections, push_walled
from sidestep._kernels.sweep_marks import WORD
from sidestep.human.goals import DirectionGoal, PointGoal
from sidestep.human.model import HumanModel
from sidestep.human.policy import GoalPolicy, words_of
from sidestep.prediction.occupancy import Prediction, Removal, frame_of, predict
from sidestep.prediction.profiles import profile_of

CENTRE = 3
WIDTH = 2 * CENTRE + 1
NOWHERE = np.zeros((0, 0), np.int64)


def both(kernel: Any) -> list[Callable[..., Any]]:
    return [kernel, kernel.py_func]


def as_python(monkeypatch: pytest.MonkeyPatch, module: Any, *names: str) -> None:
    for name in names:
        monkeypatch.setattr(module, name, getattr(module, name).py_func)


def dense(field: np.ndarray, section: int, d: int) -> np.ndarray:
    return field[section : section + WIDTH ** (d - 1)].reshape((WIDTH,) * d)


def random_mass(rng: np.random.Generator, d: int, radius: int) -> np.ndarray:
    """Field of one section of mass within `radius`, and an empty one."""
    field = np.zeros((2 * WIDTH ** (d - 1), WIDTH))
    inner = (slice(CENTRE - radius, CENTRE + radius + 1),) * d
    dense(field, 0, d)[inner] = rng.random((2 * radius + 1,) * d) * (rng.random((2 * radius + 1,) * d) < 0.7)
    return field


def box_of(d: int, radius: int) -> np.ndarray:
    box = np.zeros(6, np.int64)
    push_sections.set_box(box, radius, d)
    return box


def follow(
    mass: np.ndarray,
    radius: int,
    d: int,
    reach: int,
    part: Callable[[int, tuple[int, ...], tuple[int, ...]], float],
) -> tuple[np.ndarray, np.ndarray]:
    """Mass and mid-steps (radius 2·radius + reach) by definition; part(cell's index, cell, action) of each moves."""
    half = 2 * radius + reach
    steps, halfway = np.zeros((WIDTH,) * d), np.zeros((2 * half + 1,) * d)
    for index, cell in enumerate(itertools.product(range(-radius, radius + 1), repeat=d)):
        here = dense(mass, 0, d)[tuple(np.array(cell) + CENTRE)]
        for u in itertools.product(range(-reach, reach + 1), repeat=d):
            share = here * part(index, cell, u)
            steps[tuple(np.array(cell) + CENTRE + u)] += share
            halfway[tuple(2 * np.array(cell) + u + half)] += share
    return steps, halfway


@pytest.mark.parametrize("d", [1, 2, 3])
def test_separable_moves(d: int) -> None:
    rng = np.random.default_rng(d)
    radius = 2
    tables = rng.random((3, 3, 5)) * (rng.random((3, 3, 1)) < 0.7)
    mass = random_mass(rng, d, radius)
    expected = follow(
        mass, radius, d, 1,
        lambda _, x, u: 0.3 * float(np.prod([tables[3 - d + a, u[a] + 1, x[a] + 2] for a in range(d)])),
    )  # fmt: skip
    section = WIDTH ** (d - 1)
    for kernel in both(push.push_separable):
        field, halves = mass.copy(), np.zeros(3 + 11**d)
        kernel(
            field, 0, box_of(d, radius), CENTRE, tables.reshape(9, 5), tables.any(axis=2).ravel().astype(float), 2, 0.3,
            d, section, halves, 3, 5,
        )  # fmt: skip
        np.testing.assert_allclose(dense(field, section, d), expected[0], atol=1e-15)
        np.testing.assert_allclose(halves[3:].reshape((11,) * d), expected[1], atol=1e-15)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("kind", ["bits", "bits among walls", "odds"])
def test_chosen_moves(d: int, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Masses and mid-steps follow the same choices."""
    rng = np.random.default_rng(d)
    radius, n = 2 if d < 3 else 1, 3**d
    cells = (2 * radius + 1) ** d
    actions = list(itertools.product((-1, 0, 1), repeat=d))
    mixture = np.repeat(np.eye(3)[None], 3, axis=0)
    mixture[2, 2] = [0.0, 0.25, 0.75]
    layers = 2 if kind == "bits among walls" else 1
    choice = rng.random((layers, cells, n)) < 0.3
    choice[1:] &= ~choice[:1]
    choice[0, ~choice.any(axis=(0, 2)), n // 2] = True
    choice[0, -2:, 0] = True
    odds = rng.dirichlet(np.ones(n), cells) if kind == "odds" else np.zeros((0, 0))
    masks = (choice * (1 << np.arange(n))).sum(axis=2).astype(np.int64)
    mass = random_mass(rng, d, radius)

    def part(index: int, _: tuple[int, ...], v: tuple[int, ...]) -> float:
        total = 0.0
        for layer, (a, u) in itertools.product(range(layers), enumerate(actions)):
            share = odds[index, a] if kind == "odds" else choice[layer, index, a] / choice[:, index].sum()
            stands = np.prod([mixture[3 - d + i, u[i] + 1, v[i] + 1] for i in range(d)])
            total += 0.6 * share * (stands if layer == 0 else float(u == v))
        return total

    expected = follow(mass, radius, d, 1, part)
    section, half = WIDTH ** (d - 1), 2 * radius + 1
    given = (np.ascontiguousarray(odds.T),) if kind == "odds" else (masks, 1)
    for plain in (False, True):
        if plain:
            as_python(monkeypatch, push, "_move", "_run", "_half_row", "list_moves", "place_moves")
            monkeypatch.setattr(push, "lowest_bit", lambda mask: (int(mask) & -int(mask)).bit_length() - 1)
        moves = push.list_moves(mixture, d)
        push.place_moves(moves, WIDTH if d > 1 else 1, WIDTH, half, d)
        compiled = push.push_odds if kind == "odds" else push.push_choices
        field, halves = mass.copy(), np.zeros(3 + (2 * half + 1) ** d)
        (compiled.py_func if plain else compiled)(
            field, 0, box_of(d, radius), CENTRE, *given, 0, radius, moves, 0.6, d, section, halves, 3, half,
        )  # fmt: skip
        np.testing.assert_allclose(dense(field, section, d), expected[0], atol=1e-14)
        np.testing.assert_allclose(halves[3:].reshape((2 * half + 1,) * d), expected[1], atol=1e-14)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("reach", [1, 2, 3])
@pytest.mark.parametrize("walls", [False, True])
def test_even_moves(d: int, reach: int, walls: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps and mid-steps, from all cells or from those where every action is admissible; the rest moves apart."""
    rng = np.random.default_rng(d)
    radius, n = CENTRE - reach, (2 * reach + 1) ** d
    cells, words = (2 * radius + 1) ** d, words_of(reach, d)
    mass = random_mass(rng, d, radius)
    free = rng.random((cells, n)) < np.where(rng.random(cells) < 0.5, 1.0, 0.5)[:, None]
    free[:, 0] = True
    masks = np.zeros((words, cells), np.int64)
    for a in range(n):
        masks[a // WORD] |= free[:, a].astype(np.int64) << (a % WORD)
    masks = masks if walls else NOWHERE
    whole = free.all(axis=1) if walls else np.ones(cells, bool)
    expected = follow(mass, radius, d, reach, lambda i, x, u: 0.7 * whole[i] / n)
    order = {u: a for a, u in enumerate(itertools.product(range(-reach, reach + 1), repeat=d))}
    rest = follow(mass, radius, d, reach, lambda i, x, u: 0.7 * (not whole[i]) * free[i, order[u]] / free[i].sum())
    section, half = WIDTH ** (d - 1), 2 * radius + reach
    scratch, line = np.full((2, (2 * half + 1) ** d + section * WIDTH), np.nan), np.zeros(WIDTH + 4 * reach)
    dense_mass = dense(mass, 0, d)[(slice(CENTRE - radius, CENTRE + radius + 1),) * d].ravel()
    for plain in (False, True):
        if plain:
            as_python(monkeypatch, push_evenly, "all_admissible", "_read_row", "_sum_along", "_add_rows", "_sources")
            as_python(monkeypatch, push_evenly, "_sum_every_other", "spread_midway", "spread_evenly")
            as_python(monkeypatch, push_walled, "all_admissible", "_scatter", "spread_walled", "spread_walled_midway")
        field = mass.copy()
        push_evenly.spread_evenly(
            field, 0, box_of(d, radius), CENTRE, reach, d, 0.7, masks, radius, section, scratch, line
        )
        np.testing.assert_allclose(dense(field, section, d), expected[0], atol=1e-14)
        flat = np.concatenate([dense_mass, np.zeros((2 * half + 1) ** d)])
        push_evenly.spread_midway(flat, 0, radius, reach, d, 0.7, masks, radius, cells, scratch, line)
        np.testing.assert_allclose(flat[cells:].reshape(expected[1].shape), expected[1], atol=1e-14)
        if walls:
            flat[cells:] = 0.0
            push_walled.spread_walled_midway(flat, 0, radius, reach, d, 0.7, masks, radius, cells)
            np.testing.assert_allclose(flat[cells:].reshape(rest[1].shape), rest[1], atol=1e-14)
            field = mass.copy()
            push_walled.spread_walled(field, 0, box_of(d, radius), CENTRE, reach, d, 0.7, masks, radius, section)
            np.testing.assert_allclose(dense(field, section, d), rest[0], atol=1e-14)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("spread", [False, True])
def test_what_touches_the_robot_is_removed(d: int, spread: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(d)
    mass = random_mass(rng, d, 2)
    gone, lost = rng.random((WIDTH,) * d) * dense(mass, 0, d), WIDTH ** (d - 1)
    dense(mass, lost, d)[:] = gone
    robot = np.zeros((2, 3))
    robot[1, 3 - d :] = rng.normal(size=d) * 0.2
    place = (np.stack(np.indices((7,) * d), axis=-1) - CENTRE) * 0.3
    gap = np.linalg.norm(place - robot[1, 3 - d :], axis=-1)
    share = (gap < 0.5).astype(float)
    samples, grids = np.zeros((1, 0)), np.zeros((1, 4))
    if spread:
        samples, grids = profile_of(0.5, np.ones(1), np.full((2, 1), 0.2), d)
        share = ncx2.cdf((0.5 / 0.2) ** 2, d, (gap / 0.2) ** 2)
    for plain, (tell, remove) in enumerate(
        zip(both(push_sections.contact_shares), both(push_sections.remove_contact), strict=True)
    ):
        if plain:
            as_python(monkeypatch, push_sections, "_read_profile")
        field, boxes, shares = mass.copy(), np.zeros((2, 7), np.int64), np.zeros(5**d)
        tell(robot, 0.3, 2, d, 0.5, samples, grids, boxes, shares)
        removed = remove(field, 0, lost, CENTRE, d, boxes, shares, 1)
        touching = (dense(mass, 0, d) - gone) * share
        np.testing.assert_array_equal(dense(field, 0, d), dense(mass, 0, d))
        np.testing.assert_allclose(dense(field, lost, d), gone + touching, atol=1e-3 if spread else 1e-15)
        assert removed == pytest.approx(touching.sum(), abs=2e-3 if spread else 1e-12)
        assert remove(field, 0, lost, CENTRE, d, boxes, shares, 0) == 0.0


@pytest.mark.parametrize("d", [1, 2, 3])
def test_boxes_are_cleared_copied_and_covered(d: int) -> None:
    rng = np.random.default_rng(d)
    mass = random_mass(rng, d, 2)
    inner = (slice(2, 5),) * d
    for clear, add in zip(both(push_sections.clear_box), both(push_sections.add_block), strict=True):
        field, flat = mass.copy(), np.ones(2 + 3**d)
        add(field, 0, box_of(d, 1), CENTRE, d, flat, 2, 1)
        np.testing.assert_allclose(flat[2:] - 1.0, dense(mass, 0, d)[inner].ravel())
        assert flat[:2].sum() == 2.0
        wider = np.zeros(5**d)
        add(field, 0, box_of(d, 1), CENTRE, d, wider, 0, 2)
        whole = wider.reshape((5,) * d)
        np.testing.assert_array_equal(whole[(slice(1, 4),) * d], dense(mass, 0, d)[inner])
        assert np.count_nonzero(whole) == np.count_nonzero(dense(mass, 0, d)[inner])
        clear(field, 0, box_of(d, 1), CENTRE, d)
        assert dense(field, 0, d)[inner].sum() == 0.0
        assert field.sum() == pytest.approx(mass.sum() - dense(mass, 0, d)[inner].sum())
    empty, out = np.array([0, -1, 0, 0, 0, 0]), np.zeros(6, np.int64)
    other = np.array([0, 0, 0, 0, 1, 4])
    for cover in both(push_sections.cover):
        assert not cover(empty, 1, d, empty, out)
        assert cover(empty, 1, d, other, out)
        np.testing.assert_array_equal(out, other)
        assert cover(box_of(d, 1), 1, d, empty, out)
        np.testing.assert_array_equal(out, box_of(d, 2))
        assert cover(box_of(d, 1), 1, d, other, out)
        np.testing.assert_array_equal(out, [*box_of(d, 2)[:5], 4])


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 3))
def test_a_box_is_trimmed_to_where_there_is_mass(seed: int, d: int) -> None:
    rng = np.random.default_rng(seed)
    mass = random_mass(rng, d, 2) * 10.0 ** rng.uniform(-20, 0, random_mass(rng, d, 2).shape)
    cells = dense(mass, 0, d)[(slice(1, 6),) * d]
    for trim in both(push_sections.trim_box):
        box = box_of(d, 2)
        trim(mass, 0, box, CENTRE, d, 1e-9)
        kept = tuple(slice(box[2 * a] + 2, box[2 * a + 1] + 3) for a in range(3 - d, 3))
        assert (box[::2] <= box[1::2]).all()
        assert cells.sum() - cells[kept].sum() <= 2 * d * 1e-9
        for axis, part in enumerate(kept):  # on no side could one more slab be cut off
            slabs = cells.sum(axis=tuple(a for a in range(d) if a != axis))
            if part.stop - part.start > 1:
                assert slabs[: part.start + 1].sum() >= 1e-9
                assert slabs[part.stop - 1 :].sum() >= 1e-9


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
    monkeypatch.setattr("sidestep.prediction.propagation.add_midway", push_evenly.add_midway.py_func)
    as_python(monkeypatch, push_horizon, "_step", "_read_actions")
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


def test_long_horizons_are_the_same_wherever_the_robot_makes_a_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    lattice = frame_of(HumanModel(frame="world"), np.array([-3.0, 0.1]), None, 0.5)
    path = np.stack([np.zeros(60), np.linspace(-3.0, 27.0, 60)], axis=1)
    each: list[Prediction] = []
    swept: list[bool] = []
    near = GoalPolicy.sweep_near
    monkeypatch.setattr(GoalPolicy, "sweep_near", lambda *a: swept.append(near(*a)) or swept[-1])
    for least in (1, 10**9):
        monkeypatch.setattr("sidestep.human.policy.NEAR_FROM", least)
        each.append(
            predict(
                model=HumanModel(frame="world"), lattice=lattice, goals=[PointGoal((4.0, 0.3)), PointGoal((0.0, 4.0))],
                weights=[[0.2, 0.3], [0.1, 0.4]], robot_path=path, horizon=20, time_step=0.5,
                removal=Removal(distance=0.6),
            )
        )  # fmt: skip
    assert swept == [True, True]
    np.testing.assert_allclose(each[0].blocks, each[1].blocks, atol=1e-15)
    np.testing.assert_allclose(each[0].contact, each[1].contact, atol=1e-15)
    np.testing.assert_allclose(each[0].action_probabilities, each[1].action_probabilities, atol=1e-15)


def test_over_long_horizons_hardly_anything_is_left_out() -> None:
    model = HumanModel(frame="world", randomness=0.3)
    lattice = frame_of(model, np.array([-3.0, 0.1]), None, 0.5)
    path = np.stack([np.zeros(90), np.linspace(-6.0, 9.0, 90)], axis=1)
    seen = predict(
        model=model, lattice=lattice, goals=[PointGoal((9.0, 0.3))], weights=[[0.5, 0.5]], robot_path=path, horizon=40,
        time_step=0.5, removal=Removal(distance=0.6), midway=True,
    )  # fmt: skip
    total = seen.occupancy.probability.sum(axis=(1, 2))
    assert (total <= 1 + 1e-13).all()
    assert (total >= 1 - 1e-12).all()
    assert sum(part.sum() for part in seen.midway) == pytest.approx(40.0, abs=1e-10)


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
