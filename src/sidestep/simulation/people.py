"""Simulated people, told apart from the predictor: they may behave by other parameters, or by another model at all.

A kind of person is a name in a scenario and a builder: those of `built_in_kinds`, and those passed to `simulate`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sidestep.errors import UnknownName
from sidestep.simulation.recordings import EDGE, Track
from sidestep.simulation.settings import MODEL_KINDS
from sidestep.types import BoolArray, FloatArray, Path, Vector, frozen_array

if TYPE_CHECKING:
    from sidestep.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """What a person knows when deciding.

    Attributes:
        time: s.
        time_step: s, between the positions of `robot_path`.
        robot_path: (K+1, d) m, the robot's announced motion from now on.
        robot_velocity: (d,) m/s; robot_radius: m.
        others: (P, d) m, positions of all people, NaN where absent; the person's own is row `index`.
        velocities: (P, d) m/s, of all people, over the last step.
        index: row of the person who decides.
        obstacles: walls (`sidestep.obstacles.Obstacles`), or None.
        signal: the robot makes itself noticed.
    """

    time: float
    time_step: float
    robot_path: Path
    robot_velocity: Vector
    robot_radius: float
    others: FloatArray
    velocities: FloatArray
    index: int
    obstacles: Any
    signal: bool

    def company(self) -> BoolArray:
        """Return (P,) who is there besides the person who decides."""
        somebody_else = np.arange(len(self.others)) != self.index
        return np.isfinite(self.others).all(axis=1) & somebody_else


class Person(Protocol):
    """One simulated or recorded person. `decide`, then `move`, once per control step."""

    @property
    def id(self) -> str:
        """Identity."""
        ...

    @property
    def radius(self) -> float:
        """Metres."""
        ...

    @property
    def goal(self) -> Vector | None:
        """(d,) m, where the person set out for; None where nobody knows."""
        ...

    @property
    def told_goal(self) -> Vector | None:
        """(d,) m, the goal that the planner is told; None: it has to infer it."""
        ...

    @property
    def awareness(self) -> float:
        """True β now: 1 concerned, 0 unconcerned, NaN where there is no such thing."""
        ...

    def position(self, time: float) -> Vector | None:
        """(d,) m at `time`, now or in the past (before the run, too, where it is known); None while absent."""
        ...

    def decide(self, around: Surroundings) -> None:
        """Choose what to do next, knowing the robot's announced motion."""
        ...

    def move(self, start: float, end: float) -> None:
        """Carry it out from `start` to `end` (s)."""
        ...


Builder = Callable[["Scenario", int, np.random.Generator], Person]
"""(scenario, index of the person, the person's own generator) → person."""


class Recorded:
    """Someone from a recording, who never reacts.

    Args:
        track: where they were.
        offset: s, time of the recording at which the run starts.
        radius: m.
    """

    def __init__(self, track: Track, offset: float, radius: float) -> None:
        self.track = track
        self.offset = offset
        self.id = track.agent
        self.radius = radius
        self.goal: Vector | None = None
        self.told_goal: Vector | None = None
        self.awareness = float("nan")
        self._stays = [(float(begin) - EDGE, float(end) + EDGE) for begin, end in track.stays]

    def position(self, time: float) -> Vector | None:
        """As recorded; None before and after the track, and in its gaps."""
        t = time + self.offset
        return self.track.at(t) if any(begin <= t <= end for begin, end in self._stays) else None

    def velocity_before(self, time: float, window: float) -> Vector | None:
        """Mean velocity (d,) m/s over the samples of the last `window` s up to `time`; None without a past."""
        return self.track.velocity_before(time + self.offset, window)

    def decide(self, around: Surroundings) -> None:
        """Recorded people have decided long ago."""

    def move(self, start: float, end: float) -> None:
        """Positions come from the track."""


def build_people(
    scenario: Scenario,
    generators: list[np.random.Generator],
    *,
    kinds: Mapping[str, Builder] | None = None,
) -> list[Person]:
    """Return the simulated people of a scenario, each with a generator of their own.

    Args:
        scenario: whose `people` are built.
        generators: one per person.
        kinds: further kinds by name.

    Raises:
        UnknownName: a person is of a kind that nobody can build.
    """
    known = dict(built_in_kinds()) | dict(kinds or {})
    people: list[Person] = []
    for i, settings in enumerate(scenario.people):
        if settings.kind not in known:
            raise UnknownName(f"people.{i}.kind", settings.kind, known)
        people.append(known[settings.kind](scenario, i, generators[i]))
    return people


def built_in_kinds() -> Mapping[str, Builder]:
    """Kinds of people that a scenario may name: by the model of Eq. 2, simple ones, and those of other models."""
    from sidestep.simulation import crowd_people, walkers

    model = dict.fromkeys(MODEL_KINDS, walkers.ModelWalker)
    simple = {"straight": walkers.StraightWalker, "standing": walkers.Stander}
    return {**model, **simple, **crowd_people.crowd_kinds()}


def point_or_none(values: tuple[float, ...] | None) -> Vector | None:
    """(d,) m, or None."""
    return None if values is None else frozen_array(values)
