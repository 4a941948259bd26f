"""Where a person will be (Eqs. 4, 6, 7).

lattice = frame_of(model, position, velocity, time_step)
prediction = predict(
model=model, lattice=lattice, goals=[PointGoal((0.0, 5.0))],
weights=[[0.5, 0.5]],                  # (G, 2): P(goal, unconcerned), P(goal, concerned); sums to 1
robot_path=path,                       # (≥ N + M + 1, d) m, instant 0 first; M = max(N_H, 1)
horizon=8, time_step=0.5,
removal=Removal(distance=0.6),         # or None
midway=True,
)
prediction.occupancy.probability           # (N+1, cells…)
prediction.contact                         # (N,)
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sidestep._kernels.push_horizon import Behaviour, Conditions, propagate
from sidestep._kernels.sweep_choices import ValueScratch
from sidestep.errors import InvalidInput
from sidestep.human.actions import ActionSet
from sidestep.human.cost import CostGrid, danger_bounds, danger_terms, embedded_path, row_shape
from sidestep.human.goals import Goal
from sidestep.human.model import HumanModel
from sidestep.human.policy import (
    GoalPolicy,
    admissible_actions,
    embedded_free,
    look_ahead,
    policy_of,
    value_scratch,
)
from sidestep.lattice import Lattice, heading_rotation
from sidestep.types import BoolArray, FloatArray, VectorLike

SINGLE_FROM = 600
"""N_R·M from which values are float32: below, float64 costs no noticeable time."""
LARGEST_ODDS = 8_000_000
"""Probabilities of a finite rationality that are held at a time (64 MB)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Occupancy:
    """Probability over cells at k = 0..N.

    Attributes:
        lattice: the cells; radius reach·N.
        probability: (N+1, cells…), each instant sums to 1.
        time_step: s, between the instants.
    """

    lattice: Lattice
    probability: FloatArray
    time_step: float

    @property
    def shape(self) -> tuple[int, ...]:
        """(N+1, cells…)."""
        return self.probability.shape

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> FloatArray:
        return np.array(self.probability, dtype=dtype) if copy or dtype else self.probability

    def __getitem__(self, key: Any) -> Any:
        return self.probability[key]

    def __len__(self) -> int:
        return len(self.probability)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Removal:
    """Mass that touches the robot at instant k is taken out before k + 1 (first passage).

    Attributes:
        distance: m between centres; contact is anything nearer.
        fractions: (N+1, F) share removed at instant k and distance `step`·i, linear between, 0 beyond (see `spread.profiles`); or
            None: everything nearer than `distance` and nothing else.
        step: m.
    """

    distance: float
    fractions: FloatArray | None = None
    step: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prediction:
    """What `predict` returns; all arrays are read-only.

    Attributes:
        occupancy: mass at k = 0..N.
        action_probabilities: (G, 2, n) P(u | x_0; goal, β) at the first instant (Eq. 4), [:, 1] concerned.
        velocities: (n, d) m/s of these actions in the world frame.
        contact: (N,) P(first contact at k = 1..N) along the robot's path; zeros without removal.
        midway: N arrays, mass at k + ½ on `midway_lattice(k)`; empty if not asked for.
        hypotheses: (G, 2, N+1, cells…) mass of each hypothesis, weight included; None if not asked for or if awareness is resampled.
    """

    occupancy: Occupancy
    action_probabilities: FloatArray
    velocities: FloatArray
    contact: FloatArray
    midway: tuple[FloatArray, ...] = ()
    hypotheses: FloatArray | None = None

    def midway_lattice(self, k: int) -> Lattice:
        """Return the lattice of `midway[k]`: half the spacing, radius reach·(2k + 1)."""
        lattice = self.occupancy.lattice
        reach = lattice.radius // (len(self.occupancy) - 1)
        return Lattice(
            origin=lattice.origin, spacing=lattice.spacing / 2, radius=reach * (2 * k + 1), rotation=lattice.rotation
        )


