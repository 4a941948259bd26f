"""The robot's senses in the lab: beams on legs, a network in between, a tracker, odometry that drifts."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.perception.classifier import LegClassifier
from sidestep.perception.scan import Scan
from sidestep.perception.tracks import Tracker
from sidestep.robots import RobotState
from sidestep.simulation.assembly import obstacles_of
from sidestep.simulation.gait import Gait
from sidestep.simulation.lab_check import TrackerCheck, pose_of
from sidestep.simulation.lab_room import LabRoom, LabSettings
from sidestep.simulation.lidar import Scanner
from sidestep.simulation.people import Person
from sidestep.simulation.scene import Scene
from sidestep.types import FloatArray, Vector

_WARM_UP = 2.0  # s that the robot looks around before it sets out
_WALKS, _LINGERS = 0.35, 1.5  # m/s, s; who was slower than this for longer than that stands
_STAYS, _THERE = 4.0, 1.0  # s that somebody may wait for the robot to pass; m, within which they have arrived
_SLIP = 0.01  # of the way, and of the turn: standard deviation of each odometry step's error
_TURN_PER_METRE = 0.01  # rad/m^½; heading error that driving adds


@dataclass(slots=True)
class _Legs:
    """One person's legs: where the body was last, how far the gait has come, which way it faces."""

    gait: Gait
    phase: float
    heading: float
    place: Vector | None = None


class Odometry:
    """Where the robot believes to be: exact at first, then off by what its wheels slip."""

    def __init__(self, pose: FloatArray, generator: np.random.Generator) -> None:
        self.pose = pose.copy()
        self._true = pose.copy()
        self._generator = generator

    def update(self, true: FloatArray) -> None:
        """Take the true pose (3,) m, m, rad, a moment later."""
        moved = true - self._true
        turn = (moved[2] + np.pi) % (2 * np.pi) - np.pi
        drift = self.pose[2] - self._true[2]
        c, s = np.cos(drift), np.sin(drift)
        step = np.array([c * moved[0] - s * moved[1], s * moved[0] + c * moved[1]])
        length = float(np.hypot(*step))
        noise = self._generator.normal(size=2)
        self.pose[:2] += step * (1 + _SLIP * noise[0])
        self.pose[2] += turn * (1 + _SLIP * noise[1]) + _TURN_PER_METRE * np.sqrt(length) * self._generator.normal()
        self._true = true.copy()


class Rays(Protocol):
    """What measures: the room's own beams, or those of a physics engine."""

    def sense(self, legs: FloatArray, pose: FloatArray, twist: FloatArray, time: float) -> Scan:
        """Return the scan that begins at `time` (s); arguments as for `Scanner.sense`."""
        ...


class SceneRays:
    """Beams cast into a scene."""

    def __init__(self, scene: Scene, scanner: Scanner, generator: np.random.Generator) -> None:
        self._scene, self._scanner, self._generator = scene, scanner, generator

    def sense(self, legs: FloatArray, pose: FloatArray, twist: FloatArray, time: float) -> Scan:
        """Return one scan, errors included."""
        return self._scanner.sense(self._scene, legs, pose, twist, time, self._generator)[0]


