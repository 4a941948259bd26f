"""Records made by hand, for what reads records: figures, animations, metrics. Straight paths, spreading predictions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sidestep.simulation.record import Record, Snapshot
from sidestep.types import FloatArray

HORIZON = 6
TIME_STEP = 0.5


def made_record(
    *,
    dimension: int = 2,
    people: int = 1,
    seed: int = 0,
    walls: Sequence[FloatArray] = (),
    snapshots: bool = True,
    awareness_known: bool = True,
    late: bool = False,
    steps: int = 24,
) -> Record:
    """Return a crossing in `dimension` axes: the robot goes up the last axis, `people` walk across it."""
    rng = np.random.default_rng(seed)
    time = TIME_STEP * np.arange(steps + 1)
    robot = _robot_path(dimension, time)
    persons = _people_paths(dimension, people, time, rng)
    if late and people:
        persons[: steps // 4, -1] = np.nan
    gap = np.linalg.norm(persons - robot[:, None], axis=-1)
    risk = np.clip(0.02 * np.exp(-np.nan_to_num(gap.min(axis=1) if people else np.full(steps + 1, 9.0), nan=9.0)), 0, 1)
    lookahead = np.minimum(np.arange(steps)[:, None] + np.arange(HORIZON + 1)[None], steps)
    belief = 1 / (1 + np.exp(-(time[:-1, None] - 3.0) * rng.choice([-1.5, 1.5], size=(1, people))))
    return Record(
        scenario=f"made-{dimension}d",
        settings={"seed": seed},
        seed=seed,
        time=time,
        robot_positions=robot,
        robot_headings=np.full(steps + 1, np.nan),
        robot_velocities=np.diff(robot, axis=0) / TIME_STEP,
        robot_goal=robot[-1],
        robot_radius=0.3,
        people=tuple("abcdefghijklmnopqrstuvwxyz"[k] for k in range(people)),
        people_radii=np.full(people, 0.3),
        people_goals=persons[-1] if people else np.zeros((0, dimension)),
        people_positions=persons,
        people_awareness=np.broadcast_to((belief[-1] > 0.5).astype(float) if awareness_known else np.nan, gap.shape),
        beliefs=np.where(np.isnan(gap[:-1]), np.nan, belief),
        status=tuple("least_risk" if r > 0.005 else "certified" for r in risk[:-1]),
        collision_probability=0.3 * risk[:-1, None] * np.ones(HORIZON),
        risk=3 * risk[:-1, None] * np.ones(HORIZON),
        plans=robot[lookahead],
        planning_time=np.full(steps, 0.002),
        plan_age=np.zeros(steps),
        risk_limit=0.02,
        clearance=0.7,
        time_step=TIME_STEP,
        control_step=TIME_STEP,
        snapshots=_snapshots(persons) if snapshots else (),
        walls=tuple(walls),
        reached_goal=True,
    )


def _robot_path(dimension: int, time: FloatArray) -> FloatArray:
    path = np.zeros((len(time), dimension))
    path[:, -1 if dimension < 3 else 1] = np.linspace(-5.0, 5.0, len(time))
    if dimension > 1:
        path[:, 0] += 0.9 * np.exp(-((time - time.mean()) ** 2) / 3.0)
    if dimension == 3:
        path[:, 2] = 1.0 + 0.5 * np.sin(time / 3)
    return path


def _people_paths(dimension: int, people: int, time: FloatArray, rng: np.random.Generator) -> FloatArray:
    persons = np.zeros((len(time), people, dimension))
    across = np.linspace(-5.0, 5.0, len(time))
    for p in range(people):
        sign = 1 if p % 2 == 0 else -1
        if dimension == 1:
            persons[:, p, 0] = 7.0 - 0.5 * time + 0.3 * p
            continue
        persons[:, p, 0] = sign * across + 0.4 * p
        persons[:, p, 1] = rng.uniform(-0.4, 0.4) * across + (p - people // 2) * 0.9
        if dimension == 3:
            persons[:, p, 2] = 1.5 + 0.2 * p
    return persons


def _snapshots(persons: FloatArray) -> tuple[Snapshot, ...]:
    made: list[Snapshot] = []
    steps, people, d = persons.shape
    for step in range(0, steps - 1, 2):
        for person in range(people):
            here, after = persons[step, person], persons[step + 1, person]
            if np.isnan(here).any() or np.isnan(after).any():
                continue
            made.append(_spreading(step, person, here, after - here, d))
    return tuple(made)


def _spreading(step: int, person: int, here: FloatArray, move: FloatArray, d: int) -> Snapshot:
    spacing = max(float(np.linalg.norm(move)) / 2, 0.1)
    radius = 2 * HORIZON
    axis = spacing * np.arange(-radius, radius + 1)
    cells = np.stack(np.meshgrid(*([axis] * d), indexing="ij"), axis=-1)
    instants = np.arange(HORIZON + 1)
    probability = np.stack(
        [np.exp(-((cells - k * move) ** 2).sum(axis=-1) / (0.05 + 0.12 * k) ** 2 / 2) + 1e-9 for k in instants]
    )
    probability /= probability.sum(axis=tuple(range(1, d + 1)), keepdims=True)
    return Snapshot(
        step=step,
        person=person,
        origin=here,
        spacing=spacing,
        rotation=np.eye(d),
        probability=probability,
        instants=instants,
    )
