"""One call of the planner as a frozen value: who is where, what is asked, and how much time there is.

From it follow the prediction that a robot motion induces, and Eq. 9 under that prediction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from sidestep.crew import Crew
from sidestep.forecast import Forecast, foresee
from sidestep.lazily import lazy
from sidestep.mind import Mind
from sidestep.obstacles import Obstacles
from sidestep.planning.anticipate import carried_forward, extended, straight
from sidestep.planning.body import Body
from sidestep.planning.geodesic import DistanceField, way_to
from sidestep.planning.plan import Plan
from sidestep.planning.problem import STANDING_SHARE, PlanningProblem
from sidestep.planning.search import Outlook
from sidestep.planning.search_maps import resolution
from sidestep.planning.settings import FIRST_STEP_MARGIN, PlannerSettings
from sidestep.planning.stopping import Inertia
from sidestep.planning.turning import turn
from sidestep.robots import DifferentialDrive, Robot, RobotState
from sidestep.robots.holonomic import diagonal
from sidestep.subjects import Circumstances, Subject
from sidestep.types import Path, Vector

STAYS = 0.1
"""Of the way that is open; a motion that gains less leads nowhere."""
STANDS = 0.25
"""m/s, below which somebody, or another robot, stands."""
_AT_GOAL = 0.01  # m, within which there is no way left to give up
_BESIDE, _COMING = 0.6, 2.0  # m beyond clearance, within which who stands besets the robot, or who walks may hit it
_PATIENCE = 4.0  # s of waiting, after which what stands about is taken to go on standing
_SEVERAL = 3  # people near, from whom on the way beyond the horizon counts on open ground
_WISH = 100.0  # per m²/s² and step; makes every other cost a tie-breaker between motions that begin as wished


class OutOfTime(Exception):  # noqa: N818 (says what happened; never leaves the planner)
    """The deadline is near; what is not done yet stays undone."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Situation:
    """What one call of the planner starts from.

    Attributes:
        time: s, now; robot: the base; state: of it; start: (d,) m, the point that planning moves; goal: (d,) m.
        settings: of the planner; around: what holds for everybody; everybody: who counts.
        field: walking distance to the goal around walls and people who stand, or None.
        remark: what is to be said of it, beginning with "; ", or "".
        waited: for how many s the robot has come no nearer to the goal.
        crew: who predicts; outlook: how far searches look at first.
        stop_by: s on the wall clock (`perf_counter`) after which no kernel is started; inf without a deadline.
        wish: (d,) m/s, a velocity that another controller asks for, or None.
        velocity: (d,) m/s, that the robot moves with now, or None where nobody knows.
    """

    time: float
    robot: Robot
    state: RobotState
    start: Vector
    goal: Vector
    settings: PlannerSettings
    around: Circumstances
    everybody: tuple[Subject, ...]
    field: DistanceField | None
    crew: Crew
    outlook: Outlook
    remark: str = ""
    waited: float = 0.0
    stop_by: float = math.inf
    wish: Vector | None = None
    velocity: Vector | None = None

    @lazy
    def beset(self) -> bool:
        """Whether somebody has stood so near for a while that the robot had better leave, and nobody is coming.

        Where somebody comes it is better to stand: who walks into a robot that stands is not run over by it.
        """
        return any(self._beyond(s) < _BESIDE for s in self.everybody) and not self._anybody_comes

    @lazy
    def _anybody_comes(self) -> bool:
        """Whether somebody who walks is near."""
        return any(self._beyond(s) < _COMING and not _stands(s.mind) for s in self.everybody)

    @property
    def among_robots(self) -> bool:
        """Whether another robot can come near within the horizon; here there are none."""
        return False

    def _beyond(self, subject: Subject) -> float:
        """Metres between somebody and the robot beyond what is to be kept."""
        return math.dist(subject.mind.position, self.start) - subject.clearance

    @property
    def stop_limit(self) -> float:
        """Largest risk on the way to a stop: that until the next call; after much waiting among who stands, of a plan.

        A plan that waits for one step and goes then is held to the larger limit: it could be made again at every call.
        """
        settings = self.settings
        if settings.first_step_limit is None:
            return settings.risk_limit
        patient = self.waited < _PATIENCE or self._anybody_comes
        return settings.first_step_limit if patient else max(settings.first_step_limit, settings.risk_limit)

    @lazy
    def body(self) -> Body | None:
        """What the base could run into before it stands: people who stand near, and walls within the disc around it.

        None where there is no such thing. People count where first actions are limited: in the paper they are not.
        """
        robot, here, interval = self.robot, self.state.position, self.around.interval
        wheels = robot.offset if isinstance(robot, DifferentialDrive) else 0.0
        fastest = max(robot.max_speed, self.around.robot_speed)
        limit = robot.planning_acceleration
        way = fastest * (interval if limit is None else interval + 0.5 * fastest / limit)  # m, of the reference
        near = []
        limited = self.settings.first_step_limit is not None
        for subject in self.everybody if limited else ():
            contact = robot.radius + subject.mind.model.radius + FIRST_STEP_MARGIN
            if math.dist(subject.mind.position, here) < contact + way + wheels and _stands(subject.mind):
                near.append((subject.mind.position, contact))
        walls = self.around.obstacles if wheels else None
        if walls is not None and walls.distance(self.start) >= robot.planning_radius + way:
            walls = None
        if walls is None and not near:
            return None
        return Body(
            robot=robot,
            state=self.state,
            interval=interval,
            people=np.array([place for place, _ in near]).reshape(-1, here.size),
            contacts=np.array([contact for _, contact in near]),
            walls=walls,
        )

    def turning(self, path: Path) -> Vector | None:
        """Return (d,) m/s, with which it turns on the spot rather than follow `path` (N+1, d) m; None: it does not."""
        robot, walls = self.robot, self.around.obstacles
        if walls is None or self.wish is not None or not isinstance(robot, DifferentialDrive):
            return None
        middle, hold = self.state.position, self.around.interval
        return turn(robot, walls, middle=middle, path=path, velocity=self.velocity, hold=hold)

    @property
    def steps(self) -> int:
        """Instants of the robot's motion that people anticipate."""
        return self.around.horizon + max((s.look_ahead for s in self.everybody), default=1)

    @property
    def recourse_steps(self) -> int | None:
        """Steps after which exceeding the limit costs less, since it will be judged again; None: no such step.

        Judged again while there is still time to stop: a base of limited acceleration needs it for longer.
        """
        s = self.settings
        if s.recourse is None or s.risk_rule != "mass":
            return None
        inertia, most = self.inertia, self.around.horizon
        needed = 0 if inertia is None else math.ceil(min(inertia.time_to_stop / s.time_step, most))
        return max(round(s.recourse / s.time_step), needed, 1)

    def late(self) -> bool:
        """Return whether no further kernel may be started."""
        return perf_counter() > self.stop_by

    def check(self) -> None:
        """Raise `OutOfTime` when no further kernel may be started."""
        if self.late():
            raise OutOfTime

    def anticipated(self, last: Plan | None) -> Path:
        """Return (steps+1, d) m, what people are taken to expect: the last plan carried on, or straight to the goal."""
        time_step, speed = self.settings.time_step, self.robot.planning_speed
        if last is not None and self.time - last.time <= last.horizon_used * time_step:
            return carried_forward(last, time=self.time, start=self.start, goal=self.goal, steps=self.steps)
        return straight(self.start, self.goal, speed=speed, time_step=time_step, steps=self.steps)

    def foresee(self, path: Path) -> Forecast:
        """Return what everybody will do if the robot moves along `path` (N+1, d) m and then on to its goal."""
        whole = extended(path, self.goal, steps=self.steps)
        return foresee(self.everybody, whole, self.around, self.crew, self.check)

    def problem_under(self, seen: Forecast) -> PlanningProblem:
        """Return Eq. 9 under a prediction."""
        self.check()
        settings, robot, field = self.settings, self.robot, seen.field
        preferred, weight = self._preference
        first_step, beset = seen.first_step, self.beset
        if beset and first_step is not None:
            first_step = first_step.no_worse_than_staying(self.start)
        if settings.risk_rule == "cells":
            field = field.cells_above(settings.risk_limit)
        return PlanningProblem(
            start=self.start,
            goal=self.goal,
            time_step=settings.time_step,
            horizon=self.around.horizon,
            max_speed=robot.planning_speed,
            shape=robot.shape,
            goal_cost=settings.goal_cost,
            goal_weight=settings.goal_weight,
            terminal_weight=self._terminal_weight(len(seen.near)),
            effort_weight=settings.effort_weight,
            people=field,
            rule=settings.risk_rule,
            risk_limit=settings.risk_limit,
            soft_risk_weight=settings.soft_risk_weight,
            recourse_steps=self.recourse_steps,
            first_step=first_step,
            hold=self.around.interval,
            standing_share=1.0 if beset else STANDING_SHARE,
            beset=beset,
            obstacles=self.around.obstacles,
            margin=robot.wall_margin,
            distance_to_goal=self.field,
            body=self.body,
            inertia=self.inertia,
            stop_limit=self.stop_limit,
            resolution=settings.search_resolution,
            overshoot_weight=0.0 if self.wish is not None else self._farther,
            preferred=preferred,
            preference_weight=weight,
        )

    def _terminal_weight(self, near: int) -> float:
        """By how many steps more the cost of the last position counts: its slope is then that of the way beyond it.

        To go on from D m to the goal at full speed v costs the sum of D − j·v·ΔT over steps j, about D²/(2·v·ΔT), of
        slope D/(v·ΔT); with squared costs about D³/(3·v·ΔT), whose slope is half as many times that of D². Without
        this a plan neither waits for a gap nor goes around where that pays only after the horizon. On open ground the
        way past one or two is found within it; between walls one is enough to be driven up a corridor by. A wish comes
        before all this.
        """
        several = _SEVERAL if self.around.obstacles is None else 1
        if self.wish is not None or near < several:
            return 0.0
        settings, most = self.settings, self.around.horizon
        left = self.distance(self.start) / (self.robot.planning_speed * settings.time_step) - most
        steps = settings.terminal_weight * min(max(left, 0.0), most)
        return 0.5 * steps if settings.goal_cost == "squared" else steps

    @property
    def _farther(self) -> float:
        """What it costs to be a metre farther from the goal during the whole horizon."""
        return self.around.horizon * float(np.max(self.settings.goal_weight))

    @property
    def _preference(self) -> tuple[Vector | None, float]:
        """(d,) m/s, the first velocity that is preferred, and the cost per m²/s² off it: as wished, else as now."""
        if self.wish is not None:
            return self.wish, _WISH * self.around.horizon
        weight = self.settings.acceleration_weight
        if self.velocity is None or weight == 0.0:
            return None, 0.0
        weight = min(weight, self._stopping_weight(self.velocity), self._lattice_weight)
        return self.velocity, weight / self.around.interval  # ∫‖a‖² dt of a steady change until the next call

    @property
    def _lattice_weight(self) -> float:
        """m²/s³, price of acceleration at which a change by one cell per step still pays; inf where plans are polished.

        On the lattice alone there is no smaller change, and a plan puts it off, free of charge, at every call. What it
        gains is a step that ends ΔT·change nearer to the goal, or, where that lies askew, 1/√d of it.
        """
        s, robot, d = self.settings, self.robot, self.start.size
        if s.polish:
            return math.inf
        cells = resolution(self.around.horizon, d, robot.shape, s.search_resolution)
        return self._slope * s.time_step * self.around.interval * cells / (robot.planning_speed * math.sqrt(d))

    @property
    def _slope(self) -> float:
        """Per m, how the goal cost of a step grows with the distance from the goal."""
        weight = float(np.max(self.settings.goal_weight))
        return weight * (2.0 * self.distance(self.start) if self.settings.goal_cost == "squared" else 1.0)

    def _stopping_weight(self, velocity: Vector) -> float:
        """m²/s³, price of acceleration at which the way to the goal is long enough to stop from `velocity` (d,) m/s.

        Only the change until the next call has a price. A plan brakes free of charge after it, so that being beyond the
        goal costs no more than a step there. That pays for an acceleration of (slope of the goal cost)·ΔT / (2·price).
        """
        way, pace = self.distance(self.start), float(velocity @ velocity)
        return self._slope * self.settings.time_step * way / pace if pace > 0.0 else math.inf

    def distance(self, place: Vector) -> float:
        """Return m from `place` to the goal, around walls and people who stand."""
        return way_to(self.goal, place, self.field)

    def gives_up(self, path: Path, share: float) -> bool:
        """Return whether a motion (N+1, d) m gains less than this share of what it could on an open way."""
        reach = self.around.horizon * self.settings.time_step * self.robot.planning_speed
        open_way = self.distance(self.start)
        return open_way - self.distance(path[-1]) < share * min(reach, open_way) - _AT_GOAL

    def wished(self) -> list[Path]:
        """Return motions (N+1, d) m that begin as wished: then standing, and going on."""
        if self.wish is None:
            return []
        stride = self.robot.limited(self.wish) * self.settings.time_step
        strides = np.arange(self.around.horizon + 1)[:, None]
        return [self.start + np.minimum(strides, 1) * stride, self.start + strides * stride]

    @lazy
    def inertia(self) -> Inertia | None:
        """What a base of limited acceleration can do now; None where it can do anything, or its velocity is unknown."""
        acceleration, velocity = self.robot.planning_acceleration, self.robot.reference_velocity(self.state)
        if acceleration is None or velocity is None:
            return None
        return Inertia(
            velocity=velocity,
            acceleration=acceleration,
            time_step=self.settings.time_step,
            interval=self.around.interval,
            top_speed=self.robot.planning_speed,
            shape=self.robot.shape,
        )

    def standing(self) -> Path:
        """Return (N+1, d) m: the robot stays where it is, or comes to stand as soon as it can."""
        path, inertia = np.repeat(self.start[None], self.around.horizon + 1, axis=0), self.inertia
        if inertia is None:
            return path
        means = inertia.hardest_stop()[None]
        stop = replace(inertia, interval=inertia.time_step).stops(means, 2 * self.around.horizon)
        path[1:] += stop.ends
        whole = stop.shifts[0, 1::2]
        path[1 : 1 + len(whole)] = self.start + whole
        path[1] = self.start + means[0] * inertia.time_step
        return path


def _stands(mind: Mind) -> bool:
    """Whether somebody stands, and has for a while."""
    paces = [mind.velocity] if mind.habits is None else [mind.velocity, mind.habits.mean_velocity]
    return all(math.hypot(*pace.tolist()) < STANDS for pace in paces)


def circumstances(
    settings: PlannerSettings,
    robot: Robot,
    *,
    horizon: int,
    interval: float,
    dimension: int,
    obstacles: Obstacles | None,
) -> Circumstances:
    """Return what holds for everybody during this call."""
    return Circumstances(
        time_step=settings.time_step,
        horizon=horizon,
        robot_radius=robot.planning_radius,
        robot_speed=robot.planning_speed * diagonal(robot.shape, dimension),
        clearance=settings.clearance,
        midway=settings.midway,
        first_step_limit=settings.first_step_limit,
        least_randomness=settings.least_randomness,
        interval=interval,
        obstacles=obstacles,
    )
