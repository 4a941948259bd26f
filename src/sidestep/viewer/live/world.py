"""One robot among the people: a run of the simulation, advanced step by step, and told as frames."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.simulation.loop import Navigator, Run, Step
from sidestep.simulation.people import Builder, Person
from sidestep.simulation.record import Record
from sidestep.simulation.scenario import Scenario
from sidestep.types import FloatArray, Vector
from sidestep.viewer.live import words
from sidestep.viewer.live.evidence import Evidence, smallest_expected_distance
from sidestep.viewer.live.heat import Heat, heat
from sidestep.viewer.live.stage import VISITOR
from sidestep.viewer.live.tally import Tally
from sidestep.viewer.live.visitor import Visitor
from sidestep.viewer.live.wire import numbers, with_images

HEATS = 6  # people whose predictions are drawn: the nearest
WALKING = 0.15  # m/s


class World:
    """One planner's view of the same person.

    Args:
        name: of the planner: "sidestep", or of a peer.
        title: what the page calls it.
        panel: index of its view.
        snapshots: steps of which the record keeps predictions.
    """

    def __init__(self, *, name: str, title: str, panel: int, snapshots: int = 24) -> None:
        self.name, self.title, self.panel = name, title, panel
        self.tally = Tally()
        self.arrived = False
        self.line = ""
        self._snapshots = snapshots
        self._evidence: dict[str, Evidence] = {}
        self._spoken_at = -math.inf
        self._spoken_of = ""
        self._last: Step | None = None
        self.run: Run

    def begin(self, scenario: Scenario, navigator: Navigator, visitor: Visitor, obstacles: Any) -> None:
        """Begin a trip: everybody at their places in `scenario`."""
        self.arrived = False
        self._evidence = {}
        self._last = None
        self._spoken_at = -math.inf
        self.run = Run(
            scenario,
            navigator=navigator,
            obstacles=obstacles,
            kinds={VISITOR: _just(visitor)},
            on_step=self._watch,
            snapshots=self._snapshots,
        )

    @property
    def time(self) -> float:
        """Seconds since this trip began."""
        return self.run.time

    @property
    def planned(self) -> bool:
        """The last step made a new plan."""
        return self._last is not None and self._last.planned

    def advance(self) -> None:
        """One control step; a robot that has arrived stands."""
        before = self.run.state
        if self.run.advance() and not self.arrived:
            self.arrived = True
            self.tally.finish()
            self.line = words.arrived(self.tally.elapsed)
        self._count(before.position)
        if not self.arrived:
            self.tally.elapsed = self.time

    def record(self) -> Record:
        """What happened on this trip so far."""
        return self.run.record(self.arrived)

    def frame(self) -> dict[str, Any]:
        """Return what the view needs at every frame."""
        gaps, nearest = self._gaps()
        beliefs = self._beliefs()
        return {
            "robot": numbers(np.array([*self.run.state.position, self._heading()])),
            "speed": round(self._speed(), 3),
            "goal": numbers(self.run.goal),
            "people": [[*numbers(place), heading] for place, heading in self._people()],
            "walking": [bool(np.linalg.norm(v) > WALKING) for v in self.run.drift],
            "beliefs": [beliefs.get(person.id) for person in self.run.people],
            "nearest": nearest,
            "distance": None if nearest is None else round(float(gaps[nearest]), 3),
            "status": "arrived" if self.arrived else self._status(),
            "words": self.line,
            "score": self.tally.summary(),
            "trip": self.tally.trip,
            "times": [round(t, 2) for t in self.tally.times[-10:]],
            "closest": _finite(self.tally.closest),
            "closest_approaching": _finite(self.tally.closest_approaching),
            "contacts": [self.tally.contacts_moving, self.tally.contacts_standing],
        }

    def plan_packet(self, time: float) -> bytes | None:
        """Return the plan in force, with predictions, as of `time` (s on the page's clock); None before the first."""
        if self._last is None:
            return None
        motion: Any = self._last.motion
        gaps, nearest = self._gaps()
        sample = {
            "time": round(time, 3),
            "distance": None if nearest is None else round(float(gaps[nearest]), 3),
            "ms": round(1000 * self.run.recorder.steps[-1].planning_time, 2),
            "belief": None,
            "risk": None,
        }
        common = {"type": "plan", "panel": self.panel, "time": time, "limit": self.run.scenario.planner.risk_limit}
        if not isinstance(motion, Plan):
            here = self.run.state.position
            ahead = here + np.linspace(0.0, 1.0, 3)[:, np.newaxis] * np.asarray(motion.velocity)
            return with_images([], **common, positions=numbers(ahead), risk=[], step=0.5, sample=sample)
        beliefs = self._beliefs()
        subject = self._subject(nearest)
        sample["belief"] = None if subject is None else beliefs.get(self.run.people[subject].id)
        sample["risk"] = _finite(float(np.max(motion.risk, initial=0.0)))
        heats = self._heats(motion)
        return with_images(
            heats,
            **common,
            positions=numbers(motion.positions),
            risk=numbers(motion.risk, 5),
            collision=numbers(motion.collision_probability, 5),
            step=motion.time_step,
            sample=sample,
        )

    def _watch(self, step: Step) -> None:
        self._last = step
        if not step.planned:
            return
        if isinstance(step.motion, Plan):
            for name, person in step.motion.people.items():
                self._evidence.setdefault(name, Evidence()).note(step.time, person.belief)
        if not self.arrived:
            self._speak(step)

    def _speak(self, step: Step) -> None:
        """Say what is going on; not more than about once a second, unless the plan's status changes."""
        changed = step.motion.status != self._spoken_of
        if step.time - self._spoken_at < 0.9 and not changed:
            return
        self._spoken_at = step.time
        self._spoken_of = step.motion.status
        gaps, nearest = self._gaps()
        distance = None if nearest is None else float(gaps[nearest])
        if not isinstance(step.motion, Plan):
            self.line = words.other_planner(self.name, self._speed(), distance)
            return
        self.line = words.describe(self._situation(step.motion, nearest, distance))

    def _situation(self, plan: Plan, nearest: int | None, distance: float | None) -> words.Situation:
        subject = self._subject(nearest)
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
            risk=float(np.max(plan.risk, initial=0.0)),
            limit=plan.risk_limit,
            contact=self.run.scenario.robot.radius + (0.0 if person is None else person.radius),
        )

    def _subject(self, nearest: int | None) -> int | None:
        """The person the page speaks of: the visitor when within sight of the robot, else the nearest."""
        gaps, _ = self._gaps()
        you = next((i for i, person in enumerate(self.run.people) if isinstance(person, Visitor)), None)
        if you is not None and (nearest is None or gaps[you] < words.FAR):
            return you
        return nearest

    def _gaps(self) -> tuple[FloatArray, int | None]:
        """Distances (P,) m between centres, and the index of the nearest person."""
        gaps = np.linalg.norm(self.run.places - self.run.state.position, axis=1)
        if not np.isfinite(gaps).any():
            return gaps, None
        return gaps, int(np.nanargmin(gaps))

    def _count(self, before: Vector) -> None:
        gaps, nearest = self._gaps()
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

    def _beliefs(self) -> dict[str, float]:
        motion = None if self._last is None else self._last.motion
        if not isinstance(motion, Plan):
            return {}
        return {name: round(person.belief, 4) for name, person in motion.people.items()}

    def _heats(self, plan: Plan) -> list[Heat]:
        here = self.run.state.position
        nearest = sorted(plan.people.values(), key=lambda p: float(np.linalg.norm(p.position - here)))
        return [heat(person) for person in nearest[:HEATS]]

    def _people(self) -> list[tuple[Vector, float | None]]:
        moving = np.linalg.norm(self.run.drift, axis=1) > WALKING
        headings = np.arctan2(self.run.drift[:, 1], self.run.drift[:, 0])
        return [(place, round(float(headings[i]), 3) if moving[i] else None) for i, place in enumerate(self.run.places)]

    def _heading(self) -> float:
        if self.run.state.heading is not None:
            return float(self.run.state.heading)
        v = np.zeros(2) if self._last is None else np.asarray(self._last.motion.velocity)
        return math.atan2(v[1], v[0]) if float(np.linalg.norm(v)) > words.WAITING else math.nan

    def _speed(self) -> float:
        return 0.0 if self._last is None else float(np.linalg.norm(self._last.motion.velocity))

    def _status(self) -> str:
        if self._last is None:
            return "certified"
        return self._last.motion.status if isinstance(self._last.motion, Plan) else "uncertified"


def _just(visitor: Visitor) -> Builder:
    """Return a builder of people that knows one person only."""

    def build(scenario: Scenario, index: int, generator: np.random.Generator) -> Person:
        del scenario, index, generator
        return visitor

    return build


def _finite(value: float) -> float | None:
    return round(value, 5) if math.isfinite(value) else None
