"""What one person at one place should do now (Eq. 2): the values of `human.policy` for a single cell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sidestep._kernels import decide as kernel
from sidestep.errors import InvalidInput
from sidestep.human.cost import CostGrid, danger_law, per_axis
from sidestep.human.goals import Goal, PointGoal
from sidestep.human.intent import EVERYWHERE
from sidestep.human.model import HumanModel
from sidestep.human.policy import action_values, embedded_free, look_ahead
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray, Path


def first_action_costs(
    model: HumanModel,
    lattice: Lattice,
    goal: Goal,
    robot_path: Path,
    awareness: int,
    time_step: float,
    free: BoolArray | None = None,
    others: FloatArray | None = None,
    law: tuple[float, float] | None = None,
) -> FloatArray:
    """Return the least cost (n,) of every first action from the lattice's anchor.

    The same numbers as `action_values` there. Somebody who is heading for a place and minds no other people, which is
    nearly everybody, is dealt with by one call of compiled code.

    Args:
        model: and what follows as for `action_values`.
        lattice: its radius does not matter.
        goal: likewise.
        robot_path: likewise.
        awareness: likewise.
        time_step: likewise.
        free: likewise.
        others: likewise.
        law: (weight, rate) of the danger as this person judges it now; None: as the model expects it to be judged.

    Raises:
        InvalidInput: the path is too short, or shapes do not fit.
    """
    if not isinstance(goal, PointGoal) or others is not None:
        if law is not None:
            model = replace(model, danger_weight=law[0], danger_rate=law[1], perception_noise=0.0)
        anchor = lattice.with_radius(0)
        return action_values(model, anchor, goal, robot_path, awareness, time_step, free, others).ravel()
    world, d, reach = np.ascontiguousarray(robot_path, dtype=np.float64), lattice.dimension, model.reach
    steps, lead = look_ahead(model, len(world) - 1)
    if len(world) < steps * lead + 1:
        raise InvalidInput("robot_path", world.shape, f"at least {steps * lead + 1} positions")
    weight, rate = danger_law(model) if law is None else law
    walls = None
    if free is not None:
        grid = CostGrid(lattice=lattice, time_step=time_step, reach=reach, steps=steps, centre=reach * steps)
        walls = embedded_free(free, grid)
    return kernel.first_action_costs(
        world, lattice.origin, lattice.rotation, lattice.spacing, lattice.spacing / time_step, reach, steps, lead,
        goal.position, per_axis("human.goal_weight", model.goal_weight, d),
        per_axis("human.effort_weight", model.effort_weight, d), model.goal_cost == "squared", bool(awareness),
        weight, rate, model.danger_decay == "squared_distance", EVERYWHERE if walls is None else walls,
    )  # fmt: skip