class LabSenses:
    """Stands where a run has its sensor: what it returns comes out of the tracker.

    A scan takes 0.1 s; it is complete at its end, travels `latency` s and may get lost. People are then predicted to
    the present by the tracker.

    Args:
        settings: latency and drop-outs.
        room: what hides people from view, and where those who walk may be heading.
        rays: what the scanner measures.
        people: in the room.
        start: of the robot.
        generator: of gaits, losses and odometry.
        scanner: its rate.
        classifier: None: the one that comes with the package.
    """

    def __init__(
        self,
        settings: LabSettings,
        room: LabRoom,
        *,
        rays: Rays,
        people: Sequence[Person],
        start: RobotState,
        generator: np.random.Generator,
        scanner: Scanner | None = None,
        classifier: LegClassifier | None = None,
    ) -> None:
        self._settings = settings
        self._rays = rays
        self._destinations = room.destinations
        self._walked: dict[str, float] = {}  # s, when each track was last seen to walk
        self._walking = replace(room.scenario.human, goals=room.destinations)
        self._people = people
        self._generator = generator
        self._legs = [
            _Legs(Gait.random(generator), generator.uniform(0, 2 * np.pi), generator.uniform(-np.pi, np.pi))
            for _ in people
        ]
        self._period = 1 / (Scanner() if scanner is None else scanner).rate
        self.odometry = Odometry(pose_of(start), generator)
        self.true_pose = pose_of(start)
        self._scan_pose, self._odometry_then = pose_of(start), pose_of(start)
        self._scan_time = -np.inf
        self._last_bodies = np.zeros((len(people), 2))
        self._on_the_way: deque[tuple[float, Scan]] = deque()
        self.tracker = Tracker(classifier=classifier, walls=obstacles_of(room.scenario))
        self.check = TrackerCheck(room.scene)
        self.scans, self.arrived = 0, 0

    def warm_up(self, people: Sequence[Person], step: float) -> None:
        """Look around before the run."""
        for k in range(-round(_WARM_UP / step), 0):
            self._look(k * step)
        self.scans = self.arrived = 0

    def observe(self, time: float, robot: Vector, people: Sequence[Person]) -> list[PersonObservation]:
        """Return who is there at `time` (s), as far as the tracker can tell."""
        self._look(time)
        found = self.tracker.people(time)
        if time == self._scan_time:
            self.check.update(found, self.odometry.pose, self.true_pose, self._last_bodies)
        return [self._with_destination(person, time) for person in found]

    def _with_destination(self, person: PersonObservation, time: float) -> PersonObservation:
        """Return the observation, with what is known of where someone who walks is going.

        Who stands is not said to be on the way anywhere: furniture that is mistaken for a person is not, and someone
        who stays at their goal would else be expected to set out again at any moment.
        """
        known = self._settings.goals
        if known == "unknown" or not self.tracker.has_moved(person.id):
            return person
        if person.velocity is not None and np.hypot(*person.velocity) > _WALKS:
            self._walked[person.id] = time
        stood = time - self._walked.get(person.id, -np.inf)
        there = np.hypot(*(person.position - self._destinations[0])) < _THERE
        if stood > (_LINGERS if known == "candidates" else _STAYS) and not (known == "known" and there):
            return person
        return replace(
            person,
            goal=self._destinations[0] if known == "known" else None,
            model=self._walking if known == "candidates" else None,
        )

    def move(self, state: RobotState) -> None:
        """Take the robot's true state after a control step."""
        self.true_pose = pose_of(state)
        self.odometry.update(self.true_pose)

    def believed(self, state: RobotState) -> RobotState:
        """Return `state` as the robot itself knows it."""
        pose = self.odometry.pose
        return RobotState(position=pose[:2], heading=float(pose[2]), velocity=state.velocity)

    def _look(self, time: float) -> None:
        """Finish a scan where one is due, and hand over those that have arrived."""
        if time - self._scan_time >= self._period - 1e-6:
            begun = self._scan_time
            if np.isfinite(begun):
                self._finish_scan(begun, time)
            self._scan_time, self._scan_pose = time, self.true_pose.copy()
            self._odometry_then = self.odometry.pose.copy()
            self._last_bodies = self._bodies(time)
        while self._on_the_way and self._on_the_way[0][0] <= time + 1e-9:
            self.tracker.update(self._on_the_way.popleft()[1])
            self.arrived += 1

    def _finish_scan(self, begun: float, time: float) -> None:
        """The scan that began at `begun` (s) is complete: bodies and robot moved evenly in the meantime."""
        duration = time - begun
        twist = (self.true_pose - self._scan_pose) / duration
        twist[2] = ((self.true_pose[2] - self._scan_pose[2] + np.pi) % (2 * np.pi) - np.pi) / duration
        velocities = (self._bodies(time) - self._last_bodies) / duration
        legs = [
            self._walk(k, self._last_bodies[k], velocities[k], duration)
            for k in range(len(self._people))
            if np.isfinite(velocities[k]).all()
        ]
        discs = np.concatenate(legs) if legs else np.zeros((0, 5))
        measured = self._rays.sense(discs, self._scan_pose, twist, begun)
        scan = Scan(time=begun, ranges=measured.ranges, beams=measured.beams, pose=self._odometry_then)
        self.scans += 1
        if self._generator.random() >= self._settings.dropout:
            self._on_the_way.append((time + self._settings.latency, scan))

    def _walk(self, index: int, place: Vector, velocity: Vector, duration: float) -> FloatArray:
        """Return the (2, 5) legs of a person at the beginning of a scan, and carry the gait on to its end."""
        legs = self._legs[index]
        speed = float(np.hypot(*velocity))
        if speed > 0.1:
            legs.heading = float(np.arctan2(velocity[1], velocity[0]))
        discs = legs.gait.legs(place, velocity, legs.heading, legs.phase)
        legs.phase = legs.gait.advance(legs.phase, speed, duration)
        return discs

    def _bodies(self, time: float) -> FloatArray:
        """(P, 2) m, NaN where absent. Who has no past stood there already."""
        places = np.full((len(self._people), 2), np.nan)
        for k, person in enumerate(self._people):
            place = person.position(time)
            if place is None and time < 0:
                place = person.position(0.0)
            if place is not None:
                places[k] = place
        return places
