"""What a base of limited acceleration can still do: the velocity to ask of it, and how it comes to stand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep.types import BoolArray, FloatArray, Shape, Vector

LAG = 0.05
"""m, how far a base of limited acceleration may stray from its plan within a step."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inertia:
    """A base that cannot change its velocity at once.

    Attributes:
        velocity: (d,) m/s now; acceleration: m/s² at most (> 0).
        time_step: s, ΔT; interval: s until the next call, before which nothing new can be asked.
        top_speed: m/s that can be asked for; shape: of every axis ("box") or of the norm ("disc").
    """

    velocity: Vector
    acceleration: float
    time_step: float
    interval: float
    top_speed: float = math.inf
    shape: Shape = "disc"

    @property
    def largest_change(self) -> float:
        """m/s by which the mean velocity of the first step may differ from the present one.

        A ramp at the limit strays from the straight step by change²/(2·acceleration) ≤ `LAG` on its way. Where calls
        are rarer than steps, the base has until the next call for it: with what it can do within a step it would be
        asked for a fraction of its acceleration, and not come round to its goal.
        """
        a = self.acceleration
        return min(a * max(self.time_step, self.interval), math.sqrt(2.0 * a * LAG))

    @property
    def time_to_stop(self) -> float:
        """How many s the base needs to stand."""
        return time_to_stop(self.velocity, self.acceleration, self.interval)

    @property
    def apart(self) -> float:
        """By how many m the displacements of two steps in a row may differ."""
        return self.acceleration * self.time_step**2

    def taps_apart(self, spacing: float) -> float:
        """Return by how many cells of `spacing` m they may differ on a lattice; one at least."""
        return max(self.apart / spacing, 1.0) * (1.0 + 1e-9)

    def asked(self, means: FloatArray) -> FloatArray:
        """Return (M, d) m/s, what to ask for where the mean velocity over the step is to be `means` (M, d) m/s.

        While the base ramps it is behind. Asked for the mean itself it ends up change²/(2·a) short of the plan; to be
        there it must be asked for a change c with c − c²/(2·a·ΔT) = change. It is, but for what would turn a stop into
        a way back: the lag is then smaller than that of asking for the mean, and the base does not swing. Nor is more
        asked for than the top speed: beyond it the base would cut it down and turn elsewhere.

        Where the hardest stop is meant, standstill is asked for.
        """
        change = means - self.velocity
        size = _norms(change)
        most = self.acceleration * self.time_step
        full = most * (1.0 - np.sqrt(np.maximum(1.0 - 2.0 * size / most, 0.0)))
        more = change * (np.maximum(full - size, 0.0) / np.maximum(size, 1e-12))[:, None]  # beyond the means
        slowest = -(means * more).sum(axis=1) / np.maximum(np.square(more).sum(axis=1), 1e-24)
        share = np.where((slowest >= 0.0) & (slowest < 1.0), slowest, 1.0)
        asked: FloatArray = means + more * np.minimum(share, self._room(means, more))[:, None]
        asked[self.are_stops(means)] = 0.0
        return asked

    def _room(self, means: FloatArray, more: FloatArray) -> FloatArray:
        """(M,) the largest shares of `more` (M, d) m/s that may be added to `means` within the top speed."""
        if self.top_speed == math.inf:
            return np.ones(len(means))
        if self.shape == "box":
            left = self.top_speed - np.sign(more) * means  # m/s, per axis
            shares = np.where(more == 0.0, np.inf, left / np.maximum(np.abs(more), 1e-12))
            return np.maximum(shares.min(axis=1), 0.0)
        along, size = (means * more).sum(axis=1), np.maximum(np.square(more).sum(axis=1), 1e-24)
        left = np.maximum(self.top_speed**2 - np.square(means).sum(axis=1), 0.0)
        return np.maximum((np.sqrt(along**2 + size * left) - along) / size, 0.0)

    def hardest_stop(self) -> Vector:
        """Return (d,) m/s, the mean velocity over the first step of a base that brakes as hard as it can.

        It is on its way all the time, only faster first and slower then; so it may be more than `largest_change` off.
        """
        speed = math.sqrt(float(self.velocity @ self.velocity))
        if speed == 0.0:
            return self.velocity
        ramp = min(speed / self.acceleration, self.time_step)
        return self.velocity * ((speed - 0.5 * self.acceleration * ramp) * ramp / self.time_step / speed)

    def are_stops(self, means: FloatArray) -> BoolArray:
        """Return (M,) whether mean velocities (M, d) m/s over the first step are those of the hardest stop."""
        return np.abs(means - self.hardest_stop()).max(axis=1) < 1e-9

    def stops(self, means: FloatArray, instants: int) -> Stops:
        """Return the motions that begin toward mean velocities (M, d) m/s and brake from the next call on.

        Args:
            means: of the first step; instants: how many half instants are looked at, at most.
        """
        a = self.acceleration
        change = self.asked(means) - self.velocity
        size = _norms(change)
        rate = change * (a / np.maximum(size, 1e-12))[:, None]  # (M, d) m/s² until what is asked for is reached
        ramp = np.minimum(size / a, self.interval)[:, None]
        met = self.velocity + rate * ramp  # (M, d) m/s at the next call
        speed = _norms(met)
        over = self.interval + speed / a
        still = (speed < 1e-9) & (_norms(self.velocity[None]) < 1e-9)
        over[still] = 0.0
        halves = min(math.ceil(2.0 * float(over.max(initial=0.0)) / self.time_step), instants)
        times = np.append(0.5 * self.time_step * np.arange(1, halves + 1), np.inf)  # in the end all stand
        times = times[:, None, None]
        driven = np.minimum(times, self.interval)
        ramped = np.minimum(driven, ramp)
        braking = np.clip(times - self.interval, 0.0, (speed / a)[:, None])
        along = met / np.maximum(speed, 1e-12)[:, None]
        shifts = (
            self.velocity * ramped + 0.5 * rate * ramped**2 + met * (driven - ramped)
            + met * braking - 0.5 * a * along * braking**2
        )  # fmt: skip
        return Stops(
            shifts=np.ascontiguousarray(shifts[:-1].transpose(1, 0, 2)),
            moving=times[:-1, :, 0].T - 0.5 * self.time_step < over[:, None],
            ends=shifts[-1],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stops:
    """M motions that come to stand.

    Attributes:
        shifts: (M, J, d) m, from where the robot is now to where it is at half instants 1..J; it stays where it stops.
        moving: (M, J) whether it still moves in the half step that ends there.
        ends: (M, d) m, from where the robot is now to where it stands at last.
    """

    shifts: FloatArray
    moving: BoolArray
    ends: FloatArray


def time_to_stop(velocity: Vector, acceleration: float, interval: float) -> float:
    """Return how many s a base needs to stand, if it is asked to from the next call on, and speeds up until then.

    Args:
        velocity: (d,) m/s now; acceleration: m/s²; interval: s until the next call.
    """
    return 2.0 * interval + math.sqrt(float(velocity @ velocity)) / acceleration


def _norms(vectors: FloatArray) -> FloatArray:
    """(M,) lengths of (M, d)."""
    return np.sqrt(np.square(vectors).sum(axis=1))
