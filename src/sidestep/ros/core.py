"""The node without ROS: the plan in force, and what may be sent to the wheels.

`plan` is called at the planner's rate and may take its time; `motion` is called at the control rate, from another
thread, and never waits for it. A motion other than standstill is given only while everything it rests on is fresh.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.human.observation import PersonObservation
from sidestep.planning.plan import Plan
from sidestep.robots import RobotState
from sidestep.ros.geometry import Pose2
from sidestep.ros.inputs import Inputs, Task
from sidestep.ros.messages import Map
from sidestep.ros.settings import NodeSettings
from sidestep.ros.status import STANDSTILL, Activity, Motion, Report
from sidestep.ros.watchdog import Beat
from sidestep.types import Vector

_LOG = logging.getLogger(__name__)


class Planning(Protocol):
    """What the core asks of a planner."""

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation] | None) -> Plan:
        """Plan from what is known at `time` (s); `people` is None where there is no news of them."""
        ...


class Wheels(Protocol):
    """What the core asks of a robot model."""

    def command(self, velocity: Vector, state: RobotState, *, hold: float = 0.0) -> Vector:
        """Return what the base takes for the velocity (2,) m/s, held for `hold` s."""
        ...

    def reference(self, state: RobotState) -> Vector:
        """Return the (2,) m point that is led to the goal."""
        ...


class Core:
    """One robot.

    Args:
        settings: of the node.
        inputs: what has arrived.
        wheels: the robot's model.
        make_planner: (goal (2,) m, map or None in the planning frame) → planner; called when either changes.
    """

    def __init__(
        self,
        settings: NodeSettings,
        *,
        inputs: Inputs,
        wheels: Wheels,
        make_planner: Callable[[Vector, Map | None], Planning],
    ) -> None:
        self._settings = settings
        self._inputs = inputs
        self._wheels = wheels
        self._make_planner = make_planner
        self._planning = threading.Lock()
        self._planner: tuple[Task, Planning] | None = None
        self._refused: Task | None = None
        self._lock = threading.Lock()  # guards what follows
        self._plan: tuple[int, Plan] | None = None
        self._broken = ""
        self._arrived = -1  # number of the task that is done
        self._holds: dict[str, tuple[Activity, str]] = {}
        self._said: tuple[Activity, str, Motion] = ("waiting", "", STANDSTILL)
        self._plans, self._commands = Beat(), Beat()

    def hold(self, who: str, reason: str, activity: Activity = "stopped") -> None:
        """Keep the robot standing until `who` says otherwise; an empty reason lets go."""
        with self._lock:
            if reason:
                self._holds[who] = activity, reason
            else:
                self._holds.pop(who, None)

    def plan(self, now: float) -> Plan | None:
        """Plan from the latest inputs; return the plan, or None where there is nothing to plan from or for.

        Whatever goes wrong in here is logged and makes the robot stand; the node lives on.
        """
        task, robot = self._inputs.task, self._inputs.robot(now)
        if task.goal is None or robot is None or not self._inputs.complete or self._arrived == task.number:
            return None
        if self._refused is task:  # to lay out the same map again would take long, and change nothing
            return None
        with self._planning:
            try:
                if self._planner is None or self._planner[0] is not task:
                    self._planner = (task, self._make_planner(task.goal, task.map))
                plan = self._planner[1].step(time=now, robot=robot, people=self._inputs.people(now))
            except Exception as error:
                self._refused = task if isinstance(error, InvalidInput) else None
                self._fail(error)
                return None
        with self._lock:
            self._broken, self._plan = "", (task.number, plan)
            self._plans.beat(now)
        return plan

    def motion(self, now: float, wall: float) -> Motion:
        """What may be sent to the wheels at `now` (s); `wall`: s, of a clock that always runs."""
        self._inputs.notice(now)
        task, robot, complaint = self._inputs.task, self._inputs.robot(now), self._inputs.complaint(now, wall)
        with self._lock:
            self._commands.beat(wall)
            if robot is not None and task.goal is not None and self._at(task.goal, robot):
                self._arrived = task.number
            activity, reason = self._standing(task, now, complaint)
            motion = STANDSTILL
            if activity == "driving" and self._plan is not None and robot is not None:
                plan = self._plan[1]
                activity = "stopped" if plan.status == "stopped" else "driving"
                reason = "" if plan.status == "certified" else plan.reason
                motion = self._motion(plan, robot)
            self._said = (activity, reason, motion)
            return motion

    def report(self, now: float) -> Report:
        """What the node does and why."""
        rates, ages, refused = self._inputs.health(now)
        task, robot = self._inputs.task, self._inputs.robot(now)
        with self._lock:
            activity, reason, motion = self._said
            plan = self._plan[1] if self._plan is not None and self._plan[0] == task.number else None
            return Report(
                time=now,
                activity=activity,
                reason=reason,
                motion=motion,
                robot=robot,
                goal=task.goal,
                plan=plan,
                plan_age=np.inf if plan is None else now - plan.time,
                rates={**rates, "plan": self._plans.rate(now), "command": self._commands.pace},
                ages=ages,
                refused=refused,
            )

    def _fail(self, error: Exception) -> None:
        trouble = f"planning failed: {error}"
        with self._lock:
            news, self._broken, self._plan = trouble != self._broken, trouble, None
        if news:  # what is wrong with a goal or a map is said in its line; all else is ours to find
            _LOG.error(trouble, exc_info=not isinstance(error, InvalidInput))

    def _standing(self, task: Task, now: float, complaint: str) -> tuple[Activity, str]:
        """Return ("driving", "") if the plan may be followed, else what to say instead."""
        if self._holds:
            return next(iter(self._holds.values()))
        if complaint:
            return ("stopped" if self._inputs.complete else "waiting"), complaint
        if task.goal is None:
            return "waiting", "no goal"
        if self._arrived == task.number:
            return "arrived", ""
        if self._broken:
            return "stopped", self._broken
        if self._plan is None or self._plan[0] != task.number:
            return "waiting", "no plan yet"
        age = now - self._plan[1].time
        if age > self._settings.node.plan_lifetime:
            return "stopped", f"the plan is {age:.1f} s old"
        return "driving", ""

    def _at(self, goal: Vector, robot: RobotState) -> bool:
        gap = float(np.linalg.norm(self._wheels.reference(robot) - goal))
        return gap <= self._settings.robot.goal_tolerance

    def _motion(self, plan: Plan, robot: RobotState) -> Motion:
        """Turn the planned velocity (world) into what the base takes, with the heading as it is now."""
        command = self._wheels.command(plan.velocity, robot, hold=1.0 / self._settings.node.control_rate)
        if self._settings.robot.kind == "differential":
            return _finite(Motion(forward=float(command[0]), turn_rate=float(command[1])))
        forward, sideways = command @ Pose2(yaw=robot.heading or 0.0).rotation
        return _finite(Motion(forward=float(forward), sideways=float(sideways)))


def _finite(motion: Motion) -> Motion:
    return motion if np.isfinite((motion.forward, motion.sideways, motion.turn_rate)).all() else STANDSTILL