def frame_of(model: HumanModel, position: VectorLike, velocity: VectorLike | None, time_step: float) -> Lattice:
    """Return the lattice (radius 0) on which a person's actions land.

    Frame "heading": its first axis points along `velocity` ((d,) m/s) and the fastest action reach·v is the observed speed within
    `speed_range`; without a velocity the axes are the world's. Frame "world": the world's axes and v = `walking_speed`.
    """
    origin = np.asarray(position, dtype=np.float64)
    if model.frame == "world":
        return Lattice(origin=origin, spacing=model.walking_speed * time_step, radius=0)
    motion = np.zeros(origin.size) if velocity is None else np.asarray(velocity, dtype=np.float64)
    low, high = model.speed_range
    fastest = min(max(float(np.linalg.norm(motion)), low), high)
    return Lattice(
        origin=origin, spacing=fastest / model.reach * time_step, radius=0, rotation=heading_rotation(motion)
    )


class Workspace:
    """Scratch arrays that `predict` may reuse from call to call (one per thread); results never live in it."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[tuple[object, ...], Any]] = {}

    def values(self, grid: CostGrid) -> ValueScratch:
        """Return arrays for sweeps on `grid`."""
        return self._keep("values", (grid.shape, grid.dimension, grid.dtype), lambda: value_scratch(grid))

    def field(self, reach: int, horizon: int, dimension: int) -> tuple[FloatArray, FloatArray]:
        """Return the field of masses and the lines that `push_horizon.propagate` writes to."""
        return self._keep("field", (reach, horizon, dimension), lambda: _new_field(reach, horizon, dimension))

    def _keep(self, name: str, key: tuple[object, ...], make: Callable[[], Any]) -> Any:
        if self._kept.get(name, ((), None))[0] != key:
            self._kept[name] = (key, make())
        return self._kept[name][1]


def _new_field(reach: int, horizon: int, dimension: int) -> tuple[FloatArray, FloatArray]:
    rows, columns = row_shape(2 * reach * horizon + 1, dimension)
    half_rows = 2 * row_shape(4 * reach * horizon - 2 * reach + 1, dimension)[0]
    return np.zeros((4 * rows + half_rows, columns + 1)), np.zeros((4, columns + 1))


def predict(
    *,
    model: HumanModel,
    lattice: Lattice,
    goals: Sequence[Goal],
    weights: FloatArray | Sequence[Sequence[float]],
    robot_path: FloatArray,
    horizon: int,
    time_step: float,
    removal: Removal | None = None,
    free: BoolArray | None = None,
    midway: bool = False,
    keep_hypotheses: bool = False,
    workspace: Workspace | None = None,
    dtype: DTypeLike | None = None,
) -> Prediction:
    """Push a person's probability mass over the horizon (Eqs. 4, 6, 7).

    Args:
        model: how the person decides.
        lattice: from `frame_of`; its radius is not used.
        goals: G hypotheses.
        weights: (G, 2), joint probability of goal and awareness, [:, 1] concerned; sums to 1.
        robot_path: (≥ N + M + 1, d) m, world frame, instant 0 first, M = max(N_H, 1).
        horizon: N ≥ 1 steps.
        time_step: s.
        removal: first-passage removal along the robot's path, or None.
        free: (cells…) of a lattice of any radius around the same anchor: where a person may be; beyond it everywhere. An action is
            admissible if it ends in a free cell; a person with no admissible action stays.
        midway: also return the mass at mid-steps.
        keep_hypotheses: also return each hypothesis by itself (persistent awareness only).
        workspace: scratch to reuse.
        dtype: of values; by default float64, float32 for long horizons.

    Raises:
        InvalidInput: shapes that do not fit.
    """
    joint = np.asarray(weights, dtype=np.float64)
    if joint.shape != (len(goals), 2):
        raise InvalidInput("weights", joint.shape, f"({len(goals)}, 2)")
    space = workspace or Workspace()
    scene = _Scene.of(model, lattice, goals, robot_path, horizon, time_step, removal, free, space, dtype)
    d, reach = lattice.dimension, model.reach
    rows, width = row_shape(2 * reach * horizon + 1, d)
    results = _Results(
        occupancy=np.zeros(((horizon + 1) * rows, width)),
        contact=np.zeros(horizon),
        halves=np.zeros(int(scene.given.offsets[-1]) if midway else 0),
    )
    kept = np.zeros((len(goals), 2, (horizon + 1) * rows, width)) if keep_hypotheses else None
    first = np.empty((len(goals), 2, (2 * reach + 1) ** d))
    for g, policy in enumerate(scene.policies):
        for beta in (0, 1):
            first[g, beta] = scene.first_actions(policy, beta)
        total = float(joint[g].sum())
        if model.awareness_over_horizon == "resampled" and total > 0:
            scene.push(policy, total, float(joint[g, 1]) / total, results)
            continue
        for beta in (0, 1):
            if joint[g, beta] > 0:
                target = results if kept is None else replace(results, occupancy=kept[g, beta])
                scene.push(policy, float(joint[g, beta]), float(beta), target)
    if kept is not None and model.awareness_over_horizon == "persistent":
        results.occupancy[:] = kept.sum(axis=(0, 1))
    cells = (horizon + 1, *(width,) * d)
    return Prediction(
        occupancy=Occupancy(
            lattice=lattice.with_radius(reach * horizon),
            probability=_read_only(results.occupancy.reshape(cells)),
            time_step=time_step,
        ),
        action_probabilities=_read_only(first),
        velocities=_read_only(action_velocities(model, lattice, time_step)),
        contact=_read_only(results.contact),
        midway=_split(results.halves, scene.given.offsets, reach, d) if midway else (),
        hypotheses=None
        if kept is None or model.awareness_over_horizon == "resampled"
        else _read_only(kept.reshape(len(goals), 2, *cells)),
    )


def first_action_probabilities(
    *,
    model: HumanModel,
    lattice: Lattice,
    goals: Sequence[Goal],
    robot_path: FloatArray,
    horizon: int,
    time_step: float,
    free: BoolArray | None = None,
    workspace: Workspace | None = None,
) -> FloatArray:
    """P(u | x; goal, β) at the anchor now (Eq. 4), (G, 2, n): what `predict` returns, without the push.

    Arguments as for `predict`; `robot_path` needs M + 1 positions. `horizon` is N_H where the model has none of its own.
    """
    model = replace(model, horizon=horizon) if model.horizon is None else model
    scene = _Scene.of(model, lattice, goals, robot_path, 1, time_step, None, free, workspace or Workspace(), None)
    return _read_only(np.array([[scene.first_actions(policy, beta) for beta in (0, 1)] for policy in scene.policies]))


def action_velocities(model: HumanModel, lattice: Lattice, time_step: float) -> FloatArray:
    """(n, d) m/s, the actions in the world frame, in the order of `ActionSet.multiples`."""
    actions = ActionSet(speed=lattice.spacing / time_step, reach=model.reach, dimension=lattice.dimension)
    return actions.velocities @ lattice.rotation.T


@dataclass(frozen=True, slots=True, kw_only=True)
class _Results:
    """What hypotheses add to: occupancy ((N+1)·rows, C), contact (N,), flat mid-steps."""

    occupancy: FloatArray
    contact: FloatArray
    halves: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scene:
    """One person, one robot path, several goals; everything laid out for the kernels."""

    horizon: int
    lead: int
    policies: list[GoalPolicy]
    given: Conditions
    values: ValueScratch
    field: FloatArray
    lines: FloatArray

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
        dtype: DTypeLike | None,
    ) -> _Scene:
        steps, lead = look_ahead(model, horizon)
        d, reach = lattice.dimension, model.reach
        world = np.asarray(robot_path, dtype=np.float64)
        needed = max(horizon + 1, horizon + lead * steps)
        if world.ndim != 2 or world.shape[1] != d or len(world) < needed:
            raise InvalidInput("robot_path", world.shape, f"at least ({needed}, {d})")
        if dtype is None:
            single = horizon * steps >= SINGLE_FROM and np.isinf(model.rationality)
            dtype = np.float32 if single else np.float64
        grid = CostGrid(
            lattice=lattice,
            time_step=time_step,
            reach=reach,
            steps=steps,
            centre=reach * (horizon - 1 + steps),
            dtype=np.dtype(dtype),
        )
        path = embedded_path(lattice, world[:needed])
        radii, bounds = danger_bounds(model, path, grid, horizon, lead)
        danger = danger_terms(model, path, radii, grid)
        walls = embedded_free(free, grid)
        field, lines = space.field(reach, horizon, d)
        return cls(
            horizon=horizon,
            lead=lead,
            policies=[policy_of(model, goal, grid, danger, bounds, walls, reach * (horizon - 1)) for goal in goals],
            given=_conditions(model, grid, path, horizon, removal, walls),
            values=space.values(grid),
            field=field,
            lines=lines,
        )

    def behaviour(self, policy: GoalPolicy, first: int, last: int, minding: bool) -> Behaviour:
        """Sweep what is wanted of one goal's policies first ≤ k < last."""
        nobody = self.given.admissible._replace(masks=np.zeros((1, 0), np.int64))
        concerned = minding and bool(policy.differs[first:last].any())
        return Behaviour(
            policy.mixture,
            policy.tables,
            policy.tables.any(axis=1).astype(np.float64),
            policy.undisturbed(self.given.middle, self.values),
            policy.concerned(first, last, self.lead, self.values) if concerned else nobody,
            policy.differs,
        )

    def push(self, policy: GoalPolicy, weight: float, concerned: float, results: _Results) -> None:
        """Add one hypothesis to the results, as many policies at a time as fit in memory."""
        touched = False
        for first, last in self._stretches(policy):
            touched = propagate(
                self.behaviour(policy, first, last, concerned > 0), self.given, first, last, touched, weight, concerned,
                self.field, self.lines, results.occupancy, results.contact, results.halves,
            )  # fmt: skip

    def _stretches(self, policy: GoalPolicy) -> list[tuple[int, int]]:
        if np.isinf(policy.rationality):
            return [(0, self.horizon)]
        cells = (2 * self.given.reach * np.arange(self.horizon) + 1) ** self.given.dimension
        part = np.cumsum(cells) * (2 * self.given.reach + 1) ** self.given.dimension // LARGEST_ODDS
        starts = np.flatnonzero(np.diff(part, prepend=-1))
        return list(zip(starts.tolist(), [*starts[1:].tolist(), self.horizon], strict=True))

    def first_actions(self, policy: GoalPolicy, beta: int) -> FloatArray:
        """P(u | x; goal, β) at the anchor now, (n,): where unit mass is after one step."""
        nothing = np.zeros((0, 0))
        behaviour = self.behaviour(policy, 0, 1, beta == 1)
        propagate(
            behaviour, self.given, 0, 1, False, 1.0, float(beta), self.field, self.lines, nothing, np.zeros(1), np.zeros(0),
        )  # fmt: skip
        d, centre, reach = self.given.dimension, self.given.centre, self.given.reach
        width = 2 * centre + 1
        rows = width ** (d - 1)
        moved = self.field[rows : 2 * rows].reshape(*(width,) * (d - 1), -1)
        return moved[(slice(centre - reach, centre + reach + 1),) * d].ravel()


