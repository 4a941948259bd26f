"""What a person's own past says about them: where they are, how steadily they go, how often they change their mind.

`Habits` is one frozen value; `update` returns the next one and never raises on what a sensor says. Nothing here looks
at the robot: how awareness is learned is another matter (Eq. 8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sidestep._kernels import habits as kernel
from sidestep.human.habit_settings import ClassTables, HabitSettings, class_tables
from sidestep.types import INSTANT, FloatArray, Vector, VectorLike, finite, sealed

_SETTLES = 40  # observations after which the filter has forgotten its start
_ROWS = 40  # remembered instants; more than `window / gap`


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Habits:
    """What is known of one person from their past.

    Attributes:
        settings: of the learning; tables: what follows from them alone.
        time: s, of the last observation that counted.
        mean: (2d,) filtered position (m) and velocity (m/s); covariance: (2d, 2d) of its error.
        noise: (2d, 2d) the part of the error that measurement noise and the unknown start alone would leave.
        history: (H, 1 + 4d) remembered instants, newest first (see `_kernels.habits`).
        steadiness: (C,) probability of each class σ_c.
        changed, unchanged: forgetful counts n₁ and n₀.
        top_speed: m/s, slowly forgotten.
        mean_velocity: (d,) m/s over the last ≤ `mean_time` s.
        extrapolated_velocity: (d,) m/s, v̂.

    """

    settings: HabitSettings
    tables: ClassTables
    time: float
    mean: FloatArray
    covariance: FloatArray
    noise: FloatArray
    history: FloatArray
    steadiness: FloatArray
    changed: float
    unchanged: float
    top_speed: float
    mean_velocity: Vector
    extrapolated_velocity: Vector

    @property
    def position(self) -> Vector:
        """(d,) m, filtered."""
        return self.mean[: self.mean.size // 2]

    @property
    def velocity(self) -> Vector:
        """(d,) m/s, filtered: the present velocity v₁."""
        return self.mean[self.mean.size // 2 :]

    def position_at(self, time: float) -> Vector:
        """(d,) m, filtered and carried forward to `time` s at the present velocity."""
        return self.position if time == self.time else sealed(self.position + (time - self.time) * self.velocity)

    @property
    def position_covariance(self) -> FloatArray:
        """(d, d) m²."""
        d = self.mean.size // 2
        return self.covariance[:d, :d]

    @property
    def velocity_covariance(self) -> FloatArray:
        """(d, d) m²/s²."""
        d = self.mean.size // 2
        return self.covariance[d:, d:]

    @property
    def randomness(self) -> float:
        """ω, from how often the velocity changed."""
        s = self.settings
        low, high = s.randomness_range
        raw = (self.changed + s.changed_before) / (self.changed + self.unchanged + s.counts_before)
        return min(max(raw, low), high)

    @property
    def standing(self) -> bool:
        """Whether both the present and the mean velocity are below walking."""
        return _standing(self.settings, self.velocity, self.mean_velocity)

    @property
    def slow(self) -> bool:
        """Whether the present velocity is below walking."""
        return math.hypot(*self.velocity.tolist()) < self.settings.standing_speed

    def off_course(self, goal: Vector) -> bool:
        """Whether somebody who walks is going elsewhere than to `goal` (d,) m."""
        way, velocity = goal - self.position, self.velocity
        far, pace = math.hypot(*way.tolist()), math.hypot(*velocity.tolist())
        if self.slow or far < pace:  # a second from it there is no telling
            return False
        return float(way @ velocity) < math.cos(self.settings.off_course) * far * pace

    @property
    def modes(self) -> Vector:
        """(3,) prior probabilities that the person keeps the present velocity, keeps the mean one, comes to a stop."""
        return self.tables.standing_modes if self.slow else self.tables.walking_modes

    def spread(self, times: VectorLike | FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the mixture of isotropic Gaussians around the predicted position.

        Args:
            times: (K,) s ahead (≥ 0).

        Returns:
            weights: (C,) of the classes, sum 1; sigmas: (K, C) m, σ(t)² = floor² + (σ_c·t^q)² + what a sensor worse
            than `habitual_noise` adds.

        """
        s = self.settings
        q = s.standing_exponent if self.standing else s.walking_exponent
        t = np.ascontiguousarray(times, dtype=np.float64)
        sigmas = kernel.spread_sigmas(t, s.floor, self.tables.scales, q, self.noise, self._habitual_variance())
        return self.steadiness, sigmas

    def velocity_over(self, span: float) -> Vector | None:
        """(d,) m/s, the mean over the last `span` s; None where nothing nearly so old is remembered."""
        d = self.position.size
        old = kernel.oldest_within(self.history, span + 0.5 * self.settings.gap)
        elapsed = self.history.item(0, 0) - self.history.item(old, 0)
        return (self.position - self.history[old, 1 : 1 + d]) / elapsed if elapsed > 0.7 * span else None

    def sensed(self, t: FloatArray) -> FloatArray:
        """(K,) m², what measurement noise beyond `habitual_noise` leaves of doubt in the position `t` s ahead.

        The scales were fitted to filtered tracks, so that the velocity error of an ordinary sensor is in them; adding
        it once more doubles the spread of a steady walker at 5 s.
        """
        return kernel.sensed_variance(t, self.noise, self._habitual_variance())

    def _habitual_variance(self) -> float:
        """m²/s² per axis, velocity noise of the settled filter behind a sensor of `habitual_noise` at this rate."""
        s, dt = self.settings, self.history.item(0, 0) - self.history.item(1, 0)
        if not dt > 0 or s.habitual_noise <= 0:  # NaN before the second observation
            return 0.0
        return settled_variance(s.acceleration_density, s.habitual_noise, round(dt, 3))


