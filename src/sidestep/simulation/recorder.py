"""Writes down a run while it happens, and returns the `Record` of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sidestep.planning.plan import PersonPlan, Plan
from sidestep.simulation.people import Person
from sidestep.simulation.record import Record, Snapshot
from sidestep.types import FloatArray, Vector, frozen_array

if TYPE_CHECKING:
    from sidestep.simulation.scenario import Scenario

_KEPT = 32  # steps whose occupancies are held at most while a run lasts
_INSTANTS = 5  # prediction instants kept of each
_NEAREST = 8  # people whose occupancies are kept


class Recorder:
    """Grows by one instant and one step at a time; a run that was interrupted leaves a whole record of what was done.

    Args:
        scenario: the run.
        people: everyone who may appear.
        snapshots: steps of which the predicted occupancy is kept; 0: none.
    """

    def __init__(self, scenario: Scenario, people: Sequence[Person], snapshots: int) -> None:
        self.scenario = scenario
        self.people = people
        self._column = {person.id: i for i, person in enumerate(people)}
        self._snapshots = snapshots
        self._albums: list[tuple[int, tuple[Snapshot, ...]]] = []
        self._stride = 1
        self.time: list[float] = []
        self.robot: list[Vector] = []
        self.headings: list[float] = []
        self.places: list[FloatArray] = []
        self.awareness: list[list[float]] = []
        self.steps: list[_Step] = []

    def instant(self, time: float, robot: Vector, heading: float | None, places: FloatArray) -> None:
        """Write down where everyone is at `time` (s): robot (d,) m, people (P, d) m."""
        self.time.append(time)
        self.robot.append(robot)
        self.headings.append(np.nan if heading is None else heading)
        self.places.append(places)
        self.awareness.append([person.awareness for person in self.people])

    def step(self, motion: object, status: str, *, planning_time: float, age: float, planned: bool) -> None:
        """Write down the plan in force during the step that begins at the last instant."""
        n, d, p = self.scenario.planner.horizon, self.scenario.dimension, len(self.people)
        step = _Step(status=status, planning_time=planning_time, age=age)
        if not planned and self.steps:
            before = self.steps[-1]
            step.beliefs, step.contact, step.risk, step.plan = before.beliefs, before.contact, before.risk, before.plan
        elif isinstance(motion, Plan):
            beliefs = [math.nan] * p
            for name, person in motion.people.items():
                if name in self._column:
                    beliefs[self._column[name]] = person.belief
            step.beliefs = np.array(beliefs)
            step.contact = _padded(motion.collision_probability, n)
            step.risk = _padded(motion.risk, n)
            step.plan = _padded(motion.positions, n + 1)
            self._photograph(motion)
        else:
            step.beliefs, step.contact, step.risk = np.full(p, np.nan), np.full(n, np.nan), np.full(n, np.nan)
            step.plan = np.full((n + 1, d), np.nan)
        self.steps.append(step)
        self.awareness[-1] = [person.awareness for person in self.people]

    def record(self, reached: bool, walls: Sequence[FloatArray]) -> Record:
        """Return what happened up to the last whole step."""
        t = min(len(self.steps), len(self.time) - 1)  # an interruption may fall between a step and the instant after it
        s, steps = self.scenario, self.steps[:t]
        time = np.array(self.time[: t + 1])
        robot = np.array(self.robot[: t + 1])
        n, d, p = s.planner.horizon, s.dimension, len(self.people)
        goals = [np.full(d, np.nan) if person.goal is None else person.goal for person in self.people]
        return Record(
            scenario=s.name,
            settings=s.settings(),
            seed=s.seed,
            time=frozen_array(time),
            robot_positions=frozen_array(robot),
            robot_headings=frozen_array(self.headings[: t + 1]),
            robot_velocities=frozen_array(np.diff(robot, axis=0) / np.diff(time)[:, None]),
            robot_goal=frozen_array(s.robot.goal),
            robot_radius=s.robot.radius,
            people=tuple(person.id for person in self.people),
            people_radii=frozen_array([person.radius for person in self.people]),
            people_goals=frozen_array(np.array(goals).reshape(p, d)),
            people_positions=frozen_array(np.array(self.places[: t + 1]).reshape(t + 1, p, d)),
            people_awareness=frozen_array(np.array(self.awareness[: t + 1]).reshape(t + 1, p)),
            beliefs=frozen_array(np.array([step.beliefs for step in steps]).reshape(t, p)),
            status=tuple(step.status for step in steps),
            collision_probability=frozen_array(np.array([step.contact for step in steps]).reshape(t, n)),
            risk=frozen_array(np.array([step.risk for step in steps]).reshape(t, n)),
            plans=frozen_array(np.array([step.plan for step in steps]).reshape(t, n + 1, d)),
            planning_time=frozen_array([step.planning_time for step in steps]),
            plan_age=frozen_array([step.age for step in steps]),
            risk_limit=s.planner.risk_limit,
            clearance=s.clearance,
            time_step=s.planner.time_step,
            control_step=s.step,
            snapshots=self._chosen(robot),
            walls=tuple(frozen_array(w) for w in walls),
            reached_goal=reached,
        )

    def _photograph(self, plan: Plan) -> None:
        """Keep the occupancies of the nearest people; when there are many, of every second step only, and so on."""
        index = len(self.steps)
        if self._snapshots <= 0 or index % self._stride:
            return
        here = self.robot[-1]
        nearest = sorted(plan.people.items(), key=lambda item: float(np.linalg.norm(item[1].position - here)))
        album = [
            snapshot(index, self._column[name], person) for name, person in nearest[:_NEAREST] if name in self._column
        ]
        self._albums.append((index, tuple(album)))
        if len(self._albums) > _KEPT:
            self._stride *= 2
            self._albums = [(i, a) for i, a in self._albums if i % self._stride == 0]

    def _chosen(self, robot: FloatArray) -> tuple[Snapshot, ...]:
        """Snapshots spread over the run up to shortly after the closest approach, which is where things happen."""
        albums = [(i, album) for i, album in self._albums if i < len(self.steps) and album]
        if not albums:
            return ()
        gaps = np.linalg.norm(np.array(self.places[: len(robot)]) - robot[:, None], axis=-1)
        gaps = np.where(np.isnan(gaps), np.inf, gaps)
        closest = int(np.argmin(gaps.min(axis=1)))
        last = max((k for k, (i, _) in enumerate(albums) if i <= closest + 1), default=0)
        picked = sorted(set(np.linspace(0, last, self._snapshots).round().astype(int).tolist()))
        return tuple(shot for k in picked for shot in albums[k][1])


class _Step:
    """What was in force during one control step."""

    __slots__ = ("age", "beliefs", "contact", "plan", "planning_time", "risk", "status")

    def __init__(self, *, status: str, planning_time: float, age: float) -> None:
        self.status = status
        self.planning_time = planning_time
        self.age = age
        self.beliefs: FloatArray
        self.contact: FloatArray
        self.risk: FloatArray
        self.plan: FloatArray


def snapshot(step: int, person: int, seen: PersonPlan) -> Snapshot:
    """Return some instants of a predicted occupancy: the first step ahead, the last, and some between."""
    last = len(seen.occupancy) - 1
    instants = np.unique(np.linspace(min(1, last), last, _INSTANTS).round().astype(np.int64))
    lattice = seen.occupancy.lattice
    weights, sigmas = (np.zeros(0), np.zeros((last + 1, 0))) if seen.spread is None else seen.spread
    return Snapshot(
        step=step,
        person=person,
        origin=lattice.origin,
        spacing=lattice.spacing,
        rotation=lattice.rotation,
        probability=frozen_array(seen.occupancy.probability[instants]),
        instants=instants,
        weights=frozen_array(weights),
        sigmas=frozen_array(sigmas[instants]),
    )


def _padded(values: FloatArray, length: int) -> FloatArray:
    """`values` cut or filled with NaN to `length` rows."""
    if len(values) == length:
        return values
    result = np.full((length, *values.shape[1:]), np.nan)
    result[: min(len(values), length)] = values[:length]
    return result
