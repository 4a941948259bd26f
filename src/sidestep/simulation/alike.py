"""Runs that begin alike: as long as their planners have been told the same, one of them plans for all.

Two runs of one encounter with different seeds, or with people of different kinds, are the same run until somebody does
something else; so long there is nothing to plan twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.planning.plan import Plan
from sidestep.robots import RobotState
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.record import Record
from sidestep.simulation.run import Run, Step
from sidestep.simulation.scenario import Scenario

if TYPE_CHECKING:
    from sidestep.planner import Planner

_OF_ROBOTS = tuple(f.name for f in fields(RobotState))
_OF_PEOPLE = tuple(f.name for f in fields(PersonObservation))
_SEEN_BY_PEOPLE = {"people", "seed", "name", "description"}  # settings that no planner is told


def planned_alike(scenario: Scenario) -> str:
    """Return what the planner of a scenario follows from: equal for those whose planners can be shared."""
    return scenario.model_dump_json(exclude=_SEEN_BY_PEOPLE)


def simulate_alike(scenarios: Sequence[Scenario], watch: Sequence[Callable[[Step], object]]) -> list[Record]:
    """Return the records of runs of these scenarios, equal to those of `simulate` but for the time that planning took.

    Args:
        scenarios: each with its own seed, all `planned_alike`, without recordings and further robots.
        watch: called after each step, one for each run.
    """
    if len({planned_alike(s) for s in scenarios}) > 1:
        raise ValueError("these scenarios are not planned alike")
    family = _Family(planner_of(scenarios[0]))
    runs = [
        Run(scenario, navigator=_Member(family), snapshots=0, on_step=look)
        for scenario, look in zip(scenarios, watch, strict=True)
    ]
    going = runs
    while going:
        for run in going:
            run.advance()
        going = [run for run in going if not run.over]
    return [run.record() for run in runs]


class _Family:
    """Planners that were told the same so far, by what they are told next."""

    def __init__(self, planner: Planner) -> None:
        self.newborn = planner
        self._time = -math.inf
        self._known: dict[Hashable, tuple[Planner, Plan]] = {}

    def plan(
        self, planner: Planner, time: float, robot: RobotState, people: Sequence[PersonObservation]
    ) -> tuple[Planner, Plan]:
        """Return the plan, and the planner that has made it; the one that is given stays as it is."""
        if time != self._time:  # all runs go in step, so nobody comes back to an earlier instant
            self._known, self._time = {}, time
        told = planner, (_content(robot, _OF_ROBOTS), *(_content(person, _OF_PEOPLE) for person in people))
        if told not in self._known:
            twin = planner.twin()
            self._known[told] = twin, twin.step(time=time, robot=robot, people=people)
        return self._known[told]


def _content(value: RobotState | PersonObservation, names: tuple[str, ...]) -> Hashable:
    """What a value holds, to the last bit."""
    held = (getattr(value, name) for name in names)
    return tuple((x.shape, x.tobytes()) if isinstance(x, np.ndarray) else x for x in held)


class _Member:
    """The navigator of one run."""

    def __init__(self, family: _Family) -> None:
        self._family = family
        self._planner = family.newborn

    def reset(self) -> None:
        """Forget everything that was seen."""
        self._planner = self._family.newborn

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Plan:
        """As `Planner.step`."""
        self._planner, plan = self._family.plan(self._planner, time, robot, people)
        return plan
