"""How the robot moves, where nobody measures it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sidestep import Holonomic, RobotState
from sidestep.own_motion import OwnMotion

RAMPED = Holonomic(max_speed=1.0, max_acceleration=1.0)


def reckoned(places: list[float], every: float = 0.2, velocity: tuple[float, float] | None = None) -> RobotState:
    """What is known of a base at the last of these places (m, along x), passed `every` s."""
    own = OwnMotion(RAMPED, timeout=1.0)
    states = [own.completed(every * k, RobotState(position=(x, 0.0), velocity=velocity)) for k, x in enumerate(places)]
    return states[-1]


def test_the_velocity_is_that_of_the_way_since_the_last_call() -> None:
    assert reckoned([0.0]).velocity is None
    assert reckoned([0.0, 0.1, 0.2, 0.3]).velocity == pytest.approx([0.5, 0.0])


def test_who_speeds_up_is_faster_than_on_the_way_so_far() -> None:
    """At 1 m/s² from standstill: after 0.6 s 0.6 m/s, on the way since 0.4 s 0.5 m/s."""
    assert reckoned([0.5 * (0.2 * k) ** 2 for k in range(4)]).velocity == pytest.approx([0.6, 0.0])


def test_after_a_pause_nothing_is_known() -> None:
    assert reckoned([0.0, 0.5], every=1.5).velocity is None


@pytest.mark.parametrize("told", [(0.0, 1e5), (math.nan, 0.0), (0.0, math.inf)])
def test_what_cannot_be_its_velocity_is_not_believed(told: tuple[float, float]) -> None:
    assert reckoned([0.0, 0.1], velocity=told).velocity == pytest.approx([0.5, 0.0])


def test_what_is_measured_is_believed() -> None:
    assert reckoned([0.0, 0.1], velocity=(0.4, 0.1)).velocity == pytest.approx([0.4, 0.1])


def test_a_base_without_inertia_moves_as_it_was_asked_to_until_that_is_too_old() -> None:
    own, here = OwnMotion(Holonomic(), timeout=1.0), RobotState(position=(0.0, 0.0))
    own.asks(0.0, np.array([0.5, 0.0]))
    own.asks(0.2, np.array([0.0, 0.5]))
    assert own.velocity(0.2, here) == pytest.approx([0.5, 0.0])  # asked again in the same instant
    assert own.velocity(0.9, here) == pytest.approx([0.0, 0.5])
    assert own.velocity(1.3, here) is None
    own.asks(0.4, None)
    assert own.velocity(0.6, here) is None
