"""Judgements of the paper's claims on made-up points, whose verdicts are known; and that no claim is forgotten."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from sidestep.studies.paper import HORIZONS, PARAMETERS, RULES, Points, section_five, section_four, sweep
from sidestep.studies.paper_claims import Finding, below, median_interval, worst
from sidestep.studies.paper_points import COLUMNS, Setting
from sidestep.studies.paper_table import CLAIMS
from sidestep.studies.paper_verdicts import chosen_claims, holds_when, rows

SEEDS = 40


def made(value: Callable[[Setting, str], float], noise: float = 1e-3) -> Points:
    """Points whose columns are `value` and a little noise."""
    rng = np.random.default_rng(0)
    settings = [*section_four(), *section_five(), *sweep()]
    return Points(
        values={
            s: np.array([[value(s, c) for c in COLUMNS]] * SEEDS) + noise * rng.normal(size=(SEEDS, len(COLUMNS)))
            for s in settings
        }
    )


def as_the_paper_says(setting: Setting, column: str) -> float:
    """Every claim is true here."""
    n, ahead, careless = setting.horizon, setting.anticipation, setting.human == "unconcerned"
    if column.endswith("length"):
        return 10.0 - 0.1 * (ahead > 0)
    if column.endswith("turning"):
        return 1.0 - 0.5 * (ahead > 0)
    if column in ("entropy", "entropy_first"):
        return 2.3 - 0.4 * (ahead > 0 and column == "entropy")
    if column == "entropy_decided":
        return 1.0
    if column.startswith("PI_H"):
        return 1.0 if ahead == 0 else 1.0 / n
    if column.startswith(("PI_R", "PI_T")):
        if setting.label.startswith("lab"):
            return 1.62 if careless else 1.0
        return 1.0 / min(n, 4) if ahead == 0 else 0.1 + 0.05 * abs(n - 5)
    if column == "belief_at_closest":
        return 0.02 if careless else 0.98
    return {"max_collision_probability": 0.04, "plan_p95": 20.0}.get(column, 0.0)


def the_contrary(setting: Setting, column: str) -> float:
    """No claim is true here."""
    values = {"belief_at_closest": 0.5, "max_collision_probability": 0.4, "plan_p95": 900.0, "entropy_decided": 3.0}
    if column in values:
        return values[column]
    if column.startswith("PI_"):
        return float(setting.horizon) if setting.human == "concerned" else 0.5 * setting.horizon
    return 1.0 + (setting.anticipation > 0)


@pytest.mark.parametrize(("value", "verdict"), [(as_the_paper_says, "holds"), (the_contrary, "does not hold")])
def test_verdicts_follow_the_points(value: Callable[[Setting, str], float], verdict: str) -> None:
    table = rows(list(CLAIMS), made(value), {})
    wrong = {(r["id"], r["parameters"], r["rule"], r["index"], r["verdict"]) for r in table if r["verdict"] != verdict}
    assert not wrong
    assert {(r["id"], r["parameters"], r["rule"]) for r in table} == {
        (c.id, p, r) for c in CLAIMS for p in PARAMETERS for r in RULES
    }
    for row in table:
        low, high = row["interval"]
        assert low <= row["measured"] <= high
        assert row["n"] >= SEEDS


def test_what_noise_hides_is_undecided() -> None:
    finding = below(np.random.default_rng(1).normal(size=60), 0.0, "nothing")
    assert finding.verdict == "undecided"
    assert finding.interval[0] < 0.0 < finding.interval[1]


def test_the_interval_of_a_median_covers_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    inside = [low <= 0.0 <= high for _, low, high in (median_interval(rng.normal(size=30)) for _ in range(2000))]
    assert 0.945 < np.mean(inside) < 0.985  # order statistics cover a little more than 95 %
    assert np.isnan(median_interval(np.full(3, np.nan))[0])


def test_a_claim_about_several_things_holds_where_all_of_them_do() -> None:
    findings = [
        Finding(measured=0.0, interval=(0.0, 0.0), n=1, verdict=v, quantity=v)
        for v in ("holds", "does not hold", "undecided")
    ]
    assert worst(*findings).verdict == "does not hold"
    assert worst(findings[0], findings[2]).verdict == "undecided"


def test_regions_name_where_a_claim_holds() -> None:
    def only_with_a_heavy_danger(setting: Setting, column: str) -> float:
        heavy = dict(setting.changes).get("danger_weight", 0.0) >= 100.0
        return (as_the_paper_says if heavy else the_contrary)(setting, column)

    regions, grid = holds_when(made(only_with_a_heavy_danger), sweep())
    assert regions["IV-A-shorter"].startswith("authors' values but ")
    assert "danger_weight 100" in regions["IV-A-shorter"]
    assert "danger_weight 25," not in regions["IV-A-shorter"]
    assert holds_when(made(the_contrary), sweep())[0]["V-distinguishes"] == "nowhere in the sweep"
    assert {entry["claim"] for entry in grid} == set(regions)


def test_claims_are_chosen_by_name() -> None:
    assert [c.id for c in chosen_claims("V-rate,IV-safety")] == ["V-rate", "IV-safety"]
    assert len(chosen_claims(None)) == len(CLAIMS) == len({c.id for c in CLAIMS})
    assert max(s.horizon for s in section_four()) == HORIZONS[-1]
