"""One person, one robot path, several hypotheses: laid out for the kernels, swept, pushed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sidestep._kernels.push_evenly import add_midway
from sidestep._kernels.push_horizon import Behaviour, Conditions, propagate
from sidestep._kernels.push_sections import contact_shares
from sidestep._kernels.risk_profile import blob_table, profiles
from sidestep._kernels.sweep_choices import Choices, ValueScratch
from sidestep.errors import InvalidInput
from sidestep.human.cost import CostGrid, danger_terms, row_shape
from sidestep.human.goals import Goal
from sidestep.human.model import HumanModel
from sidestep.human.policy import (
    GoalPolicy,
    admissible_actions,
    boxes,
    embedded_free,
    look_ahead,
    policy_of,
    value_scratch,
    words_of,
)
from sidestep.lattice import Lattice
from sidestep.types import BoolArray, FloatArray, IntArray

SINGLE_FROM = 200
"""N_R·M from which values are float32: below, float64 costs little time."""
LARGEST_ODDS = 8_000_000
"""Probabilities of a finite rationality that are held at a time (64 MB)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Removal:
    """Mass that touches the robot at instant k is taken out before k + 1 (first passage).

    Attributes:
        distance: m between centres; contact is anything nearer.
        weights: (C,) of the Gaussians that spread the person's position around the lattice, or None: nothing does.
        sigmas: (N+1, C) m, their standard deviations at k = 0..N; the share removed is then P(nearer than `distance`).
        profile: of `risk_profile.profiles` for these, where it is known already.
    """

    distance: float
    weights: FloatArray | None = None
    sigmas: FloatArray | None = None
    profile: tuple[FloatArray, FloatArray] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """What hypotheses add to: flat blocks of mass (or size 0) and contact (N,)."""

    blocks: FloatArray
    contact: FloatArray


_NO_ACTIONS = np.zeros(0)
_NOT_SPREAD = np.zeros((1, 0)), np.zeros((1, 4))


