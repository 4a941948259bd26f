"""Is P_coll what it says? Predicted collision probabilities against how often the collision came true.

A plan's P_coll(k|t) speaks of the robot on that plan. So the robot commits: it keeps each plan for its whole horizon
before it asks for the next, and each plan gives one pair (prediction, outcome) per stage. It is also told to accept any
risk, or there would be nothing but zeros to compare.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from sidestep.checks import counted, seeded
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.planner import Planner
from sidestep.planning.plan import Plan
from sidestep.planning.settings import PlannerSettings
from sidestep.robots import RobotState
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.crowd_people import crowd_kinds
from sidestep.simulation.loop import simulate
from sidestep.simulation.record import Record
from sidestep.simulation.scenario import Scenario
from sidestep.studies.engines import Store, each, length, run_kept
from sidestep.studies.statistics import calibration_bins, expected_calibration_error
from sidestep.types import BoolArray, FloatArray, frozen_array

EDGES = np.array([0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
HORIZON, TIME_STEP = 5, 0.5
EPISODES_PER_PIECE = 20
LENGTH = 6.0  # m, of a trip


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationPiece:
    """Some episodes of one kind of people; `kind` is a name of `kinds_of_people()`."""

    kind: str
    start: int
    stop: int
    seed: int

    @property
    def name(self) -> str:
        """What it is kept under."""
        return f"calibration--{self.kind}--{self.seed}--{self.start}-{self.stop}"


class Committed:
    """Keeps each plan to its end."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._plan: Plan | None = None
        self._stage = 0

    def reset(self) -> None:
        """Forget the plan and what the planner knows."""
        self._planner.reset()
        self._plan, self._stage = None, 0

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Plan:
        """Return the plan in force, its velocity that of the present stage; a new plan after the last stage.

        The planner looks at every observation, so that its belief is up to date when it is asked.
        """
        fresh = self._planner.step(time=time, robot=robot, people=people)
        self._stage += 1
        if self._plan is None or self._stage >= len(self._plan.velocities):
            self._plan, self._stage = fresh, 0
            return fresh
        return replace(self._plan, velocity=frozen_array(self._plan.velocities[self._stage]))


def calibration_study(
    *,
    episodes: int,
    seed: int = 0,
    workers: int = 1,
    engine: str = "joblib",
    address: str | None = None,
    kinds: Sequence[str] = ("in_model", "social_force", "goal_switch", "noise"),
    store: Store | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, dict[str, Any]]:
    """Compare predictions with outcomes for each kind of people.

    Args:
        episodes: per kind; each gives 15 to 30 pairs.
        seed: base of all seeds.
        workers, engine, address: see `run_pieces`.
        kinds: "in_model" is drawn from the predictor's own model; the others are not.
        store: where finished pieces are kept and looked for.
        progress: called with (episodes done, all episodes).

    Returns:
        kind → {"ece", "brier", "n", "steps", "bins"}, JSON-able.

    Raises:
        InvalidInput: there are no episodes, or too many, or the seed is none.
    """
    counted("episodes", episodes)
    seeded("seed", seed)
    pieces = [
        CalibrationPiece(kind=kind, start=k, stop=min(k + EPISODES_PER_PIECE, episodes), seed=seed)
        for kind in kinds
        for k in range(0, episodes, EPISODES_PER_PIECE)
    ]
    found = run_kept(
        each(pairs_of_piece),
        pieces,
        store=store,
        size=length,
        workers=workers,
        engine=engine,
        address=address,
        progress=progress,
    )
    return {kind: _summary([found[p.name] for p in pieces if p.kind == kind]) for kind in kinds}


def pairs_of_piece(piece: CalibrationPiece) -> tuple[CalibrationPiece, dict[str, Any]]:
    """Return the piece, and as JSON predicted probabilities, whether they came true, and the simulated steps."""
    predicted, happened, steps = [np.zeros(0)], [np.zeros(0, dtype=bool)], 0
    for episode in range(piece.start, piece.stop):
        scenario = kinds_of_people()[piece.kind](episode, piece.seed)
        navigator = Committed(planner_of(scenario))
        record = simulate(scenario, navigator=navigator, kinds=crowd_kinds(), snapshots=0)
        p, h = pairs(record, scenario.human.radius)
        predicted.append(p)
        happened.append(h)
        steps += len(record.status)
    kept = {"predicted": np.concatenate(predicted).tolist(), "happened": np.concatenate(happened).tolist()}
    return piece, kept | {"steps": steps}


