"""The study: same seeds for everybody, same numbers for any number of workers, resumable, tables that add up."""

import json
import math
from dataclasses import fields

import numpy as np
import pytest

from sidestep.errors import InvalidInput, UnknownName
from sidestep.io.checkpoints import Checkpoints
from sidestep.studies.conditions import TRIP, conditions
from sidestep.studies.episode import columns, histogram, quantile, run_episode
from sidestep.studies.evaluate import Batch, Evaluation, Piece, evaluate, work
from sidestep.studies.evaluate_table import aims, best_opponent, condition_rows, price_of_unconcern
from sidestep.studies.opponents import contestants, trip_of

CHEAP = ("straight-robot-faster", "half-random-2hz")
SIMPLE = ("stop-and-go", "chance")


def values_of(evaluation):
    return {key: batch.values for key, batch in evaluation.batches.items()}


def test_every_condition_makes_paired_seeded_episodes():
    for name, condition in conditions().items():
        one, again, next_ = condition.scenario(3), condition.scenario(3), condition.scenario(4)
        assert one == again, name
        assert one != next_, name
        assert one != condition.scenario(3, base_seed=1), name
        assert np.linalg.norm(np.subtract(one.robot.goal, one.robot.start)) == TRIP
        for i, person in enumerate(one.people):
            assert math.dist(person.start, one.robot.start) >= one.clearance, (name, i)
            assert not person.goal_known, name


def test_conditions_cover_what_they_claim():
    every = conditions()
    assert {c.noise for c in every.values()} >= {0.0, 0.1, 0.2}
    assert {c.rate for c in every.values()} == {2.0, 10.0}
    ratios = {c.robot_speed / c.person_speed for c in every.values()}
    assert min(ratios) < 1 < max(ratios)
    for count in (5, 12):
        for word, share in (("none", 0.0), ("half", 0.5), ("all", 1.0)):
            scenario = every[f"crowd-{count}-{word}-unconcerned"].scenario(0)
            blind = [p.kind.endswith("unconcerned") for p in scenario.people]
            assert len(blind) == count
            assert abs(np.mean(blind) - share) <= 0.5 / count + 1e-9
    assert sum(c.quick for c in every.values()) >= 3


def test_people_of_a_condition_do_meet_a_blind_robot():
    hits = 0
    for episode in range(12):
        outcome, _ = run_episode(conditions()["straight"].scenario(episode), contestants()["stop-and-go"])
        hits += outcome.min_distance < 1.5
    assert hits >= 8


def test_numbers_do_not_depend_on_workers_or_resumption(tmp_path, monkeypatch):
    pytest.importorskip("joblib")
    monkeypatch.setattr("sidestep.studies.evaluate.PIECE", 4)
    one = evaluate(CHEAP, SIMPLE, episodes=7, seed=5)
    two = evaluate(CHEAP, SIMPLE, episodes=7, seed=5, workers=2, store=Checkpoints(tmp_path))
    files = sorted(tmp_path.glob("*.json"))
    assert len(files) == 8
    files[2].unlink()
    seen = []
    third = evaluate(CHEAP, SIMPLE, episodes=7, seed=5, store=Checkpoints(tmp_path), progress=lambda *a: seen.append(a))
    assert len(seen) == 1  # one piece was missing
    for key in values_of(one):
        np.testing.assert_array_equal(values_of(one)[key], values_of(two)[key])
        np.testing.assert_array_equal(values_of(one)[key], values_of(third)[key])
        assert one.batches[key].values.shape == (7, len(columns()))
    other = evaluate(CHEAP[:1], SIMPLE[:1], episodes=3, seed=6)
    assert not np.array_equal(next(iter(values_of(other).values())), values_of(one)[CHEAP[0], SIMPLE[0]][:3])


def test_fewer_episodes_are_the_first_of_more():
    few = evaluate(CHEAP[:1], SIMPLE[:1], episodes=3)
    more = evaluate(CHEAP[:1], SIMPLE[:1], episodes=5)
    key = (CHEAP[0], SIMPLE[0])
    np.testing.assert_array_equal(values_of(few)[key], values_of(more)[key][:3])


