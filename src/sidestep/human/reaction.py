"""Whether somebody makes room: how far clear of the robot they will pass now, and would have on their earlier course.

A person who is not aware of the robot keeps their course as well as people do; one who minds it gains clearance. What
is weighed is a *gain*: the least distance to the robot's way on the present course (the velocity of the last half
second), less that on the collision course of a moment ago. Both are taken to the same way of the robot, so that what
the robot itself does about the conflict is no evidence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from sidestep._kernels.closest import closest_approach
from sidestep.checks import Checks
from sidestep.human.habits import Habits
from sidestep.types import INSTANT, Path, Vector, sealed

_EVER = 0.01  # share of those who never show that they mind


@dataclass(frozen=True, slots=True, kw_only=True)
class ReactionSettings:
    """When somebody is on a collision course, and what gaining clearance says.

    Attributes:
        margin: m beyond contact; whoever keeps their velocity and comes nearer is on a collision course.
        ahead: s that a velocity is kept; soonest: s; what is nearer in time cannot be reacted to any more.
        slowest: m/s; who is slower has no course.
        pace_time: s over which the course is taken; present velocities are too nervous for that.
        window: s; the oldest collision course within it is what the present course is compared with; it ends with the
            latest one, so that who has cleared the way is still compared with how they came.
        remembered: s after the latest collision course, in which that holds; later, courses older than `window` count
            no more.
        gained: m, by which those who mind the robot pass farther from it.
        doubt: m, standard deviation by which the gain of others strays from 0; doubt_rate: m/s, the same per second
            until they would be nearest (nobody's velocity is kept better, or measured better).
        freedom: of the Student-t which that doubt follows: one wild step proves nothing.
        undecided: share of those who mind the robot but have not shown it yet, `ahead` s before they would be nearest;
            it shrinks with the time that is left.
    """

    margin: float = 0.7
    ahead: float = 4.0
    soonest: float = 1.0
    slowest: float = 0.5
    pace_time: float = 0.5
    window: float = 1.25
    remembered: float = 2.0
    gained: float = 1.3
    doubt: float = 0.2
    doubt_rate: float = 0.15
    freedom: float = 3.0
    undecided: float = 0.5

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        check = Checks(self, "human.reaction")
        check.numbers("margin", "ahead", "pace_time", "window", "gained", "doubt", "freedom", above=0.0)
        check.numbers("soonest", "slowest", "remembered", "doubt_rate", least=0.0)
        check.numbers("undecided", above=0.0, below=1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Way:
    """Where the robot was about to go.

    Attributes:
        time: s; positions: (K, d) m, every `step` s from then on.
    """

    time: float
    positions: Path
    step: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """A person on a collision course: time (s), place (d,) m and velocity (d,) m/s."""

    time: float
    position: Vector
    velocity: Vector


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Facing:
    """A person and the robot that may be in their way.

    Attributes:
        settings: of the judgement.
        way: of the robot, as last known; contact: m between centres at which bodies touch.
        courses: collision courses of the last `settings.window` s before the latest, oldest first.
    """

    settings: ReactionSettings
    way: Way
    contact: float
    courses: tuple[Course, ...] = ()

    def at(self, time: float) -> Self:
        """Return what still counts at `time` s."""
        s = self.settings
        latest = self.courses[-1].time if self.courses else time
        since = latest - s.window if time - latest <= s.remembered + INSTANT else time - s.window
        kept = tuple(c for c in self.courses if since - INSTANT <= c.time <= time + INSTANT)
        return self if len(kept) == len(self.courses) else replace(self, courses=kept)

    def noted(self, habits: Habits, time: float) -> Self:
        """Return the same with the present course, if it is a collision course."""
        s = self.settings
        velocity = habits.velocity_over(s.pace_time)
        if velocity is None or math.hypot(*velocity.tolist()) < s.slowest:
            return self
        if self.courses and time - self.courses[-1].time < 0.5 * habits.settings.gap:
            return self
        near = self.contact + s.margin
        place = habits.position_at(time)
        here, _ = self._nearest(place, np.zeros_like(velocity), time, 0.0)
        distance, when = self._nearest(place, velocity, time, s.ahead)
        if distance >= near or when < s.soonest or here < near + 0.5:
            return self  # no conflict, or too late to do anything about it
        return replace(self, courses=(*self.courses, Course(time=time, position=place, velocity=velocity)))

    def log_ratio(self, habits: Habits, time: float) -> float | None:
        """Return log P(gain | concerned) − log P(gain | unconcerned), or None where there was no collision course.

        log(u + (1 − u)·T((g − G)/s)/T(g/s)), T the Student-t density, s = doubt + doubt_rate·τ, u = undecided·τ/ahead,
        τ s until nearest on the old course. Heavy tails make very large gains and losses less telling again; here they
        tell as much as the most telling ones.
        """
        s, present = self.settings, habits.velocity_over(self.settings.pace_time)
        if present is None or not self.courses or time - self.courses[0].time <= INSTANT:
            return None
        old = self.courses[0]
        then = sealed(old.position + (time - old.time) * old.velocity)
        was, when = self._nearest(then, old.velocity, time, s.ahead)
        now, _ = self._nearest(habits.position_at(time), present, time, s.ahead)
        habitual = s.doubt + s.doubt_rate * when
        width = math.sqrt(habitual**2 + 2.0 * float(habits.sensed(np.array([when]))[0]))
        aim, nu = s.gained / width, s.freedom
        gain = min(max((now - was) / width, 0.5 * (aim - math.sqrt(aim**2 + 4.0 * nu))), aim)
        ratio = ((nu + gain**2) / (nu + (gain - aim) ** 2)) ** (0.5 * (nu + 1.0))
        undecided = max(s.undecided * min(when / s.ahead, 1.0), _EVER)
        return math.log(undecided + (1.0 - undecided) * ratio)

    def _nearest(self, position: Vector, velocity: Vector, time: float, ahead: float) -> tuple[float, float]:
        way = self.way
        return closest_approach(way.positions, way.step, time - way.time, position, velocity, ahead)