def _conditions(
    model: HumanModel,
    grid: CostGrid,
    path: FloatArray,
    horizon: int,
    removal: Removal | None,
    walls: BoolArray | None,
) -> Conditions:
    d, reach = grid.dimension, grid.reach
    count, middle = 2 * reach + 1, reach * (horizon - 1)
    sizes = [(2 * reach * (2 * k + 1) + 1) ** d for k in range(horizon)]
    fractions = np.zeros((1, 0)) if removal is None or removal.fractions is None else removal.fractions
    uniform = np.full((3 * count, 2 * middle + 1), 1.0 / count)
    return Conditions(
        dimension=d,
        reach=reach,
        spacing=grid.lattice.spacing,
        randomness=float(model.randomness),
        uniform=uniform if walls is None else uniform[:0],
        admissible=admissible_actions(grid, walls, horizon),
        same=np.repeat(np.eye(count)[None], 3, axis=0),
        centre=reach * horizon,
        middle=middle,
        half_centre=2 * middle + reach,
        path=path,
        contact=-1.0 if removal is None else float(removal.distance),
        fractions=np.ascontiguousarray(fractions, dtype=np.float64),
        fraction_step=1.0 if removal is None else float(removal.step),
        offsets=np.cumsum([0, *sizes]),
    )


def _split(halves: FloatArray, offsets: NDArray[np.int64], reach: int, d: int) -> tuple[FloatArray, ...]:
    return tuple(
        _read_only(halves[start:stop].reshape((2 * reach * (2 * k + 1) + 1,) * d))
        for k, (start, stop) in enumerate(itertools.pairwise(offsets))
    )


def _read_only(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