def test_the_expensive_get_fewer_episodes_and_are_paired_with_the_first():
    found = evaluate(CHEAP[:1], SIMPLE, episodes=5, fewer={"chance": 2})
    assert [len(batch.values) for batch in found.batches.values()] == [5, 2]
    ours, yardstick = batch(time_to_goal=10.0), batch(time_to_goal=8.0)
    short = Batch(values=yardstick.values[:4], times=yardstick.times)
    rows = condition_rows(Evaluation(batches={("w", "sidestep"): ours, ("w", "orca"): short}, seed=0))
    assert "against" not in rows[0]  # too few episodes for a yardstick
    rows = condition_rows(
        Evaluation(batches={("w", "sidestep-cells"): ours, ("w", "sidestep"): short, ("w", "orca"): short}, seed=0)
    )
    assert rows[0]["against"]["pairs"] == 4
    assert rows[0]["against"]["time_ratio"] == pytest.approx(1.25)
    with pytest.raises(UnknownName, match="chance"):
        evaluate(CHEAP[:1], SIMPLE, episodes=5, fewer={"chanse": 2})
    with pytest.raises(InvalidInput, match="episodes"):
        evaluate(CHEAP[:1], SIMPLE, episodes=5, fewer={"chance": 0})


def test_a_name_that_a_condition_and_a_navigator_share_says_which_is_meant():
    names = [CHEAP[0], "straight-noise-0.1"], SIMPLE
    for fewer, counts in (
        ({"condition:straight-noise-0.1": 1}, [2, 2, 1, 1]),
        ({"navigator:chance": 1}, [2, 1, 2, 1]),
    ):
        found = evaluate(*names, episodes=2, fewer=fewer)
        assert [len(batch.values) for batch in found.batches.values()] == counts
    assert "social-force" in set(conditions()) & set(contestants())
    with pytest.raises(InvalidInput, match="condition:social-force or navigator:social-force"):
        evaluate(*names, episodes=2, fewer={"social-force": 1})
    with pytest.raises(UnknownName, match="navigator"):
        evaluate(*names, episodes=2, fewer={"navigators:chance": 1})
    with pytest.raises(UnknownName, match="straight"):
        evaluate(*names, episodes=2, fewer={"condition:strait": 1})


def test_limits_of_one_kind_leave_the_other_of_that_name_alone(monkeypatch):
    def nothing(work, pieces, **_):
        return {p.name: {"rows": [[0.0] * len(columns())] * (p.stop - p.start), "times": [0.0]} for p in pieces}

    monkeypatch.setattr("sidestep.studies.evaluate.run_kept", nothing)
    names = ["straight", "social-force"]
    for kind, counts in (("condition", [5, 5, 2, 2]), ("navigator", [5, 2, 5, 2])):
        found = evaluate(names, ["orca", "social-force"], episodes=5, fewer={f"{kind}:social-force": 2})
        assert [len(batch.values) for batch in found.batches.values()] == counts


def test_rows_add_up_and_are_json():
    rows = condition_rows(evaluate(CHEAP, SIMPLE, episodes=12))
    assert len(rows) == 4
    needed = {
        "name", "navigator", "episodes", "collision_moving", "collision_moving_upper99", "collision_standing",
        "success", "timeout", "time_to_goal", "min_distance_p5", "plan_ms_p95",
    }  # fmt: skip
    for row in json.loads(json.dumps(rows, allow_nan=False)):
        assert needed <= set(row)
        assert row["episodes"] == 12
        assert row["collision_moving"] <= row["collision_moving_upper99"]
        assert row["success"] + row["timeout"] <= 1.0 + 1e-9
        assert 0 < row["plan_ms_p50"] <= row["plan_ms_p95"] <= row["plan_ms_p99"]


def batch(**numbers):
    values = np.full((10, len(columns())), np.nan)
    for name, column in (
        {"collision_moving": 0.0, "collision_standing": 0.0, "success": 1.0, "timeout": 0.0} | numbers
    ).items():
        values[:, columns().index(name)] = column
    return Batch(values=values, times=histogram(np.array([1.0])))


