"""The polished plan never costs more than the lattice plan, and never breaks a limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st

from made_masses import person, still_person
from sidestep.obstacles import Obstacles
from sidestep.planning.geodesic import ways_to_goal
from sidestep.planning.polish import polish
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search
from sidestep.planning.stopping import Inertia
from sidestep.prediction.collision import RiskField

INERTIA = Inertia(velocity=np.array([0.4, 0.1]), acceleration=1.0, time_step=0.5, interval=0.1)
WALLS = Obstacles(polygons=[[(1.0, -2.0), (1.1, -2.0), (1.1, 0.4), (1.0, 0.4)]])


def problem(**changes):
    settings = {
        "start": np.zeros(2), "goal": np.array([4.0, 0.33]), "time_step": 0.5, "horizon": 5, "max_speed": 1.0,
        "shape": "disc", "effort_weight": 0.05}  # fmt: skip
    return PlanningProblem(**{**settings, **changes})


@given(
    x=st.floats(0.4, 2.5), y=st.floats(-0.8, 0.8), heading=st.floats(-3.1, 3.1),
    shape=st.sampled_from(["box", "disc"]), goal_cost=st.sampled_from(["squared", "distance"]),
    soft=st.sampled_from([0.0, 15.0]), spread=st.booleans(), graded=st.booleans(), walls=st.booleans(),
    limited=st.booleans(), preferred=st.sampled_from([None, (0.9, 0.0), (-0.4, 0.6)]),
)  # fmt: skip
@options(max_examples=60)
def test_polish_never_costs_more_and_never_breaks_a_limit(
    x, y, heading, shape, goal_cost, soft, spread, graded, walls, limited, preferred
):
    people = RiskField(
        people=[person(horizon=5, position=(x, y), heading=heading, spread=spread)], distances=np.array([0.6])
    )
    given_ = problem(
        shape=shape, goal_cost=goal_cost, soft_risk_weight=soft, people=people, graded=graded, risk_limit=0.05,
        obstacles=WALLS if walls else None, inertia=INERTIA if limited else None,
        preferred=None if preferred is None else np.array(preferred), preference_weight=0.5 if preferred else 0.0,
    )  # fmt: skip
    found = search(given_)
    refined = polish(given_, found)
    if not found.feasible:
        assert refined.path is found.path
        return
    assert refined.cost <= found.cost
    assert refined.cost == pytest.approx(given_.cost(refined.path), rel=1e-9, abs=1e-9)
    assert refined.path[0] == pytest.approx(given_.start)
    if refined.rounds:
        assert given_.allows(refined.path)
        speeds = np.diff(refined.path, axis=0) / 0.5
        top = np.abs(speeds).max() if shape == "box" else np.linalg.norm(speeds, axis=1).max()
        assert top <= 1.0 + 1e-5


@pytest.mark.parametrize("shape", ["box", "disc"])
@pytest.mark.parametrize("goal_cost", ["squared", "distance"])
def test_free_space_comes_close_to_the_straight_line(shape, goal_cost):
    goal = np.array([4.0, 1.3])
    given_ = problem(shape=shape, goal_cost=goal_cost, goal=goal, effort_weight=0.0, horizon=4)
    refined = polish(given_, search(given_), rounds=4)
    ideal = goal / np.linalg.norm(goal) if shape == "disc" else np.array([1.0, np.nan])
    if shape == "disc":
        best = given_.cost(np.outer(0.5 * np.arange(5), ideal))
        assert best - 1e-9 <= refined.cost <= best * 1.005
    else:
        assert refined.path[-1, 0] == pytest.approx(2.0, abs=1e-4)


def test_polish_uses_what_the_lattice_leaves():
    people = RiskField(people=[still_person(6, (1.5, 0.03))], distances=np.array([0.7]))
    given_ = problem(horizon=6, people=people)
    found = search(given_)
    refined = polish(given_, found)
    assert refined.rounds > 0
    assert refined.cost < found.cost - 0.05
    assert people.along(refined.path).max() == 0.0


@pytest.mark.parametrize("d", [1, 3])
def test_polish_in_other_dimensions(d):
    goal, position = np.zeros(d), np.zeros(d)
    goal[0], position[0] = 5.0, 1.53
    people = RiskField(people=[still_person(4, position)], distances=np.array([0.5]))
    given_ = problem(start=np.zeros(d), goal=goal, horizon=4, people=people)
    found = search(given_)
    refined = polish(given_, found)
    assert refined.cost <= found.cost
    assert given_.allows(refined.path)


def test_polish_follows_the_way_around_walls():
    around = ways_to_goal(WALLS, (2.5, 0.0), margin=0.3).field()
    given_ = problem(horizon=8, obstacles=WALLS, margin=0.3, goal=np.array([2.5, 0.0]), distance_to_goal=around)
    found = search(given_)
    refined = polish(given_, found)
    assert refined.cost <= found.cost
    assert given_.allows(refined.path)
    assert WALLS.segment_free(refined.path[1:-1], refined.path[2:], 0.295).all()
