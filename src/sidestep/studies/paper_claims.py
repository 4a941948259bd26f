"""How each claim of the paper is judged: what is measured for it, and the verdict with its interval."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import binom

from sidestep.studies.paper import Place, Points
from sidestep.studies.statistics import clopper_pearson
from sidestep.types import BoolArray, FloatArray

NARROW = (0.8, 1.25)  # ratios within count as "hardly changes"
STRONG = 0.9  # a ratio below counts as "falls"
TOLD_APART = 0.9  # share of runs in which the belief must be right at the closest approach


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What was measured for a claim under one parameter set and rule.

    Attributes:
        measured: the number; interval: 95 %; n: seeds; verdict: "holds", "does not hold" or "undecided".
        quantity: what the number is, in words; detail: further numbers.
    """

    measured: float
    interval: tuple[float, float]
    n: int
    verdict: str
    quantity: str
    detail: Mapping[str, Any] = field(default_factory=dict)


def median_interval(values: FloatArray) -> tuple[float, float, float]:
    """Return the median and its distribution-free 95 % interval (binomial order statistics); NaN are left out."""
    x = np.sort(values[np.isfinite(values)])
    n = len(x)
    if n == 0:
        return float("nan"), float("nan"), float("nan")
    low = int(binom.ppf(0.025, n, 0.5))
    return float(np.median(x)), float(x[max(low - 1, 0)]), float(x[min(n - low, n - 1)])


def below(values: FloatArray, limit: float, quantity: str, **detail: Any) -> Finding:
    """Judge "the median is below the limit"."""
    middle, low, high = median_interval(values)
    verdict = "holds" if high < limit else "does not hold" if low >= limit else "undecided"
    n = int(np.isfinite(values).sum())
    return Finding(measured=middle, interval=(low, high), n=n, verdict=verdict, quantity=quantity, detail=detail)


def _ratios(values: FloatArray, base: FloatArray) -> FloatArray:
    """Values / base, seed by seed; two zeros (an index that vanishes in both) are a ratio of 1."""
    tiny = 1e-6
    return (values + tiny) / (base + tiny)


def worst(*findings: Finding) -> Finding:
    """Return the finding that is farthest from holding: a claim about several quantities holds where all of them do."""
    order = {"does not hold": 0, "undecided": 1, "holds": 2}
    return min(findings, key=lambda f: order[f.verdict])


def judge_difference(column: str, quantity: str) -> Callable[[Points, Place, str], Finding]:
    """Both agents' value with prediction (N_H = 5) less that without, paired by seed, below zero."""

    def judge(points: Points, place: Place, index: str) -> Finding:
        del index
        parts: list[Finding] = []
        for agent in ("robot", "human"):
            name = f"{agent}_{column}" if column in ("length", "turning") else column
            ahead = points.column(place.encounter(5, 5), name)
            blind = points.column(place.encounter(5, 0), name)
            parts.append(below(ahead - blind, 0.0, f"{agent}: {quantity}", without=float(np.median(blind))))
            if column == "entropy":
                break
        return worst(*parts)

    return judge


def judge_falls(points: Points, place: Place, index: str) -> Finding:
    """PI_R and PI_T with a non-predictive person: N = 7 against N = 1."""
    parts: list[Finding] = []
    for name in ("PI_R", "PI_T"):
        first = points.column(place.encounter(1, 0), name + index)
        last = points.column(place.encounter(7, 0), name + index)
        parts.append(below(_ratios(last, first), STRONG, f"{name}{index}(N = 7) / {name}{index}(N = 1), N_H = 0"))
    return worst(*parts)


def judge_flat(points: Points, place: Place, index: str) -> Finding:
    """PI_H from N = 1 to 7 and PI_T from N = 4 to 10 with a non-predictive person."""
    human = [points.column(place.encounter(n, 0), "PI_H" + index) for n in (1, 7)]
    total = [points.column(place.encounter(n, 0), "PI_T" + index) for n in (4, 10)]
    return worst(
        _hardly_changes(_ratios(human[1], human[0]), f"PI_H{index}(N = 7) / PI_H{index}(N = 1), N_H = 0"),
        _hardly_changes(_ratios(total[1], total[0]), f"PI_T{index}(N = 10) / PI_T{index}(N = 4), N_H = 0"),
    )


def _hardly_changes(ratios: FloatArray, quantity: str) -> Finding:
    middle, low, high = median_interval(ratios)
    inside = NARROW[0] <= low and high <= NARROW[1]
    outside = high < NARROW[0] or low > NARROW[1]
    verdict = "holds" if inside else "does not hold" if outside else "undecided"
    return Finding(measured=middle, interval=(low, high), n=len(ratios), verdict=verdict, quantity=quantity)


def judge_optimum(points: Points, place: Place, index: str) -> Finding:
    """PI_T with a predictive person is lower at some horizon than at both ends."""
    curves = {n: points.column(place.encounter(n, n), "PI_T" + index) for n in place.horizons}
    best = min(place.horizons, key=lambda n: float(np.median(curves[n])))
    ends = worst(
        below(curves[best] - curves[place.horizons[0]], 0.0, f"PI_T{index}(N = {best}) − PI_T{index}(N = 1)"),
        below(curves[best] - curves[place.horizons[-1]], 0.0, f"PI_T{index}(N = {best}) − PI_T{index}(N = 10)"),
    )
    return Finding(
        measured=ends.measured,
        interval=ends.interval,
        n=ends.n,
        verdict=ends.verdict,
        quantity=f"{ends.quantity}, m² (or m); best horizon {best}, N_H = N_R",
        detail={"best_horizon": best},
    )


