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

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np

from sidestep._kernels.blocks import take_steps
from sidestep._kernels.frames import turned
from sidestep.errors import InvalidInput
from sidestep.human.actions import ActionSet
from sidestep.human.goals import Goal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice, heading_rotation
from sidestep.prediction.ground import Ground
from sidestep.prediction.propagation import Removal, Scene
from sidestep.prediction.workspace import Results, Workspace
from sidestep.types import BoolArray, FloatArray, IntArray, VectorLike, sealed

UNFOLLOWED = 1e-9
"""Hypotheses that weigh at most this together are not pushed; no probability is off by more."""

MISSING = 1e-6
"""Mass that a prediction may lose on its way; a plan must never be certified for people who are not there."""


class Occupancy:
    """Probability over cells at k = 0..N.

    Args:
        lattice: the cells; radius reach·N.
        probability: (N+1, cells…), each instant sums to 1; or what lays that out when it is asked for.
        time_step: s, between the instants.
    """

    def __init__(
        self, *, lattice: Lattice, probability: FloatArray | Callable[[], FloatArray], time_step: float
    ) -> None:
        self.lattice = lattice
        self.time_step = time_step
        self._given = probability

    @cached_property
    def probability(self) -> FloatArray:
        """(N+1, cells…), each instant sums to 1."""
        return self._given() if callable(self._given) else self._given

    def __reduce__(self) -> tuple[Callable[..., Occupancy], tuple[Any, ...]]:
        return _occupancy, (self.lattice, self.probability, self.time_step)

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


def _occupancy(lattice: Lattice, probability: FloatArray, time_step: float) -> Occupancy:
    return Occupancy(lattice=lattice, probability=sealed(probability), time_step=time_step)


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """What `predict` returns; all arrays are read-only.

    Attributes:
        occupancy: mass at k = 0..N.
        action_probabilities: (G, 2, n) P(u | x_0; goal, β) at the first instant (Eq. 4), [:, 1] concerned.
        velocities: (n, d) m/s of these actions in the world frame.
        contact: (N,) P(first contact at k = 1..N) along the robot's path; zeros without removal.
        blocks: mass at half instants 0, 1, … 2N, flat, each on its own box; those of mid-steps may be empty.
        offsets: (2N+2,) where the blocks begin; radii: (2N+1,) cells from the anchor to their faces.
        hypotheses: (G, 2, N+1, cells…) mass of each hypothesis, weight included; None if not asked for, or if
            awareness is resampled.
    """

    occupancy: Occupancy
    action_probabilities: FloatArray
    velocities: FloatArray
    contact: FloatArray
    blocks: FloatArray
    offsets: IntArray
    radii: IntArray
    hypotheses: FloatArray | None = None

    @cached_property
    def midway(self) -> tuple[FloatArray, ...]:
        """N arrays, mass at k + ½ on `midway_lattice(k)`; empty if not asked for."""
        steps = len(self.occupancy) - 1 if self.offsets[2] > self.offsets[1] else 0
        parts = [self.blocks[self.offsets[2 * k + 1] : self.offsets[2 * k + 2]] for k in range(steps)]
        return tuple(sealed(part.reshape(self.midway_lattice(k).shape)) for k, part in enumerate(parts))

    def midway_lattice(self, k: int) -> Lattice:
        """Return the lattice of `midway[k]`: half the spacing, radius reach·(2k + 1)."""
        lattice = self.occupancy.lattice
        return Lattice(
            origin=lattice.origin,
            spacing=lattice.spacing / 2,
            radius=int(self.radii[2 * k + 1]),
            rotation=lattice.rotation,
        )


