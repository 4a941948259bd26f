"""Judgements of the paper's claims on made-up points, whose verdicts are known; and that no claim is forgotten."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sidestep.errors import UnknownName
from sidestep.io.checkpoints import Checkpoints
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.studies.paper import HORIZONS, HUMANS, PARAMETERS, PLACES, RULES, Piece, Points, run_points, sweep
from sidestep.studies.paper_claims import Finding, below, median_interval, worst
from sidestep.studies.paper_points import COLUMNS, WIDTHS, Change, Setting, Trial, run_trials
from sidestep.studies.paper_table import CLAIMS
from sidestep.studies.paper_verdicts import asked_by, chosen_claims, failing_claims, rows, with_regions

SEEDS = 40


def made(value: Callable[[Setting, str], float]) -> Points:
    """Points whose columns are `value` and a little noise."""
    rng = np.random.default_rng(0)
    noise = 1e-3 * np.array([c != "uncertified" for c in COLUMNS])  # of that, none is none
    settings = dict.fromkeys(s for place in (*PLACES, *sweep()) for s in place.settings())
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
    table = rows(CLAIMS, made(value))
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


def danger(setting: Setting) -> float:
    """The danger weight that a point of the sweep has been given."""
    return {c.field: c.value for c in setting.changes}.get("human.danger_weight", 0.0)


def judged(value: Callable[[Setting, str], float]) -> list[dict[str, Any]]:
    points = made(value)
    return with_regions(rows(CLAIMS, points), rows(CLAIMS, points, sweep()))


def test_regions_name_where_a_claim_holds_that_holds_nowhere_else() -> None:
    def only_with_a_heavy_danger(setting: Setting, column: str) -> float:
        return (as_the_paper_says if danger(setting) >= 100.0 else the_contrary)(setting, column)

    table = judged(only_with_a_heavy_danger)
    assert len({row["holds_when"] for row in table}) == 1  # every claim: IV-A, IV-B and V, by either index
    assert table[0]["holds_when"].startswith(f"at 6 of {len(sweep())} places around the authors' values: ")
    assert "danger_weight 100, danger_rate 0.008; " in table[0]["holds_when"]
    assert "danger_weight 25," not in table[0]["holds_when"]
    assert table[0]["holds_when"].endswith("; and 2 more")
    assert {row["holds_when"] for row in judged(the_contrary)} == {
        f"at none of {len(sweep())} places around the authors' values"
    }


def test_no_region_is_looked_for_where_one_parameter_set_will_do() -> None:
    def with_the_authors(setting: Setting, column: str) -> float:
        theirs = setting.label in ("paper-authors", "lab-meeting") and not setting.changes
        return (as_the_paper_says if theirs else the_contrary)(setting, column)

    table = judged(with_the_authors)
    assert not failing_claims(table)
    assert {(row["parameters"], row["verdict"], row["holds_when"]) for row in table} == {
        ("printed", "does not hold", "the authors' values"),
        ("authors", "holds", ""),
    }


def test_the_sweep_changes_weights_rates_randomness_and_the_speeds_of_both() -> None:
    fields = {c.field for place in sweep() for c in place.changes}
    assert fields == {
        *("human.danger_weight", "human.danger_rate", "human.randomness"),
        *("human.walking_speed", "robot.max_speed"),
    }
    assert len({place.words for place in sweep()}) == len(sweep())
    base = load_scenario("lab-meeting")
    changes = (Change("human.walking_speed", 1.5, times=True), Change("human.danger_weight", 25.0))
    setting = Setting(label="", rule="mass", human="unconcerned", horizon=3, anticipation=1, changes=changes)
    changed = setting.scenario(base)
    assert changed.human.walking_speed == pytest.approx(1.5 * base.human.walking_speed)
    assert (changed.human.danger_weight, changed.human.horizon, changed.planner.horizon) == (25.0, 1, 3)


def test_only_the_points_that_a_claim_needs_are_run() -> None:
    lab_only = asked_by(chosen_claims("V-ratio"))
    assert {s.label for s in lab_only} == {"lab-printed", "lab-meeting"}
    assert len(lab_only) == len(PARAMETERS) * len(RULES) * 2
    everything = asked_by(CLAIMS)
    assert set(everything) <= {s for place in PLACES for s in place.settings()}
    needed = made(as_the_paper_says).values
    only = Points(values={s: needed[s] for s in everything})
    assert rows(CLAIMS, only) == rows(CLAIMS, made(as_the_paper_says))
    assert not only.have(PLACES[0].settings())  # curves need unconcerned people too


def test_how_wide_predictions_are_is_measured_where_a_claim_asks_and_changes_nothing_else() -> None:
    asked = asked_by(CLAIMS)
    wide = {s for s, columns in asked.items() if not WIDTHS.isdisjoint(columns)}
    assert wide == {s for p in PLACES for s in (*(p.encounter(5, n) for n in (0, 5)), *map(p.lab, HUMANS))}
    setting = PLACES[2].encounter(2, 2)
    scenario = setting.scenario(load_scenario("paper-authors", ["duration=6.0"]))
    found = run_trials([Trial(scenario=scenario, widths=w) for w in (True, False)])
    with_widths, without = (dict(zip(COLUMNS, row, strict=True)) for row in found)
    for column in set(COLUMNS) - {"plan_p95"}:
        if column in WIDTHS:
            assert np.isnan(without[column])
        else:
            np.testing.assert_equal(without[column], with_widths[column])
    assert with_widths["entropy"] > 0
    assert 0 < with_widths["peak_first"] < 1


def test_points_are_those_of_single_runs_whoever_is_run_beside_them() -> None:
    base = load_scenario("paper-authors", ["duration=6.0"])
    settings = [Setting(label="", rule="cells", human=h, horizon=3, anticipation=3) for h in HUMANS]
    points = run_points(settings, {"": base}, columns={}, seeds=3, workers=1, store=None)
    for setting in settings:
        records = [simulate(setting.scenario(base), seed=seed, snapshots=0) for seed in range(3)]
        assert points.column(setting, "PI_T").tolist() == [measure(record).PI_T for record in records]
        assert (points.column(setting, "plan_p95") > 0).all()


def test_what_is_kept_of_one_kind_of_people_is_not_run_again_for_the_other(tmp_path: Path) -> None:
    base = load_scenario("paper-authors", ["duration=2.0"])
    settings = [Setting(label="", rule="mass", human=h, horizon=2, anticipation=2) for h in HUMANS]

    def run(chosen: list[Setting]) -> list[tuple[int, int]]:
        told: list[tuple[int, int]] = []
        store = Checkpoints(tmp_path)
        run_points(
            chosen,
            {"": base},
            columns={},
            seeds=2,
            workers=1,
            store=store,
            progress=lambda done, of: told.append((done, of)),
        )
        return told

    assert run(settings[:1]) == [(2, 2)]
    assert run(settings) == [(4, 4)]  # two were there, so that nothing but the last two is told
    assert run(settings) == []


def test_a_piece_is_kept_under_all_numbers_of_its_scenario() -> None:
    setting = PLACES[0].lab("concerned")

    def name(**changed: float) -> str:
        base = load_scenario("lab-printed", [f"{key}={value}" for key, value in changed.items()])
        return Piece(setting=setting, scenario=setting.scenario(base), start=0, stop=20, widths=False).name

    assert name() == name()
    assert name() != name(**{"robot.radius": 0.2})


def test_claims_are_chosen_by_name() -> None:
    assert [c.id for c in chosen_claims("V-rate,IV-safety")] == ["V-rate", "IV-safety"]
    assert len(chosen_claims(None)) == len(CLAIMS) == len({c.id for c in CLAIMS})
    assert max(s.horizon for place in PLACES for s in place.settings()) == HORIZONS[-1]
    with pytest.raises(UnknownName, match="IV-safety"):
        chosen_claims("IV-safty")