def judge_human_falls(points: Points, place: Place, index: str) -> Finding:
    """PI_H with a predictive person falls, and does not rise again."""
    curves = {n: points.column(place.encounter(n, n), "PI_H" + index) for n in place.horizons}
    best = min(place.horizons, key=lambda n: float(np.median(curves[n])))
    fall = below(_ratios(curves[best], curves[1]), STRONG, f"PI_H{index}(N = {best}) / PI_H{index}(N = 1), N_H = N_R")
    rise = below(
        _ratios(curves[10], curves[best]), NARROW[1], f"PI_H{index}(N = 10) / PI_H{index}(N = {best}), N_H = N_R"
    )
    return worst(fall, rise)


def judge_safety(points: Points, place: Place, index: str) -> Finding:
    """Runs in which P_coll ≤ P_th at every step of every plan; by the rule `cells`, and the clearance is kept."""
    del index
    limit = 0.05
    probability = np.concatenate(
        [points.column(place.encounter(n, n), "max_collision_probability") for n in place.horizons]
    )
    uncertified = np.concatenate([points.column(place.encounter(n, n), "uncertified") for n in place.horizons])
    parts = [
        _always(
            probability <= limit + 1e-9,
            "share of runs in which P_coll ≤ P_th at every step of every plan",
            largest=float(probability.max()),
        )
    ]
    if place.rule == "cells":
        clear = "share of runs in which every plan keeps its clearance from every cell with P ≥ P_th"
        parts.append(_always(uncertified == 0.0, clear))
    return worst(*parts)


def _always(good: BoolArray, quantity: str, **detail: Any) -> Finding:
    """Judge "in every run"."""
    share = float(good.mean())
    low, high = clopper_pearson(int(good.sum()), good.size, 0.95)
    verdict = "holds" if share == 1.0 else "does not hold" if high < 1.0 else "undecided"
    return Finding(
        measured=share, interval=(low, high), n=int(good.size), verdict=verdict, quantity=quantity, detail=detail
    )


def judge_rate(points: Points, place: Place, index: str) -> Finding:
    """95th percentile of the planning time against the 500 ms of 2 Hz."""
    del index
    times = np.concatenate([points.column(place.lab(h), "plan_p95") for h in ("concerned", "unconcerned")])
    return below(times, 500.0, "95th percentile of the planning time, ms, against the 500 ms of 2 Hz")


def judge_told_apart(points: Points, place: Place, index: str) -> Finding:
    """Runs with the belief on the right side at the closest approach."""
    del index
    concerned = points.column(place.lab("concerned"), "belief_at_closest") > 0.9
    unconcerned = points.column(place.lab("unconcerned"), "belief_at_closest") < 0.1
    right = np.concatenate([concerned, unconcerned])
    share = float(right.mean())
    low, high = clopper_pearson(int(right.sum()), right.size, 0.95)
    verdict = "holds" if low >= TOLD_APART else "does not hold" if high < TOLD_APART else "undecided"
    steps = [points.column(place.lab(h), "steps_to_identify") for h in ("concerned", "unconcerned")]
    return Finding(
        measured=share,
        interval=(low, high),
        n=int(right.size),
        verdict=verdict,
        quantity="share of runs with belief > 0.9 (< 0.1) at the closest approach",
        detail={"median_steps_to_identify": [median_interval(s)[0] for s in steps]},
    )


def judge_ratio(points: Points, place: Place, index: str) -> Finding:
    """PI_R with an unconcerned person over PI_R with a concerned one."""
    careless = points.column(place.lab("unconcerned"), "PI_R" + index)
    careful = points.column(place.lab("concerned"), "PI_R" + index)
    if index:  # the offset of a robot that need not deviate is 0, and there is no ratio to it
        found = below(careful - careless, 0.0, f"PI_R{index} unconcerned less concerned, m")
    else:
        found = below(-_ratios(careless, careful), -1.0, "PI_R unconcerned / concerned")
    low, high = found.interval
    return Finding(
        measured=-found.measured, interval=(-high, -low), n=found.n, verdict=found.verdict, quantity=found.quantity
    )


def judge_narrows(points: Points, place: Place, index: str) -> Finding:
    """Entropy of the prediction once the belief is decided, less that at first."""
    del index
    parts: list[Finding] = []
    for human in ("concerned", "unconcerned"):
        setting = place.lab(human)
        change = points.column(setting, "entropy_decided") - points.column(setting, "entropy_first")
        if not np.isfinite(change).any():
            no = f"{human}: the belief was never decided, so nothing narrowed"
            return Finding(measured=0.0, interval=(0.0, 0.0), n=len(change), verdict="does not hold", quantity=no)
        peaks = {name: median_interval(points.column(setting, name))[0] for name in ("peak_first", "peak_decided")}
        parts.append(below(change, 0.0, f"{human}: entropy while decided less that at first, nat", **peaks))
    return worst(*parts)