@lru_cache(maxsize=256)
def settled_variance(density: float, noise: float, step: float) -> float:
    """Return what a sensor's noise alone leaves of doubt in a velocity that was filtered for long.

    Args:
        density: m²/s³, of the filter; noise: m, of the sensor; step: s between observations.

    Returns:
        m²/s² per axis. At high rates about √2/4·q^¾·(r²Δt)^¼; at low ones more than a difference of two positions
        has, because the filter overshoots there.
    """
    mean, covariance = np.zeros(2), np.eye(2)
    alone, r = np.eye(2), np.full((1, 1), noise**2)
    for _ in range(max(_SETTLES, math.ceil(2.0 / max(step, 1e-3)))):
        kernel.filter_step(mean, covariance, alone, max(step, 1e-3), density, np.zeros(1), r)
    return float(alone[1, 1])


def meet(
    time: float,
    position: VectorLike,
    covariance: FloatArray | None = None,
    *,
    velocity: VectorLike | None = None,
    velocity_covariance: FloatArray | None = None,
    settings: HabitSettings | None = None,
) -> Habits | None:
    """Return what is known of a person at first sight, or None when the observation is not finite.

    Args:
        time: s.
        position: (d,) m.
        covariance: (d, d) m² of the position, or None for the settings' noise.
        velocity: (d,) m/s from the past, or None when it was not seen yet.
        velocity_covariance: (d, d) m²/s², or None for 0.3 m/s per axis.
        settings: of the learning, or None for the defaults.

    """
    s = settings or HabitSettings()
    z = np.array(position, dtype=np.float64)
    if not (math.isfinite(time) and np.isfinite(z).all()):
        return None
    d = z.size
    mean = np.concatenate([z, np.zeros(d)])
    start = np.zeros((2 * d, 2 * d))
    start[:d, :d] = _usable(covariance, d, s.measurement_noise)
    start[d:, d:] = np.eye(d) * s.unknown_speed**2
    if velocity is not None and np.isfinite(v := np.asarray(velocity, dtype=np.float64)).all():
        speed = float(np.linalg.norm(v))
        mean[d:] = v if speed <= s.top_speed else v * (s.top_speed / speed)
        start[d:, d:] = _usable(velocity_covariance, d, 0.3)
    history = np.full((_ROWS, 1 + 4 * d), np.nan)
    kernel.remember(history, float(time), mean, start, s.gap)
    tables = class_tables(s)
    standing = _standing(s, mean[d:], mean[d:])
    weights = np.exp(tables.standing if standing else tables.walking)
    velocities = np.stack([mean[d:], mean[d:]])
    counts = np.array([0.0, 0.0, math.hypot(*mean[d:])])
    return _frozen(s, tables, float(time), mean, start, start.copy(), history, weights, counts, velocities)


