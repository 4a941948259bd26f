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
            velocity: (d,) m/s wanted, of the point that planning moves. What is not that counts as zero, and `reason`
                says so.
            time: s; robot: as measured; people: seen now, [] for nobody, None for no data.
        """
        d = self.planner.goal.size
        wanted = np.array(_numbers(velocity))
        understood = wanted.size == d
        if not understood:
            wanted = np.zeros(d)
        plan = self.planner.step(time=time, robot=robot, people=people, wish=wanted)
        change = float(np.linalg.norm(plan.velocity - self.planner.robot.limited(wanted)))
        interfered = change > _SAME
        told = f"changed by {change:.2f} m/s" if interfered else "let through"
        if not understood:
            told = f"what was wanted is not {d} finite numbers and counts as standing, {told}"
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


def _numbers(velocity: object) -> tuple[float, ...]:
    """The numbers of a sequence or an array of any kind, () where it is none: a policy may answer with a tensor."""
    try:
        return numbers_in(velocity) or numbers_in(np.asarray(velocity))
    except Exception:  # of whoever made it; the robot must not be left with an old command
        return ()
