"""What the node does and why, as values: the motion to send, and the report that people and machines watch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sidestep.planning.plan import Plan, limited_name
from sidestep.robots import RobotState
from sidestep.ros.outgoing import ERROR, OK, WARN
from sidestep.types import Vector

Activity = Literal["driving", "arrived", "waiting", "stopped"]
"""Driving a plan; at the goal; nothing to do yet; something is wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """What `cmd_vel` says, in the robot's own frame.

    Attributes:
        forward: m/s; sideways: m/s, to the left; turn_rate: rad/s, counter-clockwise.
    """

    forward: float = 0.0
    sideways: float = 0.0
    turn_rate: float = 0.0


STANDSTILL = Motion()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Report:
    """The node at one instant.

    Attributes:
        time: s.
        activity: what it does.
        reason: why, in plain words.
        motion: last sent.
        robot: last measured, carried forward to `time`, or None.
        goal: (2,) m, or None.
        plan: in force, or None; plan_age: s, inf without one.
        rates: Hz, of inputs, of planning ("plan") and of commands ("command").
        ages: s, of the inputs.
        refused: input → messages that could not be used.
    """

    time: float
    activity: Activity
    reason: str
    motion: Motion
    robot: RobotState | None
    goal: Vector | None
    plan: Plan | None
    plan_age: float
    rates: Mapping[str, float]
    ages: Mapping[str, float]
    refused: Mapping[str, int]

    @property
    def level(self) -> int:
        """Level for diagnostics: an error where the robot stands because something is wrong."""
        if self.activity == "stopped":
            return ERROR
        certified = self.plan is None or self.plan.status == "certified"
        return OK if certified and not any(self.refused.values()) else WARN

    @property
    def summary(self) -> str:
        """One line."""
        return f"{self.activity}: {self.reason}" if self.reason else self.activity

    def values(self) -> dict[str, object]:
        """Flat names and values for diagnostics."""
        flat: dict[str, object] = {"activity": self.activity, "reason": self.reason}
        if self.plan is not None:
            flat |= {
                "plan status": self.plan.status,
                "plan age (s)": f"{self.plan_age:.3f}",
                "planning time (ms)": f"{1e3 * self.plan.duration:.2f}",
                "largest P_coll": f"{_largest(self.plan.collision_probability):.4f}",
                limited_name(self.plan.risk_rule): f"{self.plan.limited_risk:.4f}",
                "risk limit": f"{self.plan.risk_limit:.4f}",
                "people": len(self.plan.people),
            }
        flat |= {f"{name} rate (Hz)": f"{rate:.1f}" for name, rate in self.rates.items()}
        flat |= {f"{name} age (s)": f"{age:.2f}" for name, age in self.ages.items()}
        return flat | {f"{name} refused": count for name, count in self.refused.items() if count}

    def as_json(self) -> dict[str, Any]:
        """What a station is told; numbers that are not finite become null."""
        plan = self.plan
        people = plan.people if plan is not None else {}
        return {
            "time": self.time,
            "activity": self.activity,
            "reason": self.reason,
            "motion": [self.motion.forward, self.motion.sideways, self.motion.turn_rate],
            "robot": None if self.robot is None else [*_rounded(self.robot.position), _plain(self.robot.heading)],
            "goal": None if self.goal is None else _rounded(self.goal),
            "status": None if plan is None else plan.status,
            "plan": None if plan is None else [_rounded(p) for p in plan.positions],
            "plan_age": _plain(self.plan_age),
            "planning_time": None if plan is None else plan.duration,
            "collision_probability": [] if plan is None else [_plain(p) for p in plan.collision_probability],
            "people": [
                {
                    "id": name,
                    "position": _rounded(person.position),
                    "velocity": _rounded(person.velocity),
                    "concerned": _plain(person.belief),
                }
                for name, person in people.items()
            ],
            "rates": {name: round(rate, 2) for name, rate in self.rates.items()},
            "ages": {name: _plain(age) for name, age in self.ages.items()},
        }


def _largest(values: Vector) -> float:
    return float(np.max(values)) if values.size else 0.0


def _plain(value: float | None) -> float | None:
    return round(float(value), 4) if value is not None and np.isfinite(value) else None


def _rounded(values: Vector) -> list[float | None]:
    return [_plain(v) for v in values]
