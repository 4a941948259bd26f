"""The least distance between a person who keeps their velocity and a robot on its way, by looking very often."""

from __future__ import annotations

import numpy as np

from sidestep.types import FloatArray


def closest_approach(
    way: FloatArray, step: float, since: float, start: FloatArray, velocity: FloatArray, ahead: float
) -> tuple[float, float]:
    times = np.linspace(0.0, ahead, 20_001)
    at = np.minimum((since + times) / step, len(way) - 1)
    robot = np.stack([np.interp(at, np.arange(len(way)), column) for column in way.T], axis=1)
    distance = np.linalg.norm(start + times[:, None] * velocity - robot, axis=1)
    return float(distance.min()), float(times[distance.argmin()])