def frame_of(model: HumanModel, position: VectorLike, velocity: VectorLike | None, time_step: float) -> Lattice:
    """Return the lattice (radius 0) on which a person's actions land.

    Frame "heading": its first axis points along `velocity` ((d,) m/s) and the fastest action reach·v is the observed
    speed within `speed_range`; without a velocity the axes are the world's. Frame "world": the world's axes and
    `walking_speed`.
    """
    origin = np.asarray(position, dtype=np.float64)
    if model.frame == "world":
        return Lattice(origin=origin, spacing=model.walking_speed * time_step, radius=0)
    motion = np.zeros(origin.size) if velocity is None else np.asarray(velocity, dtype=np.float64)
    low, high = model.speed_range
    fastest = min(max(math.hypot(*motion), low), high)
    rotation = heading_rotation(motion)
    rotation.setflags(write=False)
    return Lattice(origin=origin, spacing=fastest / model.reach * time_step, radius=0, rotation=rotation)


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
    randomness: float | None = None,
    midway: bool = False,
    keep_hypotheses: bool = False,
    workspace: Workspace | None = None,
    dtype: type[np.float32] | type[np.float64] | None = None,
    others: FloatArray | None = None,
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
        free: (cells…) of a lattice of any radius around the same anchor: where a person may be; beyond it everywhere.
            An action is admissible if it ends in a free cell; a person with no admissible action stays.
        randomness: ω; None: the model's.
        midway: also return the mass at mid-steps.
        keep_hypotheses: also return each hypothesis by itself (persistent awareness only).
        workspace: scratch to reuse.
        dtype: of values; by default float64, float32 for long horizons.
        others: (P, ≥ N + M + 1, d) m, other people at the same instants, minded if `repulsion_weight` > 0; or None.

    Raises:
        InvalidInput: shapes that do not fit.
    """
    return predict_on(
        Ground.of(model, lattice, goals, horizon, time_step, free, dtype),
        weights=weights,
        robot_path=robot_path,
        removal=removal,
        randomness=randomness,
        midway=midway,
        keep_hypotheses=keep_hypotheses,
        workspace=workspace,
        others=others,
    )


def predict_on(
    ground: Ground,
    *,
    weights: FloatArray | Sequence[Sequence[float]],
    robot_path: FloatArray,
    removal: Removal | None = None,
    randomness: float | None = None,
    midway: bool = False,
    keep_hypotheses: bool = False,
    workspace: Workspace | None = None,
    others: FloatArray | None = None,
) -> Prediction:
    """Predict as `predict` does, on what was laid out for the person before; arguments as there."""
    joint, goals = np.asarray(weights, dtype=np.float64), ground.intents
    if joint.shape != (len(goals), 2):
        raise InvalidInput("weights", joint.shape, f"({len(goals)}, 2)")
    scene = Scene.of(ground, robot_path, removal, workspace or Workspace(), randomness, others, midway)
    model, lattice, horizon, time_step = ground.model, ground.grid.lattice, ground.horizon, ground.grid.time_step
    d, reach = lattice.dimension, model.reach
    persistent = model.awareness_over_horizon == "persistent"
    results = Results(blocks=np.zeros(int(scene.offsets[-1])), contact=np.zeros(horizon))
    kept = np.zeros((len(goals), 2, results.blocks.size)) if keep_hypotheses and persistent else None
    joint = joint if keep_hypotheses else _worth_following(joint)
    first = np.empty((len(goals), 2, (2 * reach + 1) ** d))
    for g in range(len(goals)):
        if kept is None and (scene.unmoved(g) or not persistent):
            _push_together(scene, g, joint[g], results, first[g])
            continue
        for beta in (1, 0):  # what the concerned do is swept first; it covers what the others need
            target = results if kept is None else replace(results, blocks=kept[g, beta])
            if persistent and joint[g, beta] > 0:
                scene.push(g, float(joint[g, beta]), float(beta), target, first[g, beta])
            else:
                scene.first_actions(g, float(beta), first[g, beta])
    if kept is not None:
        results.blocks[:] = kept.sum(axis=(0, 1))
    if midway:
        scene.add_midway(results.blocks)
    left, wanted = float(results.blocks[scene.offsets[-2] :].sum()), float(joint.sum())
    if not abs(left - wanted) <= MISSING:
        raise ArithmeticError(f"a prediction ends with a mass of {left} instead of {wanted}")
    shape = (horizon + 1, *(2 * reach * horizon + 1,) * d)
    return Prediction(
        occupancy=Occupancy(
            lattice=lattice.with_radius(reach * horizon),
            probability=partial(_laid_out, sealed(results.blocks), scene.offsets, scene.radii, shape),
            time_step=time_step,
        ),
        action_probabilities=sealed(first),
        velocities=sealed(action_velocities(model, lattice, time_step)),
        contact=sealed(results.contact),
        blocks=results.blocks,
        offsets=scene.offsets,
        radii=scene.radii,
        hypotheses=None if kept is None else _each(kept, scene.offsets, scene.radii, shape),
    )


def _worth_following(joint: FloatArray) -> FloatArray:
    """Return the weights without those that sum to at most `UNFOLLOWED`; the others make up for them."""
    if all(weight > UNFOLLOWED / joint.size for weight in joint.ravel().tolist()):
        return joint
    kept = np.where(joint > UNFOLLOWED / joint.size, joint, 0.0)
    return kept * (joint.sum() / kept.sum())


def _laid_out(blocks: FloatArray, offsets: IntArray, radii: IntArray, shape: tuple[int, ...]) -> FloatArray:
    """(N+1, cells…) the mass at whole instants."""
    steps = np.zeros(shape)
    take_steps(blocks, offsets, radii, len(shape) - 1, steps.reshape(shape[0], -1, shape[-1]))
    return sealed(steps)


def _each(kept: FloatArray, offsets: IntArray, radii: IntArray, shape: tuple[int, ...]) -> FloatArray:
    """(G, 2, N+1, cells…) of (G, 2, ·) blocks."""
    parts = [_laid_out(blocks, offsets, radii, shape) for pair in kept for blocks in pair]
    return sealed(np.stack(parts).reshape(*kept.shape[:2], *shape))


def _push_together(scene: Scene, goal: int, weights: FloatArray, results: Results, first: FloatArray) -> None:
    """Add both awarenesses at once: where they act alike, or where awareness is redrawn at every step (Eq. 7)."""
    total = float(weights.sum())
    alike = scene.unmoved(goal)
    if total > 0:
        scene.push(goal, total, 0.0 if alike else float(weights[1]) / total, results)
    scene.first_actions(goal, 0.0, first[0])
    if alike:
        first[1] = first[0]
    else:
        scene.first_actions(goal, 1.0, first[1])


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

    Arguments as for `predict`; `robot_path` needs M + 1 positions; `horizon` is N_H where the model has none of its
    own.
    """
    model = replace(model, horizon=horizon) if model.horizon is None else model
    scene = Scene.of(Ground.of(model, lattice, goals, 1, time_step, free), robot_path, None, workspace or Workspace())
    first = np.empty((len(goals), 2, (2 * model.reach + 1) ** lattice.dimension))
    for g, beta in np.ndindex(len(goals), 2):
        scene.first_actions(g, float(beta), first[g, beta])
    return sealed(first)


def action_velocities(model: HumanModel, lattice: Lattice, time_step: float) -> FloatArray:
    """(n, d) m/s, the actions in the world frame, in the order of `ActionSet.multiples`."""
    units = _unit_velocities(model.reach, lattice.dimension)
    return turned(units, lattice.rotation, lattice.spacing / time_step)


@lru_cache(maxsize=16)
def _unit_velocities(reach: int, dimension: int) -> FloatArray:
    return ActionSet(speed=1.0, reach=reach, dimension=dimension).velocities
