"""Several robots: each plans with what the others have announced as known moving obstacles, in the order of priority.

    for planner in planners:                        # first the robot that goes first
        planner.announce([what the others announced])
        plan = planner.step(...)

A robot that goes first has planned for now: its next motion is known. One that comes later has announced what it
planned at the last call; it may do that, or stop instead. A first motion is taken only if it, and the stop after it,
clear all of these and the stops after them. So a robot that finds nothing better stops, which all others have reckoned
with: nobody drives into anybody, as long as the bases do what they are told.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import count
from types import MappingProxyType

import numpy as np

from sidestep.checks import WIDEST, measured, measured_number, of_kind
from sidestep.detour import Disc
from sidestep.forecast import Forecast
from sidestep.human.observation import PersonObservation
from sidestep.ladder import Outcome
from sidestep.lattice import Lattice
from sidestep.lazily import lazy
from sidestep.planner import Planner
from sidestep.planning.plan import Plan
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.settings import CLEARANCE_MARGIN, FIRST_STEP_MARGIN
from sidestep.planning.stopping import Inertia
from sidestep.prediction.collision import RiskField
from sidestep.prediction.first_step import FirstStep
from sidestep.prediction.person_mass import PersonMass
from sidestep.robots import DifferentialDrive, RobotState
from sidestep.robots.until_standing import slices, slid, until_standing
from sidestep.situation import STANDS, Situation
from sidestep.types import LARGEST, FloatArray, Path, Vector, VectorLike, plausible

LEAST_MARGIN = 0.01  # m beyond contact, below which the robot stops
_SAME = 1e-9  # m; what comes nearer by less does not


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Announced:
    """What another robot has announced.

    What is in it is not judged here: `FleetPlanner.step` stops where it cannot tell where the other robot will be.

    Attributes:
        path: (K+1, d) m, K ≥ 1, of the point that planning moves (`Plan.positions`), from now on at multiples of the
            time step; past its end the robot stands.
        radius: m, of a disc around that point which covers the body: its `planning_radius`. That of the body itself
            leaves out how far a base with two wheels reaches back from its point.
        settled: it was planned for now and is what the robot will do; else the robot may stop instead.
        velocity: (d,) m/s, of that point now; None: as at the beginning of the path.
        acceleration: m/s², which it brakes with (its `planning_acceleration`); None: it can stop at once.
        age: s since the announcement was made, as over a slow network; negative counts as 0. Path and velocity are then
            those of that time, and nobody knows what the robot has decided since.
    """

    path: Path
    radius: float
    settled: bool
    velocity: Vector | None = None
    acceleration: float | None = None
    age: float = 0.0

    def __post_init__(self) -> None:
        keep = object.__setattr__
        keep(self, "path", measured("announced.path", self.path, "(K + 1, d) numbers (m), K ≥ 1"))
        keep(self, "radius", measured_number("announced.radius", self.radius))
        if self.velocity is not None:
            keep(self, "velocity", measured("announced.velocity", self.velocity, "(d,) numbers (m/s), or none"))
        if self.acceleration is not None:
            keep(self, "acceleration", measured_number("announced.acceleration", self.acceleration))

    def unusable(self, dimension: int, oldest: float = math.inf) -> str:
        """Say why nobody can tell where the robot will be, or ''; an announcement may be `oldest` s old."""
        shape = self.path.shape
        if len(shape) != 2 or shape[0] < 2 or shape[1] != dimension:
            return f"another robot announced a path of shape {shape}, not (K + 1, {dimension}) with K ≥ 1"
        if not plausible(self.path.ravel()):
            return "another robot announced a path that is not finite, or beyond 1e9 m"
        if not 0.0 < self.radius <= WIDEST:
            return f"another robot announced a radius of {self.radius} m"
        if self.velocity is not None and (self.velocity.shape != (dimension,) or not plausible(self.velocity)):
            return f"another robot announced a velocity of {self.velocity.tolist()}, not {dimension} finite numbers"
        if self.acceleration is not None and not 0.0 < self.acceleration <= LARGEST:
            return f"another robot announced an acceleration of {self.acceleration} m/s²"
        if not self.age <= oldest:
            return f"another robot's announcement is {self.age} s old, more than {oldest:g} s"
        return ""

    def carried(self, time_step: float) -> Announced:
        """Return what a late announcement tells of now; one that is not late, or cannot be used, as it is.

        Args:
            time_step: s, between the places of the path.
        """
        if not 0.0 < self.age < math.inf or self.path.ndim != 2 or self.unusable(self.path.shape[1]):
            return self
        late = self.age / time_step
        instants = late + np.arange(max(len(self.path) - int(late), 2))
        path = np.stack([np.interp(instants, np.arange(len(self.path)), x) for x in self.path.T], axis=1)
        velocity = self.velocity if late < 1.0 and self.velocity is not None else (path[1] - path[0]) / time_step
        return replace(self, path=path, velocity=velocity, settled=False)

    def doubled(self, blocks: int) -> FloatArray:
        """Return (blocks, d) m, where the robot is at the half instants from 0 on."""
        whole = np.minimum(np.arange(blocks) / 2.0, len(self.path) - 1)
        return np.stack([np.interp(whole, np.arange(len(self.path)), x) for x in self.path.T], axis=1)

    def motions(self, time_step: float, interval: float) -> FloatArray:
        """Return (1 or 2, T, d) m, where it may be every `SLICE` s, as planned for `interval` s and on until it stands.

        Args:
            time_step: s, between the places of the path; interval: s until the next call.
        """
        means = (self.path[1:2] - self.path[:1]) / time_step
        asked, braked, now = means, self.acceleration, means[0] if self.velocity is None else self.velocity
        if braked is not None:
            asked = Inertia(velocity=now, acceleration=braked, time_step=time_step, interval=interval).asked(means)
        may = asked if self.settled else np.concatenate([asked, np.zeros_like(asked)])
        return slid(self.path[0], now, may, interval, braked)

    def first_velocities(self, time_step: float, interval: float) -> FloatArray:
        """Return (1 or 2, d) m/s: how it may move until the next call, on the mean."""
        if self.acceleration is None:
            going = (self.path[1] - self.path[0]) / time_step
            return going[None] if self.settled else np.stack([going, np.zeros_like(going)])
        places = self.motions(time_step, interval)
        return (places[:, slices(interval)] - places[:, 0]) / interval


class FleetPlanner(Planner):
    """A `Planner` that makes room for other robots as it does for people. Arguments as for `Planner`."""

    _others: tuple[Announced, ...] = ()
    _places: Mapping[int, Vector] = MappingProxyType({})  # (d,) m by number, where other robots were seen last

    def announce(self, others: Sequence[Announced]) -> None:
        """Take what the others have announced, in any order; it counts until the next announcement."""
        for other in others:
            of_kind("announce.others", other, Announced)
        self._others = tuple(other.carried(self.settings.time_step) for other in others)

    def reset(self) -> None:
        """Forget everybody, the other robots too."""
        super().reset()
        self._others, self._places = (), MappingProxyType({})

    def _trouble(self, time: float, robot: RobotState, people: Sequence[PersonObservation] | None) -> str:
        trouble = super()._trouble(time, robot, people)
        d, oldest = self.goal.size, self.settings.timeout
        return trouble or next(filter(None, (other.unusable(d, oldest) for other in self._others)), "")

    def _plan(self, now: Situation, outcome: Outcome, started: float) -> Plan:
        """A stop where the plan would come too close to another robot."""
        plan = super()._plan(now, outcome, started)
        if isinstance(now, AmongRobots) and now.collides(plan.velocity):
            return self._stopped(now.time, now.state, "another robot has the way", started)
        return plan

    def _discs(self) -> dict[str, Disc]:
        """Other robots may stand in the way, too. They have numbers for names, which no person could have."""
        numbers = _numbered([other.path[0] for other in self._others], self._places)
        told = dict(zip(numbers, self._others, strict=True))
        self._places = {**self._places, **{number: other.path[0] for number, other in told.items()}}
        return super()._discs() | {f"\0{n}": Disc(other.path[0], other.radius, "robots") for n, other in told.items()}

    def _situation(self, time: float, robot: RobotState, started: float, wish: VectorLike | None) -> Situation:
        now = super()._situation(time, robot, started, wish)
        return AmongRobots(**{f.name: getattr(now, f.name) for f in fields(now)}, others=self._others)


@dataclass(frozen=True, kw_only=True, eq=False)
class AmongRobots(Situation):
    """A situation with other robots in it.

    Attributes:
        others: what they have announced.
    """

    others: tuple[Announced, ...] = ()

    @lazy
    def beset(self) -> bool:
        """Whether the robot had better leave: because of people, or since another robot stands within its margin."""
        return super().beset or (not self._anybody_comes and any(map(self._stands_too_near, self.others)))

    @property
    def among_robots(self) -> bool:
        """Whether another robot can come near within the horizon."""
        far, blocks = self.around.horizon * self.around.time_step * self.around.robot_speed, 2 * self.around.horizon + 1
        return any(
            float(np.sqrt(np.square(other.doubled(blocks) - self.start).sum(axis=1)).min())
            < self._clearance(other) + far
            for other in self.others
        )

    def collides(self, asked: Vector) -> bool:
        """Whether asking for (d,) m/s, and stopping then, comes nearer than allowed to what another robot may do."""
        velocity, braked = (None, None) if self.inertia is None else (self.inertia.velocity, self.inertia.acceleration)
        interval = self.around.interval
        ways = [(slid(self.start, velocity, asked[None], interval, braked)[0], self.robot.planning_radius)]
        swings = isinstance(self.robot, DifferentialDrive) and braked is not None  # its axle, on the way to a stop
        if swings:
            ways.append((until_standing(self.robot, self.state, asked[None], interval)[0], self.robot.radius))
        for other in self.others:
            for theirs in other.motions(self.settings.time_step, interval):
                for own, radius in ways:
                    least = min(radius + other.radius + LEAST_MARGIN, math.dist(own[0], theirs[0]) - _SAME)
                    if _nearest(own, theirs) < least:
                        return True
        return False

    def _clearance(self, other: Announced) -> float:
        """Metres between the points that planning moves that plans keep from another robot."""
        return self.robot.planning_radius + other.radius + CLEARANCE_MARGIN

    def _stands_too_near(self, other: Announced) -> bool:
        """Whether another robot stands nearer than plans keep from it."""
        going = other.first_velocities(self.settings.time_step, self.around.interval)
        near = math.dist(other.path[0], self.start) < self._clearance(other)
        return near and float(np.abs(going).max()) < STANDS

    def problem_under(self, seen: Forecast) -> PlanningProblem:
        """Return Eq. 9 under a prediction, in which other robots count like people who are sure of their way."""
        problem = Situation.problem_under(self, seen)
        if not self.others:
            return problem
        return replace(problem, people=self._field(problem.people), first_step=self._first_step(problem.first_step))

    def _field(self, people: RiskField | None) -> RiskField:
        blocks = 2 * self.around.horizon + 1
        masses = [] if people is None else list(people.people)
        distances = np.zeros(0) if people is None else people.distances
        for other in self.others:
            masses += [_at(place, b, blocks) for b, place in enumerate(other.doubled(blocks))]
            distances = np.concatenate([distances, np.full(blocks, self._clearance(other))])
        return RiskField(people=masses, distances=distances, midway=self.around.midway)

    def _first_step(self, people: FirstStep | None) -> FirstStep | None:
        """Add what the others may do until the next call; each possibility counts as more than is allowed."""
        if self.around.first_step_limit is None:
            return None
        d = self.start.size
        known = people or FirstStep(
            positions=np.zeros((0, d)), sigmas=np.zeros(0), person=np.zeros(0, dtype=np.int64),
            velocities=np.zeros((0, d)), probabilities=np.zeros(0), distances=np.zeros(0),
            interval=self.around.interval, limit=self.around.first_step_limit,
        )  # fmt: skip
        told = [other.first_velocities(self.settings.time_step, self.around.interval) for other in self.others]
        keep = [self.robot.planning_radius + other.radius + FIRST_STEP_MARGIN for other in self.others]
        rows = len(known.positions) + np.repeat(np.arange(len(told)), [len(v) for v in told])
        return replace(
            known,
            positions=np.concatenate([known.positions, [other.path[0] for other in self.others]]),
            sigmas=np.concatenate([known.sigmas, np.full(len(told), 1e-6)]),
            person=np.concatenate([known.person, rows]),
            velocities=np.concatenate([known.velocities, *told]),
            probabilities=np.concatenate([known.probabilities, *(np.full(len(v), 1.0 / len(v)) for v in told)]),
            distances=np.concatenate([known.distances, keep]),
        )


def _numbered(places: Sequence[Vector], before: Mapping[int, Vector]) -> list[int]:
    """Which robot is at each of the places (d,) m: the nearest one `before`, closest pairs first; else a new one."""
    known = {number: place for number, place in before.items() if all(place.size == now.size for now in places)}
    pairs = sorted((math.dist(now, known[n]), i, n) for i, now in enumerate(places) for n in known)
    found: dict[int, int] = {}
    for _, i, number in pairs:
        if i not in found and number not in found.values():
            found[i] = number
    new = (number for number in count() if number not in known)
    return [found[i] if i in found else next(new) for i in range(len(places))]


def _nearest(one: Path, other: Path) -> float:
    """Metres between two points that move along (T, d) and (U, d) m at the same instants and then stand, at least."""
    last = max(len(one), len(other)) - 1
    instants = np.arange(last + 1)
    apart = other[np.minimum(instants, len(other) - 1)] - one[np.minimum(instants, len(one) - 1)]
    drift = np.diff(apart, axis=0)
    square = np.maximum(np.square(drift).sum(axis=1), 1e-24)
    shares = np.clip(-(apart[:-1] * drift).sum(axis=1) / square, 0.0, 1.0)
    return float(np.sqrt(np.square(apart[:-1] + shares[:, None] * drift).sum(axis=1)).min())


def _at(place: Vector, instant: int, blocks: int) -> PersonMass:
    """All mass at one place at one half instant, and none at the others."""
    flat = np.zeros(blocks)
    flat[instant] = 1.0
    return PersonMass(
        lattice=Lattice(origin=place, spacing=1.0, radius=0),
        flat=flat,
        offsets=np.arange(blocks + 1, dtype=np.int64),
        radii=np.zeros(blocks, dtype=np.int64),
    )
