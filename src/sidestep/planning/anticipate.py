"""The robot motion that people are taken to anticipate: the last plan carried forward, or straight to the goal."""

from __future__ import annotations

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.types import Path, Vector


def straight(start: Vector, goal: Vector, *, speed: float, time_step: float, steps: int) -> Path:
    """Return (steps+1, d) m: straight to the goal at `speed` (m/s), then standing there."""
    way = goal - start
    length = float(np.linalg.norm(way))
    travelled = np.minimum(speed * time_step * np.arange(steps + 1), length)
    return start + (travelled / length if length > 0 else travelled)[:, None] * way


def extended(path: Path, goal: Vector, *, time_step: float, steps: int) -> Path:
    """Return `path` grown to (steps+1, d) m: past its end, on to the goal at the last speed, and stopping there."""
    missing = steps + 1 - len(path)
    if missing <= 0:
        return path[: steps + 1]
    last = float(np.linalg.norm(path[-1] - path[-2])) / time_step if len(path) > 1 else 0.0
    tail = straight(path[-1], goal, speed=last, time_step=time_step, steps=missing)
    return np.concatenate([path, tail[1:]])


def carried_forward(plan: Plan, *, time: float, start: Vector, goal: Vector, steps: int) -> Path:
    """Return the last plan as seen from now: shifted by the time that has passed, laid on the robot's true position.

    Args:
        plan: made at `plan.time` ≤ `time`.
        time: s, now.
        start: (d,) m, where the robot is.
        goal: (d,) m.
        steps: length of the result.

    Returns:
        (steps+1, d) m, sampled at the plan's time step.
    """
    shift = (time - plan.time) / plan.time_step
    instants = np.minimum(np.arange(steps + 1) + shift, len(plan.positions) - 1)
    whole = np.arange(len(plan.positions))
    path = np.stack([np.interp(instants, whole, plan.positions[:, a]) for a in range(start.size)], axis=1)
    known = int(np.searchsorted(instants, len(plan.positions) - 1))
    path = extended(path[: max(known, 1)], goal, time_step=plan.time_step, steps=steps)
    return path + (start - path[0])
