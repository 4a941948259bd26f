"""Intervals and paired tests that a reviewer accepts: exact where they can be, bootstrap where not."""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from sidestep.errors import InvalidInput
from sidestep.types import FloatArray


def clopper_pearson(successes: int, trials: int, confidence: float = 0.99) -> tuple[float, float]:
    """Return the exact two-sided interval of a proportion (Clopper and Pearson, 1934); (0, 1) without trials."""
    _check(successes, trials)
    if trials == 0:
        return 0.0, 1.0
    tail = (1.0 - confidence) / 2.0
    low = 0.0 if successes == 0 else float(stats.beta.ppf(tail, successes, trials - successes + 1))
    high = 1.0 if successes == trials else float(stats.beta.ppf(1.0 - tail, successes + 1, trials - successes))
    return low, high


def upper_bound(successes: int, trials: int, confidence: float = 0.99) -> float:
    """Return the exact one-sided upper bound of a binomial proportion; 1 without trials."""
    _check(successes, trials)
    if trials == 0 or successes == trials:
        return 1.0
    return float(stats.beta.ppf(confidence, successes + 1, trials - successes))


def mcnemar(only_first: int, only_second: int) -> float:
    """Return the exact two-sided p-value of McNemar's test on paired outcomes.

    Args:
        only_first: pairs in which the first alone had the event.
        only_second: pairs in which the second alone had it.
    """
    discordant = only_first + only_second
    _check(only_first, discordant)
    if discordant == 0:
        return 1.0
    return float(stats.binomtest(only_first, discordant, 0.5).pvalue)


def bootstrap_mean(
    values: FloatArray, generator: np.random.Generator, confidence: float = 0.95, resamples: int = 2000
) -> tuple[float, float]:
    """Return the percentile interval of the mean of `values` (n,); NaN without values."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return math.nan, math.nan
    means = np.empty(resamples)
    for start in range(0, resamples, 100):  # in portions, so that many values fit into memory
        index = generator.integers(len(values), size=(min(100, resamples - start), len(values)))
        means[start : start + 100] = values[index].mean(axis=1)
    tail = (1.0 - confidence) / 2.0
    low, high = np.quantile(means, [tail, 1.0 - tail])
    return float(low), float(high)


def area_under_curve(scores: FloatArray, labels: FloatArray) -> float:
    """Return P(score of a positive > score of a negative), ties half; NaN where one of the classes is empty.

    Args:
        scores: (n,).
        labels: (n,) true or 1 for positives.
    """
    positive = labels.astype(bool)
    p, n = int(positive.sum()), int((~positive).sum())
    if p == 0 or n == 0:
        return math.nan
    ranks = stats.rankdata(scores)
    return float((ranks[positive].sum() - p * (p + 1) / 2) / (p * n))


def area_interval(
    scores: FloatArray, labels: FloatArray, generator: np.random.Generator, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the percentile interval of `area_under_curve`, positives and negatives drawn anew 1000 times each."""
    positive, negative = scores[labels.astype(bool)], scores[~labels.astype(bool)]
    if len(positive) == 0 or len(negative) == 0:
        return math.nan, math.nan
    truth = np.repeat([1.0, 0.0], [len(positive), len(negative)])
    found = [
        area_under_curve(np.concatenate([generator.choice(x, len(x)) for x in (positive, negative)]), truth)
        for _ in range(1000)
    ]
    tail = (1.0 - confidence) / 2.0
    low, high = np.quantile(found, [tail, 1.0 - tail])
    return float(low), float(high)


def log_loss(probabilities: FloatArray, labels: FloatArray) -> float:
    """Return the mean −log of the probability of what was, (n,) each; probabilities are kept 1e-6 away from 0 and 1."""
    if len(probabilities) == 0:
        return math.nan
    p = np.clip(probabilities, 1e-6, 1.0 - 1e-6)
    return float(-np.where(labels.astype(bool), np.log(p), np.log1p(-p)).mean())


def calibration_bins(
    predicted: FloatArray, happened: FloatArray, edges: FloatArray, confidence: float = 0.99
) -> list[dict[str, float]]:
    """Return per bin of the predicted probability: mean prediction, frequency, its exact interval, count.

    Args:
        predicted: (n,) probabilities.
        happened: (n,) true or false.
        edges: (B+1,) increasing, from 0 to 1.
    """
    index = np.clip(np.searchsorted(edges, predicted, side="right") - 1, 0, len(edges) - 2)
    bins: list[dict[str, float]] = []
    for b in range(len(edges) - 1):
        own = index == b
        n, k = int(own.sum()), int(happened[own].sum())
        if n == 0:
            continue
        low, high = clopper_pearson(k, n, confidence)
        bins.append(
            {
                "from": float(edges[b]),
                "to": float(edges[b + 1]),
                "n": n,
                "predicted": float(predicted[own].mean()),
                "frequency": k / n,
                "low": low,
                "high": high,
            }
        )
    return bins


def expected_calibration_error(bins: list[dict[str, float]]) -> float:
    """Return the mean over bins, weighted by their counts, of |prediction − frequency|; NaN without bins."""
    total = sum(b["n"] for b in bins)
    if total == 0:
        return math.nan
    return sum(b["n"] * abs(b["predicted"] - b["frequency"]) for b in bins) / total


def _check(successes: int, trials: int) -> None:
    if not 0 <= successes <= trials:
        raise InvalidInput("successes", successes, f"0 to the number of trials, {trials}")
