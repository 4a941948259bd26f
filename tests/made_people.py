"""People, goals, robots and walls drawn at random, small enough to enumerate everything they may do."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.human.goals import DirectionGoal, Goal, PointGoal, SlowingGoal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice
from sidestep.prediction.occupancy import Prediction, Removal, frame_of, predict

TIME_STEP = 0.5


@dataclass(frozen=True)
class Encounter:
    """One person, one robot path, two goals."""

    model: HumanModel
    lattice: Lattice
    goals: list[Goal]
    weights: np.ndarray  # (2, 2)
    path: np.ndarray  # (K, d) m
    horizon: int
    free: np.ndarray | None


def draw_model(rng: np.random.Generator, d: int, reach: int, horizon: int) -> HumanModel:
    return HumanModel(
        frame=str(rng.choice(["world", "heading"])),  # type: ignore[arg-type]
        reach=reach,
        horizon=horizon,
        goal_cost=str(rng.choice(["squared", "distance"])),  # type: ignore[arg-type]
        goal_weight=tuple(rng.uniform(0.1, 2.0, d)) if rng.random() < 0.5 else float(rng.uniform(0.1, 2.0)),
        effort_weight=tuple(rng.uniform(0.0, 2.0, d)) if rng.random() < 0.5 else float(rng.uniform(0.0, 2.0)),
        danger_weight=float(rng.choice([0.0, rng.uniform(0.0, 20.0)], p=[0.1, 0.9])),
        danger_rate=float(rng.uniform(0.05, 1.0)),
        danger_decay=str(rng.choice(["distance", "squared_distance"])),  # type: ignore[arg-type]
        perception_noise=float(rng.choice([0.0, 0.5])),
        randomness=float(rng.uniform(0.0, 1.0)),
        rationality=float(rng.choice([math.inf, math.inf, 0.7])),
        awareness_over_horizon=str(rng.choice(["persistent", "resampled"])),  # type: ignore[arg-type]
    )


def draw_goal(rng: np.random.Generator, d: int) -> Goal:
    kind = rng.integers(5)
    if kind == 0:
        return StandGoal()
    if kind == 4:
        return SlowingGoal(rng.normal(size=d), rng.uniform(0.2, 3.0))
    if kind == 1:
        return DirectionGoal(rng.normal(size=d))
    return PointGoal(3.0 * rng.normal(size=d))


def draw_encounter(seed: int, *, d: int, reach: int, steps: int, horizon: int, walls: bool) -> Encounter:
    """`steps` is N_H; `walls` allows them."""
    rng = np.random.default_rng(seed)
    model = draw_model(rng, d, reach, steps)
    free = rng.random((7,) * d) < 0.7 if walls and rng.random() < 0.5 else None
    return Encounter(
        model=model,
        lattice=frame_of(model, rng.normal(size=d), rng.normal(size=d), TIME_STEP),
        goals=[draw_goal(rng, d), draw_goal(rng, d)],
        weights=rng.dirichlet([1.0] * 4).reshape(2, 2),
        path=np.cumsum(0.5 * rng.normal(size=(horizon + max(steps, 1) + 1, d)), axis=0),
        horizon=horizon,
        free=free,
    )


def predicted(case: Encounter, **changes: object) -> Prediction:
    """Predict an encounter; `changes` are arguments of `predict`."""
    arguments = {
        "model": case.model,
        "lattice": case.lattice,
        "goals": case.goals,
        "weights": case.weights,
        "robot_path": case.path,
        "horizon": case.horizon,
        "time_step": TIME_STEP,
        "removal": Removal(distance=1.0),
        "free": case.free,
        "midway": True,
    }
    return predict(**(arguments | changes))  # type: ignore[arg-type]
