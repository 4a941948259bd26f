"""A finished record behind the same interface as a live session: played, paused, stepped and scrubbed."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from sidestep.lattice import Lattice
from sidestep.simulation.metrics import arrival
from sidestep.simulation.record import Record, Snapshot
from sidestep.types import FloatArray
from sidestep.viewer.live import messages, stage, words
from sidestep.viewer.live.chronicle import flat, outcome, paths, samples
from sidestep.viewer.live.heat import Heat, paint
from sidestep.viewer.live.wire import Packet, numbers, text, with_images

MOST_WAITING = 256  # messages kept between two ticks
SNAPSHOT_AGE = 2.0  # s, beyond which a kept prediction is not shown


class Replay:
    """Same methods as `Session`, for what has happened. 1-D records are shown as a line, 3-D ones from above."""

    def __init__(self, record: Record) -> None:
        self.running = False
        self.pace = 1.0
        self.index = 0
        self._record = record
        self._robot = flat(record.robot_positions)
        self._people = flat(record.people_positions)
        self._plans = flat(record.plans)
        self._goal = flat(record.robot_goal[np.newaxis])[0]
        self._clock = 0.0
        self._shown = -1
        self._greet = True
        self._inbox: deque[messages.Message] = deque(maxlen=MOST_WAITING)

    @property
    def interval(self) -> float:
        """Seconds between two ticks."""
        return stage.CONTROL_STEP

    @property
    def last(self) -> int:
        """Index of the last recorded instant."""
        return len(self._record.time) - 1

    def post(self, message: messages.Message) -> None:
        """Take a message from the browser; it acts at the next tick."""
        self._inbox.append(message)

    def greet(self) -> None:
        """Tell the browser everything again at the next tick."""
        self._greet = True

    def record(self, panel: int = 0) -> Record:
        """Return the record that is shown."""
        del panel
        return self._record

    def tick(self) -> list[Packet]:
        """Take in what was posted, go on if playing, and return what to send."""
        while self._inbox:
            self._act(self._inbox.popleft())
        if self.running:
            self._seek_time(self._clock + self.interval)
        packets: list[Packet] = []
        if self._greet:
            self._greet = False
            self._shown = -1
            packets = [self.scene(), self._history()]
        if self.index != self._shown:
            self._shown = self.index
            packets.append(self._plan_packet())
        return [*packets, self.frame()]

    def scene(self) -> str:
        """Return what does not change from frame to frame."""
        r = self._record
        radii = zip(r.people, r.people_radii, strict=True)
        return text(
            type="scene",
            mode="record",
            name=r.scenario,
            bounds=list(self._bounds()),
            walls=[numbers(wall) for wall in r.walls],
            panels=[{"title": r.scenario, "radius": r.robot_radius, "kind": "holonomic"}],
            people=[{"id": name, "radius": float(radius), "you": name == "you"} for name, radius in radii],
            limit=r.risk_limit,
            summed=r.risk_rule == "trajectory",
            clearance=r.clearance,
            contact=r.robot_radius + float(np.max(r.people_radii, initial=0.0)),
            horizon=r.risk.shape[1],
            step=r.time_step,
            steps=self.last,
            length=float(r.time[-1] - r.time[0]),
            outcome=outcome(r),
        )

    def frame(self) -> str:
        """Return everything that moves, between two recorded instants where the clock is between them."""
        r, i = self._record, self.index
        after = min(i + 1, self.last)
        gap = float(r.time[after] - r.time[i])
        share = min(1.0, (self._clock - float(r.time[i] - r.time[0])) / gap) if gap > 0 else 0.0
        robot = (1 - share) * self._robot[i] + share * self._robot[after]
        people = (1 - share) * self._people[i] + share * self._people[after]
        drift = (self._people[after] - self._people[i]) / gap if gap > 0 else np.zeros_like(people)
        gaps = np.linalg.norm(people - robot, axis=1)
        nearest = int(np.nanargmin(gaps)) if np.isfinite(gaps).any() else None
        step = min(i, len(r.status) - 1)
        panel = {
            "robot": numbers(np.array([*robot, self._heading(step)])),
            "speed": round(float(np.linalg.norm(r.robot_velocities[step])), 3),
            "goal": numbers(self._goal),
            "people": [[*numbers(p), _angle(v)] for p, v in zip(people, drift, strict=True)],
            "walking": [_angle(v) is not None for v in drift],
            "beliefs": numbers(r.beliefs[step], 4),
            "nearest": nearest,
            "distance": None if nearest is None else round(float(gaps[nearest]), 3),
            "status": self._status(step),
            "words": self._words(step, nearest, gaps),
            "score": "",
            "trip": 1,
            "times": [],
        }
        return text(
            type="frame",
            time=round(self._clock, 3),
            index=i,
            running=self.running,
            pace=round(self.pace, 3),
            hand=None,
            trouble="",
            panels=[panel],
        )

    def _act(self, message: messages.Message) -> None:
        if isinstance(message, messages.Seek):
            self._seek(message.index)
        elif isinstance(message, messages.Transport):
            if message.type == "play" and self.index >= self.last:
                self._seek(0)
            if message.type == "step":
                self._seek(self.index + 1)
            elif message.type == "reset":
                self._seek(0)
            self.running = message.type == "play"

    def _seek(self, index: int) -> None:
        self.index = min(max(index, 0), self.last)
        self._clock = float(self._record.time[self.index] - self._record.time[0])

    def _seek_time(self, clock: float) -> None:
        since = self._record.time - self._record.time[0]
        self._clock = min(clock, float(since[-1]))
        self.index = int(np.searchsorted(since, self._clock + 1e-9, side="right")) - 1
        self.running = self.running and self._clock < float(since[-1])

    def _bounds(self) -> stage.Bounds:
        points = np.concatenate([self._robot, self._people.reshape(-1, 2), self._goal[np.newaxis], *self._record.walls])
        return stage.around(points[np.isfinite(points).all(axis=1)])

    def _heading(self, step: int) -> float:
        heading = float(self._record.robot_headings[step])
        if math.isfinite(heading):
            return heading
        v = flat(self._record.robot_velocities)[step]
        return math.atan2(v[1], v[0]) if float(np.linalg.norm(v)) > words.WAITING else math.nan

    def _status(self, step: int) -> str:
        if self.index >= self.last and self._record.reached_goal:
            return "arrived"
        return self._record.status[step]

    def _words(self, step: int, nearest: int | None, gaps: FloatArray) -> str:
        r = self._record
        if self._status(step) == "arrived":
            return words.arrived(arrival(r) - float(r.time[0]), back=False)
        belief = math.nan if nearest is None else float(r.beliefs[step, nearest])
        risk = float(r.limited_risk[step])
        situation = words.Situation(
            you=nearest is not None and r.people[nearest] == "you",
            status=r.status[step],
            speed=float(np.linalg.norm(r.robot_velocities[step])),
            distance=None if nearest is None else float(gaps[nearest]),
            belief=belief if math.isfinite(belief) else None,
            risk=risk if math.isfinite(risk) else None,
            summed=r.risk_rule == "trajectory",
            limit=r.risk_limit,
            contact=r.robot_radius + (0.0 if nearest is None else float(r.people_radii[nearest])),
        )
        return words.describe(situation)

    def _plan_packet(self) -> bytes:
        r = self._record
        step = min(self.index, len(r.status) - 1)
        known = np.isfinite(self._plans[step]).all(axis=1)
        heats = self._heats(step)
        return with_images(
            heats,
            type="plan",
            panel=0,
            time=round(self._clock, 3),
            limit=r.risk_limit,
            positions=numbers(self._plans[step][known]) if known.sum() > 1 else [numbers(self._robot[step])] * 2,
            risk=numbers(r.risk[step], 5) if known.sum() > 1 else [],
            collision=numbers(r.collision_probability[step], 5),
            step=r.time_step,
            sample=None,
        )

    def _heats(self, step: int) -> list[Heat]:
        """The last predictions kept before this step; none where they are too old."""
        oldest = max(1, round(SNAPSHOT_AGE / self._record.control_step))
        shots = [s for s in self._record.snapshots if 0 <= step - s.step <= oldest]
        newest = max((s.step for s in shots), default=-1)
        return [_painted(s) for s in shots if s.step == newest]

    def _history(self) -> str:
        return text(type="history", panel=0, samples=samples(self._record), paths=paths(self._record))


def _angle(velocity: FloatArray) -> float | None:
    if not np.isfinite(velocity).all() or float(np.linalg.norm(velocity)) < 0.15:
        return None
    return round(math.atan2(velocity[1], velocity[0]), 3)


def _painted(shot: Snapshot) -> Heat:
    width = shot.probability.shape[1]
    lattice = Lattice(origin=shot.origin, spacing=shot.spacing, radius=(width - 1) // 2, rotation=shot.rotation)
    spread = (shot.weights, shot.sigmas) if shot.weights.size else None
    return paint(shot.probability, lattice, tuple(int(k) for k in shot.instants), spread)
