"""People who walk by themselves: by the model of Eq. 2 with parameters of their own, straight on, or not at all."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep._kernels.decide import drawn, odds_of, seen_off
from sidestep.human.actions import ActionSet
from sidestep.human.cost import TIE, danger_law
from sidestep.human.decision import first_action_costs
from sidestep.human.goals import DirectionGoal, PointGoal, StandGoal
from sidestep.human.model import HumanModel
from sidestep.lattice import Lattice, heading_rotation, identity
from sidestep.simulation.people import Surroundings, point_or_none
from sidestep.simulation.settings import PersonSettings
from sidestep.types import BoolArray, FloatArray, IntArray, Path, Vector, frozen_array, sealed

if TYPE_CHECKING:
    from sidestep.simulation.scenario import Scenario

_ARRIVED = 0.5  # m, within which a waypoint counts as passed
_TOWARD_ROBOT = 10.0  # m, how far beyond oneself a goal lies that was set "toward the robot"


class Walker:
    """What all of them share: goals in order, awareness over time, presence, walls. Subclasses choose velocities.

    Args:
        scenario: the run.
        index: of the person in `scenario.people`.
        generator: of this person alone, so that their luck does not depend on what the robot does.
    """

    def __init__(self, scenario: Scenario, index: int, generator: np.random.Generator) -> None:
        settings = scenario.people[index]
        self.settings: PersonSettings = settings
        self.id = scenario.identity(index)
        self.model: HumanModel = scenario.model_of(settings)
        self.radius = self.model.radius
        self.generator = generator
        self.goal = point_or_none(settings.goal)
        self.told_goal = self.goal if settings.goal_known else None
        self.velocity: Vector = np.zeros(scenario.dimension)
        self.awareness = 1.0 if settings.kind == "concerned" else 0.0
        if settings.kind == "switching":
            self.awareness = float(settings.initially_concerned)
        step = scenario.step
        wanted = settings.decision_interval or scenario.planner.time_step
        self._interval = max(round(wanted / step), 1) * step
        self._next_decision = settings.appears
        self._place: Vector = frozen_array(settings.start)
        self._way = [np.array(p) for p in settings.waypoints] + ([] if self.goal is None else [self.goal])
        self._changes = sorted(settings.goal_changes, key=lambda change: change.time)
        self._switches = sorted(settings.switch_times) if settings.kind == "switching" else []
        self._obstacles: Any = None
        horizon = scenario.planner.horizon if self.model.horizon is None else self.model.horizon
        self._looked_ahead = max(horizon, 1)

    @property
    def target(self) -> Vector:
        """(d,) m, the next place on the way; the present place where there is none."""
        return self._way[0] if self._way else self._place

    def position(self, time: float) -> Vector | None:
        """The present place, or where the person came from; None while absent."""
        s = self.settings
        if time < s.appears - 1e-9:
            if s.arrives_with is None or s.appears > 0 or time >= 0:
                return None
            return np.array(s.start) + time * np.array(s.arrives_with)
        if s.vanishes is not None and time >= s.vanishes - 1e-9:
            return None
        return self._place

    def decide(self, around: Surroundings) -> None:
        """Choose a velocity, at every decision instant of this person."""
        present = self.position(around.time) is not None and around.time >= self.settings.appears - 1e-9
        self._change_mind(around)
        if not present or around.time < self._next_decision - 1e-9:
            return
        self._next_decision = around.time + self._interval
        self._obstacles = around.obstacles
        heeds = self.generator.random() < self.settings.heeds_signal  # drawn always: luck does not depend on the robot
        if around.signal and heeds:
            self.awareness = 1.0
        while len(self._way) > 1 and math.dist(self._way[0], self._place) <= _ARRIVED:
            self._way.pop(0)
        self.velocity = self.choose(around)

    def choose(self, around: Surroundings) -> Vector:
        """Velocity (d,) m/s until the next decision."""
        raise NotImplementedError

    @property
    def pace(self) -> float:
        """m/s, the fastest along an axis: reach·v."""
        return self.model.reach * self.model.walking_speed

    def straight_on(self) -> Vector:
        """(d,) m/s, full pace toward the next place on the way; the last step ends there."""
        way = self.target - self._place
        distance = float(np.linalg.norm(way))
        return way * (min(self.pace, distance / self._interval) / distance) if distance > 1e-9 else np.zeros_like(way)

    def move(self, start: float, end: float) -> None:
        """Walk; a wall stops."""
        if self.position(start) is None:
            return
        there = sealed(self._place + (end - start) * self.velocity)
        if self._obstacles is None or self._obstacles.segment_free(self._place[None], there[None], margin=0.0)[0]:
            self._place = there

    def _change_mind(self, around: Surroundings) -> None:
        while self._switches and around.time >= self._switches[0] - 1e-9:
            self._switches.pop(0)
            self.awareness = 1.0 - self.awareness
        while self._changes and around.time >= self._changes[0].time - 1e-9:
            goal = self._changes.pop(0).goal
            if isinstance(goal, str):
                way = around.robot_path[0] - self._place
                self._way = [self._place + way / max(float(np.linalg.norm(way)), 1e-9) * _TOWARD_ROBOT]
            else:
                self._way = [frozen_array(goal)]


class StraightWalker(Walker):
    """Walks to the goal at constant velocity, whatever the robot does, and stops there."""

    def choose(self, around: Surroundings) -> Vector:
        """Full pace along the line."""
        return self.straight_on()


class Stander(Walker):
    """Does not move."""

    def choose(self, around: Surroundings) -> Vector:
        """Zero."""
        return np.zeros_like(self._place)


class ModelWalker(Walker):
    """Decides by Eq. 2 with own parameters, acts at random with probability ω (Eq. 4), and misjudges distances.

    A concerned person knows the motion that the robot has announced, as the predictor assumes (Remark 1 of the paper);
    where `repulsion_weight` says so, they also keep away from where the others will be if they go on as they do.
    Arguments as for `Walker`.
    """

    def __init__(self, scenario: Scenario, index: int, generator: np.random.Generator) -> None:
        super().__init__(scenario, index, generator)
        actions = ActionSet(speed=self.model.walking_speed, reach=self.model.reach, dimension=scenario.dimension)
        self._multiples, self._velocities = actions.multiples, actions.velocities

    def choose(self, around: Surroundings) -> Vector:
        """One of the best actions, all equally likely, or with probability ω any action that no wall forbids."""
        random, which, error = self.generator.random(), self.generator.random(), self.generator.standard_normal()
        lattice = self._lattice(around.time_step)
        free = self._free(lattice, around)
        if random < self.model.randomness:
            chances = np.ones(len(self._velocities)) if free is None else _reachable(free, self._multiples)
        else:
            chances = self._deliberate(lattice, around, free, error)
        index = drawn(chances, which)
        return np.zeros_like(self._place) if index < 0 else lattice.rotation @ self._velocities[index]

    def _deliberate(self, lattice: Lattice, around: Surroundings, free: BoolArray | None, error: float) -> FloatArray:
        """(n,) weights of the actions in P_d (Eq. 5)."""
        model = self.model
        law, path = self._perceived(around, error)
        costs = first_action_costs(
            model, lattice, self._aim(), path, int(self.awareness), around.time_step, free,
            others_along(around, len(path)) if model.repulsion_weight > 0 else None, law,
        )  # fmt: skip
        return odds_of(costs, model.rationality, TIE)

    def _lattice(self, time_step: float) -> Lattice:
        """Around oneself; along the way to the goal where the model has the person's own frame."""
        model, d = self.model, self._place.size
        rotation = heading_rotation(self.target - self._place) if model.frame == "heading" else identity(d)
        radius = model.reach * self._looked_ahead
        return Lattice(origin=self._place, spacing=model.walking_speed * time_step, radius=radius, rotation=rotation)

    def _perceived(self, around: Surroundings, error: float) -> tuple[tuple[float, float], Path]:
        """Danger (weight, rate) and motion of the robot as judged here: all distances are off by the same ε (Eq. 2a).

        For the decay exp(−θ4·(d + ε)), ε ~ N(0, σ²), that is a factor on θ3; otherwise the robot is seen farther off or
        nearer by ε along the line of sight.
        """
        model, path = self.model, around.robot_path[: self._looked_ahead + 1]
        epsilon = model.perception_noise * error
        if epsilon == 0:
            return danger_law(model), path
        if model.danger_decay == "distance":
            return (model.danger_weight * math.exp(-model.danger_rate * epsilon), model.danger_rate), path
        return (model.danger_weight, model.danger_rate), seen_off(path, self._place, epsilon)

    def _aim(self) -> PointGoal | DirectionGoal | StandGoal:
        if self._way:
            return PointGoal(self.target)
        heading = self.settings.arrives_with
        return StandGoal() if heading is None else DirectionGoal(heading)

    def _free(self, lattice: Lattice, around: Surroundings) -> BoolArray | None:
        """Cells outside walls, or None where there are no walls."""
        if around.obstacles is None:
            return None
        places = lattice.positions().reshape(-1, lattice.dimension)
        return np.asarray(around.obstacles.free(places, margin=self.radius)).reshape(lattice.shape)


def _reachable(free: BoolArray, multiples: IntArray) -> FloatArray:
    """(n,) 1 for actions whose next cell is free."""
    cells = multiples + free.shape[0] // 2
    return free[tuple(cells.T)].astype(np.float64)


def others_along(around: Surroundings, instants: int) -> FloatArray:
    """(P, instants, d) m, everybody else who is there, if each goes on at the present velocity."""
    present = around.company()
    pace = np.nan_to_num(around.velocities[present])  # nobody knows the pace of somebody who has just appeared
    time = around.time_step * np.arange(instants)[:, None]
    return around.others[present][:, None] + time * pace[:, None]
