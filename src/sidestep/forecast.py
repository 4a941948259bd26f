"""What everybody will do if the robot moves along a path: one prediction per person, and the risk they add up to."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sidestep.human.goals import DirectionGoal, Goal, PointGoal
from sidestep.minds import Mind
from sidestep.obstacles import Obstacles
from sidestep.planning.plan import PersonPlan
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.prediction.first_step import FirstStep
from sidestep.prediction.occupancy import Prediction, Removal, Workspace, frame_of, predict
from sidestep.types import FloatArray, Path

_NEAR_MARGIN = 0.05  # m beyond contact that the first action must keep


@dataclass(frozen=True, slots=True, kw_only=True)
class Circumstances:
    """What holds for everybody.

    Attributes:
        time_step: s; horizon: steps; robot_radius: m; robot_speed: m/s, its largest in any direction.
        clearance: m between centres, or None: contact + 0.10 m.
        midway: look between the steps too; first_step_limit: see `PlannerSettings`; interval: s until the next call.
        obstacles: walls that people do not pass, or None.
    """

    time_step: float
    horizon: int
    robot_radius: float
    robot_speed: float
    clearance: float | None
    midway: bool
    first_step_limit: float | None
    interval: float
    obstacles: Obstacles | None

    def contact(self, mind: Mind) -> float:
        """Return m between centres at which bodies touch."""
        return self.robot_radius + mind.model.radius

    def clearance_of(self, mind: Mind) -> float:
        """Return m between centres that is to be kept."""
        return self.contact(mind) + 0.10 if self.clearance is None else self.clearance

    def look_ahead(self, mind: Mind) -> int:
        """Return steps that this person looks ahead, M."""
        return max(self.horizon if mind.model.horizon is None else mind.model.horizon, 1)

    def matters(self, mind: Mind, start: FloatArray) -> bool:
        """Return whether the person can come within clearance of the robot at all during the horizon.

        If not, the risk field is exactly zero wherever the robot can be, and nobody needs to be predicted.
        """
        time = self.horizon * self.time_step
        frame = frame_of(mind.model, mind.position, mind.heading_velocity, self.time_step)
        walk = mind.model.reach * frame.spacing * self.horizon * np.sqrt(mind.position.size)
        spread = mind.spread(np.array([time]))
        blur = 0.0 if spread is None else 5.0 * float(spread[1].max())
        reach = walk + self.robot_speed * time + max(self.clearance_of(mind), self.contact(mind) + _NEAR_MARGIN) + blur
        return float(np.linalg.norm(mind.position - start)) <= reach


@dataclass(frozen=True, kw_only=True, eq=False)
class Forecast:
    """What everybody will do if the robot moves along `path`.

    Attributes:
        path: (≥ N+1, d) m, of the robot, instant 0 first.
        around: circumstances.
        minds: everybody, and whether they matter: (P,) booleans.
        predictions: of those who matter, by id.
    """

    path: Path
    around: Circumstances
    minds: tuple[Mind, ...]
    predictions: Mapping[str, Prediction]

    @cached_property
    def near(self) -> tuple[Mind, ...]:
        """Those who can come close within the horizon."""
        return tuple(m for m in self.minds if m.id in self.predictions)

    @cached_property
    def field(self) -> RiskField:
        """P(somebody within clearance) at any place and half instant."""
        around = self.around
        return RiskField(
            people=[_mass(self.predictions[m.id], m, around) for m in self.near],
            distances=np.array([around.clearance_of(m) for m in self.near]),
            midway=around.midway,
        )

    @cached_property
    def contact(self) -> FloatArray:
        """(N,) P(first contact with anybody at k) along `path`."""
        none = np.ones(self.around.horizon)
        for mind in self.near:
            none = none * (1.0 - self.predictions[mind.id].contact)
        return 1.0 - none

    def expectations(self) -> list[tuple[FloatArray, FloatArray] | None]:
        """Return for each mind the action probabilities (G, 2, n) and velocities (n, d) m/s now, None if far away."""
        found = [self.predictions.get(m.id) for m in self.minds]
        return [None if p is None else (p.action_probabilities, p.velocities) for p in found]

    def first_step(self) -> FirstStep | None:
        """Return the risk until the next call, or None where it is not limited or nobody is near."""
        around = self.around
        if around.first_step_limit is None or not self.near:
            return None
        told = [self.predictions[m.id] for m in self.near]
        sigmas = [math.sqrt(float(np.trace(m.position_covariance)) / m.position.size) for m in self.near]
        return FirstStep(
            positions=np.array([m.position for m in self.near]),
            sigmas=np.array(sigmas),
            person=np.repeat(np.arange(len(told)), [len(p.velocities) for p in told]),
            velocities=np.concatenate([p.velocities for p in told]),
            probabilities=np.concatenate([_mixed(m, p) for m, p in zip(self.near, told, strict=True)]),
            distances=np.array([around.contact(m) + _NEAR_MARGIN for m in self.near]),
            interval=around.interval,
            limit=around.first_step_limit,
        )


def foresee(
    minds: tuple[Mind, ...], path: Path, around: Circumstances, workspace: Workspace, check: Callable[[], object]
) -> Forecast:
    """Predict everybody who matters, under the robot motion `path` ((≥ N + M + 1, d) m); `check` before each."""
    near = [m for m in minds if around.matters(m, path[0])]
    predictions: dict[str, Prediction] = {}
    for mind in near:
        check()
        predictions[mind.id] = predicted(mind, path, around, workspace)
    return Forecast(
        path=path,
        around=around,
        minds=minds,
        predictions=predictions,
    )


def predicted(mind: Mind, path: Path, around: Circumstances, workspace: Workspace) -> Prediction:
    """Predict one person."""
    lattice = frame_of(mind.model, mind.position, mind.heading_velocity, around.time_step)
    free = None
    if around.obstacles is not None:
        reach = mind.model.reach * (around.horizon + around.look_ahead(mind))
        free = around.obstacles.free_cells(lattice.with_radius(reach), margin=0.5 * mind.model.radius)
    learned = mind.randomness != mind.model.randomness
    return predict(
        model=replace(mind.model, randomness=mind.randomness) if learned else mind.model,
        lattice=lattice,
        goals=mind.goals,
        weights=mind.belief.weights,
        robot_path=path,
        horizon=around.horizon,
        time_step=around.time_step,
        removal=_removal(mind, around),
        free=free,
        midway=around.midway,
        workspace=workspace,
    )


def _removal(mind: Mind, around: Circumstances) -> Removal:
    """Contact, of the person as spread out as their habits say."""
    spread = mind.spread(around.time_step * np.arange(around.horizon + 1.0))
    if spread is None:
        return Removal(distance=around.contact(mind))
    return Removal(distance=around.contact(mind), weights=spread[0], sigmas=spread[1])


def _mixed(mind: Mind, prediction: Prediction) -> FloatArray:
    """(n,) action probabilities now, over goal and awareness as believed."""
    return np.einsum("gb,gbn->n", mind.belief.weights, prediction.action_probabilities)


def _mass(prediction: Prediction, mind: Mind, around: Circumstances) -> PersonMass:
    spread = mind.spread(np.arange(2.0 * around.horizon + 1.0) * (0.5 * around.time_step))
    return PersonMass.of(
        lattice=prediction.occupancy.lattice,
        steps=prediction.occupancy.probability,
        midway=prediction.midway,
        reach=mind.model.reach,
        weights=None if spread is None else spread[0],
        sigmas=None if spread is None else spread[1],
    )


def person_plan(mind: Mind, seen: Forecast) -> PersonPlan:
    """Return what a plan made under `seen` says of one person."""
    prediction = seen.predictions.get(mind.id)
    around = seen.around
    return PersonPlan(
        belief=mind.belief.concerned,
        occupancy=(prediction or predicted(mind, seen.path, around, Workspace())).occupancy,
        collision_probability=np.zeros(around.horizon) if prediction is None else prediction.contact,
        goals=dict(zip(map(_name, mind.goals), mind.belief.goals.tolist(), strict=True)),
        randomness=mind.randomness,
        position=mind.position,
        velocity=mind.velocity,
        spread=mind.spread(around.time_step * np.arange(around.horizon + 1.0)),
    )


def _name(goal: Goal) -> str:
    """A goal in a few words."""
    if isinstance(goal, PointGoal):
        return "at (" + ", ".join(f"{x:.2f}" for x in goal.position) + ")"
    if isinstance(goal, DirectionGoal):
        return "along (" + ", ".join(f"{x:.2f}" for x in goal.velocity) + ") m/s"
    return "stands still"
