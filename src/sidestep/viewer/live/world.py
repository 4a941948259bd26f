"""One robot among the people: a run of the simulation, advanced step by step, and told as frames."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.simulation.navigators import Navigator
from sidestep.simulation.people import Builder, Person
from sidestep.simulation.record import Record
from sidestep.simulation.run import Run, Step
from sidestep.simulation.scenario import Scenario
from sidestep.types import FloatArray, Vector
from sidestep.viewer.live import words
from sidestep.viewer.live.album import Album
from sidestep.viewer.live.evidence import Evidence, smallest_expected_distance
from sidestep.viewer.live.stage import VISITOR
from sidestep.viewer.live.tally import Tally
from sidestep.viewer.live.visitor import Visitor


class World:
    """One planner's view of the same person.

    Args:
        name: of the planner: "sidestep", or of a peer.
        title: what the page calls it.
        panel: index of its view.
    """

    def __init__(self, *, name: str, title: str, panel: int) -> None:
        self.name, self.title, self.panel = name, title, panel
        self.tally = Tally()
        self.line = ""
        self._album = Album()
        self._evidence: dict[str, Evidence] = {}
        self._spoken_at = -math.inf
        self._spoken_of = ""
        self.last: Step | None = None
        self.run: Run

    def begin(self, scenario: Scenario, navigator: Navigator, visitor: Visitor, obstacles: Any) -> None:
        """Begin a trip: everybody at their places in `scenario`."""
        self._evidence = {}
        self._album = Album()
        self.last = None
        self._spoken_at = -math.inf
        self.run = Run(
            scenario,
            navigator=navigator,
            obstacles=obstacles,
            kinds={VISITOR: _just(visitor)},
            on_step=self._watch,
            snapshots=0,
        )

    @property
    def time(self) -> float:
        """Seconds since this trip began."""
        return self.run.time

    @property
    def arrived(self) -> bool:
        """The robot has been at its goal on this trip."""
        return self.run.reached

    @property
    def planned(self) -> bool:
        """The last step made a new plan."""
        return self.last is not None and self.last.planned

    def advance(self) -> None:
        """One control step; a robot that has arrived stands."""
        before, underway = self.run.state, not self.arrived
        self.run.advance()
        if self.arrived and underway:
            self.tally.finish()
            self.line = words.arrived(self.tally.elapsed)
        self._count(before.position)
        if not self.arrived:
            self.tally.elapsed = self.time

    def record(self) -> Record:
        """What happened on this trip so far."""
        record = self.run.record()
        return replace(record, snapshots=self._album.snapshots(len(record.status)))

    def _watch(self, step: Step) -> None:
        self.last = step
        if not step.planned:
            return
        if isinstance(step.motion, Plan):
            for name, person in step.motion.people.items():
                self._evidence.setdefault(name, Evidence()).note(step.time, person.belief)
            columns = {person.id: i for i, person in enumerate(self.run.people)}
            self._album.add(step.index, step.motion, columns, step.robot.position)
        if not self.arrived:
            self._speak(step)

    def _speak(self, step: Step) -> None:
        """Say what is going on; not more than about once a second, unless the plan's status changes."""
        changed = step.motion.status != self._spoken_of
        if step.time - self._spoken_at < 0.9 and not changed:
            return
        self._spoken_at = step.time
        self._spoken_of = step.motion.status
        gaps, nearest = self.gaps()
        distance = None if nearest is None else float(gaps[nearest])
        if not isinstance(step.motion, Plan):
            self.line = words.other_planner(self.name, self.speed(), distance)
            return
        self.line = words.describe(self._situation(step.motion, nearest, distance))

    def _situation(self, plan: Plan, nearest: int | None, distance: float | None) -> words.Situation:
        subject = self.subject(nearest)
        person = None if subject is None else self.run.people[subject]
        assumed = None if person is None else plan.people.get(person.id)
        evidence = self._evidence.get(person.id, Evidence()) if person is not None else Evidence()
        return words.Situation(
            you=isinstance(person, Visitor),
            status=plan.status,
            reason=plan.reason,
            speed=float(np.linalg.norm(plan.velocity)),
            distance=distance,
            belief=None if assumed is None else assumed.belief,
            ignored=evidence.ignored,
            taken=evidence.taken,
            keeping=None if assumed is None else smallest_expected_distance(plan, assumed.occupancy),
            risk=plan.limited_risk,
            summed=plan.risk_rule == "trajectory",
            limit=plan.risk_limit,
            contact=self.run.scenario.robot.radius + (0.0 if person is None else person.radius),
        )

    def subject(self, nearest: int | None) -> int | None:
        """The person the page speaks of: the visitor when within sight of the robot, else the nearest."""
        gaps, _ = self.gaps()
        you = next((i for i, person in enumerate(self.run.people) if isinstance(person, Visitor)), None)
        if you is not None and (nearest is None or gaps[you] < words.FAR):
            return you
        return nearest

    def gaps(self) -> tuple[FloatArray, int | None]:
        """Distances (P,) m between centres, and the index of the nearest person."""
        gaps = np.linalg.norm(self.run.places - self.run.state.position, axis=1)
        if not np.isfinite(gaps).any():
            return gaps, None
        return gaps, int(np.nanargmin(gaps))

    def _count(self, before: Vector) -> None:
        gaps, nearest = self.gaps()
        if nearest is None:
            return
        there = self.run.places[nearest]
        shrinks = float(np.linalg.norm(there - self.run.state.position)) < float(np.linalg.norm(there - before)) - 1e-9
        self.tally.instant(
            distance=float(gaps[nearest]),
            contact=self.run.scenario.robot.radius + self.run.people[nearest].radius,
            speed=float(np.linalg.norm(self.run.state.position - before)) / self.run.scenario.step,
            approaching=shrinks,
        )

    def beliefs(self) -> dict[str, float]:
        """P(concerned) by id; empty for planners that do not ask."""
        motion = None if self.last is None else self.last.motion
        if not isinstance(motion, Plan):
            return {}
        return {name: round(person.belief, 4) for name, person in motion.people.items()}

    def speed(self) -> float:
        """m/s that the robot is told to go."""
        return 0.0 if self.last is None else float(np.linalg.norm(self.last.motion.velocity))

    def status(self) -> str:
        """Of the plan in force; "uncertified" for planners that certify nothing."""
        if self.last is None:
            return "certified"
        return self.last.motion.status if isinstance(self.last.motion, Plan) else "uncertified"


def _just(visitor: Visitor) -> Builder:
    """Return a builder of people that knows one person only."""

    def build(scenario: Scenario, index: int, generator: np.random.Generator) -> Person:
        del scenario, index, generator
        return visitor

    return build