def test_the_yardstick_is_the_fastest_opponent_that_does_not_collide_too_often():
    reckless = np.array([1.0] * 3 + [0.0] * 7)
    evaluation = Evaluation(
        batches={
            ("w", "sidestep"): batch(time_to_goal=10.4),
            ("w", "orca"): batch(time_to_goal=10.0),
            ("w", "hl"): batch(time_to_goal=9.0, collision_moving=reckless, success=1.0 - reckless),
            ("w", "sidestep-cells"): batch(time_to_goal=8.0),
            ("w", "stop-and-go"): batch(time_to_goal=30.0),
        },
        seed=0,
    )
    rows = condition_rows(evaluation)
    best = best_opponent("w", rows)
    assert best is not None
    assert best["navigator"] == "orca"
    (aim,) = aims(rows)
    assert aim["fast"]
    assert aim["time_ratio"] == pytest.approx(1.04)
    assert not aim["safe"]  # ten episodes prove nothing
    assert aim["collision_moving_upper99"] == pytest.approx(1 - 0.01 ** (1 / 10))
    hl = next(r for r in rows if r["navigator"] == "hl")
    assert hl["against"]["collided_alone"] == 3
    assert hl["against"]["mcnemar_p"] == pytest.approx(0.25)


def test_price_of_unconcern():
    batches = {
        ("crowd-5-all-unconcerned", "sidestep"): batch(time_to_goal=12.0),
        ("crowd-5-none-unconcerned", "sidestep"): batch(time_to_goal=10.0),
    }
    assert price_of_unconcern(Evaluation(batches=batches, seed=0)) == {"crowd-5": pytest.approx(1.2)}


def test_quantiles_of_planning_times():
    times = np.random.default_rng(0).lognormal(0.0, 1.0, 5000)
    for share in (0.5, 0.95, 0.99):
        assert quantile(histogram(times), share) == pytest.approx(np.quantile(times, share), rel=0.08)
    assert math.isnan(quantile(histogram(np.zeros(0)), 0.5))


def test_ours_runs_in_a_condition():
    piece = Piece(condition="straight-2hz", navigator="sidestep", start=0, stop=1, seed=0)
    same, result = work(piece)
    assert same == piece
    row = dict(zip(columns(), result["rows"][0], strict=True))
    assert row["success"] == 1.0
    assert row["belief_accuracy"] is not None


def test_every_ablation_differs_from_ours_in_what_it_takes_away():
    scenario, everybody = conditions()["straight"].scenario(0), contestants()
    ours = everybody["sidestep"].build(scenario, None)
    taken = {"sidestep-unconcerned": "danger_weight", "sidestep-concerned": "prior_concerned",
             "sidestep-no-anticipation": "horizon", "sidestep-no-directions": "goals",
             "sidestep-no-steadiness": "steadiness", "sidestep-fixed-randomness": "online_randomness",
             "sidestep-no-filter": "motion_filter"}  # fmt: skip
    planner = {"sidestep-cells": "risk_rule", "sidestep-no-soft-risk": "soft_risk_weight"}
    for name, contestant in everybody.items():
        if contestant.kind != "ablation":
            continue
        other = contestant.build(scenario, None)
        human = {f.name for f in fields(ours.human) if getattr(ours.human, f.name) != getattr(other.human, f.name)}
        settings = {
            f.name for f in fields(ours.settings) if getattr(ours.settings, f.name) != getattr(other.settings, f.name)
        }
        assert len(human | settings) == (2 if name == "sidestep-concerned" else 1), name
        assert name not in taken or taken[name] in human
        assert name not in planner or planner[name] in settings
    assert set(taken) | set(planner) <= set(everybody)


def test_limits_are_the_same_for_all():
    scenario = conditions()["straight-robot-faster"].scenario(0)
    trip = trip_of(scenario)
    assert trip.max_speed == scenario.robot.max_speed == 1.5
    assert trip.clearance == scenario.clearance
    assert trip.time_step == scenario.period


def test_bad_requests_are_named():
    with pytest.raises(UnknownName, match="straight"):
        evaluate(["strait"], SIMPLE, episodes=1)
    with pytest.raises(UnknownName, match="orca"):
        evaluate(CHEAP, ["orka"], episodes=1)
    with pytest.raises(InvalidInput, match="episodes"):
        evaluate(CHEAP, SIMPLE, episodes=0)
