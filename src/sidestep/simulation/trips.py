"""Trips through recorded crowds: a way that a blind robot could not go, and on which it starts safely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.simulation.recordings import Recording
from sidestep.types import FloatArray

_LENGTHS = ((7.0, 10.0), (4.0, 7.0))  # m, wanted; where no such trip fits
_ATTEMPTS = 4000
_ROOM = 1.5  # m, free around the robot at the start
_EDGE = 0.5  # m, beyond where people walk
_PATIENCE = 10.0  # s after the earliest arrival in which the goal must be free half of the time


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """A robot's task in a recording.

    Attributes:
        time: s of the recording at which the robot starts.
        start, goal: (2,) m.
        shortest: s, straight on at full speed.
    """

    time: float
    start: tuple[float, float]
    goal: tuple[float, float]
    shortest: float


def choose_trip(
    recording: Recording,
    generator: np.random.Generator,
    *,
    speed: float,
    contact: float,
    clearance: float,
    time: float | None = None,
) -> Trip:
    """Return a trip of 7–10 m (4–7 m in a small place) on which a robot that went straight would touch someone.

    Args:
        recording: with the people only.
        generator: chooses among the possible trips.
        speed: m/s, of the robot.
        contact: m between centres.
        clearance: m, around the goal.
        time: s of the recording at which it has to start; None: at any.

    Raises:
        InvalidInput: the recording has no place or time for such a trip.
    """
    crowd = _Crowd(recording)
    for lengths in _LENGTHS:
        for _ in range(_ATTEMPTS):
            trip = _candidate(crowd, generator, speed, lengths, time)
            if trip is not None and _good(crowd, trip, speed, contact, clearance):
                return trip
    when = "" if time is None else f" from {time:g} s on"
    raise InvalidInput(
        "scene",
        recording.name,
        f"one with people in whose way a robot at {speed:g} m/s can go at least {_LENGTHS[-1][0]:g} m{when}",
        "choose another scene or start, or give robot.start and robot.goal",
    )


class _Crowd:
    """Everyone's positions at all sampling instants of a scene."""

    def __init__(self, recording: Recording) -> None:
        if not recording.tracks:
            raise InvalidInput("scene", recording.name, "one with people in it", "choose another scene")
        count = round((recording.end - recording.start) / recording.interval) + 1
        self.times: FloatArray = recording.start + recording.interval * np.arange(count, dtype=np.float64)
        self.places = np.stack([track.at(self.times) for track in recording.tracks], axis=1)  # (K, P, 2) m
        known = self.places[np.isfinite(self.places[..., 0])]
        self.low, self.high = known.min(axis=0) - _EDGE, known.max(axis=0) + _EDGE

    def index(self, time: float) -> int:
        return int(np.clip(np.searchsorted(self.times, time - 1e-6), 0, len(self.times) - 1))

    def gaps(self, points: FloatArray, first: int) -> FloatArray:
        """(K', P) m from points (K', 2) at the instants from `first` on; infinite where someone is absent."""
        there = self.places[first : first + len(points)]
        gaps = np.linalg.norm(there - points[: len(there), None], axis=-1)
        return np.where(np.isnan(gaps), np.inf, gaps)


def _candidate(
    crowd: _Crowd, generator: np.random.Generator, speed: float, lengths: tuple[float, float], time: float | None
) -> Trip | None:
    """A line through a place where someone will be just when the robot would be there."""
    first = crowd.index(time) if time is not None else int(generator.integers(len(crowd.times)))
    length, angle = generator.uniform(*lengths), generator.uniform(0.0, 2 * np.pi)
    before = generator.uniform(0.25, 0.75) * length
    meeting = crowd.index(crowd.times[first] + before / speed)
    present = np.flatnonzero(np.isfinite(crowd.places[meeting, :, 0]))
    if not len(present) or crowd.times[-1] < crowd.times[first] + length / speed:
        return None
    place = crowd.places[meeting, generator.choice(present)]
    way = np.array([np.cos(angle), np.sin(angle)])
    start, goal = place - before * way, place + (length - before) * way
    if not all((crowd.low <= p).all() and (p <= crowd.high).all() for p in (start, goal)):
        return None
    return Trip(
        time=round(float(crowd.times[first]), 6),
        start=(round(float(start[0]), 3), round(float(start[1]), 3)),
        goal=(round(float(goal[0]), 3), round(float(goal[1]), 3)),
        shortest=length / speed,
    )


def _good(crowd: _Crowd, trip: Trip, speed: float, contact: float, clearance: float) -> bool:
    first = crowd.index(trip.time)
    start, goal = np.array(trip.start), np.array(trip.goal)
    step = float(crowd.times[1] - crowd.times[0]) if len(crowd.times) > 1 else trip.shortest
    if crowd.gaps(start[None], first).min() < max(_ROOM, clearance):
        return False
    travelled = np.minimum(np.arange(0.0, trip.shortest + step, step) * speed / np.linalg.norm(goal - start), 1.0)
    blind = start + travelled[:, None] * (goal - start)
    if crowd.gaps(blind, first).min() >= contact:
        return False
    arrival = crowd.index(trip.time + trip.shortest)
    wait = np.repeat(goal[None], max(round(_PATIENCE / step), 1), axis=0)
    return bool((crowd.gaps(wait, arrival).min(axis=1) >= clearance).mean() >= 0.5)
