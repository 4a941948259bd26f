"""How soon a prediction that is not told the goal is as good as one that is: log-likelihood by the steps seen."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.planner import Planner
from sidestep.robots import Holonomic, RobotState
from sidestep.simulation.loop import simulate
from sidestep.simulation.scenario import Scenario
from sidestep.studies.arms import Columns, Row, Study
from sidestep.types import FloatArray, Path

STEPS = 8
STEP = 0.5  # s
KNOWN, HIDDEN = "goal told", "goal hidden"


def model() -> HumanModel:
    """Return people of Eqs. 2 and 4 on the world's axes, whose every step is on the lattice: likelihoods are exact."""
    return HumanModel(
        frame="world", walking_speed=0.5, goal_cost="squared", goal_weight=1.0, effort_weight=0.5, danger_weight=20.0,
        danger_rate=0.5, randomness=0.1, switch_rate=0.0, measurement_noise=1e-6, action_noise=0.0, motion_filter=False,
        steadiness=False, online_randomness=False,
    )  # fmt: skip


def candidates(generator: np.random.Generator) -> FloatArray:
    """Return (4, 2) m places where somebody may want to go, all around the start."""
    angles = generator.uniform(0.0, 2 * math.pi) + np.arange(4) * math.pi / 2 + generator.uniform(-0.5, 0.5, 4)
    return 6.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def walk(seed: int) -> tuple[Path, FloatArray, FloatArray]:
    """Return the positions (STEPS+1, 2) m of a person near a robot, the candidates (4, 2) m, and the true goal."""
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, 11])))
    goals = candidates(generator)
    goal = goals[generator.integers(4)]
    data = {
        "name": "hidden-goal",
        "seed": seed,
        "duration": (STEPS + 1) * STEP,
        "stop_at_goal": False,
        "robot": {"start": (3.0, -1.0), "goal": (3.0, 5.0), "max_speed": 0.5},
        "people": [{"kind": "concerned" if seed % 2 else "unconcerned", "start": (0.0, 0.0), "goal": goal.tolist()}],
        "human": {f: getattr(model(), f) for f in ("frame", "walking_speed", "goal_cost", "goal_weight",
                  "effort_weight", "danger_weight", "danger_rate", "randomness", "switch_rate", "motion_filter",
                  "steadiness", "online_randomness")},
        "planner": {"horizon": 4},
    }  # fmt: skip
    record = simulate(Scenario.parse(data), snapshots=0)
    return record.people_positions[: STEPS + 1, 0], goals, goal


def episode(seed: int, *, told: bool) -> Row:
    """Return the log-likelihood (nats) of each step that was then made, after 0, 1, … steps had been seen."""
    path, goals, goal = walk(seed)
    human = model() if told else replace(model(), goals=tuple(map(tuple, goals.tolist())))
    planner = Planner(robot=Holonomic(max_speed=0.5, radius=0.3), goal=(3.0, 5.0), human=human, horizon=4)
    row: Row = {}
    for k in range(STEPS):
        person = PersonObservation(id="a", position=path[k], goal=goal if told else None)
        robot = RobotState(position=(3.0, -1.0 + 0.5 * STEP * k))
        plan = planner.step(time=STEP * k, robot=robot, people=[person])
        ahead = plan.people["a"].occupancy
        cell = np.rint((path[k + 1] - path[k]) / ahead.lattice.spacing).astype(int) + ahead.lattice.radius
        row[f"seen_{k}"] = math.log(float(ahead.probability[1][tuple(cell)]))
    return row


def means(found: Columns) -> tuple[FloatArray, FloatArray]:
    """Return the mean log-likelihoods (STEPS,) with the goal told and hidden, by the number of steps seen."""
    told, hidden = (np.array([found[arm][f"seen_{k}"].mean() for k in range(STEPS)]) for arm in (KNOWN, HIDDEN))
    return told, hidden


def _rows(found: Columns) -> list[list[Any]]:
    told, hidden = means(found)
    apart = np.array([found[KNOWN][f"seen_{k}"] - found[HIDDEN][f"seen_{k}"] for k in range(STEPS)])
    error = apart.std(axis=1, ddof=1) / math.sqrt(apart.shape[1]) if apart.shape[1] > 1 else np.full(STEPS, np.nan)
    return [
        [k, f"{told[k]:.3f}", f"{hidden[k]:.3f}", f"{told[k] - hidden[k]:.3f} ± {error[k]:.3f}"] for k in range(STEPS)
    ]


def _remarks(found: Columns) -> list[str]:
    told, hidden = means(found)
    return [
        f"Before anything is seen a hidden goal costs {told[0] - hidden[0]:.2f} nat per step; after five steps, "
        f"{told[5] - hidden[5]:.3f} nat."
    ]


HIDDEN_GOALS = Study(
    name="goals",
    title="Unknown goals",
    lead="A person sets out for one of four places around them, near a moving robot, and follows the predictor's "
    "model. The log-likelihood of the step that comes next, predicted with the goal told and with the four places as "
    "candidates, by how many steps have been seen.",
    arms={KNOWN: partial(episode, told=True), HIDDEN: partial(episode, told=False)},
    header=("steps seen", "goal told, nat", "goal hidden, nat", "difference ± standard error"),
    rows=_rows,
    remarks=_remarks,
    episodes=400,
)
