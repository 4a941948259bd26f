"""The paper's claims: what each says, what is measured for it, and the verdict with its interval."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import binom

from sidestep.studies.paper import HORIZONS, LAB_HORIZON, Points
from sidestep.studies.paper_points import Setting
from sidestep.studies.statistics import clopper_pearson
from sidestep.types import FloatArray

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One claim of the text.

    Attributes:
        id: as in the table of claims; statement: in words; paper: what the paper or its recorded runs show.
        judge: from points, parameter set, rule and definition of PI ("" or "_lateral").
        lab: it is about Section V.
        by_index: it is about performance indices, and judged under both definitions.
    """

    id: str
    statement: str
    paper: str
    judge: Callable[[Points, str, str, str], Finding]
    lab: bool = False
    by_index: bool = False


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


def point(parameters: str, rule: str, horizon: int, ahead: int, human: str = "concerned") -> Setting:
    """Return a point of Section IV."""
    return Setting(label=f"paper-{parameters}", rule=rule, human=human, horizon=horizon, anticipation=ahead)


def lab(parameters: str, rule: str, human: str) -> Setting:
    """Return a point of Section V: as printed, or the variant in which the two meet."""
    label = "lab-printed" if parameters == "printed" else "lab-meeting"
    return Setting(label=label, rule=rule, human=human, horizon=LAB_HORIZON, anticipation=LAB_HORIZON)


def _with_minus_without(column: str, quantity: str) -> Callable[[Points, str, str, str], Finding]:
    """Both agents' value with prediction (N_H = 5) less that without, paired by seed, below zero."""

    def judge(points: Points, parameters: str, rule: str, index: str) -> Finding:
        del index
        parts: list[Finding] = []
        for agent in ("robot", "human"):
            name = f"{agent}_{column}" if column in ("length", "turning") else column
            ahead = points.column(point(parameters, rule, 5, 5), name)
            blind = points.column(point(parameters, rule, 5, 0), name)
            parts.append(below(ahead - blind, 0.0, f"{agent}: {quantity}", without=float(np.median(blind))))
            if column == "entropy":
                break
        return worst(*parts)

    return judge


def _falls(points: Points, parameters: str, rule: str, index: str) -> Finding:
    parts: list[Finding] = []
    for name in ("PI_R", "PI_T"):
        first = points.column(point(parameters, rule, 1, 0), name + index)
        last = points.column(point(parameters, rule, 7, 0), name + index)
        parts.append(below(_ratios(last, first), STRONG, f"{name}{index}(N = 7) / {name}{index}(N = 1), N_H = 0"))
    return worst(*parts)


def _flat(points: Points, parameters: str, rule: str, index: str) -> Finding:
    human = [points.column(point(parameters, rule, n, 0), "PI_H" + index) for n in (1, 7)]
    total = [points.column(point(parameters, rule, n, 0), "PI_T" + index) for n in (4, 10)]
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


def _optimum(points: Points, parameters: str, rule: str, index: str) -> Finding:
    curves = {n: points.column(point(parameters, rule, n, n), "PI_T" + index) for n in HORIZONS}
    best = min(HORIZONS, key=lambda n: float(np.median(curves[n])))
    ends = worst(
        below(curves[best] - curves[HORIZONS[0]], 0.0, f"PI_T{index}(N = {best}) − PI_T{index}(N = 1)"),
        below(curves[best] - curves[HORIZONS[-1]], 0.0, f"PI_T{index}(N = {best}) − PI_T{index}(N = 10)"),
    )
    return Finding(
        measured=ends.measured,
        interval=ends.interval,
        n=ends.n,
        verdict=ends.verdict,
        quantity=f"{ends.quantity}, m² (or m); best horizon {best}, N_H = N_R",
        detail={"best_horizon": best},
    )


def _human_falls(points: Points, parameters: str, rule: str, index: str) -> Finding:
    curves = {n: points.column(point(parameters, rule, n, n), "PI_H" + index) for n in HORIZONS}
    best = min(HORIZONS, key=lambda n: float(np.median(curves[n])))
    fall = below(_ratios(curves[best], curves[1]), STRONG, f"PI_H{index}(N = {best}) / PI_H{index}(N = 1), N_H = N_R")
    rise = below(
        _ratios(curves[10], curves[best]), NARROW[1], f"PI_H{index}(N = 10) / PI_H{index}(N = {best}), N_H = N_R"
    )
    return worst(fall, rise)


def _safety(points: Points, parameters: str, rule: str, index: str) -> Finding:
    del index
    limit = 0.05
    runs = [points.column(point(parameters, rule, n, n), "max_collision_probability") for n in HORIZONS]
    uncertified = [points.column(point(parameters, rule, n, n), "uncertified") for n in HORIZONS]
    good = np.concatenate(runs) <= limit + 1e-9
    share = float(good.mean())
    low, high = clopper_pearson(int(good.sum()), good.size, 0.95)
    verdict = "holds" if share == 1.0 else "does not hold" if high < 1.0 else "undecided"
    return Finding(
        measured=share,
        interval=(low, high),
        n=int(good.size),
        verdict=verdict,
        quantity="share of runs in which P_coll ≤ P_th at every step of every plan",
        detail={
            "largest": float(np.concatenate(runs).max()),
            "steps_without_certificate": float(np.concatenate(uncertified).mean()),
        },
    )


def _rate(points: Points, parameters: str, rule: str, index: str) -> Finding:
    del index
    times = np.concatenate([points.column(lab(parameters, rule, h), "plan_p95") for h in ("concerned", "unconcerned")])
    return below(times, 500.0, "95th percentile of the planning time, ms, against the 500 ms of 2 Hz")


