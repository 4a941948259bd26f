"""What another controller wants is let through, or changed, and which of the two is said."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep import Holonomic, PersonObservation, Planner, RobotState, SafetyFilter

FAR = PersonObservation(id="far", position=(0.0, 8.0), velocity=(0.0, 1.0))
IN_THE_WAY = PersonObservation(id="near", position=(1.0, 0.0), velocity=(0.0, 0.0))


def filtered(people: list[PersonObservation], wanted: tuple[float, float]):
    screen = SafetyFilter(Planner(robot=Holonomic(max_speed=1.0, radius=0.3, shape="disc"), goal=(4.0, 0.0)))
    return screen.filter(wanted, time=0.0, robot=RobotState(position=(0.0, 0.0)), people=people)


@pytest.mark.parametrize("people", [[], [FAR]])
def test_what_is_safe_is_let_through(people: list[PersonObservation]) -> None:
    told = filtered(people, (0.6, 0.2))
    assert told.velocity == pytest.approx([0.6, 0.2])
    assert not told.interfered
    assert told.reason.startswith("let through: every limit holds")


def test_what_is_not_is_changed_and_by_how_much_is_said() -> None:
    told = filtered([IN_THE_WAY], (0.9, 0.0))
    assert told.interfered
    change = float(np.linalg.norm(told.velocity - (0.9, 0.0)))
    assert change > 0.2
    assert told.reason.startswith(f"changed by {change:.2f} m/s: ")


def test_what_no_base_can_do_is_no_interference() -> None:
    told = filtered([], (3.0, 0.0))
    assert told.velocity == pytest.approx([1.0, 0.0])
    assert not told.interfered
