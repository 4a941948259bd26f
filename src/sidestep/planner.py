"""`Planner.step`: what was seen → what people will do → a motion, its certificate, and how safe that is, in words."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from copy import copy
from dataclasses import fields, replace
from functools import lru_cache
from time import perf_counter
from types import MappingProxyType
from typing import Any

import numpy as np

from sidestep import compiling, minds, rehearsal
from sidestep.checks import numbers_in, of_kind, plainly
from sidestep.crew import Crew
from sidestep.detour import Course, Detours, Disc
from sidestep.errors import InvalidInput, UnknownName
from sidestep.forecast import Afterwards, person_plan
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import Way
from sidestep.ladder import Outcome, climb
from sidestep.mind import Mind
from sidestep.obstacles import Obstacles
from sidestep.own_motion import OwnMotion
from sidestep.planning.pace import Pace
from sidestep.planning.plan import Plan, stopped_plan
from sidestep.planning.search import Outlook
from sidestep.planning.settings import LONGEST_LOOK, PlannerSettings
from sidestep.reasons import reason_of
from sidestep.robots import DifferentialDrive, Holonomic, Robot, RobotState
from sidestep.site import Site, site_of
from sidestep.situation import OutOfTime, Situation, circumstances
from sidestep.subjects import everybody_of
from sidestep.types import INSTANT, Vector, VectorLike, frozen_array, plausible, sealed, settled

_LEAST_STRIDE = 0.005  # m; the risk is drawn on the robot's lattice, whose cells must not be much finer than people
_log = logging.getLogger(__name__)


class Planner:
    """Plans a robot's motion among people, and learns about each of them while doing so.

    Args:
        robot: `Holonomic` or `DifferentialDrive`, able to move by 5 mm in a time step.
        goal: (d,) m, d = 1, 2 or 3.
        human: the model of every person whose observation brings none; None is `HumanModel()`.
        obstacles: static map, or None.
        settings: all settings at once, or None.
        changes: single fields of `PlannerSettings` by name, e.g. `horizon=8, risk_limit=0.02`.

    Raises:
        InvalidInput: a value is not allowed; one line that names the field. `step` never raises.
    """

    def __init__(
        self,
        *,
        robot: Holonomic | DifferentialDrive,
        goal: VectorLike,
        human: HumanModel | None = None,
        obstacles: Obstacles | None = None,
        settings: PlannerSettings | None = None,
        **changes: Any,
    ) -> None:
        of_kind("planner.robot", robot, Holonomic, DifferentialDrive)
        of_kind("planner.human", human, HumanModel, optional=True)
        of_kind("planner.settings", settings, PlannerSettings, optional=True)
        self.robot = robot
        self._told = HumanModel() if human is None else human
        self.settings = _settled(settings, changes)
        if robot.planning_speed * self.settings.time_step < _LEAST_STRIDE:
            allowed = f"a robot that can move by {_LEAST_STRIDE} m in a time step of {self.settings.time_step:g} s"
            raise InvalidInput("planner.robot", robot, allowed, "make it faster, or the time step longer")
        limit = robot.planning_acceleration
        if limit is not None and robot.planning_speed > LONGEST_LOOK * limit:
            allowed = f"a robot that can stop within {LONGEST_LOOK:g} s"
            raise InvalidInput("planner.robot", robot, allowed, "make it slower, or its acceleration larger")
        self._warn_of_unseen_stops()
        self._crew = Crew(self.settings.threads)
        self._outlook = Outlook()
        self._afterwards = Afterwards()
        self._pace = Pace()
        self._detours = Detours(self.robot, self.settings)
        self._minds: dict[str, Mind] = {}
        self._last: Plan | None = None
        self._time = -math.inf  # s, of the last call
        self._informed = -math.inf  # s, of the last call that knew about people
        self._interval = self.settings.time_step  # s, until the next call, as far as the calls so far tell
        self._own = OwnMotion(self.robot, self.settings.timeout)
        self._site = self._at(goal, obstacles, self._told)
        if self.settings.deadline is not None:
            self.warm_up()

    def _warn_of_unseen_stops(self) -> None:
        """Say so where a plan ends before the base could stand, since nobody looks at who is there then."""
        limit, steps, step = self.robot.planning_acceleration, self.settings.horizon, self.settings.time_step
        needed = 0.0 if limit is None else self.robot.planning_speed / limit  # s, from full speed
        if needed > steps * step:
            told = "planner.horizon: %d steps of %g s end before the base can stand, %.3g s from full speed: who is in "
            told += "the way of such a stop is not seen; ask for %d steps, or make the base slower"
            _log.warning(told, steps, step, needed, math.ceil(needed / step))

    def warm_up(self, *, walled: bool | None = None) -> None:
        """Compile and load all that planning needs, which takes seconds once per process, before a call that counts.

        The first time after an installation takes a minute or two, shared among the processors.

        Done by itself where there is a deadline: the first calls would be late.

        Args:
            walled: whether there will be a map; None: as there is one now.
        """
        human = replace(self.human, goals=())  # where to makes no difference
        walled = self.obstacles is not None if walled is None else walled
        _rehearsed(self.robot, human, self.settings, self.goal.size, walled)

    @property
    def goal(self) -> Vector:
        """(d,) m, where the robot is to go; may be set between calls."""
        return self._site.goal

    @goal.setter
    def goal(self, value: VectorLike) -> None:
        self._take(self._at(value, self.obstacles, self.human))

    @property
    def obstacles(self) -> Obstacles | None:
        """The static map, or None; may be set between calls, and nobody is forgotten.

        Except where people are taken to head for the exits of the map, and those are others now.
        """
        return self._site.obstacles

    @obstacles.setter
    def obstacles(self, value: Obstacles | None) -> None:
        self.set_world(goal=self.goal, obstacles=value)

    def set_world(self, *, goal: VectorLike, obstacles: Obstacles | None) -> None:
        """Set the goal ((d,) m) and the map at once, where neither fits what the other was before."""
        self._take(self._at(goal, obstacles, self._told))

    def _take(self, site: Site) -> None:
        """Plan for another goal or map from now on; a call that is being answered is answered for the old one."""
        with self._crew.busy:
            if site.human.goals != self.human.goals:
                self._minds = {}
            self._site, self._last = site, None
            self._detours.renew(site)

    @property
    def human(self) -> HumanModel:
        """The model of every person whose observation brings none."""
        return self._site.human

    def _at(self, goal: VectorLike, obstacles: Obstacles | None, human: HumanModel) -> Site:
        return site_of(goal, obstacles, robot=self.robot, human=human, settings=self.settings)

    def reset(self) -> None:
        """Forget everybody and the last plan."""
        with self._crew.busy:
            self._minds, self._last = {}, None
            self._own = OwnMotion(self.robot, self.settings.timeout)
            self._detours = Detours(self.robot, self.settings)
            self._time = self._informed = -math.inf

    def twin(self) -> Planner:
        """Return a planner that knows what this one knows; from here on each learns and plans for itself.

        The two share scratch space: one that is asked while the other is planning waits for it.
        """
        other = object.__new__(type(self))
        own = {name: copy(getattr(self, name)) for name in ("_minds", "_outlook", "_pace", "_detours", "_own")}
        other.__dict__.update(self.__dict__ | own)
        return other

    def step(
        self,
        *,
        time: float,
        robot: RobotState,
        people: Sequence[PersonObservation] | None,
        wish: VectorLike | None = None,
    ) -> Plan:
        """Return a motion for now. Never raises, never returns NaN: what cannot be planned for is answered by a stop.

        One call at a time: one from another thread waits until this one is done.

        Args:
            time: s, now; any rate.
            robot: as measured now.
            people: everybody who is seen now; [] is "nobody is there", None is "no data".
            wish: (d,) m/s, a velocity that another controller asks for: the plan begins as close to it as can be
                certified (see `SafetyFilter`). What is not finite is not wished.
        """
        started, time = perf_counter(), plainly(time)
        with self._crew.busy:
            plan = self._answer(time, robot, people, started, wish)
            stopped = plan.status == "stopped"
            self._last = None if stopped else plan
            self._own.asks(plan.time, None if stopped else plan.velocity)
        return plan

    def _answer(
        self,
        time: float,
        robot: RobotState,
        people: Sequence[PersonObservation] | None,
        started: float,
        wish: VectorLike | None,
    ) -> Plan:
        """A plan, or a stop where there is none."""
        try:
            compiling.announce(walls=self.obstacles is not None)
            stop = self._trouble(time, robot, people)
            return self._stopped(time, robot, stop, started) if stop else self._planned(time, robot, started, wish)
        except Exception as error:  # a fault of ours must not leave the robot with an old command
            _log.exception("planning failed")
            return self._stopped(time, robot, f"internal error: {error!r}", started)

    def _trouble(self, time: float, robot: RobotState, people: Sequence[PersonObservation] | None) -> str:
        """Say why nothing can be planned, or ''. Keeps the clock."""
        if not _is_state(robot):
            return f"robot is a {type(robot).__name__}, not a RobotState"
        if not _is_finite(time):
            return f"time is {time}"
        if time < self._time:
            back = self._time - time
            self.reset()
            self._time = time
            return f"time ran backwards by {back:.3g} s; starting afresh"
        if robot.position.shape != self.goal.shape:
            return f"robot position has {minds.coordinates_of(robot.position)}, the goal {self.goal.size}"
        if not plausible(robot.position):
            return f"robot position is {robot.position.tolist()}"
        if isinstance(self.robot, DifferentialDrive) and not _is_finite(robot.heading):
            return f"robot heading is {robot.heading}; a differential drive needs a finite one"
        self._interval = self._until_next(time - self._time)
        self._time = time
        informed = self._informed if people is None else time
        if time - informed > self.settings.timeout:
            age = "yet" if informed == -math.inf else f"for {time - informed:.2f} s"
            return f"no observation of people {age}"
        try:
            self._minds = minds.met(
                self._minds,
                () if people is None else people,
                time,
                model=self.human,
                dimension=self.goal.size,
                time_step=self.settings.time_step,
                memory=self.settings.memory,
            )
        except minds.Unplaceable as problem:
            return str(problem)
        self._informed = informed  # not by people of whom nobody can say where they are
        return ""

    def _until_next(self, gap: float) -> float:
        """Return s until the next call, a `gap` (s) after the last: as long again, but for pauses beyond `timeout`.

        Being asked again in the same instant (the clock of a simulation may be a slow one) tells nothing of that.
        """
        step, timeout = self.settings.time_step, min(self.settings.timeout, LONGEST_LOOK)
        if gap == 0.0:
            return self._interval
        late = step + INSTANT < gap <= timeout + INSTANT
        return gap if late else min(max(gap, 0.02), step)

    def _situation(self, time: float, robot: RobotState, started: float, wish: VectorLike | None) -> Situation:
        """Gather what this call starts from."""
        settings = self.settings
        wanted = frozen_array(numbers_in(wish))
        state = self._own.completed(time, robot)
        start = self.robot.reference(robot)
        course = Course(self._site.field)
        if wanted.size == 0:
            course = self._detours.course(self._site, self._discs(), here=start, time=time)
        horizon = self._pace.horizon(settings, self._own.time_to_stand(state, self._interval))
        around = circumstances(
            settings,
            self.robot,
            horizon=horizon,
            interval=self._interval,
            dimension=self.goal.size,
            obstacles=self.obstacles,
        )
        return Situation(
            time=time,
            robot=self.robot,
            state=state,
            start=start,
            goal=self.goal,
            settings=settings,
            around=around,
            everybody=everybody_of(tuple(self._minds.values()), around),
            field=course.field,
            remark=self._site.no_way_from(start) or course.remark,
            waited=course.waited,
            crew=self._crew,
            outlook=self._outlook,
            stop_by=math.inf if settings.deadline is None else started + 0.8 * settings.deadline,
            wish=wanted if wanted.size == self.goal.size else None,
            velocity=self._own.velocity(time, state),
        )

    def _discs(self) -> dict[str, Disc]:
        """Whoever may stand in the way."""
        return {name: Disc(mind.position, mind.model.radius) for name, mind in self._minds.items()}

    def _planned(self, time: float, robot: RobotState, started: float, wish: VectorLike | None) -> Plan:
        """Predict, plan, certify."""
        now = self._situation(time, robot, started, wish)
        try:
            outcome = climb(now, now.anticipated(self._last))
        except OutOfTime:
            self._pace.late(now.around.horizon, perf_counter() - started)
            return self._stopped(time, robot, f"no plan within the deadline of {self.settings.deadline} s", started)
        self._pace.took(now.around.horizon, perf_counter() - started)
        way = Way(time=time, positions=outcome.foreseen.path, step=self.settings.time_step)
        for subject, told in zip(now.everybody, outcome.foreseen.expectations(), strict=True):
            if told is not None:
                known = minds.expect(subject.mind, *told, time)
                self._minds[subject.mind.id] = minds.face(known, way, subject.contact, time)
        return self._plan(now, outcome, started)

    def _plan(self, now: Situation, outcome: Outcome, started: float) -> Plan:
        seen, settings = outcome.foreseen, self.settings
        velocities = (outcome.path[1:] - outcome.path[:-1]) / settings.time_step
        inertia = now.inertia
        asked = velocities[0] if inertia is None else inertia.asked(velocities[:1])[0]
        risk = outcome.risk[1::2]
        if settings.risk_rule != "trajectory":  # which sums up whole instants
            risk = np.maximum(outcome.risk[0::2], risk)
        wary = [s.mind for s in seen.near if s.mind.belief.concerned < (settings.signal_belief or 0.0)]
        return Plan(
            time=now.time,
            time_step=settings.time_step,
            velocity=frozen_array(self.robot.limited(asked)),
            command=frozen_array(self.robot.command(asked, now.state, hold=self._interval)),
            positions=settled(outcome.path),
            velocities=sealed(velocities),
            collision_probability=sealed(seen.contact),
            risk=sealed(risk),
            risk_limit=settings.risk_limit,
            risk_rule=settings.risk_rule,
            status=outcome.status,
            reason=reason_of(outcome, now, risk),
            people=MappingProxyType({s.mind.id: person_plan(s, seen, self._afterwards) for s in seen.everybody}),
            horizon_used=now.around.horizon,
            rounds=outcome.rounds,
            cost=outcome.cost,
            duration=perf_counter() - started,
            signal=bool(wary) and any(seen.predictions[m.id].contact.sum() > 0.1 * settings.risk_limit for m in wary),
        )

    def _stopped(self, time: float, robot: RobotState, reason: str, started: float) -> Plan:
        """The last rung: stand still, and say why."""
        d = self.goal.size
        known = _is_state(robot) and robot.position.shape == (d,) and plausible(robot.position)
        here, wheels = robot.position if known else np.zeros(d), isinstance(self.robot, DifferentialDrive)
        if known and wheels and _is_finite(robot.heading):
            here = self.robot.reference(robot)
        return stopped_plan(
            time=time,
            here=here,
            inputs=2 if wheels else d,
            settings=self.settings,
            reason=reason,
            duration=perf_counter() - started,
        )


def _is_finite(value: object) -> bool:
    """Whether it is a finite number; what is none is not."""
    try:
        return math.isfinite(value)  # type: ignore[arg-type]
    except (TypeError, OverflowError):
        return False


def _is_state(robot: object) -> bool:
    """Whether it is what `step` asks for: what is none must not leave the robot with an old command."""
    return isinstance(robot, RobotState)


class _Double(Planner):
    """Plans past people who do not exist. How far ahead is not what was asked for, and nobody is warned of it."""

    def _warn_of_unseen_stops(self) -> None:
        pass


@lru_cache(maxsize=64)
def _rehearsed(robot: Robot, human: HumanModel, settings: PlannerSettings, dimension: int, walled: bool) -> None:
    """Plan past people who do not exist, once in a process for every kind of world."""
    compiling.compile_together(walls=walled)
    walls = rehearsal.walls(robot) if walled else None
    most = (settings.horizon,) if settings.deadline is None else rehearsal.HORIZONS
    soon = None if settings.detour_after is None else rehearsal.PERIOD
    for horizon in {min(n, settings.horizon) for n in most}:
        unhurried = replace(settings, deadline=None, horizon=horizon, detour_after=soon)
        goal = rehearsal.goal(dimension)
        double = _Double(robot=robot, goal=goal, human=human, obstacles=walls, settings=unhurried)
        for time, state, people in rehearsal.calls(robot, dimension):
            double.step(time=time, robot=state, people=people)


def _settled(settings: PlannerSettings | None, changes: dict[str, Any]) -> PlannerSettings:
    names = [f.name for f in fields(PlannerSettings)]
    for name in changes:
        if name not in names:
            raise UnknownName(f"planner.{name}", name, names)
    return replace(settings or PlannerSettings(), **changes)
