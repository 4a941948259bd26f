"""The strong baseline: constant velocity with a mixture of errors in the heading frame, fitted on the score itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtr

from sidestep.studies.people_grid import CELL, Density, cell_of
from sidestep.studies.people_samples import Moment
from sidestep.types import FloatArray

SPEED_CLASSES = (0.3, 0.8)  # m/s: standing, slow, brisk
COMPONENTS = 4
SMALLEST = 0.02  # m, of a standard deviation
FEWEST = 40  # moments that a class of its own needs
BACKGROUND = 0.002  # share of people who go anywhere, in the fit and in the prediction alike
ANYWHERE = 1.5  # m/s, how fast that spreads


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorMixture:
    """Errors of one speed class at one horizon, along and across the heading.

    Attributes:
        weights: (M,); means: (M, 2) m, across 0; sigmas: (M, 2) m.
    """

    weights: FloatArray
    means: FloatArray
    sigmas: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConstantVelocity:
    """Velocity of the last 0.4 s, kept, and the errors that this makes.

    Attributes:
        horizons: (H,) s.
        errors: per speed class, per horizon.
    """

    horizons: tuple[float, ...]
    errors: tuple[tuple[ErrorMixture, ...], ...]

    def predict(self, moment: Moment, index: int) -> Density:
        """Return the density at horizon `index`."""
        error = self.errors[speed_class(moment)][index]
        mean = (moment.velocity @ moment.frame) * self.horizons[index]
        wide = np.full((1, 2), ANYWHERE * self.horizons[index])
        return Density(
            weights=np.append((1.0 - BACKGROUND) * error.weights, BACKGROUND),
            means=np.concatenate([mean + error.means, mean[None]]),
            sigmas=np.concatenate([error.sigmas, wide]),
        )


def speed_class(moment: Moment) -> int:
    """Return 0 for those who stand, 1 for slow walkers, 2 for the others."""
    return int(np.searchsorted(SPEED_CLASSES, moment.speed, side="right"))


def fit_baseline(moments: Sequence[Moment], horizons: Sequence[float], indices: Sequence[int]) -> ConstantVelocity:
    """Fit the errors by maximum likelihood on the cells.

    Args:
        moments: to fit on; not those that are scored later.
        horizons: s, of `Moment.future`.
        indices: horizons that will be asked for.
    """
    classes = np.array([speed_class(m) for m in moments])
    velocity = np.array([m.velocity @ m.frame for m in moments])
    future = np.array([m.future for m in moments])
    errors: list[tuple[ErrorMixture, ...]] = []
    for c in range(len(SPEED_CLASSES) + 1):
        own = classes == c if (classes == c).sum() >= FEWEST else np.ones(len(moments), dtype=bool)
        row: list[ErrorMixture] = []
        for k in indices:
            row.append(_fit(future[own, k], velocity[own] * horizons[k]))
        errors.append(tuple(row))
    return ConstantVelocity(horizons=tuple(horizons[k] for k in indices), errors=tuple(errors))


def _fit(truth: FloatArray, predicted: FloatArray) -> ErrorMixture:
    """Start from quantiles of the error and descend the mean score of the cells; truth, predicted (S, 2) m."""
    error = truth - predicted
    size = np.sqrt((error**2).sum(axis=1) / 2)
    scales = np.log(np.maximum(np.quantile(size, [0.3, 0.6, 0.85, 0.98]), SMALLEST))
    along = np.full(COMPONENTS, np.median(error[:, 0]))
    start = np.concatenate([np.zeros(COMPONENTS), along, scales, scales])
    low = (cell_of(truth) - 0.5) * CELL - predicted
    found = minimize(_objective, start, args=(low,), jac=True, method="L-BFGS-B", options={"maxiter": 200})
    return _unpacked(found.x)


def _objective(values: FloatArray, low: FloatArray) -> tuple[float, FloatArray]:
    """Mean log loss of cells whose lower corner lies at `low` (S, 2) m from the prediction, and its gradient."""
    m = _unpacked(values)
    a = (low[:, None] - m.means) / m.sigmas  # (S, M, 2)
    b = (low[:, None] + CELL - m.means) / m.sigmas
    sides = ndtr(b) - ndtr(a)
    parts = m.weights * sides.prod(axis=-1)  # (S, M)
    mass = BACKGROUND * 1e-3 + (1.0 - BACKGROUND) * parts.sum(axis=-1)  # the first keeps a lone surprise from ruling
    density_a, density_b = _bell(a), _bell(b)
    d_mean = (density_a - density_b) / m.sigmas
    d_log_sigma = a * density_a - b * density_b
    other = sides[..., ::-1]
    share = (1.0 - BACKGROUND) / mass[:, None]
    g_logits = -(share * parts - m.weights * (share * parts).sum(axis=1, keepdims=True)).mean(axis=0)
    g_along = -(share * m.weights * d_mean[..., 0] * other[..., 0]).mean(axis=0)
    g_sigma = -((share * m.weights)[..., None] * d_log_sigma * other).mean(axis=0)  # (M, 2)
    held = (values[2 * COMPONENTS :] < _LOWEST) | (values[2 * COMPONENTS :] > _HIGHEST)
    g_log = np.where(held, 0.0, np.concatenate([g_sigma[:, 0], g_sigma[:, 1]]))
    return float(-np.log(mass / CELL**2).mean()), np.concatenate([g_logits, g_along, g_log])


def _bell(z: FloatArray) -> FloatArray:
    return np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)


_LOWEST, _HIGHEST = float(np.log(SMALLEST)), float(np.log(20.0))


def _unpacked(values: FloatArray) -> ErrorMixture:
    logits, along, log_x, log_y = np.split(values, 4)
    weights = np.exp(logits - logits.max())
    sigmas = np.exp(np.clip(np.stack([log_x, log_y], axis=1), _LOWEST, _HIGHEST))
    means = np.stack([along, np.zeros(COMPONENTS)], axis=1)
    return ErrorMixture(weights=weights / weights.sum(), means=means, sigmas=sigmas)
