"""Best actions everywhere, by backward induction (Eqs. 2 and 5).

Policy k says what a person does at instant k. It charges the M = max(N_H, 1) predicted states after it; with N_H = 0
the robot is taken to stay where it is at k, otherwise it is anticipated. One sweep gives the optimal first action
from every cell.

A `DirectionGoal` whose velocity lies between actions is kept on average: its deliberate action is the mixture of the
two neighbouring actions per axis that has exactly that mean. A person who minds the robot deviates per axis: along an
axis where the best component is the undisturbed one there is no reason to deviate, and the mixture stays; elsewhere
the best component itself is taken. So β = 0 and β = 1 agree exactly where the robot does not matter. A finite
rationality spreads the choice by itself: then Eq. 5's Boltzmann form is kept as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sidestep._kernels.sweep import CostTables, Values, sweep
from sidestep._kernels.sweep_choices import Choices, ValueScratch, choose, mark_admissible
from sidestep._kernels.sweep_marks import WORD
from sidestep._kernels.sweep_near import NearScratch, choose_near
from sidestep.errors import InvalidInput
from sidestep.human.cost import TIE, CostGrid, DangerTerms, action_terms, danger_terms, goal_terms
from sidestep.human.goals import Goal, SlowingGoal, StandGoal
from sidestep.human.intent import Intent
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray

NEAR_FROM = 300
"""N·M from which it pays to look for where the robot makes a difference before anything is swept."""
_ONCE = np.ones(1, np.bool_)


def look_ahead(model: HumanModel, horizon: int) -> tuple[int, int]:
    """(M, lead): actions that a person looks ahead, and 1 if they anticipate the robot's motion (N_H ≥ 1), else 0."""
    prediction = horizon if model.horizon is None else model.horizon
    return max(prediction, 1), min(prediction, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalPolicy:
    """What a person with one goal would do near the robot, ready to be swept.

    Attributes:
        intent: the goal; costs: of its stages, the danger's with them.
        differs: (N,) False where the danger provably changes no action of policy k.
    """

    intent: Intent
    costs: CostTables
    differs: BoolArray

    @property
    def felt_near_by(self) -> bool:
        """Whether `sweep_near` may be asked, and may be worth it."""
        enough = len(self.differs) * self.intent.grid.steps >= NEAR_FROM
        product = self.costs.danger_axes.shape[1] > 1 and self.costs.danger_table.size == 0
        return enough and product and self.intent.grid.dimension == 2 and math.isinf(self.intent.rationality)

    def sweep_near(self, lead: int, scratch: NearScratch, choices: Choices) -> bool:
        """Write what `sweep` does with danger for all policies that differ; False: felt in too many places for it."""
        grid, intent, costs = self.intent.grid, self.intent, self.costs
        return choose_near(
            costs.goal_axes, costs.goal_table, costs.danger_axes, intent.actions.taps, lead, self.differs, grid.centre,
            grid.tolerance, 0.5 * intent.negligible / grid.steps, intent.free, intent.actions.mixture, *scratch,
            *choices,
        )  # fmt: skip

    def sweep(
        self, danger: bool, first: int, last: int, lead: int, wanted: BoolArray, scratch: ValueScratch, choices: Choices
    ) -> None:
        """Write the choices of the policies first ≤ k < last that are `wanted`, with the danger term or without."""
        grid, intent = self.intent.grid, self.intent
        choose(
            *self.costs, intent.actions.taps, danger, lead, first, last, wanted, grid.centre, grid.dimension,
            grid.tolerance, intent.rationality, intent.free, intent.actions.mixture, *scratch, *choices,
        )  # fmt: skip


def policy_of(intent: Intent, danger: DangerTerms) -> GoalPolicy:
    """Return what somebody with this intent does under the `danger` (from `danger_terms`)."""
    grid, actions = intent.grid, intent.actions
    if intent.heedless:
        differs = np.zeros(len(danger.bounds), np.bool_)
    elif actions.margin > 0 and intent.free.size == 0:
        # Danger ≥ 0: the undisturbed choice costs at most the bound more, every other at least the margin more than
        # it did.
        differs = danger.bounds >= actions.margin - 10 * grid.tolerance * (actions.cheapest + actions.margin)
    else:
        differs = danger.bounds > intent.negligible
    costs = CostTables(intent.axes, intent.table, danger.axes, danger.table)
    return GoalPolicy(intent=intent, costs=costs, differs=differs)


def undisturbed(intent: Intent, horizon: int, scratch: ValueScratch, room: Choices) -> Choices:
    """Return the choices of whoever does not mind the robot, the same at every instant; `room` has a single box."""
    nothing = np.ones((3, 1), intent.grid.dtype), np.zeros((0, 0), intent.grid.dtype)
    calm = GoalPolicy(intent=intent, costs=CostTables(intent.axes, intent.table, *nothing), differs=_ONCE)
    calm.sweep(False, 0, 1, 0, _ONCE, scratch, room)
    return room._replace(radii=np.full(horizon, room.radii[0]), offsets=np.zeros(horizon, np.int64))


def words_of(reach: int, dimension: int) -> int:
    """Words that hold one bit per action."""
    return -(-((2 * reach + 1) ** dimension) // WORD)


def boxes(radii: list[int], dimension: int, words: int, rows: int) -> Choices:
    """Return cleared choices for boxes of these radii, one after another."""
    sizes = [(2 * r + 1) ** dimension for r in radii]
    ends = np.cumsum(np.array(sizes, dtype=np.int64))
    masks = np.zeros((rows, int(ends[-1])), np.int64)
    return Choices(np.array(radii), ends - sizes, words, masks, np.zeros((0, 0)))


def admissible_actions(grid: CostGrid, free: BoolArray, horizon: int) -> Choices:
    """Return the choices of a person among walls who acts at random, the same at every instant."""
    d, reach = grid.dimension, grid.reach
    radius, words = reach * (horizon - 1), words_of(reach, d)
    masks = np.zeros((words, (2 * radius + 1) ** d), np.int64)
    mark_admissible(free, grid.centre, d, reach, radius, masks)
    return Choices(np.full(horizon, radius), np.zeros(horizon, np.int64), words, masks, np.zeros((0, 0)))


def value_scratch(grid: CostGrid) -> ValueScratch:
    """Return arrays for sweeps on `grid`."""
    rows, columns = grid.shape
    plane = np.zeros((rows if grid.dimension == 3 else 0, columns), grid.dtype)
    even, odd = np.zeros((rows, columns), grid.dtype), np.zeros((rows, columns), grid.dtype)
    return ValueScratch(even, odd, plane, np.zeros((3, columns), grid.dtype))


def near_scratch(grid: CostGrid, values: ValueScratch, horizon: int, words: int) -> NearScratch:
    """Return arrays for `GoalPolicy.sweep_near` over `horizon` policies with `words` rows of bits, and `values`."""
    rows, columns = grid.shape
    return NearScratch(
        even=values.even,
        odd=values.odd,
        near=np.zeros((rows, columns), grid.dtype),
        lines=values.lines,
        kept=np.zeros(rows * columns, grid.dtype),
        pool=np.zeros((2, 4 * rows * columns), grid.dtype),
        parts=np.zeros((2, horizon, rows + 1, 2), np.int64),
        felt=np.zeros((horizon + grid.steps, rows + 1, 2), np.int64),
        calm=np.zeros((words, (2 * grid.reach * (horizon - 1) + 1) ** 2), np.int64),
    )


def embedded_free(free: BoolArray | None, grid: CostGrid) -> BoolArray | None:
    """`free` (cells…) of any odd width → the same on the rows and columns of `grid`; cells beyond it are free."""
    if free is None:
        return None
    given = np.asarray(free, dtype=np.bool_)
    d, centre = grid.dimension, grid.centre
    if given.ndim != d or len(set(given.shape)) != 1 or given.shape[0] % 2 == 0:
        raise InvalidInput("free", given.shape, f"{d} equal odd sizes (the cells of a lattice)")
    radius = given.shape[0] // 2
    whole = np.ones((2 * centre + 1,) * d, dtype=np.bool_)
    kept = min(radius, centre)
    whole[(slice(centre - kept, centre + kept + 1),) * d] = given[(slice(radius - kept, radius + kept + 1),) * d]
    return whole.reshape(grid.shape)


def action_values(
    model: HumanModel,
    lattice: Lattice,
    goal: Goal,
    robot_path: FloatArray,
    awareness: int,
    time_step: float,
    free: BoolArray | None = None,
    others: FloatArray | None = None,
) -> FloatArray:
    """Least cost of every first action from every cell (Eq. 2): Q (cells…, n).

    The cost sums the goal and danger terms of the M = max(N_H, 1) predicted states and the effort of the M actions;
    the state now, which no action changes, is not charged. `StandGoal`: zero for action 0, +inf otherwise.
    `SlowingGoal`: of its mean pace, the robot unheeded; without walls its actions follow from the place instead.

    Args:
        model: `horizon` None takes the length of `robot_path` less one.
        lattice: cells wanted; spacing = v·ΔT.
        goal: what the person is heading for.
        robot_path: (≥ N_H + 1, d) m, world frame, instant 0 first.
        awareness: β, 0 or 1.
        time_step: s.
        free: (cells…) of a lattice of any radius with the same anchor: cells a person may occupy; beyond it all are.
        others: (P, ≥ N_H + 1, d) m, other people at the same instants, minded if `repulsion_weight` > 0; or None.

    Raises:
        InvalidInput: the path is too short, or shapes do not fit.
    """
    world = np.atleast_2d(np.asarray(robot_path, dtype=np.float64))
    steps, lead = look_ahead(model, len(world) - 1)
    if len(world) < steps * lead + 1:
        raise InvalidInput("robot_path", world.shape, f"at least {steps * lead + 1} positions")
    reach, d = model.reach, lattice.dimension
    if isinstance(goal, StandGoal):
        count = (2 * reach + 1) ** d
        values = np.full((*lattice.shape, count), np.inf)
        values[..., count // 2] = 0.0
        return values
    if isinstance(goal, SlowingGoal):
        goal, awareness = goal.held(steps * time_step), 0
    centre = lattice.radius + reach * steps
    grid = CostGrid(lattice=lattice, time_step=time_step, reach=reach, steps=steps, centre=centre)
    kept = lead * steps + 1
    company = None if others is None else others[:, :kept]
    danger = danger_terms(model, np.ascontiguousarray(world[:kept]), grid, 1, lead, lattice.radius, company)
    taps = action_terms(model, goal, grid, 1).taps
    costs = CostTables(*goal_terms(model, goal, grid, embedded_free(free, grid)), danger.axes, danger.table)
    arrive = sweep(costs, lead, bool(awareness), taps, lattice.radius, centre, d, *value_scratch(grid))
    return _first_actions(arrive, taps[0], lattice, reach, centre)


def _first_actions(arrive: Values, taps: Values, lattice: Lattice, reach: int, centre: int) -> FloatArray:
    d = lattice.dimension
    cells = arrive.reshape((2 * centre + 1,) * d)
    first, last = centre - lattice.radius - reach, centre + lattice.radius + reach
    reached = sliding_window_view(cells[(slice(first, last + 1),) * d], (2 * reach + 1,) * d)  # (cells…, actions…)
    effort = reduce(np.add.outer, taps[3 - d :])
    return (reached + effort).reshape(*lattice.shape, -1)


def best_actions(
    model: HumanModel,
    lattice: Lattice,
    goal: Goal,
    robot_path: FloatArray,
    awareness: int,
    time_step: float,
    free: BoolArray | None = None,
) -> BoolArray:
    """Support of P_d (Eq. 5): bool (cells…, n), the minimisers of `action_values`, ties within 1e-6 relative."""
    values = action_values(model, lattice, goal, robot_path, awareness, time_step, free)
    best = values.min(axis=-1, keepdims=True)
    limit = np.where(np.isfinite(best), best + TIE * np.abs(best) + 1e-12, -np.inf)
    return values <= limit
