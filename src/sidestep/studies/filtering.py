"""What the safety filter does to controllers that do not know awareness: contacts before and after, interference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.safety_filter import SafetyFilter
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.navigators import Answer, Navigator, Steering, Trip, steering
from sidestep.simulation.peers_orca import Orca
from sidestep.simulation.scenario import Scenario
from sidestep.studies.arms import Columns, Row, Study
from sidestep.studies.conditions import conditions
from sidestep.studies.episode import moving_share
from sidestep.studies.opponents import trip_of
from sidestep.studies.statistics import clopper_pearson

CONDITIONS = ("straight", "half-random", "toward-robot")


class BlindStraight:
    """Straight to the goal at full speed, whoever is there."""

    def __init__(self, trip: Trip) -> None:
        self._trip = trip

    def reset(self) -> None:
        """Nothing is remembered."""

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Steering:
        """Return the way to the goal."""
        del time, people
        return steering(self._trip.preferred(robot.position), self._trip.max_speed)


class Guarded:
    """A navigator behind the safety filter; counts how often the filter changed its mind.

    Args:
        inner: what is filtered.
        guard: the filter.
    """

    def __init__(self, inner: Navigator, guard: SafetyFilter) -> None:
        self._inner = inner
        self._guard = guard
        self.calls = 0
        self.interfered = 0
        self.change = 0.0  # m/s, summed over the calls

    def reset(self) -> None:
        """Forget everybody."""
        self._inner.reset()
        self._guard.reset()

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Answer:
        """Return the nearest motion to the wanted one that is certified."""
        wanted = self._inner.step(time=time, robot=robot, people=people).velocity
        answer = self._guard.filter(wanted, time=time, robot=robot, people=people)
        self.calls += 1
        self.interfered += answer.interfered
        self.change += float(np.linalg.norm(answer.velocity - wanted))
        return answer.plan


def episode(seed: int, *, condition: str, controller: Callable[[Trip], Navigator], guarded: bool) -> Row:
    """Return the numbers of one trip."""
    scenario: Scenario = conditions()[condition].scenario(seed)
    inner = controller(trip_of(scenario))
    guard = Guarded(inner, SafetyFilter(planner_of(scenario))) if guarded else None
    record = simulate(scenario, navigator=guard or inner, snapshots=0)
    m = measure(record)
    return {
        "moving_contact": float(m.contacts_moving > 0),
        "standing_contact": float(m.contacts_standing > 0),
        "reached": float(m.reached_goal),
        "time": m.time_to_goal,
        "interfered": guard.interfered / guard.calls if guard else float("nan"),
        "change": guard.change / guard.calls if guard else float("nan"),
        "moving": moving_share(record),
    }


def _rows(found: Columns) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for arm, c in found.items():
        hits, count = int(c["moving_contact"].sum()), len(c["moving_contact"])
        low, high = clopper_pearson(hits, count)
        watched = np.isfinite(c["interfered"]).any()
        rows.append(
            [
                *arm.split(": "),
                count,
                f"{hits / count:.3f} ({low:.3f}–{high:.3f})",
                f"{c['standing_contact'].mean():.3f}",
                f"{c['reached'].mean():.3f}",
                f"{np.nanmean(c['time']):.2f}" if np.isfinite(c["time"]).any() else "–",
                f"{c['interfered'].mean():.3f}" if watched else "–",
                f"{c['change'].mean():.3f}" if watched else "–",
            ]
        )
    return rows


def _remarks(found: Columns) -> list[str]:
    del found
    return [
        "A moving contact is one in which the robot had a part; a standing one, where a person walked into a robot "
        "that stood. Interference is the share of calls whose velocity was changed by more than 1 mm/s; the last "
        "column is the mean size of the change over all calls."
    ]


def _arms() -> dict[str, Callable[[int], Row]]:
    controllers: dict[str, Callable[[Trip], Navigator]] = {"blind straight": BlindStraight, "ORCA": Orca}
    return {
        f"{condition}: {name}{', filtered' if guarded else ''}": partial(
            episode, condition=condition, controller=build, guarded=guarded
        )
        for condition in CONDITIONS
        for name, build in controllers.items()
        for guarded in (False, True)
    }


FILTER = Study(
    name="filter",
    title="The safety filter around other controllers",
    lead="Trips of 10 m past one person who walks straight on, acts at random half of the time, or turns toward the "
    "robot; 10 Hz. The same seeds with the controller alone and behind `SafetyFilter`.",
    arms=_arms(),
    header=("person", "controller", "episodes", "moving contact (99 %)", "standing", "goal reached", "time s",
            "interference", "change m/s"),
    rows=_rows,
    remarks=_remarks,
    episodes=100,
    piece=10,
)  # fmt: skip
