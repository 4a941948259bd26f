"""Poses in the plane: where a frame lies in another, and the yaw inside a quaternion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sidestep.types import LARGEST, FloatArray, Vector


@dataclass(frozen=True, slots=True)
class Pose2:
    """The pose of a frame B in a frame A.

    Attributes:
        x: m; y: m; yaw: rad, counter-clockwise.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def position(self) -> Vector:
        """(2,) m, the origin of B in A."""
        return np.array([self.x, self.y])

    @property
    def rotation(self) -> FloatArray:
        """(2, 2), its columns are the axes of B in A."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s], [s, c]])

    def apply(self, points: FloatArray) -> FloatArray:
        """Points (…, 2) m given in B → the same points in A."""
        return np.asarray(points, dtype=np.float64) @ self.rotation.T + self.position

    def after(self, inner: Pose2) -> Pose2:
        """Compose: with self = B in A and inner = C in B, return C in A."""
        origin = self.apply(inner.position)
        return Pose2(float(origin[0]), float(origin[1]), wrapped(self.yaw + inner.yaw))

    def inverse(self) -> Pose2:
        """Return A in B."""
        origin = -self.position @ self.rotation
        return Pose2(float(origin[0]), float(origin[1]), wrapped(-self.yaw))

    def moved(self, velocity: Vector, turn_rate: float, seconds: float) -> Pose2:
        """Return the pose after `seconds` at a constant velocity ((2,) m/s, in A) and turn rate (rad/s)."""
        dx, dy = velocity * seconds
        return Pose2(self.x + float(dx), self.y + float(dy), wrapped(self.yaw + turn_rate * seconds))

    @property
    def plausible(self) -> bool:
        """Return whether this can be a pose: finite, and within `LARGEST` (m)."""
        return abs(self.x) <= LARGEST and abs(self.y) <= LARGEST and math.isfinite(self.yaw)


def wrapped(angle: float) -> float:
    """Return the same angle in (−π, π] (rad)."""
    return -math.remainder(-angle, 2 * math.pi)


def yaw_of(quaternion: Any) -> float:
    """Return the yaw (rad) of a message-like quaternion with fields x, y, z, w.

    All four zero, as drivers send that fill in nothing, is taken for "no rotation"; it need not be normalised.
    """
    x, y, z, w = (float(getattr(quaternion, axis)) for axis in "xyzw")
    if x == y == z == w == 0.0:
        return 0.0
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def quaternion_of(yaw: float) -> tuple[float, float, float, float]:
    """Return (x, y, z, w) of a rotation about the vertical by `yaw` (rad)."""
    return 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)