def update(state: Habits, time: float, position: VectorLike, covariance: FloatArray | None = None) -> Habits:
    """Return what is known after one more observation; the same state when it says nothing.

    Not finite, repeated or late observations change nothing. After a silence longer than `time_out`, a clock that
    jumped back by more than that, or a displacement that no person makes, the person is met anew.

    Args:
        state: what was known.
        time: s.
        position: (d,) m, measured.
        covariance: (d, d) m² of the measurement, or None for the settings' noise.

    """
    s = state.settings
    z = np.asarray(position, dtype=np.float64)
    dt = time - state.time
    d = state.mean.size // 2
    if z.size != d or not (math.isfinite(dt) and finite(z)) or -s.time_out <= dt <= INSTANT:
        return state
    r = _usable(covariance, d, s.measurement_noise)
    if _anew(state, dt, z, r):
        return meet(time, z, r, settings=s) or state
    mean, cov, noise = state.mean.copy(), state.covariance.copy(), state.noise.copy()
    history, tables = state.history.copy(), state.tables
    weights, counts = np.empty(tables.scales.size), np.array([state.changed, state.unchanged, state.top_speed])
    velocities = kernel.learn(
        float(time), float(dt), z, r, tables.constants, tables.scales, tables.priors, mean, cov, noise, history,
        counts, weights,
    )  # fmt: skip
    return _frozen(s, tables, float(time), mean, cov, noise, history, weights, counts, velocities)


def begins_anew(state: Habits, time: float, position: VectorLike, covariance: FloatArray | None = None) -> bool:
    """Return whether a finite observation tells nothing of who was known, as `update` says; arguments as there."""
    z = np.asarray(position, dtype=np.float64)
    return _anew(state, time - state.time, z, _usable(covariance, z.size, state.settings.measurement_noise))


def _anew(state: Habits, dt: float, z: FloatArray, r: FloatArray) -> bool:
    """Whether z (d,) m with the covariance r (d, d) m², `dt` s later, is too late or too far away to be the same."""
    s = state.settings
    far = kernel.is_another(state.mean, state.covariance, z, r, s.top_speed * dt)
    return abs(dt) > s.time_out or (dt > INSTANT and far)


def _standing(s: HabitSettings, velocity: FloatArray, mean_velocity: FloatArray) -> bool:
    slow = s.standing_speed
    return math.hypot(*velocity.tolist()) < slow and math.hypot(*mean_velocity.tolist()) < slow


def _usable(covariance: FloatArray | None, d: int, sigma: float) -> FloatArray:
    """Return `covariance` (+ 1 mm²) when finite and of no negative variance, else the isotropic one of `sigma`."""
    given = covariance is not None and covariance.shape == (d, d)
    return kernel.usable(covariance if given and covariance is not None else _unknown(d), sigma)


@lru_cache(maxsize=3)
def _unknown(d: int) -> FloatArray:
    return sealed(np.full((d, d), np.nan))


def _frozen(
    s: HabitSettings,
    tables: ClassTables,
    time: float,
    mean: FloatArray,
    covariance: FloatArray,
    noise: FloatArray,
    history: FloatArray,
    steadiness: FloatArray,
    counts: FloatArray,
    velocities: FloatArray,
) -> Habits:
    for array in (mean, covariance, noise, history, steadiness, velocities):
        array.setflags(write=False)
    return Habits(
        settings=s,
        tables=tables,
        time=time,
        mean=mean,
        covariance=covariance,
        noise=noise,
        history=history,
        steadiness=steadiness,
        changed=float(counts[0]),
        unchanged=float(counts[1]),
        top_speed=float(counts[2]),
        mean_velocity=velocities[0],
        extrapolated_velocity=velocities[1],
    )