def pairs(record: Record, person_radius: float) -> tuple[FloatArray, BoolArray]:
    """Return the pairs of all plans kept to their end: P_coll(k|t), and whether stage k brought first contact.

    Args:
        record: of a run with a committed robot, recorded once per stage.
        person_radius: m.
    """
    contact = record.robot_radius + person_radius
    gaps = np.linalg.norm(record.people_positions - record.robot_positions[:, None], axis=-1)
    touching = (gaps < contact).any(axis=1)  # (T+1,) at the samples, as Eq. 7 counts
    predicted: list[float] = []
    happened: list[bool] = []
    for start in range(0, len(record.status) - HORIZON + 1, HORIZON):
        stages = record.collision_probability[start, :HORIZON]
        if touching[start] or not np.isfinite(stages).all():
            continue
        after = np.flatnonzero(touching[start + 1 : start + 1 + HORIZON])
        first = after[0] if len(after) else -1
        predicted += stages.tolist()
        happened += [k == first for k in range(HORIZON)]
    return np.array(predicted), np.array(happened, dtype=bool)


def kinds_of_people() -> Mapping[str, Callable[[int, int], Scenario]]:
    """Return generators (episode, base seed) → scenario, by kind."""
    return {
        "in_model": _in_model,
        "social_force": lambda e, s: _real(e, s, "social-force"),
        "goal_switch": lambda e, s: _real(e, s, "straight", switch=True),
        "noise": lambda e, s: _real(e, s, "straight", noise=0.1),
    }


def _in_model(episode: int, seed: int) -> Scenario:
    """People who follow the predictor's model exactly: Eqs. 2, 4 on the world's axes, goal known, β from the prior."""
    generator = _generator(episode, seed, 1)
    model = HumanModel(
        frame="world", walking_speed=0.5, goal_cost="squared", goal_weight=1.0, effort_weight=0.5, danger_weight=20.0,
        danger_rate=0.5, randomness=0.2, switch_rate=0.0, measurement_noise=1e-6, action_noise=0.0, motion_filter=False,
        steadiness=False, online_randomness=False,
    )  # fmt: skip
    kind = "concerned" if generator.random() < model.prior_concerned else "unconcerned"
    start, goal = _crossing(generator, 1.0)
    person = {"kind": kind, "start": start, "goal": goal, "goal_known": True}
    return _scenario(generator, model, person, 0.0)


def _real(episode: int, seed: int, kind: str, *, switch: bool = False, noise: float = 0.0) -> Scenario:
    """People of another model, met with the defaults for real people."""
    generator = _generator(episode, seed, 2)
    start, goal = _crossing(generator, 1.0)
    way = np.subtract(goal, start)
    person: dict[str, Any] = {
        "kind": kind,
        "start": start,
        "goal": goal,
        "goal_known": False,
        "speed": 1.0,
        "arrives_with": tuple((way / np.linalg.norm(way)).tolist()),
    }
    if switch:
        person["goal_changes"] = [{"time": float(generator.uniform(0.5, 4.0)), "goal": "robot"}]
    return _scenario(generator, HumanModel(), person, noise)


def _generator(episode: int, seed: int, stream: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, stream, episode])))


def _crossing(generator: np.random.Generator, pace: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Start and goal of somebody whose way meets the robot's, from any side but from behind."""
    angle = generator.uniform(math.radians(45), math.radians(315))
    along = np.array([math.cos(angle), math.sin(angle)])
    where = np.array([generator.uniform(1.5, 4.5), generator.uniform(-0.4, 0.4)])
    start = where - along * pace * max(where[0] + generator.uniform(-1.0, 1.0), 1.5)
    return tuple(start.tolist()), tuple((where + along * 4.0).tolist())


def _scenario(generator: np.random.Generator, model: HumanModel, person: Mapping[str, Any], noise: float) -> Scenario:
    settings = PlannerSettings(
        time_step=TIME_STEP, horizon=HORIZON, risk_limit=1.0, soft_risk_weight=0.0, first_step_limit=None, clearance=0.6
    )
    data = {
        "name": "calibration",
        "seed": int(generator.integers(2**31)),
        "duration": LENGTH + 1.5,
        "stop_at_goal": False,
        "control_step": TIME_STEP,
        "robot": {"start": (0.0, 0.0), "goal": (LENGTH, 0.0), "max_speed": 1.0},
        "people": [person],
        "measurement": {"position_noise": noise},
        "planner": asdict(settings),
        "human": asdict(model),
    }
    return Scenario.parse(data)


def _summary(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    predicted = np.concatenate([np.array(part["predicted"], dtype=np.float64) for part in parts])
    happened = np.concatenate([np.array(part["happened"], dtype=np.bool_) for part in parts])
    bins = calibration_bins(predicted, happened.astype(np.float64), EDGES)
    return {
        "ece": expected_calibration_error(bins),
        "brier": float(((predicted - happened) ** 2).mean()) if len(predicted) else None,
        "n": len(predicted),
        "steps": sum(part["steps"] for part in parts),
        "bins": bins,
    }
