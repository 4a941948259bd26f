"""The robot motion that people are taken to anticipate: the last plan carried forward, or straight to the goal."""

from __future__ import annotations

import numpy as np

from sidestep._kernels.carry import grown, head_for, shifted
from sidestep.planning.plan import Plan
from sidestep.types import Path, Vector


def straight(start: Vector, goal: Vector, *, speed: float, time_step: float, steps: int) -> Path:
    """Return (steps+1, d) m: straight to the goal at `speed` (m/s), then standing there."""
    path = np.empty((steps + 1, start.size))
    path[0] = start
    head_for(path, 1, goal, speed * time_step)
    return path


def extended(path: Path, goal: Vector, *, steps: int) -> Path:
    """Return `path` grown to (steps+1, d) m: past its end, on to the goal at the last speed, and stopping there."""
    return grown(path, goal, steps)


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
    return shifted(plan.positions, (time - plan.time) / plan.time_step, start, goal, steps)
