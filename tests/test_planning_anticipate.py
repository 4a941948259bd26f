"""The motion that people are taken to anticipate."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sidestep.planning.anticipate import extended, straight


def test_straight_stops_at_the_goal() -> None:
    path = straight(np.zeros(2), np.array([0.0, 1.2]), speed=1.0, time_step=0.5, steps=4)
    np.testing.assert_allclose(path, [[0, 0], [0, 0.5], [0, 1.0], [0, 1.2], [0, 1.2]])


def test_straight_from_the_goal_stands() -> None:
    path = straight(np.ones(2), np.ones(2), speed=1.0, time_step=0.5, steps=3)
    np.testing.assert_allclose(path, np.ones((4, 2)))


@given(steps=st.integers(1, 12), speed=st.floats(0, 2))
def test_extended_keeps_the_path_and_ends_at_or_before_the_goal(steps: int, speed: float) -> None:
    goal = np.array([3.0, 0.0])
    path = straight(np.zeros(2), goal, speed=speed, time_step=0.5, steps=2)
    grown = extended(path, goal, steps=steps)
    assert grown.shape == (steps + 1, 2)
    np.testing.assert_allclose(grown[: min(3, steps + 1)], path[: steps + 1])
    assert (grown[:, 0] <= 3.0 + 1e-9).all()
    np.testing.assert_allclose(grown, straight(np.zeros(2), goal, speed=speed, time_step=0.5, steps=steps), atol=1e-9)
