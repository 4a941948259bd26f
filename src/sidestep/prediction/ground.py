"""One person's cells, walls and goals: all of a prediction that the robot's motion leaves as it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sidestep._kernels.sweep_choices import Choices
from sidestep.human.cost import CostGrid
from sidestep.human.goals import Goal
from sidestep.human.intent import Intent, intent_of
from sidestep.human.model import HumanModel
from sidestep.human.policy import admissible_actions, boxes, embedded_free, look_ahead, undisturbed, words_of
from sidestep.lattice import Lattice
from sidestep.prediction.workspace import Workspace
from sidestep.types import BoolArray, IntArray

SINGLE_FROM = 200
"""N_R·M from which values are float32: below, float64 costs little time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """What predictions of one person at one time have in common, whatever the robot does.

    Attributes:
        model: how the person decides; grid: cells and stages.
        horizon: N; lead: 1 if the robot is anticipated, else 0.
        intents: one per goal.
        random: masks of the actions of a person among walls who acts at random; None: no walls.
    """

    model: HumanModel
    grid: CostGrid
    horizon: int
    lead: int
    intents: tuple[Intent, ...]
    random: IntArray | None
    _calm: dict[int, Choices] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        model: HumanModel,
        lattice: Lattice,
        goals: Sequence[Goal],
        horizon: int,
        time_step: float,
        free: BoolArray | None = None,
        dtype: type[np.float32] | type[np.float64] | None = None,
    ) -> Ground:
        """Lay it out; arguments as for `predict`."""
        steps, lead = look_ahead(model, horizon)
        reach = model.reach
        if dtype is None:
            dtype = np.float32 if horizon * steps >= SINGLE_FROM and math.isinf(model.rationality) else np.float64
        grid = CostGrid(
            lattice=lattice,
            time_step=time_step,
            reach=reach,
            steps=steps,
            centre=reach * (horizon - 1 + steps),
            dtype=dtype,
        )
        walls = embedded_free(free, grid)
        radius = reach * (horizon - 1)
        return cls(
            model=model,
            grid=grid,
            horizon=horizon,
            lead=lead,
            intents=tuple(intent_of(model, goal, grid, walls, radius) for goal in goals),
            random=None if walls is None else admissible_actions(grid, walls, horizon).masks,
        )

    def calm(self, goal: int, space: Workspace) -> Choices:
        """Choices of the perfectly rational person with this goal who does not mind the robot, at every instant."""
        if goal not in self._calm:
            grid, intent = self.grid, self.intents[goal]
            radius, words = grid.reach * (self.horizon - 1), words_of(grid.reach, grid.dimension)
            room = boxes([radius], grid.dimension, words, intent.layers * words)
            self._calm[goal] = undisturbed(intent, self.horizon, space.values(grid), room)
        return self._calm[goal]