class Workspace:
    """Scratch arrays that `predict` may reuse from call to call (one per thread); results never live in it."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[object, Any]] = {}

    def values(self, grid: CostGrid) -> ValueScratch:
        """Return arrays for sweeps on `grid`."""
        return self._keep("values", (grid.shape, grid.dimension, grid.dtype), lambda: value_scratch(grid))

    def choices(self, name: str, radii: list[int], dimension: int, words: int, layers: int) -> Choices:
        """Return choices for boxes of these radii."""
        key = (radii, dimension, words, layers)
        return self._keep(name, key, lambda: boxes(radii, dimension, words, layers * words))

    def constants(self, reach: int, horizon: int, dimension: int) -> Constants:
        """Return what depends on sizes alone."""
        return self._keep("constants", (reach, horizon, dimension), lambda: _constants(reach, horizon, dimension))

    def _keep(self, name: str, key: object, make: Callable[[], Any]) -> Any:
        if name not in self._kept or self._kept[name][0] != key:
            self._kept[name] = (key, make())
        return self._kept[name][1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Constants:
    """What depends on sizes alone: scratch (see `propagate`; contact shares; nobody reads `nowhere`) and constants.

    The mass at half instants 0..2N makes up blocks, flat, of `radii` cells from the anchor; they begin at `offsets`,
    or at `step_offsets` where those of mid-steps are empty.
    """

    field: FloatArray
    scratch: FloatArray
    line: FloatArray
    lost: IntArray
    nowhere: Results
    shares: FloatArray
    offsets: IntArray
    step_offsets: IntArray
    radii: IntArray
    nobody: Choices


def _constants(reach: int, horizon: int, dimension: int) -> Constants:
    rows, columns = row_shape(2 * reach * horizon + 1, dimension)
    few, wide = 2 * reach * (horizon - 1) + 1, 2 * reach * (2 * horizon - 1) + 1
    room = max(rows * columns, few ** min(dimension - 1, 1) * wide ** max(dimension - 1, 1))
    radii = [reach * (b if b % 2 else b // 2) for b in range(2 * horizon + 1)]
    sizes = [(2 * r + 1) ** dimension for r in radii]
    return Constants(
        field=np.zeros((4 * rows, columns)),
        scratch=np.zeros((2, room)),
        line=np.zeros(columns + 4 * reach),
        lost=np.zeros(6, np.int64),
        nowhere=Results(blocks=np.zeros(0), contact=np.zeros(1)),
        shares=np.empty(sum((2 * reach * k + 1) ** dimension for k in range(1, horizon + 1))),
        offsets=np.cumsum(np.array([0, *sizes]), dtype=np.int64),
        step_offsets=np.cumsum(np.array([0, *(0 if b % 2 else size for b, size in enumerate(sizes))]), dtype=np.int64),
        radii=np.array(radii, dtype=np.int64),
        nobody=boxes([0] * horizon, dimension, words_of(reach, dimension), 0),
    )


class Scene:
    """One person, one robot path, several goals; everything laid out for the kernels."""

    def __init__(
        self,
        policies: list[GoalPolicy],
        given: Conditions,
        space: Workspace,
        constants: Constants,
        horizon: int,
        lead: int,
    ) -> None:
        self.given = given
        self._policies = policies
        self._space = space
        self._constants = constants
        self._horizon = horizon
        self._lead = lead
        self._swept: tuple[int, int, int, bool] | None = None
        self._behaviour: Behaviour | None = None
        self._calm: tuple[int, Choices] | None = None

    @classmethod
    def of(
        cls,
        model: HumanModel,
        lattice: Lattice,
        goals: Sequence[Goal],
        robot_path: FloatArray,
        horizon: int,
        time_step: float,
        removal: Removal | None,
        free: BoolArray | None,
        space: Workspace,
        dtype: type[np.float32] | type[np.float64] | None,
        randomness: float | None = None,
        others: FloatArray | None = None,
        midway: bool = False,
    ) -> Scene:
        """Lay out everything; arguments as for `predict`."""
        steps, lead = look_ahead(model, horizon)
        d, reach = lattice.dimension, model.reach
        world = np.ascontiguousarray(robot_path, dtype=np.float64)
        needed = max(horizon + 1, horizon + lead * steps)
        if world.ndim != 2 or world.shape[1] != d or len(world) < needed:
            raise InvalidInput("robot_path", world.shape, f"at least ({needed}, {d})")
        if dtype is None:
            dtype = np.float32 if horizon * steps >= SINGLE_FROM and np.isinf(model.rationality) else np.float64
        grid = CostGrid(
            lattice=lattice,
            time_step=time_step,
            reach=reach,
            steps=steps,
            centre=reach * (horizon - 1 + steps),
            dtype=dtype,
        )
        company = None if others is None else others[:, :needed]
        danger = danger_terms(model, world[:needed], grid, horizon, lead, others=company)
        walls = embedded_free(free, grid)
        constants = space.constants(reach, horizon, d)
        policies = [policy_of(model, goal, grid, danger, walls, reach * (horizon - 1)) for goal in goals]
        random = model.randomness if randomness is None else randomness
        given = _conditions(random, grid, danger.path, horizon, removal, walls, midway, constants)
        return cls(policies, given, space, constants, horizon, lead)

    @property
    def offsets(self) -> IntArray:
        """(2N+2,) where the blocks at half instants begin; those of mid-steps are empty unless they are wanted."""
        return self.given.offsets

    @property
    def radii(self) -> IntArray:
        """(2N+1,) cells from the anchor to the faces of each block."""
        return self._constants.radii

    def push(
        self, goal: int, weight: float, concerned: float, results: Results, actions: FloatArray | None = None
    ) -> None:
        """Add one hypothesis to the results, as many policies at a time as fit; `actions`: see `propagate`."""
        for first, last in self._stretches(self._policies[goal]):
            self._propagate(goal, first, last, weight, concerned, results, actions)

    def add_midway(self, blocks: FloatArray) -> None:
        """Add to the mid-steps, once all hypotheses are in, what moves at random."""
        given, own = self.given, self._constants
        add_midway(
            blocks, given.offsets, given.reach, given.dimension, given.randomness, given.walls, given.middle,
            own.scratch, own.line,
        )  # fmt: skip

    def unmoved(self, goal: int) -> bool:
        """Whether the robot provably changes nothing that a person with this goal does."""
        return not self._policies[goal].differs.any()

    def first_actions(self, goal: int, beta: float, actions: FloatArray) -> None:
        """Write P(u | x; goal, β) at the anchor now into `actions` (n,)."""
        self._propagate(goal, 0, 1, 1.0, beta, self._constants.nowhere, actions)

    def _propagate(
        self,
        goal: int,
        first: int,
        last: int,
        weight: float,
        concerned: float,
        results: Results,
        actions: FloatArray | None,
    ) -> None:
        own, behaviour = self._constants, self._behave(goal, first, last, concerned > 0)
        calm, minding = behaviour.undisturbed, behaviour.concerned
        propagate(
            behaviour.mixture, behaviour.tables, behaviour.used, behaviour.differs, calm.words, calm.radii,
            calm.offsets, calm.masks, calm.odds, minding.radii, minding.offsets, minding.masks, minding.odds,
            *self.given, first, last, weight, concerned, own.field, own.scratch, own.line, own.lost, results.blocks,
            results.contact, _NO_ACTIONS if actions is None else actions,
        )  # fmt: skip

    def _behave(self, goal: int, first: int, last: int, minding: bool) -> Behaviour:
        """Sweep what is needed of one goal's policies first ≤ k < last, unless the last thing swept covers it."""
        if self._behaviour is None or not self._covered(goal, first, last, minding):
            policy = self._policies[goal]
            self._swept = (goal, first, last, minding)
            self._behaviour = Behaviour(
                policy.actions.mixture,
                policy.tables,
                policy.used,
                self._undisturbed(goal, self.given.reach * (last - 1)),
                self._concerned(policy, first, last) if minding else self._constants.nobody,
                policy.differs,
            )
        return self._behaviour

    def _covered(self, goal: int, first: int, last: int, minding: bool) -> bool:
        if self._swept is None:
            return False
        known, begin, end, heeded = self._swept
        return goal == known and begin <= first and last <= end and heeded >= minding

    def _concerned(self, policy: GoalPolicy, first: int, last: int) -> Choices:
        if not policy.differs[first:last].any():
            return self._constants.nobody
        radii = [policy.grid.reach * k for k in range(self._horizon)]
        choices = self._room("concerned", policy, radii, first, last)
        policy.sweep(True, first, last, self._lead, policy.differs, self._space.values(policy.grid), choices)
        return choices

    def _undisturbed(self, goal: int, radius: int) -> Choices:
        policy = self._policies[goal]
        if policy.tables.size > 0:
            return self._constants.nobody
        if self._calm is not None and self._calm[0] == goal and self._calm[1].radii[0] >= radius:
            return self._calm[1]
        one = self._room("undisturbed", policy, [radius], 0, 1)
        policy.sweep(False, 0, 1, 0, np.ones(1, np.bool_), self._space.values(policy.grid), one)
        offsets = np.zeros(self._horizon, np.int64)
        self._calm = goal, one._replace(radii=np.full(self._horizon, radius), offsets=offsets)
        return self._calm[1]

    def _room(self, name: str, policy: GoalPolicy, radii: list[int], first: int, last: int) -> Choices:
        """Masks from the workspace, or odds for the policies first ≤ k < last alone."""
        d, reach = policy.grid.dimension, policy.grid.reach
        words = words_of(reach, d)
        if np.isinf(policy.rationality):
            return self._space.choices(name, radii, d, words, policy.layers)
        sizes = [(2 * r + 1) ** d if first <= k < last else 0 for k, r in enumerate(radii)]
        ends = np.cumsum(np.array(sizes, dtype=np.int64))
        odds = np.zeros(((2 * reach + 1) ** d, int(ends[-1])))
        return Choices(np.array(radii), ends - sizes, words, np.zeros((words, 0), np.int64), odds)

    def _stretches(self, policy: GoalPolicy) -> list[tuple[int, int]]:
        if np.isinf(policy.rationality):
            return [(0, self._horizon)]
        reach, d = self.given.reach, self.given.dimension
        cells = (2 * reach * np.arange(self._horizon) + 1) ** d
        part = np.cumsum(cells) * (2 * reach + 1) ** d // LARGEST_ODDS
        starts = [int(k) for k in np.flatnonzero(np.diff(part, prepend=-1))]
        return list(zip(starts, [*starts[1:], self._horizon], strict=True))


