"""The latest of everything that arrives, in the planning frame. May be called from any thread."""

from __future__ import annotations

import threading
from collections import Counter
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.ros.frames import Frames
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import LaserScan, Map, Odometry, People, Target
from sidestep.ros.settings import NodeSettings
from sidestep.ros.watchdog import Watchdog
from sidestep.types import Vector, plausible


class Sensing(Protocol):
    """Who is there: remembers people between messages."""

    def map(self, grid: Map) -> None:
        """Take a map in the planning frame."""
        ...

    def scan(self, scan: LaserScan, pose: Pose2, time: float) -> None:
        """Take a scan, measured at `time` (s) from `pose` in the planning frame."""
        ...

    def people(self, people: People, pose: Pose2, time: float) -> None:
        """Take measured people, given in a frame that lies at `pose`."""
        ...

    def now(self, time: float) -> list[PersonObservation]:
        """Return everyone who is seen, carried forward to `time` (s)."""
        ...

    def clear(self) -> None:
        """Forget everyone."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """What is to be done.

    Attributes:
        number: grows with every new goal; a plan made for another number is not followed. One that was made before the
            map changed is, until it is too old.
        goal: (2,) m in the planning frame, or None.
        map: walls in the planning frame, or None.
    """

    number: int = 0
    goal: Vector | None = None
    map: Map | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Robot:
    time: float
    pose: Pose2
    velocity: Vector
    turn_rate: float


class Inputs:
    """What has arrived, and how fresh it is.

    Args:
        settings: of the node.
        sensing: who is there.
        frames: what lies where.
        lead: m ahead of the middle of the base, of the point that planning moves.
    """

    def __init__(self, settings: NodeSettings, *, sensing: Sensing, frames: Frames, lead: float = 0.0) -> None:
        self._node = settings.node
        self._sensing = sensing
        self._frames = frames
        self._lead = lead
        self._eyes = "scan" if self._node.people_from == "scan" else "people"
        self._watchdog = Watchdog(("odom", self._eyes), self._node.timeout)
        self._lock = threading.Lock()
        self._looking = threading.Lock()
        self._clock = -np.inf
        self._robot: _Robot | None = None
        self._task = Task()
        self._refused: Counter[str] = Counter()
        self.renewed = threading.Event()
        """Set when the task has changed: plan at once."""
        self.looked = threading.Event()
        """Set when there is news of people."""
        self._waiting: dict[str, Target | Map] = {}  # what came in a frame that nobody has placed yet
        if settings.robot.first_goal is not None:
            self.take_goal(Target(frame="", position=np.array(settings.robot.first_goal)))

    @property
    def task(self) -> Task:
        """What is to be done."""
        with self._lock:
            self._place()
            return self._task

    def take_odometry(self, odometry: Odometry | None, now: float) -> None:
        """Take where the robot is (None: a message that could not be used)."""
        with self._lock:
            time = odometry.time if odometry is not None and odometry.time > 0 else now
            pose = None if odometry is None else self._frames.note(odometry, time)
            if odometry is None or pose is None:
                self._refused["odom"] += 1
                self._watchdog.refused("odom")
                return
            turn = Pose2(yaw=pose.yaw - odometry.pose.yaw).rotation  # from the odometry's frame into the planning frame
            self._robot = _Robot(time=time, pose=pose, velocity=turn @ odometry.velocity, turn_rate=odometry.turn_rate)
            self._watchdog.fed("odom", now=now, stamp=odometry.time)

    def take_scan(self, scan: LaserScan | None, now: float) -> None:
        """Take a scan; it is looked at in the caller's thread."""
        with self._lock:
            time = now if scan is None or scan.time <= 0 else scan.time
            pose = None if scan is None else self._frames.scanner(scan.frame, time)
        if scan is not None and pose is not None and not self._to_come(time, now):
            with self._looking:
                self._sensing.scan(scan, pose, time)
        self._seen(scan is not None and pose is not None, now, 0.0 if scan is None else scan.time)

    def take_people(self, people: People | None, now: float) -> None:
        """Take measured people."""
        with self._lock:
            time = now if people is None or people.time <= 0 else people.time
            pose = None if people is None else self._frames.locate(people.frame, time)
        if people is not None and pose is not None and not self._to_come(time, now):
            with self._looking:
                self._sensing.people(people, pose, time)
        self._seen(people is not None and pose is not None, now, 0.0 if people is None else people.time)

    def take_goal(self, target: Target | None) -> None:
        """Take a new goal; the old one is void, even if the frame of the new one is not known yet."""
        with self._lock:
            if target is None or not plausible(target.position):
                self._refused["goal"] += 1
                return
            self._renew(None)
            self._waiting["goal"] = target
            self._place()
        self.renewed.set()

    def take_map(self, grid: Map | None) -> None:
        """Take a map of walls."""
        with self._lock:
            if grid is None:
                self._refused["map"] += 1
                return
            self._waiting["map"] = grid
            self._place()
        self.renewed.set()

    def notice(self, now: float) -> None:
        """Forget what was measured when the clock has jumped back, as when a recording starts again.

        Called from one thread only: two threads that read the clock may bring what they read in the wrong order.
        """
        with self._lock:
            jumped, self._clock = now < self._clock, now
            if not jumped:
                return
            self._robot = None
            self._watchdog.clear()
            self._frames.clear()
            self._renew(self._task.goal)
        with self._looking:
            self._sensing.clear()

    def robot(self, now: float) -> RobotState | None:
        """The robot, carried forward from its last measurement to `now`; None before the first one.

        It goes on in its own frame as it did. The velocity is that of the point that planning moves: turning counts.
        """
        with self._lock:
            known = self._robot
        if known is None:
            return None
        ahead = min(max(now - known.time, 0.0), self._node.timeout)
        pose = known.pose.moved(known.velocity, known.turn_rate, ahead)
        turned = Pose2(yaw=known.turn_rate * ahead).rotation @ known.velocity
        swung = known.turn_rate * self._lead * pose.rotation[:, 1]
        return RobotState(position=pose.position, heading=pose.yaw, velocity=turned + swung)

    def people(self, now: float) -> list[PersonObservation] | None:
        """Return everyone who is seen, carried forward to `now`; None where nothing has come since the last call."""
        if not self.looked.is_set():
            return None
        self.looked.clear()
        return self.seen(now)

    def seen(self, now: float) -> list[PersonObservation]:
        """Return everyone who is seen, as `people`, whether or not there is news."""
        with self._looking:
            return self._sensing.now(now)

    def complaint(self, now: float, wall: float) -> str:
        """Why the inputs do not allow to move, or ""; see `Watchdog.complaint`."""
        with self._lock:
            lost = [f"the {what} is in frame {given.frame!r}, unknown" for what, given in self._waiting.items()]
            return self._watchdog.complaint(now, wall) or "".join(lost[:1])

    @property
    def complete(self) -> bool:
        """Return whether everything that is needed has come at least once."""
        with self._lock:
            return not self._watchdog.waits()

    def health(self, now: float) -> tuple[dict[str, float], dict[str, float], dict[str, int]]:
        """Rates (Hz) and ages (s) of the inputs, and how many messages could not be used."""
        with self._lock:
            names = self._watchdog.required
            rates = {name: self._watchdog.rate(name, now) for name in names}
            return rates, {name: self._watchdog.age(name, now) for name in names}, dict(self._refused)

    def _to_come(self, time: float, now: float) -> bool:
        """Whether a stamp (s) lies so far ahead that the watchdog stops the robot for it.

        Looked at, what comes stamped rightly afterwards would be taken for late until then.
        """
        return self._watchdog.wrong_clock(time, now) > 0

    def _place(self) -> None:
        """Move a waiting goal or map into the planning frame as soon as its own frame is known."""
        for what, given in list(self._waiting.items()):
            pose = self._frames.locate(given.frame)
            if pose is None:
                continue
            del self._waiting[what]
            if isinstance(given, Target):
                self._renew(pose.apply(given.position))
            else:
                here = replace(given, frame=self._node.frame, origin=pose.after(given.origin))
                if not here.same_as(self._task.map):  # who draws maps sends them every few seconds, changed or not
                    self._sensing.map(here)
                    self._task = replace(self._task, map=here)

    def _renew(self, goal: Vector | None) -> None:
        self._task = replace(self._task, number=self._task.number + 1, goal=goal)

    def _seen(self, good: bool, now: float, stamp: float) -> None:
        with self._lock:
            if good:
                self._watchdog.fed(self._eyes, now=now, stamp=stamp)
            else:
                self._refused[self._eyes] += 1
                self._watchdog.refused(self._eyes)
        if good:
            self.looked.set()
