"""From episodes to the table of a paper: rates, intervals, the best opponent, and how we compare with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sidestep.studies.episode import quantile
from sidestep.studies.evaluate import Batch, Evaluation
from sidestep.studies.opponents import contestants
from sidestep.studies.statistics import bootstrap_mean, clopper_pearson, mcnemar, upper_bound

OURS = "sidestep"
TOO_OFTEN = 0.20  # an opponent that collides at least this often is no yardstick for speed
FAIR = 40
"""Episodes after which an opponent is known well enough to be a yardstick, where ours has more."""
AIM_COLLISION, AIM_TIME = 0.05, 1.05
_MEANS = (
    "path_length", "spl", "time_intimate", "time_personal", "speed", "acceleration", "jerk", "below_clearance",
    "belief_accuracy", "belief_brier", "time_to_identify", "certified",
)  # fmt: skip


def condition_rows(evaluation: Evaluation) -> list[dict[str, Any]]:
    """Return one row per condition and navigator, JSON-able; NaN stands as None."""
    rows = [_row(c, n, batch, evaluation.seed) for (c, n), batch in evaluation.batches.items()]
    for row in rows:
        best = best_opponent(row["name"], rows)
        if best is not None and row["navigator"] != best["navigator"]:
            both = evaluation.batches
            own, other = both[row["name"], row["navigator"]], both[row["name"], best["navigator"]]
            row["against"] = _compared(best["navigator"], own, other)
    return [{k: _plain(v) for k, v in row.items()} for row in rows]


def best_opponent(condition: str, rows: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the row of the fastest opponent that collides less than 20 %; None where there is none.

    One with fewer episodes than ours, and fewer than `FAIR`, is no yardstick: too few to say how often it collides.
    """
    kinds = {name: c.kind for name, c in contestants().items()}
    enough = max((r["episodes"] for r in rows if r["name"] == condition and r["navigator"] == OURS), default=0)
    fit = [
        r
        for r in rows
        if r["name"] == condition
        and kinds.get(r["navigator"]) == "opponent"
        and r["episodes"] >= min(enough, FAIR)
        and r["collision_moving"] < TOO_OFTEN
        and r["success"] > 0.5
        and r["time_to_goal"] is not None
        and math.isfinite(r["time_to_goal"])
    ]
    return min(fit, key=lambda r: r["time_to_goal"], default=None)


def aims(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return per condition whether ours is as safe and as fast as is aimed at."""
    found: list[dict[str, Any]] = []
    for row in rows:
        if row["navigator"] != OURS:
            continue
        best = best_opponent(row["name"], rows)
        ratio = row["against"]["time_ratio"] if "against" in row else None
        found.append(
            {
                "name": row["name"],
                "collision_moving_upper99": row["collision_moving_upper99"],
                "safe": row["collision_moving_upper99"] <= AIM_COLLISION,
                "fastest_opponent": None if best is None else best["navigator"],
                "time_ratio": ratio,
                "fast": None if ratio is None else ratio <= AIM_TIME,
            }
        )
    return found


def pooled(evaluation: Evaluation) -> list[dict[str, Any]]:
    """Return one row per navigator over all conditions that it ran in, each condition counting alike for the time."""
    found: list[dict[str, Any]] = []
    for navigator in dict.fromkeys(n for _, n in evaluation.batches):
        own = [batch for (_, n), batch in evaluation.batches.items() if n == navigator]
        count = int(sum(batch.column("collision_moving").sum() for batch in own))
        episodes = sum(len(batch.values) for batch in own)
        ratios = [_mean(batch.column("time_to_goal") / batch.column("shortest_time")) for batch in own]
        found.append(
            {
                "navigator": navigator,
                "conditions": len(own),
                "episodes": episodes,
                "collision_moving": count / episodes,
                "collision_moving_ci99": list(clopper_pearson(count, episodes)),
                "time_ratio": _plain(_mean(np.array(ratios))),
            }
        )
    return found


def price_of_unconcern(evaluation: Evaluation, navigator: str = OURS) -> dict[str, float]:
    """Return per size of crowd the mean time among unconcerned people over that among concerned ones."""
    prices: dict[str, float] = {}
    for size in (5, 12):
        pair = [evaluation.batches.get((f"crowd-{size}-{w}-unconcerned", navigator)) for w in ("all", "none")]
        if pair[0] is not None and pair[1] is not None:
            unconcerned, concerned = (float(np.nanmean(b.column("time_to_goal"))) for b in pair if b is not None)
            prices[f"crowd-{size}"] = unconcerned / concerned
    return prices


def _row(condition: str, navigator: str, batch: Batch, seed: int) -> dict[str, Any]:
    episodes = len(batch.values)
    count = {k: int(batch.column(k).sum()) for k in ("collision_moving", "collision_standing", "success", "timeout")}
    time = batch.column("time_to_goal")
    nearest = batch.column("min_distance")
    nearest = nearest[np.isfinite(nearest)]
    low, high = bootstrap_mean(time, np.random.Generator(np.random.PCG64(seed)))
    row: dict[str, Any] = {
        "name": condition,
        "navigator": navigator,
        "episodes": episodes,
        "collision_moving": count["collision_moving"] / episodes,
        "collision_moving_upper99": upper_bound(count["collision_moving"], episodes),
        "collision_moving_ci99": clopper_pearson(count["collision_moving"], episodes),
        "collision_standing": count["collision_standing"] / episodes,
        "success": count["success"] / episodes,
        "success_ci99": clopper_pearson(count["success"], episodes),
        "timeout": count["timeout"] / episodes,
        "time_to_goal": _mean(time),
        "time_to_goal_ci95": (low, high),
        "min_distance_p5": float(np.quantile(nearest, 0.05)) if len(nearest) else math.nan,
        "plan_ms_p50": quantile(batch.times, 0.50),
        "plan_ms_p95": quantile(batch.times, 0.95),
        "plan_ms_p99": quantile(batch.times, 0.99),
    }
    row |= {name: _mean(batch.column(name)) for name in _MEANS}
    predicted, realised = batch.column("predicted_violations"), batch.column("realised_violations")
    row |= {"predicted_violations": float(np.nansum(predicted)), "realised_violations": int(np.nansum(realised))}
    return row


def _compared(name: str, own: Batch, other: Batch) -> dict[str, Any]:
    """Paired by seed: who collided where the other did not, and how much longer the same trips took on average."""
    n = min(len(own.values), len(other.values))  # whoever has fewer episodes has the first ones
    a, b = own.column("collision_moving")[:n] > 0, other.column("collision_moving")[:n] > 0
    pair = own.column("time_to_goal")[:n], other.column("time_to_goal")[:n]
    arrived = np.isfinite(pair[0]) & np.isfinite(pair[1])
    return {
        "navigator": name,
        "pairs": n,
        "collided_alone": int((a & ~b).sum()),
        "other_collided_alone": int((b & ~a).sum()),
        "mcnemar_p": mcnemar(int((a & ~b).sum()), int((b & ~a).sum())),
        "time_ratio": _plain(_mean(pair[0][arrived]) / _mean(pair[1][arrived])),
    }


def _mean(values: Any) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else math.nan


def _plain(value: Any) -> Any:
    """None for NaN, which JSON does not know; lists for tuples."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    return value
