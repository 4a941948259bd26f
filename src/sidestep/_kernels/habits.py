"""One step of the filter over a person's past, and what the remembered velocities say about their habits.

Layouts: `mean` (2d,) position then velocity; covariances (2d, 2d); `history` (H, 1 + 4d) rows, newest first: time,
position, velocity, and per axis the variance of position and of velocity that measurement noise alone causes; NaN times
mark empty rows.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray


@njit(**KERNEL)
def filter_step(
    mean: FloatArray, covariance: FloatArray, noise: FloatArray, dt: float, density: float, z: FloatArray, r: FloatArray
) -> None:
    """Predict over `dt` and correct with the position `z` (d,), in place.

    `covariance` is the usual error covariance; `noise` the part of it that measurement noise alone causes (Joseph form
    without process noise): what a perfectly steady person would show. `r` (d, d) m², positive definite.
    """
    d = z.size
    n = 2 * d
    for i in range(d):
        mean[i] += dt * mean[d + i]
    for matrix in (covariance, noise):
        for i in range(d):  # F·P
            for j in range(n):
                matrix[i, j] += dt * matrix[d + i, j]
        for j in range(d):  # (F·P)·Fᵀ
            for i in range(n):
                matrix[i, j] += dt * matrix[i, d + j]
    for i in range(d):
        covariance[i, i] += density * dt**3 / 3.0
        covariance[i, d + i] += density * dt**2 / 2.0
        covariance[d + i, i] += density * dt**2 / 2.0
        covariance[d + i, d + i] += density * dt
    # Correlated axes of r are decorrelated by its Cholesky factor; then each axis is a scalar measurement.
    factor = np.zeros((d, d))
    for i in range(d):
        for j in range(i + 1):
            s = r[i, j]
            for k in range(j):
                s -= factor[i, k] * factor[j, k]
            factor[i, j] = math.sqrt(max(s, 1e-12)) if i == j else s / factor[j, j]
    rows = np.zeros((d, d))
    white = np.zeros(d)
    for i in range(d):
        for j in range(d):
            s = 1.0 if i == j else 0.0
            for k in range(i):
                s -= factor[i, k] * rows[k, j]
            rows[i, j] = s / factor[i, i]
        s = z[i]
        for k in range(i):
            s -= factor[i, k] * white[k]
        white[i] = s / factor[i, i]
    gain = np.empty(n)
    for a in range(d):
        _scalar_update(mean, covariance, noise, rows[a], white[a], gain)


@njit(**KERNEL)
def _scalar_update(
    mean: FloatArray, covariance: FloatArray, noise: FloatArray, row: FloatArray, value: float, gain: FloatArray
) -> None:
    """Correct with one unit-variance measurement value = row·position, in place."""
    n = mean.size
    d = row.size
    total = 1.0
    for i in range(n):
        s = 0.0
        for j in range(d):
            s += covariance[i, j] * row[j]
        gain[i] = s
    for j in range(d):
        total += row[j] * gain[j]
    residual = value
    for j in range(d):
        residual -= row[j] * mean[j]
    for matrix in (covariance, noise):  # (I − K·h)·P·(I − K·h)ᵀ + K·Kᵀ, with K = gain/total
        seen = np.zeros(n)
        for i in range(n):
            for j in range(d):
                seen[i] += matrix[i, j] * row[j]
        both = 1.0
        for j in range(d):
            both += row[j] * seen[j]
        for i in range(n):
            for j in range(i + 1):
                k_i = gain[i] / total
                k_j = gain[j] / total
                updated = matrix[i, j] - k_i * seen[j] - seen[i] * k_j + k_i * k_j * both
                matrix[i, j] = updated
                matrix[j, i] = updated
    for i in range(n):
        mean[i] += gain[i] / total * residual


@njit(**KERNEL)
def remember(history: FloatArray, time: float, mean: FloatArray, noise: FloatArray, gap: float) -> None:
    """Put the present estimate on top of `history`, in place; a row younger than `gap` s below it is replaced."""
    d = mean.size // 2
    rows = history.shape[0]
    if not (rows > 1 and time - history[1, 0] < gap):
        for i in range(rows - 1, 0, -1):
            for column in range(history.shape[1]):  # written out: to assign a row takes 2 s to compile
                history[i, column] = history[i - 1, column]
    history[0, 0] = time
    for a in range(d):
        history[0, 1 + a] = mean[a]
        history[0, 1 + d + a] = mean[d + a]
        history[0, 1 + 2 * d + a] = max(noise[a, a], 0.0)
        history[0, 1 + 3 * d + a] = max(noise[d + a, d + a], 0.0)


@njit(**KERNEL)
def row_before(history: FloatArray, age: float, slack: float) -> int:
    """Index of the newest row at least `age − slack` s older than the newest, or −1."""
    for i in range(1, history.shape[0]):
        if math.isnan(history[i, 0]):
            return -1
        if history[0, 0] - history[i, 0] >= age - slack:
            return i
    return -1


@njit(**KERNEL)
def oldest_within(history: FloatArray, age: float) -> int:
    """Index of the oldest row at most `age` s older than the newest (0 when there is none)."""
    best = 0
    for i in range(1, history.shape[0]):
        if math.isnan(history[i, 0]) or history[0, 0] - history[i, 0] > age + 1e-9:
            break
        best = i
    return best


@njit(**KERNEL)
def steadiness_evidence(
    history: FloatArray, scales: FloatArray, window: float, spacing: float, freedom: float, weights: FloatArray
) -> int:
    """Add to `weights` (C,) the log likelihood of the velocity changes in the last `window` s; return their number.

    Velocities are mean ones over ≥ `spacing` s, from filtered positions. The change between two neighbours over τ₁, τ₂
    is multivariate Student-t (`freedom`) with variance σ_c²·(τ₁ + τ₂) per axis plus that of the measurement noise: the
    velocity walk whose position spreads by σ_c·τ^1.5.
    """
    d = (history.shape[1] - 1) // 4
    newer, middle, found = 0, -1, 0
    for i in range(1, history.shape[0]):
        if math.isnan(history[i, 0]) or history[0, 0] - history[i, 0] > window + 1e-9:
            break
        if middle < 0:
            if history[newer, 0] - history[i, 0] >= spacing - 1e-9:
                middle = i
            continue
        tau2 = history[middle, 0] - history[i, 0]
        if tau2 < spacing - 1e-9:
            continue
        tau1 = history[newer, 0] - history[middle, 0]
        change = 0.0
        jitter = 0.0
        for a in range(d):
            first = (history[newer, 1 + a] - history[middle, 1 + a]) / tau1
            change += (first - (history[middle, 1 + a] - history[i, 1 + a]) / tau2) ** 2
            jitter += history[newer, 1 + 2 * d + a] / tau1**2
            jitter += history[middle, 1 + 2 * d + a] * (1.0 / tau1 + 1.0 / tau2) ** 2
            jitter += history[i, 1 + 2 * d + a] / tau2**2
        for c in range(scales.size):
            variance = scales[c] ** 2 * (tau1 + tau2) + jitter / d
            weights[c] -= 0.5 * d * math.log(variance) + 0.5 * (freedom + d) * math.log1p(change / (freedom * variance))
        newer, middle = middle, i
        found += 1
    return found


@njit(**KERNEL)
def normalise_log(weights: FloatArray) -> None:
    """Turn log weights into probabilities, in place."""
    top = weights.max()
    total = 0.0
    for c in range(weights.size):
        weights[c] = math.exp(weights[c] - top)
        total += weights[c]
    for c in range(weights.size):
        weights[c] /= total


@njit(**KERNEL)
def turned(history: FloatArray, span: float, threshold: float) -> bool:
    """Whether the velocity moved by more than `threshold` m/s + 2σ (σ: its noise per axis) in the last `span` s."""
    d = (history.shape[1] - 1) // 4
    slack = 0.01
    for i in range(1, history.shape[0]):
        if math.isnan(history[i, 0]):
            return False
        if i > 1 and history[0, 0] - history[i, 0] > span + slack:
            return False
        change = 0.0
        jitter = 0.0
        for a in range(d):
            change += (history[0, 1 + d + a] - history[i, 1 + d + a]) ** 2
            jitter += (history[0, 1 + 3 * d + a] + history[i, 1 + 3 * d + a]) / d
        if math.sqrt(change) > threshold + 2.0 * math.sqrt(jitter):
            return True
    return False


@njit(**KERNEL)
def usable(covariance: FloatArray, sigma: float) -> FloatArray:
    """`covariance` (d, d) + 1 mm² where it is finite and of no negative variance, else the isotropic one of `sigma`."""
    d = covariance.shape[0]
    fit = True
    for i in range(d):
        for j in range(d):
            fit = fit and math.isfinite(covariance[i, j])
        fit = fit and covariance[i, i] >= 0.0
    out = np.zeros((d, d))
    for i in range(d):
        for j in range(d):
            out[i, j] = covariance[i, j] if fit else 0.0
        out[i, i] += 1e-6 if fit else sigma**2
    return out


@njit(**KERNEL)
def is_another(mean: FloatArray, covariance: FloatArray, z: FloatArray, r: FloatArray, stride: float) -> bool:
    """Whether `z` (d,) is farther from the filtered position than a `stride` (m) and all doubt explain."""
    jump = known = measured = 0.0
    for i in range(z.size):
        jump += (z[i] - mean[i]) ** 2
        known, measured = max(known, covariance[i, i]), max(measured, r[i, i])
    return math.sqrt(jump) > stride + 6.0 * math.sqrt(known + measured) + 0.5


@njit(**KERNEL)
def velocities_seen(
    history: FloatArray, mean: FloatArray, mean_time: float, extrapolation_time: float, gap: float, gain: float
) -> FloatArray:
    """(2, d) m/s: the mean velocity over the last ≤ `mean_time` s and v̂ = v₁ + gain·(v₁ − v₂), kept at a person's pace.

    A change within its noise is no turn: it is shrunk by the share of its square that the noise explains.
    """
    d = mean.size // 2
    out = np.empty((2, d))
    old = oldest_within(history, mean_time)
    elapsed = history[0, 0] - history[old, 0]
    for a in range(d):
        out[0, a] = (mean[a] - history[old, 1 + a]) / elapsed if elapsed > 0.0 else mean[d + a]
        out[1, a] = mean[d + a]
    before = row_before(history, extrapolation_time, 0.5 * gap)
    if before < 0:
        return out
    square = 0.0
    for a in range(d):
        square += (mean[d + a] - history[before, 1 + d + a]) ** 2
    noise = history[0, 1 + 3 * d] + history[before, 1 + 3 * d]
    trust = max(0.0, 1.0 - d * noise / square) if square > 0.0 else 0.0
    for a in range(d):
        out[1, a] += gain * trust * (mean[d + a] - history[before, 1 + d + a])
    return out


@njit(**KERNEL)
def learn(
    time: float,
    dt: float,
    z: FloatArray,
    r: FloatArray,
    constants: FloatArray,
    scales: FloatArray,
    priors: FloatArray,
    mean: FloatArray,
    covariance: FloatArray,
    noise: FloatArray,
    history: FloatArray,
    counts: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Take in one observation, everything in place; returns the velocities of `velocities_seen`.

    Args:
        time: s; dt: s since the last one; z: (d,) m, measured; r: (d, d) m² of it.
        constants: of `habit_settings.class_tables`, in the order in which they are read here.
        scales: (C,) m/s^q of the steadiness classes.
        priors: (2, C) their log prior, walking and standing.
        mean, covariance, noise, history: see the module.
        counts: n₁, n₀ of changed velocities, and the top speed (m/s).
        weights: (C,) written: probability of each class.
    """
    density, gap, window, spacing, freedom = constants[0], constants[1], constants[2], constants[3], constants[4]
    tempering, slow, span, threshold = constants[5], constants[6], constants[7], constants[8]
    d = z.size
    filter_step(mean, covariance, noise, dt, density, z, r)
    remember(history, time, mean, noise, gap)
    velocities = velocities_seen(history, mean, constants[11], constants[12], gap, constants[13])
    weights[:] = 0.0
    steadiness_evidence(history, scales, window, spacing, freedom, weights)
    pace = present = 0.0
    for a in range(d):
        present += mean[d + a] ** 2
        pace += velocities[0, a] ** 2
    present, pace = math.sqrt(present), math.sqrt(pace)
    kind = 1 if present < slow and pace < slow else 0
    for c in range(weights.size):
        weights[c] = tempering * weights[c] + priors[kind, c]
    normalise_log(weights)
    share = min(dt / span, 1.0)
    kept = constants[9] ** share
    moved = turned(history, span, threshold)
    counts[0] = kept * counts[0] + (share if moved else 0.0)
    counts[1] = kept * counts[1] + (0.0 if moved else share)
    counts[2] = max(present - math.sqrt(max(noise[d, d], 0.0)), counts[2] * math.exp(-dt / constants[10]))
    return velocities


