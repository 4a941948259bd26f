"""Awareness for any other controller: the velocity that it wants, or the nearest one that leaves a certified plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.checks import numbers_in, of_kind
from sidestep.human.observation import PersonObservation
from sidestep.planner import Planner
from sidestep.planning.plan import Plan
from sidestep.robots import RobotState
from sidestep.types import Vector, VectorLike

_SAME = 1e-3  # m/s; a smaller change is no interference


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Filtered:
    """What the robot should do instead of what was wanted.

    Attributes:
        velocity: (d,) m/s, to be applied until the next call; command: what the base takes.
        interfered: whether it differs from what was wanted, as far as the base can do that at all.
        reason: one line that says why, or that it was let through.
        plan: the motion that begins with it, and its certificate.
    """

    velocity: Vector
    command: Vector
    interfered: bool
    reason: str
    plan: Plan


class SafetyFilter:
    """Stands between any controller (a learned policy, a joystick, another planner) and the robot.

    Args:
        planner: whose people, limits and fall-backs count. Its goal only breaks ties.
    """

    def __init__(self, planner: Planner) -> None:
        of_kind("safety_filter.planner", planner, Planner)
        self.planner = planner

    def filter(
        self,
        velocity: VectorLike,
        *,
        time: float,
        robot: RobotState,
        people: Sequence[PersonObservation] | None,
    ) -> Filtered:
        """Return `velocity` if a certified plan can begin with it, else the nearest that can. Never raises.

        Args:
            velocity: (d,) m/s wanted, of the point that planning moves. What is not finite counts as zero.
            time: s; robot: as measured; people: seen now, [] for nobody, None for no data.
        """
        wanted = np.array(numbers_in(velocity))
        if wanted.size != self.planner.goal.size:
            wanted = np.zeros_like(self.planner.goal)
        plan = self.planner.step(time=time, robot=robot, people=people, wish=wanted)
        change = float(np.linalg.norm(plan.velocity - self.planner.robot.limited(wanted)))
        interfered = change > _SAME
        told = f"changed by {change:.2f} m/s" if interfered else "let through"
        return Filtered(
            velocity=plan.velocity,
            command=plan.command,
            interfered=interfered,
            reason=f"{told}: {plan.reason}",
            plan=plan,
        )

    def reset(self) -> None:
        """Forget everybody."""
        self.planner.reset()
