"""The robot's search against trying everything, and the laws it must obey."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st
from numba import njit

from alternatives import search as naive
from made_masses import person, still_person
from sidestep._kernels import min_plus, search_tube
from sidestep._kernels import search as kernel
from sidestep._kernels.search_walk import walk, walk_abreast
from sidestep.obstacles import Obstacles
from sidestep.planning.geodesic import ways_to_goal
from sidestep.planning.problem import PlanningProblem, respects
from sidestep.planning.search import Outlook, search
from sidestep.planning.search_maps import lattice_taps, prepare, resolution
from sidestep.planning.stopping import LAG, Inertia
from sidestep.prediction.collision import RiskField, all_in_reach
from sidestep.prediction.first_step import FirstStep


@njit
def solved(*arguments):
    return walk(kernel.induce(*arguments), arguments[10])


@njit
def solved_abreast(*arguments):
    return walk_abreast(kernel.induce(*arguments[:-1]), arguments[10], arguments[-1])


def problem(**changes):
    settings = {
        "start": np.zeros(2),
        "goal": np.array([4.0, 0.3]),
        "time_step": 0.5,
        "horizon": 5,
        "max_speed": 1.0,
        "shape": "disc",
        "effort_weight": 0.02,
    }
    return PlanningProblem(**{**settings, **changes})


def made_case(seed, d, horizon, radius, shape, *, walls, midway, steep):
    """A random small problem, as arrays for the kernel and for the naive twin."""
    rng = np.random.default_rng(seed)
    active = (np.arange(3) >= 3 - d).astype(np.int64)
    taps = lattice_taps(radius, d, shape)
    if d == 3:
        taps = taps[: min(len(taps), 11)]
    width = 2 * radius * horizon + 1
    stage = rng.uniform(0, 3, (width,) * d).astype(np.float32)
    rasters = [None]
    for b in range(1, 2 * horizon + 1):
        w = 2 * ((radius * b + 1) // 2) + 1
        some = rng.random() < 0.8 and (midway or b % 2 == 0)
        rasters.append((rng.uniform(0, 1, (w,) * d) ** 6).astype(np.float32) if some else None)
    solid = rng.random((2 * width + 1,) * d) < (0.15 if walls else 0.0)  # on the lattice of half spacing
    centre = width  # index of the robot in it

    def wall(half_cells):
        return bool(solid[tuple(np.asarray(half_cells) + centre)])

    given_ = {
        "taps": taps, "effort": rng.uniform(0, 1, len(taps)).astype(np.float32), "share": 0.3,
        "first": np.where(rng.random(len(taps)) < 0.2, np.inf, rng.uniform(0, 1, len(taps))).astype(np.float32),
        "stage": stage, "terminal": rng.uniform(0, 1) * stage, "risk": rasters, "weights": (0.7, 0.4), "limit": 0.5,
        "steep": steep, "wall": wall if walls else None}  # fmt: skip
    blocked = np.zeros((0, 1, 1), dtype=np.bool_)
    halfway = np.zeros((0, 1, 1, 1), dtype=np.bool_)
    if walls:
        span = np.arange(-radius * horizon, radius * horizon + 1)
        blocked = solid[np.ix_(*([2 * span + centre] * d))].reshape((1,) * (3 - d) + (width,) * d)
        h = (radius * (2 * horizon - 1) + 1) // 2
        span = np.arange(-h, h + 1)
        boxes = []
        for p in range(2**d):
            shifts = [(p >> (d - 1 - a)) & 1 for a in range(d)]
            boxes.append(solid[np.ix_(*[2 * span + s + centre for s in shifts])])
        halfway = np.stack(boxes).reshape((2**d, *(1,) * (3 - d), *(2 * h + 1,) * d))
    given_["effort"][0] = 0.0
    given_["steep"] = steep = steep * rng.uniform(0.1, 1.0, horizon)  # of each step
    starts = np.zeros(2 * horizon + 2, dtype=np.int64)
    values = []
    for b in range(1, 2 * horizon + 1):
        w = 2 * ((radius * b + 1) // 2) + 1
        values.append(np.zeros(w**d, dtype=np.float32) if rasters[b] is None else rasters[b].ravel())
        starts[b + 1] = starts[b] + values[-1].size
    embedded = np.zeros((len(taps), 3), dtype=np.int64)
    embedded[:, 3 - d :] = taps
    box = (1,) * (3 - d) + (width,) * d
    low, size = all_in_reach(horizon, radius, d)
    arguments = (
        horizon, radius, active, embedded, given_["effort"], given_["first"], stage.reshape(box),
        given_["terminal"].astype(np.float32).reshape(box), blocked, halfway,
        kernel.Seen(np.concatenate(values), starts, np.array([r is not None for r in rasters]), low, size),
        given_["weights"], given_["limit"], steep, given_["share"], low[::2], size[::2],
    )  # fmt: skip
    return given_, arguments


@given(
    seed=st.integers(0, 10**6),
    case=st.sampled_from([(1, 3, 2, "box"), (2, 2, 1, "box"), (2, 3, 1, "disc"), (2, 2, 2, "disc"), (3, 2, 1, "box")]),
    walls=st.booleans(),
    midway=st.booleans(),
    steep=st.sampled_from([np.inf, 50.0]),
)
@options(max_examples=40)
def test_search_finds_the_minimum_over_all_sequences(seed, case, walls, midway, steep):
    d, horizon, radius, shape = case
    given_, arguments = made_case(seed, d, horizon, radius, shape, walls=walls, midway=midway, steep=steep)
    best = naive.best_sequence(horizon, given_)
    total, chosen = solved(*arguments)
    if np.isinf(best):
        assert np.isinf(total)
        return
    assert total == pytest.approx(best, rel=1e-5)
    assert naive.sequence_cost(chosen, given_) == pytest.approx(best, rel=1e-5)


@given(
    seed=st.integers(0, 10**6),
    case=st.sampled_from([(1, 4, 2, "box"), (2, 3, 1, "box"), (2, 3, 1, "disc"), (2, 2, 2, "disc")]),
    walls=st.booleans(),
    change=st.sampled_from([1.0, 1.5, 2.0]),
)
@options(max_examples=40)
def test_what_may_not_change_at_once_is_the_minimum_too_where_no_state_is_left_out(seed, case, walls, change):
    d, horizon, radius, shape = case
    given_, arguments = made_case(seed, d, horizon, radius, shape, walls=walls, midway=True, steep=50.0)
    total, chosen = solved_abreast(*arguments, change)
    best = naive.best_sequence(horizon, given_, change)
    if np.isinf(best):
        assert np.isinf(total)
        return
    assert total == pytest.approx(best, rel=1e-5)
    assert naive.sequence_cost(chosen, given_) == pytest.approx(total, rel=1e-5)
    assert (np.linalg.norm(np.diff(given_["taps"][chosen], axis=0), axis=1) <= change).all()


@given(seed=st.integers(0, 10**6), walls=st.booleans(), change=st.sampled_from([1.0, 1.5]))
@options(max_examples=20)
def test_where_states_are_left_out_what_is_found_may_still_be_done_and_costs_what_is_said(seed, walls, change):
    given_, arguments = made_case(seed, 2, 6, 3, "box", walls=walls, midway=True, steep=50.0)
    total, chosen = solved_abreast(*arguments, change)
    bound, _ = solved(*arguments)
    assert total >= bound * (1 - 1e-5)
    if np.isinf(total):
        return
    assert naive.sequence_cost(chosen, given_) == pytest.approx(total, rel=1e-5)
    assert (np.linalg.norm(np.diff(given_["taps"][chosen], axis=0), axis=1) <= change).all()
    assert solved_abreast(*arguments, 100.0)[0] == pytest.approx(bound, rel=1e-5)  # any tap after any


def within_slack(arguments, slack):
    """The search within the tube of motions that cost up to `slack` more than the cheapest without risk."""
    horizon, radius, active, taps, effort, first, stage, terminal, blocked = arguments[:9]
    to_go = search_tube.costs_to_go(horizon, radius, active, taps, effort, stage, terminal, blocked)
    least, low, size, *between = search_tube.tube(
        horizon, radius, active, taps, effort, first, stage, blocked, *to_go, slack, 0
    )  # fmt: skip
    whole = arguments[10]
    values, starts = [], np.zeros(2 * horizon + 2, dtype=np.int64)
    for b in range(1, 2 * horizon + 1):
        full = whole.values[whole.starts[b] : whole.starts[b + 1]].reshape(whole.size[b])
        first_cell = between[0][b] - whole.low[b]
        values.append(full[tuple(slice(i, i + n) for i, n in zip(first_cell, between[1][b], strict=True))].ravel())
        starts[b + 1] = starts[b] + values[-1].size
    cut = kernel.Seen(np.concatenate(values), starts, whole.some, *between)
    return least, low, size, solved(*arguments[:10], cut, *arguments[11:15], low, size)


@given(
    seed=st.integers(0, 10**6),
    case=st.sampled_from([(1, 6, 3, "box"), (2, 5, 2, "box"), (2, 5, 3, "disc"), (3, 3, 1, "box"), (3, 3, 2, "disc")]),
    walls=st.booleans(),
    separable=st.booleans(),
    steep=st.sampled_from([np.inf, 50.0]),
    slack=st.floats(0.0, 3.0),
)
@options(max_examples=60)
def test_what_is_left_out_of_the_search_is_not_missed(seed, case, walls, separable, steep, slack):
    d, horizon, radius, shape = case
    _, arguments = made_case(seed, d, horizon, radius, shape, walls=walls, midway=True, steep=steep)
    arguments = list(arguments)
    places = np.stack(np.meshgrid(*[np.arange(n) - n // 2 for n in arguments[6].shape], indexing="ij"), axis=-1)
    arguments[6] = arguments[6] / 6 + np.linalg.norm(places - [0, 4, -9], axis=-1).astype(np.float32)
    if separable:
        arguments[4] = 0.03 * np.square(arguments[3]).sum(axis=1).astype(np.float32)
    least, low, size, (total, chosen) = within_slack(arguments, slack)
    free = list(arguments)
    free[10] = arguments[10]._replace(some=np.zeros(2 * horizon + 1, dtype=np.bool_))
    free[9] = arguments[9][:0]
    cheapest = solved(*free)[0]
    assert least <= cheapest + 1e-4
    if separable and shape == "box" and d < 3:
        assert least == pytest.approx(cheapest, rel=1e-5)
    exact, best = solved(*arguments)
    assert total >= exact
    if total <= least + slack or not np.isfinite(least):
        assert total == exact
        assert (chosen == best).all()
    if exact <= least + slack and np.isfinite(exact):
        assert total == exact
        path = np.concatenate([np.zeros((1, 3), dtype=np.int64), arguments[3][best].cumsum(axis=0)])
        assert ((low <= path) & (path < low + size)).all()


@given(
    seed=st.integers(0, 10**6),
    case=st.sampled_from([(1, 4, 2, "box"), (2, 3, 1, "box"), (2, 3, 1, "disc"), (2, 2, 2, "disc"), (3, 2, 1, "disc")]),
    walls=st.booleans(),
    separable=st.booleans(),
    slack=st.floats(0.0, 3.0),
)
@options(max_examples=12)
def test_bounds_of_the_search_are_the_costs_without_risk(seed, case, walls, separable, slack):
    d, horizon, radius, shape = case
    given_, arguments = made_case(seed, d, horizon, radius, shape, walls=walls, midway=False, steep=np.inf)
    if separable:
        given_["effort"][:] = 0.03 * np.square(given_["taps"]).sum(axis=1)
    _, _, active, taps, effort, first, stage, terminal, blocked = arguments[:9]
    wall = blocked.reshape(given_["stage"].shape) if walls else None
    before, after = naive.free_costs(horizon, radius, given_, wall)
    to_go, begin = search_tube.costs_to_go(horizon, radius, active, taps, effort, stage, terminal, blocked)
    for k in range(1, horizon + 1):
        assert to_go[begin[k] : begin[k + 1]] == pytest.approx(np.array(list(after[k].values())), rel=1e-5, abs=1e-5)
    least, low, size, *_ = search_tube.tube(
        horizon, radius, active, taps, effort, first, stage, blocked, to_go, begin, slack, 0
    )
    assert least == pytest.approx(min(cost + after[1][cell] for cell, cost in before[1].items()), rel=1e-5)
    if not np.isfinite(least):
        return
    for k in range(1, horizon + 1):
        total = {cell: cost + after[k][cell] for cell, cost in before[k].items()}
        first_cell, last_cell = low[k, 3 - d :], (low + size)[k, 3 - d :] - 1
        within = [cell for cell, cost in total.items() if cost <= least + slack - 1e-3]
        at_most = [
            cell for cell, cost in total.items() if cost <= least + slack + 1e-3
        ]  # rounding decides about the edge
        assert all((first_cell <= cell).all() and (cell <= last_cell).all() for cell in within)
        assert (first_cell >= np.min(at_most, axis=0)).all()
        assert (last_cell <= np.max(at_most, axis=0)).all()


@given(seed=st.integers(0, 10**6), count=st.integers(1, 40), taps=st.integers(1, 20))
@options(max_examples=40)
def test_minimum_over_taps_is_that_of_its_definition(seed, count, taps):
    rng = np.random.default_rng(seed)
    costs, table, other = (rng.random(n, dtype=np.float32) for n in (taps, 200, 200))
    shifts, moves = rng.integers(0, 60, (2, taps))
    known = rng.random(count, dtype=np.float32)
    for two in (False, True):
        out = np.concatenate([np.zeros(3), known, np.zeros(min_plus.WIDTH)]).astype(np.float32)
        lowered(costs, table, shifts, other, moves, out, count, two)
        expected = [
            min([known[i]] + [
                (costs[t] + other[7 + moves[t] + i] if two else costs[t]) + table[5 + shifts[t] + i]
                for t in range(1, taps)
            ])
            for i in range(count)
        ]  # fmt: skip
        assert out[3 : 3 + count] == pytest.approx(expected, rel=1e-6)
        assert (out[:3] == 0).all()


@njit
def lowered(costs, table, shifts, other, moves, out, count, two):
    if two:
        min_plus.lower_by_two(1, costs.size, costs, other, moves, 7, table, shifts, 5, out, 3, count)
    else:
        min_plus.lower(1, costs.size, costs, table, shifts, 5, out, 3, count)


def test_search_is_the_same_without_compilation():
    for seed in range(3):
        _, arguments = made_case(seed, 2, 2, 1, "box", walls=True, midway=True, steep=50.0)
        compiled = solved(*arguments)
        plain = walk.py_func(kernel.induce.py_func(*arguments), arguments[10])
        assert plain[0] == pytest.approx(compiled[0])
        assert (plain[1] == compiled[1]).all()
        compiled = solved_abreast(*arguments, 1.5)
        plain = walk_abreast.py_func(kernel.induce(*arguments), arguments[10], 1.5)
        assert plain[0] == pytest.approx(compiled[0])
        assert (plain[1] == compiled[1]).all()
        given_ = arguments[:9]
        to_go = search_tube.costs_to_go(*given_[:5], *given_[6:])
        plain = search_tube.costs_to_go.py_func(*given_[:5], *given_[6:])
        assert plain[0][: plain[1][-1]] == pytest.approx(to_go[0][: to_go[1][-1]])
        tube = [f(*given_[:7], given_[8], *to_go, 0.7, 1) for f in (search_tube.tube, search_tube.tube.py_func)]
        for one, other in zip(*tube, strict=True):
            assert one == pytest.approx(other)


def test_free_space_leads_straight_to_the_goal_and_stays_there():
    found = search(problem(goal=np.array([1.5, 0.0]), horizon=6))
    assert found.feasible
    assert found.path[-1] == pytest.approx([1.5, 0.0])
    assert found.path[1] == pytest.approx([0.5, 0.0])


@pytest.mark.parametrize("goal_cost", ["squared", "distance"])
@pytest.mark.parametrize("shape", ["box", "disc"])
def test_cost_of_the_search_is_the_objective_of_its_path(goal_cost, shape):
    people = RiskField(people=[person(horizon=4, position=(1.5, 0.2), heading=2.8)], distances=np.array([0.6]))
    given_ = problem(
        horizon=4, shape=shape, goal_cost=goal_cost, people=people, risk_limit=0.3, soft_risk_weight=3.0,
        terminal_weight=0.5, goal_weight=(1.0, 2.0), effort_weight=(0.1, 0.3),
    )  # fmt: skip
    found = search(given_)
    assert found.feasible
    assert found.cost == pytest.approx(given_.cost(found.path))
    for other in (0.1, -0.1):  # moving the last point on the lattice never helps
        path = found.path.copy()
        path[-1, 1] += other
        if given_.allows(path):
            assert given_.cost(path) >= found.cost - 1e-5


@given(
    weight=st.sampled_from([0.0, 0.5, 20.0, 1e4]), angle=st.floats(-3.1, 3.1), speed=st.floats(0.0, 1.5),
    squared=st.booleans(), graded=st.booleans(),
)  # fmt: skip
@options(max_examples=40)
def test_preferred_first_velocity_is_weighed_against_everything_else(weight, angle, speed, squared, graded):
    preferred = speed * np.array([np.cos(angle), np.sin(angle)])
    given_ = problem(
        horizon=2, resolution=2, preferred=preferred, preference_weight=weight, graded=graded,
        goal_cost="squared" if squared else "distance",
    )  # fmt: skip
    found = search(given_)
    taps = 0.25 * lattice_taps(2, 2, "disc")
    ways = [np.stack([np.zeros(2), a, a + b]) for a in taps for b in taps]
    plain = replace(given_, preferred=None, preference_weight=0.0)
    best = min(plain.cost(way) + weight * ((way[1] / 0.5 - preferred) ** 2).sum() for way in ways)
    assert found.cost == pytest.approx(best, rel=1e-5, abs=1e-5)
    assert given_.cost(found.path) == pytest.approx(found.cost)
    if weight == 1e4:
        off = np.linalg.norm(found.path[1] / 0.5 - preferred)
        assert off == pytest.approx(min(np.linalg.norm(w[1] / 0.5 - preferred) for w in ways))


@given(
    x=st.floats(0.8, 2.5), y=st.floats(-0.8, 0.8), heading=st.floats(-3.1, 3.1), limit=st.sampled_from([0.02, 0.1]),
    spread=st.booleans(),
)  # fmt: skip
@options(max_examples=25)
def test_what_the_search_calls_feasible_respects_the_exact_limit(x, y, heading, limit, spread):
    people = RiskField(
        people=[person(horizon=4, position=(x, y), heading=heading, spread=spread)], distances=np.array([0.7])
    )
    given_ = problem(horizon=4, people=people, risk_limit=limit)
    found = search(given_)
    assert np.isfinite(found.path).all()
    if found.feasible:
        assert given_.allows(found.path)
        assert people.along(found.path).max() <= limit * (1 + 1e-5)


@given(
    x=st.floats(0.8, 2.5), y=st.floats(-0.8, 0.8), heading=st.floats(-3.1, 3.1), graded=st.booleans(),
    needed=st.sampled_from([0.0, 1e-3, 0.3, 5.0, np.inf]), rule=st.sampled_from(["mass", "trajectory"]),
)  # fmt: skip
@options(max_examples=40)
def test_how_far_searches_had_to_look_changes_nothing_that_is_found(x, y, heading, graded, needed, rule):
    def found(outlook):
        people = RiskField(people=[person(horizon=4, position=(x, y), heading=heading)], distances=np.array([0.7]))
        return search(problem(horizon=4, people=people, rule=rule, graded=graded, risk_limit=0.05), outlook=outlook)

    outlook = Outlook()
    outlook.saw(graded, needed)
    plain, told = found(None), found(outlook)
    assert told.feasible == plain.feasible
    assert told.cost == pytest.approx(plain.cost, rel=1e-6)
    assert told.path == pytest.approx(plain.path, abs=1e-9)


def test_search_looks_as_far_at_once_as_the_last_had_to():
    people = RiskField(people=[still_person(6, (1.5, 0.02))], distances=np.array([0.7]))
    given_, outlook = problem(horizon=6, people=people), Outlook()
    for _ in range(3):
        found = search(given_, outlook=outlook)
        detour = found.cost - search(replace(given_, people=None)).cost
        assert outlook.slack(False) == pytest.approx(1.6 * detour, rel=1e-3)
        assert outlook.slack(True) == 0.0
        assert prepare(given_, outlook.slack(False)).slack >= detour
    in_the_way = RiskField(people=[still_person(4, (0.05, 0.0))], distances=np.array([0.7]))
    assert not search(problem(horizon=4, people=in_the_way, max_speed=1.5), outlook=outlook).feasible
    assert outlook.slack(False) == np.inf


def test_mirrored_world_gives_the_mirrored_plan():
    for flip in (np.diag([1.0, -1.0]), np.array([[0.0, -1.0], [1.0, 0.0]])):
        results = []
        for turn in (np.eye(2), flip):
            people = RiskField(
                people=[person(horizon=4, position=(1.4, 0.13), heading=np.pi, turn=turn)], distances=np.array([0.7])
            )
            results.append(search(problem(goal=turn @ [4.0, 0.3], people=people, horizon=4, risk_limit=0.1)))
        assert results[0].feasible
        assert results[1].path == pytest.approx(results[0].path @ flip.T, abs=1e-9)


def test_person_in_the_way_is_passed_with_the_whole_clearance():
    people = RiskField(people=[still_person(6, (1.5, 0.02))], distances=np.array([0.7]))
    given_ = problem(horizon=6, people=people)
    found = search(given_)
    assert found.feasible
    gaps = np.linalg.norm(found.path - np.array([1.5, 0.02]), axis=1)
    middles = np.linalg.norm(0.5 * (found.path[1:] + found.path[:-1]) - np.array([1.5, 0.02]), axis=1)
    assert min(gaps.min(), middles.min()) >= 0.7 - 1e-6
    assert found.path[-1, 0] > 2.0


def test_person_on_top_of_the_robot_is_infeasible_and_the_graded_search_gets_away():
    people = RiskField(people=[still_person(4, (0.05, 0.0))], distances=np.array([0.7]))
    given_ = problem(horizon=4, people=people, resolution=2, max_speed=1.5)
    found = search(given_)
    assert not found.feasible
    assert np.isinf(found.cost)
    assert (found.path == 0).all()
    graded = replace(given_, graded=True)
    least = search(graded, found.maps)
    assert least.feasible
    assert np.linalg.norm(least.path[-1] - [0.05, 0.0]) > 0.69
    assert least.cost == pytest.approx(graded.cost(least.path), rel=1e-5)
    slow = replace(graded, max_speed=0.2)  # too slow to get out: standing, charged a third, is the lesser evil
    assert (search(slow).path == 0.0).all()


def test_trajectory_rule_bounds_the_sum():
    people = RiskField(people=[person(horizon=5, position=(1.6, 0.1), heading=np.pi)], distances=np.array([0.7]))
    free = search(problem(people=people, risk_limit=1.0))
    before = people.along(free.path)[1::2].sum()
    bound = 0.25 * before
    found = search(problem(people=people, rule="trajectory", risk_limit=bound))
    assert found.feasible
    assert people.along(found.path)[1::2].sum() <= bound * (1 + 1e-5)
    assert found.cost >= free.cost - 1e-6
    tight = search(problem(people=people, rule="trajectory", risk_limit=0.5 * bound))
    assert not tight.feasible or tight.cost >= found.cost - 1e-6


def test_cells_rule_keeps_off_every_cell_above_the_threshold():
    someone = person(horizon=5, position=(1.6, 0.1), heading=np.pi)
    threshold = 0.1
    people = RiskField(people=[someone], distances=np.array([0.5])).cells_above(threshold)
    found = search(problem(people=people, rule="cells", risk_limit=threshold))
    assert found.feasible
    steps = [someone.flat[someone.offsets[2 * k] : someone.offsets[2 * k + 1]] for k in range(6)]
    for k in range(1, 6):
        cells = someone.lattice.with_radius(int(someone.radii[2 * k])).positions().reshape(-1, 2)
        near = np.linalg.norm(cells - found.path[k], axis=1) < 0.5 - 1e-6
        assert steps[k][near].max(initial=0.0) < threshold


def inertia(velocity: tuple[float, ...], acceleration: float) -> Inertia:
    return Inertia(velocity=np.array(velocity), acceleration=acceleration, time_step=0.5, interval=0.1)


def test_acceleration_limits_the_first_action():
    given_ = problem(inertia=inertia((0.0, 0.5), 0.8), resolution=5)
    found = search(given_)
    first = (found.path[1] - found.path[0]) / 0.5
    assert np.linalg.norm(first - [0.0, 0.5]) <= given_.largest_change + 1e-9
    assert given_.largest_change**2 / (2 * 0.8) <= LAG + 1e-12
    assert given_.allows(found.path)
    too_fast = search(replace(given_, inertia=inertia((5.0, 0.0), 0.8)))  # back into the speed limit, nothing else
    assert too_fast.path[1] == pytest.approx([0.5, 0.0])
    hardly = replace(given_, inertia=inertia((0.13, 0.12), 0.01))  # no action of the lattice is near enough
    begun = (search(hardly).path[1] - hardly.start) / 0.5
    assert np.linalg.norm(begun - [0.13, 0.12]) == pytest.approx(hardly.largest_change)  # toward the next one


@given(
    velocity=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    wanted=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    acceleration=st.floats(0.05, 5.0),
)
def test_what_is_begun_is_what_is_wanted_or_as_far_toward_it_as_acceleration_allows(velocity, wanted, acceleration):
    given_ = problem(inertia=inertia(velocity, acceleration))
    begun = given_.begun(np.array([wanted]))[0]
    change, whole = begun - velocity, np.subtract(wanted, velocity)
    most = given_.largest_change
    assert np.linalg.norm(change) == pytest.approx(min(np.linalg.norm(whole), most), abs=1e-9)
    assert change[0] * whole[1] == pytest.approx(change[1] * whole[0], abs=1e-9)
    assert change @ whole >= 0.0
    assert (problem().begun(np.array([wanted])) == [wanted]).all()


def test_first_step_limit_forbids_actions_that_sweep_too_close():
    near = FirstStep(
        positions=np.array([[1.0, 0.0]]), sigmas=np.array([0.0]), person=np.zeros(1, dtype=np.int64),
        velocities=np.array([[-0.5, 0.0]]), probabilities=np.array([1.0]), distances=np.array([0.6]), interval=0.5,
    )  # fmt: skip
    found = search(problem(first_step=near))
    velocity = (found.path[1] - found.path[0]) / 0.5
    assert near.risk(np.zeros(2), velocity[None])[0][0] <= near.limit
    assert search(problem()).path[1] == pytest.approx([0.5, 0.0])


def test_a_first_action_goes_on_until_the_next_call():
    wall = Obstacles(polygons=[[(1.5, -1.0), (1.7, -1.0), (1.7, 1.0), (1.5, 1.0)]])
    ahead = np.array([[0.9, 0.0], [1.1, 0.0]])  # m/s, 1.2 m are free
    costs = problem(obstacles=wall, margin=0.3, hold=1.2).first_step_costs(ahead)
    assert list(np.isinf(costs)) == [False, True]
    assert not problem(obstacles=wall, margin=0.3, hold=0.1).first_step_costs(ahead).any()  # 0.55 m in a step
    assert list(np.isinf(problem(obstacles=wall, margin=0.3, time_step=1.2).first_step_costs(ahead))) == [False, True]


@pytest.mark.parametrize("step", range(5))
def test_every_step_of_what_is_allowed_keeps_off_walls_and_within_the_speed_limit(step):
    path = np.arange(6)[:, None] * np.array([[0.4, 0.0]])
    middle = 0.4 * step + 0.2
    for gap, kept in ((0.28, False), (0.32, True)):  # beside the middle of one step
        wall = Obstacles(polygons=[[(middle - 0.01, gap), (middle + 0.01, gap), (middle, 1.0)]])
        assert problem(obstacles=wall, margin=0.3).allows(path) is kept
    for more, kept in ((0.11, False), (0.09, True)):
        faster = path.copy()
        faster[step + 1 :, 0] += more
        assert problem().allows(faster) is kept  # 1 m/s, 0.5 m in a step


def test_what_a_rule_limits():
    risk = np.array([0.9, 0.02, 0.0, 0.02, 0.9, 0.009])  # at half instants 1 to 6
    assert respects(risk, "trajectory", 0.05)  # at whole instants, summed
    assert not respects(risk, "trajectory", 0.048)
    assert not respects(risk, "mass", 0.05)
    assert respects(0.05 * risk, "mass", 0.046)
    assert not respects(0.05 * risk, "mass", 0.044)
    assert respects(0.5 * risk, "cells", 0.01)  # whatever is near a cell above it is 1
    assert not respects(0.6 * risk, "cells", 0.99)


def test_what_exceeds_the_limit_is_charged_less_from_recourse_on():
    given_ = problem(graded=True, recourse_steps=2, later_risk_weight=7.0, steep_risk_weight=90.0)
    assert given_.excess_weights.tolist() == [90.0, 90.0, 7.0, 7.0, 7.0]
    assert replace(given_, recourse_steps=None).excess_weights.tolist() == [90.0] * 5
    assert replace(given_, graded=False).excess_weights.tolist() == [0.0] * 5


def test_walls_are_kept_off_along_the_whole_way():
    walls = Obstacles(polygons=[[(1.0, -2.0), (1.1, -2.0), (1.1, 0.4), (1.0, 0.4)]])
    given_ = problem(horizon=8, obstacles=walls, margin=0.3, goal=np.array([2.5, 0.0]))
    found = search(given_)
    assert found.feasible
    assert walls.segment_free(found.path[:-1], found.path[1:], 0.295).all()
    assert found.path[-1, 0] > 1.5


def test_robot_inside_a_wall_gets_out_or_stops_but_never_fails():
    walls = Obstacles(polygons=[[(-0.3, -3.0), (0.2, -3.0), (0.2, 3.0), (-0.3, 3.0)]])
    out = search(problem(obstacles=walls, margin=0.3))
    assert np.isfinite(out.path).all()
    deep = Obstacles(polygons=[[(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)]])
    stuck = search(problem(obstacles=deep, margin=0.3))
    assert np.isfinite(stuck.path).all()
    if not stuck.feasible:
        assert (stuck.path == 0.0).all()


@pytest.mark.parametrize("goal_cost", ["squared", "distance"])
@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("walled", [False, True])
def test_maps_hold_the_costs_and_walls_of_their_places(d, goal_cost, walled):
    if d == 1 and walled:
        return
    walls = Obstacles(polygons=[[(0.6, -0.5), (0.8, -0.5), (0.8, 0.4), (0.6, 0.4)]]) if walled else None
    goal = np.arange(1.0, d + 1.0)
    given_ = problem(
        start=np.full(d, 0.1), goal=goal, horizon=2, resolution=2, goal_cost=goal_cost,
        goal_weight=tuple(np.arange(1.0, d + 1.0)), obstacles=walls, margin=0.2,
        distance_to_goal=ways_to_goal(walls, goal, margin=0.2).field() if walled else None,
    )  # fmt: skip
    maps = prepare(given_)
    span = maps.spacing * np.arange(-4, 5)
    places = 0.1 + np.stack(np.meshgrid(*([span] * d), indexing="ij"), axis=-1).reshape(-1, d)
    exact = given_.goal_costs(places)
    assert maps.stage.ravel() == pytest.approx(exact - exact.min(), abs=1e-4)
    if walled:
        margin = np.hypot(0.2, 0.125)
        assert (maps.blocked.ravel() == ~walls.free(places, margin)).all()
        half = (2 * 3 + 1) // 2
        span = maps.spacing * (np.arange(-half, half + 1) + 0.5)
        odd = 0.1 + np.stack(np.meshgrid(*([span] * d), indexing="ij"), axis=-1).reshape(-1, d)
        assert (maps.blocked_halfway[-1].ravel() == ~walls.free(odd, margin)).all()


@pytest.mark.parametrize("d", [1, 3])
def test_search_in_other_dimensions(d):
    goal = np.zeros(d)
    goal[0] = 5.0
    position = np.zeros(d)
    position[0] = 1.5
    people = RiskField(people=[still_person(4, position)], distances=np.array([0.5]))
    found = search(problem(start=np.zeros(d), goal=goal, horizon=4, people=people))
    assert found.feasible
    assert people.along(found.path).max() == 0.0
    if d == 1:
        assert found.path[-1, 0] == pytest.approx(1.0, abs=0.06)  # nobody is passed on a line
    else:
        assert found.path[-1, 0] > 1.0


def test_resolution_falls_with_the_horizon_and_taps_start_with_standing():
    assert resolution(5, 2, "disc") == 5
    assert resolution(50, 2, "box") < resolution(20, 2, "box")
    assert resolution(200, 3, "box") == 2
    for d in (1, 2, 3):
        taps = lattice_taps(2, d, "disc")
        assert (taps[0] == 0).all()
        assert (np.linalg.norm(taps, axis=1) <= 2).all()
        assert len(lattice_taps(2, d, "box")) == 5**d
