"""The motion that people are taken to anticipate."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sidestep._kernels.carry import shifted
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


@given(
    seed=st.integers(0, 1000), d=st.integers(1, 3), planned=st.integers(1, 6), shift=st.floats(0, 8),
    steps=st.integers(1, 10),
)  # fmt: skip
def test_a_plan_carried_forward_is_itself_later_on_and_then_heads_for_the_goal(
    seed: int, d: int, planned: int, shift: float, steps: int
) -> None:
    generator = np.random.default_rng(seed)
    positions = np.cumsum(generator.normal(0, 0.4, (planned + 1, d)), axis=0)
    start, goal = generator.normal(size=d), 5.0 * generator.normal(size=d)
    instants = np.minimum(np.arange(steps + 1) + shift, planned)
    known = max(int((instants < planned).sum()), 1)
    slow = np.stack([np.interp(instants, np.arange(planned + 1), positions[:, a]) for a in range(d)], axis=1)[:known]
    stride = np.linalg.norm(slow[-1] - slow[-2]) if known > 1 else 0.0
    while len(slow) < steps + 1:
        way = goal - slow[-1]
        length = np.linalg.norm(way)
        slow = np.concatenate([slow, [slow[-1] + way * min(stride / length, 1.0) if length > 1e-12 else slow[-1]]])
    np.testing.assert_allclose(shifted(positions, shift, start, goal, steps), slow + start - slow[0], atol=1e-9)