@njit(**KERNEL)
def spread_sigmas(
    t: FloatArray, floor: float, scales: FloatArray, exponent: float, noise: FloatArray, habitual: float
) -> FloatArray:
    """(K, C) m: σ(t)² = floor² + (σ_c·t^q)² + what a sensor worse than the habitual one adds (see `sensed`)."""
    sensed = sensed_variance(t, noise, habitual)
    out = np.empty((t.size, scales.size))
    for k in range(t.size):
        power = max(t[k], 0.0) ** exponent
        for c in range(scales.size):
            out[k, c] = math.sqrt(floor * floor + (power * scales[c]) ** 2 + sensed[k])
    return out


@njit(**KERNEL)
def sensed_variance(t: FloatArray, noise: FloatArray, habitual: float) -> FloatArray:
    """(K,) m², what a velocity noise beyond `habitual` (m²/s²) leaves of doubt in the position `t` s ahead."""
    d = noise.shape[0] // 2
    place = both = pace = 0.0
    for a in range(d):
        place += noise[a, a] / d
        both += noise[a, d + a] / d
        pace += noise[d + a, d + a] / d
    share = max(0.0, 1.0 - habitual / pace) if pace > 0.0 else 0.0
    out = np.empty(t.size)
    for k in range(t.size):
        ahead = max(t[k], 0.0)
        out[k] = share * max(place + 2.0 * ahead * both + ahead * ahead * pace, 0.0)
    return out