def _told_apart(points: Points, parameters: str, rule: str, index: str) -> Finding:
    del index
    concerned = points.column(lab(parameters, rule, "concerned"), "belief_at_closest") > 0.9
    unconcerned = points.column(lab(parameters, rule, "unconcerned"), "belief_at_closest") < 0.1
    right = np.concatenate([concerned, unconcerned])
    share = float(right.mean())
    low, high = clopper_pearson(int(right.sum()), right.size, 0.95)
    verdict = "holds" if low >= TOLD_APART else "does not hold" if high < TOLD_APART else "undecided"
    steps = [points.column(lab(parameters, rule, h), "steps_to_identify") for h in ("concerned", "unconcerned")]
    return Finding(
        measured=share,
        interval=(low, high),
        n=int(right.size),
        verdict=verdict,
        quantity="share of runs with belief > 0.9 (< 0.1) at the closest approach",
        detail={"median_steps_to_identify": [median_interval(s)[0] for s in steps]},
    )


def _ratio(points: Points, parameters: str, rule: str, index: str) -> Finding:
    careless = points.column(lab(parameters, rule, "unconcerned"), "PI_R" + index)
    careful = points.column(lab(parameters, rule, "concerned"), "PI_R" + index)
    if index:  # the offset of a robot that need not deviate is 0, and there is no ratio to it
        found = below(careful - careless, 0.0, f"PI_R{index} unconcerned less concerned, m")
    else:
        found = below(-_ratios(careless, careful), -1.0, "PI_R unconcerned / concerned")
    low, high = found.interval
    return Finding(
        measured=-found.measured, interval=(-high, -low), n=found.n, verdict=found.verdict, quantity=found.quantity
    )


def _narrows(points: Points, parameters: str, rule: str, index: str) -> Finding:
    del index
    parts: list[Finding] = []
    for human in ("concerned", "unconcerned"):
        setting = lab(parameters, rule, human)
        change = points.column(setting, "entropy_decided") - points.column(setting, "entropy_first")
        if not np.isfinite(change).any():
            no = f"{human}: the belief was never decided, so nothing narrowed"
            return Finding(measured=0.0, interval=(0.0, 0.0), n=len(change), verdict="does not hold", quantity=no)
        parts.append(below(change, 0.0, f"{human}: entropy while decided less that at first, nat"))
    return worst(*parts)


CLAIMS: tuple[Claim, ...] = (
    Claim(
        id="IV-A-shorter",
        statement="with prediction (N_H = 5) both paths are shorter than without (N_H = 0)",
        paper="robot 19.45 → 19.31 m, human 9.83 → 9.25 m (one run each)",
        judge=_with_minus_without("length", "path length with less without prediction, m"),
    ),
    Claim(
        id="IV-A-smoother",
        statement="with prediction (N_H = 5) both paths are smoother than without",
        paper="total turning: robot 0.85 → 1.04 rad, human 5.0 → 0 (one run each)",
        judge=_with_minus_without("turning", "total turning with less without prediction, rad"),
    ),
    Claim(
        id="IV-A-narrower",
        statement="without prediction the predicted distribution is wider",
        paper="entropy at k = 5: 2.30 without, 1.87 nat with",
        judge=_with_minus_without("entropy", "entropy at k = 5 with less without prediction, nat"),
    ),
    Claim(
        id="IV-B-nonpredictive-falls",
        statement="PI_R and PI_T fall strongly with N_R when the human is non-predictive",
        paper="normalised PI_R 1, .72, .62, .11, .08, .03, .03 for N = 1..7",
        judge=_falls,
        by_index=True,
    ),
    Claim(
        id="IV-B-nonpredictive-flat",
        statement="PI_H hardly changes with N_R; PI_T then stays constant (non-predictive human)",
        paper="PI_H .65–1.0; PI_T .19–.22 for N = 4..7",
        judge=_flat,
        by_index=True,
    ),
    Claim(
        id="IV-B-predictive-optimum",
        statement="predictive human: PI_R and PI_T fall, then rise; best at N = 5",
        paper="PI_T .74, .60, .48, .08, .06, .77, 1.18",
        judge=_optimum,
        by_index=True,
    ),
    Claim(
        id="IV-B-predictive-human",
        statement="predictive human: PI_H falls and does not rise again",
        paper="PI_H .68, .15, .76, 0, 0, 0, 0",
        judge=_human_falls,
        by_index=True,
    ),
    Claim(
        id="IV-safety",
        statement="collision probability ≤ P_th at every step",
        paper="stated as a constraint",
        judge=_safety,
    ),
    Claim(
        id="V-rate",
        statement="the whole system runs at 2 Hz",
        paper="recorded steps are 5 s apart",
        judge=_rate,
        lab=True,
    ),
    Claim(
        id="V-distinguishes",
        statement="concerned and unconcerned humans are told apart online",
        paper="shown for one run each",
        judge=_told_apart,
        lab=True,
    ),
    Claim(
        id="V-ratio",
        statement="PI_R(unconcerned) / PI_R(concerned) = 1.62",
        paper="1.62; not recomputable from the recordings. Only the direction (> 1) is judged",
        judge=_ratio,
        lab=True,
        by_index=True,
    ),
    Claim(
        id="V-narrows",
        statement="the distribution narrows as awareness is learned",
        paper="peak cell .47 while undecided → .93",
        judge=_narrows,
        lab=True,
    ),
)
"""Every claim of Sections IV and V, in the order of the text."""