def _conditions(
    randomness: float,
    grid: CostGrid,
    path: FloatArray,
    horizon: int,
    removal: Removal | None,
    walls: BoolArray | None,
    midway: bool,
    constants: Constants,
) -> Conditions:
    reach = grid.reach
    middle = reach * (horizon - 1)
    boxes = np.empty((0 if removal is None else horizon + 1, 7), np.int64)
    if removal is not None:
        samples, grids = _contact_profiles(removal, horizon, grid.dimension)
        contact_shares(
            path, grid.lattice.spacing, reach, grid.dimension, float(removal.distance), samples, grids, boxes,
            constants.shares,
        )  # fmt: skip
    return Conditions(
        dimension=grid.dimension,
        reach=reach,
        randomness=float(randomness),
        walls=constants.nobody.masks if walls is None else admissible_actions(grid, walls, horizon).masks,
        centre=reach * horizon,
        middle=middle,
        boxes=boxes,
        shares=constants.shares,
        offsets=constants.offsets if midway else constants.step_offsets,
        midway=midway,
    )


def _contact_profiles(removal: Removal, horizon: int, dimension: int) -> tuple[FloatArray, FloatArray]:
    if removal.weights is None or removal.sigmas is None:
        return _NOT_SPREAD
    sigmas = np.ascontiguousarray(removal.sigmas, dtype=np.float64)
    weights = np.ascontiguousarray(removal.weights, dtype=np.float64)
    if weights.ndim != 1 or sigmas.shape != (horizon + 1, weights.size):
        raise InvalidInput("removal.sigmas", sigmas.shape, f"({horizon + 1}, {weights.size})")
    if removal.profile is not None:
        return removal.profile
    return profiles(float(removal.distance), weights, sigmas, blob_table(dimension))
