"""Scores of a predictive density on cells: the same for everybody who predicts.

A density is a mixture of axis-aligned Gaussians in the heading frame of the moment: the mass of a cell is exact.
The grid lies in that frame too, the person's measured position in the middle of a cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from sidestep.types import FloatArray

CELL = 0.5  # m
FLOOR = 1e-9  # smallest mass of a cell, so that one surprise does not make a score infinite
LEVELS = (0.50, 0.90, 0.95, 0.99)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Density:
    """What is predicted of one person for one instant.

    Attributes:
        weights: (M,) sum 1.
        means: (M, 2) m, displacement in the frame of the moment.
        sigmas: (M, 2) m, along its axes (> 0).
    """

    weights: FloatArray
    means: FloatArray
    sigmas: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score:
    """One prediction against what happened.

    Attributes:
        log_loss: nat, −log of the mean density over the true cell, 1/m².
        brier: Σ over cells of (mass − [true cell])², 0 to 2.
        covered: (L,) share of the true cell inside the smallest region of mass ≥ `LEVELS`.
        area: (L,) m² of these regions.
    """

    log_loss: float
    brier: float
    covered: FloatArray
    area: FloatArray


def cell_of(displacement: FloatArray) -> FloatArray:
    """Return the (…, 2) indices of the cells of displacements (…, 2) m; (0, 0) has the origin in its middle."""
    return np.floor(displacement / CELL + 0.5)


def log_losses(truth: FloatArray, weights: FloatArray, means: FloatArray, sigmas: FloatArray) -> FloatArray:
    """Return (S,) nat for many moments at once.

    Args:
        truth: (S, 2) m.
        weights: (S, M); means: (S, M, 2) m; sigmas: (S, M, 2) m.
    """
    low = ((cell_of(truth) - 0.5) * CELL)[:, None]
    mass = (_between(low, low + CELL, means, sigmas).prod(axis=-1) * weights).sum(axis=-1)
    return -np.log(np.maximum(mass, FLOOR) / CELL**2)


def masses(density: Density, reach: int) -> FloatArray:
    """Return the mass of each cell, (2·reach + 1, 2·reach + 1)."""
    low = (np.arange(-reach, reach + 1, dtype=np.float64)[:, None] - 0.5) * CELL
    x = _between(low, low + CELL, density.means[:, 0], density.sigmas[:, 0])  # (cells, M)
    y = _between(low, low + CELL, density.means[:, 1], density.sigmas[:, 1])
    return (x * density.weights) @ y.T


def score(mass: FloatArray, truth: FloatArray) -> Score:
    """Score the masses of cells ((W, W), the origin in the middle; the rest lies outside) against `truth` (2,) m.

    Regions take the most probable cells first and of the last cell only the share that is still needed: then the
    expected coverage of a calibrated prediction is the level itself, however coarse the grid.
    """
    reach = len(mass) // 2
    i, j = (int(v) + reach for v in cell_of(truth))
    inside = 0 <= i < len(mass) and 0 <= j < len(mass)
    true_mass = float(mass[i, j]) if inside else 0.0
    squares = float((mass**2).sum())
    ordered = np.sort(mass, axis=None)[::-1]
    total = np.cumsum(ordered)
    tied = np.isclose(mass, true_mass, rtol=1e-9, atol=0.0)  # mirrored cells: each gets its share of what is left
    above, equal = float(mass[(mass > true_mass) & ~tied].sum()), float(mass[tied].sum())
    covered, area = np.zeros(len(LEVELS)), np.zeros(len(LEVELS))
    for n, level in enumerate(LEVELS):
        last = int(np.searchsorted(total, level))
        before = total[last - 1] if last else 0.0
        share = (level - before) / ordered[last] if last < len(ordered) else 0.0
        area[n] = (last + share) * CELL**2
        covered[n] = np.clip((level - above) / equal, 0.0, 1.0) if true_mass > 0 else float(above < level)
    return Score(
        log_loss=float(-np.log(max(true_mass, FLOOR) / CELL**2)),
        brier=squares - 2.0 * true_mass + 1.0,
        covered=covered,
        area=area,
    )


def reach_of(horizon: float, fastest: float = 3.0) -> int:
    """Return how many cells on each side hold everybody `horizon` s later (a person at `fastest` m/s)."""
    return int(np.ceil((fastest * horizon + 1.0) / CELL))


def mean_scores(scores: Sequence[Score]) -> dict[str, float]:
    """Return the means by name, as they stand in tables."""
    table = {
        "nll": float(np.mean([s.log_loss for s in scores])),
        "brier": float(np.mean([s.brier for s in scores])),
    }
    for n, level in enumerate(LEVELS):
        table[f"coverage_{round(100 * level)}"] = float(np.mean([s.covered[n] for s in scores]))
        table[f"area_{round(100 * level)}"] = float(np.mean([s.area[n] for s in scores]))
    return table


def _between(low: FloatArray, high: FloatArray, mean: FloatArray, sigma: FloatArray) -> FloatArray:
    return ndtr((high - mean) / sigma) - ndtr((low - mean) / sigma)
