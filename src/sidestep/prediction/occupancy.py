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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sidestep._kernels.push_horizon import Conditions, Policy, Scratch, first_choice, propagate, undisturbed_values
from sidestep.errors import InvalidInput
from sidestep.human.actions import ActionSet
from sidestep.human.cost import CostGrid, danger_bounds, danger_terms, embedded_path, row_shape
from sidestep.human.goals import Goal
from sidestep.human.model import HumanModel
from sidestep.human.policy import embedded_free, look_ahead, policy_of, tolerance
from sidestep.lattice import Lattice, heading_rotation
from sidestep.types import BoolArray, FloatArray, VectorLike

SINGLE_FROM = 600
"""N_R·M from which values are float32: below, float64 costs no noticeable time."""


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
        self._key: tuple[object, ...] = ()
        self._scratch: Scratch | None = None

    def scratch(self, grid: CostGrid, horizon: int, midway: bool) -> Scratch:
        """Return arrays for this size: those of the last call if it had the same."""
        key = (grid.shape, grid.reach, grid.dtype, horizon, midway)
        if self._scratch is None or self._key != key:
            self._key, self._scratch = key, _new_scratch(grid, horizon, midway)
        return self._scratch


def _new_scratch(grid: CostGrid, horizon: int, midway: bool) -> Scratch:
    d, reach, (rows, columns) = grid.dimension, grid.reach, grid.shape
    count = 2 * reach + 1
    mass = row_shape(2 * reach * horizon + 1, d)
    width = 4 * reach * horizon - 2 * reach + 1
    half = (2 * row_shape(width, d)[0], width // 2 + 1) if midway else (0, width // 2 + 1)
    return Scratch(
        even=np.zeros((rows, columns), grid.dtype),
        odd=np.zeros((rows, columns), grid.dtype),
        plane=np.zeros((columns if d == 3 else 0, columns), grid.dtype),
        lines=np.zeros((3, columns), grid.dtype),
        values=np.zeros((count**d, mass[1]), grid.dtype),
        counts=np.zeros((2, mass[1]), grid.dtype),
        mass=np.zeros(mass),
        moved=np.zeros(mass),
        alive=np.zeros(mass),
        moved_alive=np.zeros(mass),
        half=np.zeros(half),
        parts=np.zeros((2, mass[1] + 1)),
        choice=np.zeros((count, count, count)),
    )


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
    grid, policies, given, scratch = _prepare(
        model, lattice, goals, robot_path, horizon, time_step, removal, free, midway, workspace or Workspace(), dtype
    )
    d, reach = grid.dimension, grid.reach
    occupancy = np.zeros((horizon + 1, *row_shape(2 * reach * horizon + 1, d)))
    contact = np.zeros(horizon)
    halves = np.zeros(int(given.offsets[-1]) if midway else 0)
    kept = np.zeros((len(goals), 2, *occupancy.shape)) if keep_hypotheses else None
    for g, policy in enumerate(policies):
        if model.awareness_over_horizon == "resampled":
            if joint[g].sum() > 0:
                concerned = float(joint[g, 1] / joint[g].sum())
                propagate(policy, given, scratch, float(joint[g].sum()), concerned, occupancy, contact, halves)
            continue
        for beta in (0, 1):
            if joint[g, beta] > 0:
                target = occupancy if kept is None else kept[g, beta]
                propagate(policy, given, scratch, float(joint[g, beta]), float(beta), target, contact, halves)
    if kept is not None and model.awareness_over_horizon == "persistent":
        occupancy = kept.sum(axis=(0, 1))
    real = (2 * reach * horizon + 1,) * d
    return Prediction(
        occupancy=Occupancy(
            lattice=lattice.with_radius(reach * horizon),
            probability=_read_only(occupancy.reshape(horizon + 1, *real)),
            time_step=time_step,
        ),
        action_probabilities=_read_only(_first_probabilities(grid, policies, given, scratch)),
        velocities=_read_only(action_velocities(model, lattice, time_step)),
        contact=_read_only(contact),
        midway=_split(halves, given.offsets, reach, d) if midway else (),
        hypotheses=None
        if kept is None or model.awareness_over_horizon == "resampled"
        else _read_only(kept.reshape(len(goals), 2, horizon + 1, *real)),
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
    """P(u | x; goal, β) at the anchor now (Eq. 4), (G, 2, n): what `predict` returns, without the push."""
    model = replace(model, horizon=horizon) if model.horizon is None else model
    grid, policies, given, scratch = _prepare(
        model, lattice, goals, robot_path, 1, time_step, None, free, False, workspace or Workspace(), None
    )
    return _read_only(_first_probabilities(grid, policies, given, scratch))


def action_velocities(model: HumanModel, lattice: Lattice, time_step: float) -> FloatArray:
    """(n, d) m/s, the actions in the world frame, in the order of `ActionSet.multiples`."""
    actions = ActionSet(speed=lattice.spacing / time_step, reach=model.reach, dimension=lattice.dimension)
    return actions.velocities @ lattice.rotation.T


def _prepare(
    model: HumanModel,
    lattice: Lattice,
    goals: Sequence[Goal],
    robot_path: FloatArray,
    horizon: int,
    time_step: float,
    removal: Removal | None,
    free: BoolArray | None,
    midway: bool,
    workspace: Workspace,
    dtype: DTypeLike | None,
) -> tuple[CostGrid, list[Policy], Conditions, Scratch]:
    steps, lead = look_ahead(model, horizon)
    d, reach = lattice.dimension, model.reach
    world = np.asarray(robot_path, dtype=np.float64)
    needed = max(horizon + 1, horizon + lead * steps)
    if world.ndim != 2 or world.shape[1] != d or len(world) < needed:
        raise InvalidInput("robot_path", world.shape, f"at least ({needed}, {d})")
    if dtype is None:
        single = horizon * steps >= SINGLE_FROM and np.isinf(model.rationality)
        dtype = np.float32 if single else np.float64
    centre = reach * (horizon - 1 + steps)
    grid = CostGrid(
        lattice=lattice, time_step=time_step, reach=reach, steps=steps, centre=centre, dtype=np.dtype(dtype)
    )
    path = embedded_path(lattice, world[:needed])
    radii, bounds = danger_bounds(model, path, grid, horizon, lead)
    danger = danger_terms(model, path, radii, grid)
    walls = embedded_free(free, grid)
    middle = reach * (horizon - 1)
    policies = [policy_of(model, goal, grid, danger, bounds, walls, middle, lead) for goal in goals]
    scratch = workspace.scratch(grid, horizon, midway)
    given = _conditions(model, grid, path, horizon, removal, walls, midway)
    for index, policy in enumerate(policies):
        if policy.tables.size == 0:
            static = np.empty(grid.shape, grid.dtype)
            undisturbed_values(policy, given, middle, scratch, static)
            policies[index] = policy._replace(static=static)
    return grid, policies, given, scratch


def _conditions(
    model: HumanModel,
    grid: CostGrid,
    path: FloatArray,
    horizon: int,
    removal: Removal | None,
    walls: BoolArray | None,
    midway: bool,
) -> Conditions:
    d, reach = grid.dimension, grid.reach
    count, middle = 2 * reach + 1, reach * (horizon - 1)
    sizes = [(2 * reach * (2 * k + 1) + 1) ** d for k in range(horizon)] if midway else []
    fractions = np.zeros((1, 0)) if removal is None or removal.fractions is None else removal.fractions
    return Conditions(
        dimension=d,
        reach=reach,
        spacing=grid.lattice.spacing,
        randomness=float(model.randomness),
        tolerance=tolerance(grid),
        rationality=float(model.rationality),
        free=np.zeros((0, 0), np.bool_) if walls is None else walls,
        uniform=np.full((3 * count, 2 * middle + 1), 1.0 / count),
        value_centre=grid.centre,
        centre=reach * horizon,
        middle=middle,
        half_centre=2 * middle + reach,
        path=path,
        contact=-1.0 if removal is None else float(removal.distance),
        fractions=np.ascontiguousarray(fractions, dtype=np.float64),
        fraction_step=1.0 if removal is None else float(removal.step),
        offsets=np.cumsum([0, *sizes]) if midway else np.zeros(0, np.int64),
    )


def _first_probabilities(grid: CostGrid, policies: Sequence[Policy], given: Conditions, scratch: Scratch) -> FloatArray:
    d, count = grid.dimension, 2 * grid.reach + 1
    chosen = np.empty((len(policies), 2, count, count, count))
    for policy, both in zip(policies, chosen, strict=True):
        first_choice(policy, given, scratch, both)
    return chosen[(slice(None), slice(None), *[grid.reach] * (3 - d))].reshape(len(policies), 2, count**d)


def _split(halves: FloatArray, offsets: NDArray[np.int64], reach: int, d: int) -> tuple[FloatArray, ...]:
    return tuple(
        _read_only(halves[start:stop].reshape((2 * reach * (2 * k + 1) + 1,) * d))
        for k, (start, stop) in enumerate(itertools.pairwise(offsets))
    )


def _read_only(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
