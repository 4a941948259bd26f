"""A human model from tracks: known habits are found again, files keep them, and the fast likelihood is the true one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from made_tracks import wavering
from sidestep.cli import execute
from sidestep.errors import InvalidFile, InvalidInput
from sidestep.human.habit_settings import HabitSettings
from sidestep.human.model import HumanModel
from sidestep.io.human_models import read_human_model, write_human_model
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.recordings import Recording, Track
from sidestep.studies import people_prediction
from sidestep.studies.people_baseline import ConstantVelocity, fit_baseline
from sidestep.studies.people_features import class_weights, features, losses
from sidestep.studies.people_fit import fit_model, packed, unpacked, walking_speeds
from sidestep.studies.people_grid import Score, masses, reach_of, score
from sidestep.studies.people_prediction import fold_names, predict_moment, prediction_study
from sidestep.studies.people_samples import HORIZONS, Moment, Watcher, moments

INDICES = [0, 2, 5, 11]


def spread_at(model: HumanModel, time: float) -> float:
    """Root mean square spread (m) that the prior promises a walker `time` s ahead."""
    s = model.habits
    bell = np.exp(-0.5 * ((np.arange(len(s.scales)) - s.prior_class) / s.prior_width) ** 2)
    return float(np.sqrt((bell / bell.sum()) @ (np.array(s.scales) * time**s.walking_exponent) ** 2 + s.floor**2))


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [0.05, 0.25])
def test_how_steadily_people_walk_is_found_again(sigma: float) -> None:
    found = fit_model({"a": wavering(15, sigma=sigma)}, HumanModel(), noises=(0.003,), every=2.0)
    assert found.nll < found.before
    true = sigma * 2.4**1.5 / np.sqrt(3.0)  # of the integral of a velocity walk
    assert spread_at(found.model, 2.4) == pytest.approx(true, rel=0.5)


@pytest.mark.slow
def test_the_noise_of_the_sensor_is_found_again() -> None:
    clean = fit_model({"a": wavering(8, sigma=0.05)}, HumanModel(), noises=(0.01, 0.1), every=2.0)
    noisy = fit_model({"a": wavering(8, sigma=0.05, noise=0.1)}, HumanModel(), noises=(0.01, 0.1), every=2.0)
    assert clean.model.measurement_noise == 0.01
    assert noisy.model.measurement_noise == 0.1


def test_packing_loses_nothing() -> None:
    for model in (HumanModel(), HumanModel(online_randomness=False, randomness=0.03)):
        back = unpacked(packed(model), model)
        assert packed(back) == pytest.approx(packed(model), abs=1e-9)
        assert back.randomness == pytest.approx(model.randomness)
        assert sum(back.habits.walking_modes) == pytest.approx(1.0)


@pytest.mark.parametrize("far", [-1e3, -30.0, 30.0, 1e3])
def test_a_search_that_goes_astray_still_has_a_likelihood(seen: list[Moment], far: float) -> None:
    model = HumanModel()
    for i in range(len(packed(model))):
        values = packed(model)
        values[i] = far
        assert np.isfinite(losses(features(seen[:4], INDICES), unpacked(values, model))).all()


def test_people_who_came_to_a_stop_are_better_told_by_a_pace_that_falls() -> None:
    """They walk for a while, then go ever more slowly; told before they begin."""
    time = np.arange(0.0, 9.0, 0.1)
    gone = np.where(time < 3.6, 1.2 * time, 1.2 * 3.6 + 1.2 * 1.5 * -np.expm1(-(time - 3.6) / 1.5))
    tracks = tuple(
        Track(agent=f"p{i}", kind="ped", time=time, positions=np.stack([gone + 0.3 * i, 0.0 * gone + i], axis=1))
        for i in range(3)
    )
    model = HumanModel(habits=HabitSettings(walking_modes=(0.5, 0.2, 0.3), slowing_time=1.5))
    abrupt = replace(model, habits=replace(model.habits, slowing_time=0.0))
    told = [m for m in moments(Recording(name="a", tracks=tracks), model, every=0.8) if m.time < 4.0]
    assert len(told) >= 3
    laid = features(told, [HORIZONS.index(2.4)])
    assert losses(laid, model).mean() < losses(laid, abrupt).mean() - 0.3


def test_a_fit_may_start_from_what_is_0() -> None:
    """Its logarithm is none: the complaint was about a prior width that nobody had given."""
    habits = replace(HabitSettings(), floor=0.0, tempering=0.0, changed_before=0.0)
    model = unpacked(packed(HumanModel(habits=habits)), HumanModel(habits=habits))
    assert np.isfinite(packed(model)).all()
    assert model.habits.floor == pytest.approx(1e-3)
    with pytest.raises(InvalidInput, match="motion_filter"):
        fit_model({"a": wavering(1, sigma=0.1)}, replace(model, motion_filter=False))


def test_too_few_people_are_refused() -> None:
    with pytest.raises(InvalidInput, match="moments"):
        fit_model({"a": wavering(1, sigma=0.1, duration=4.0)}, HumanModel(), noises=(0.03,))


@pytest.fixture(scope="module")
def seen() -> list[Moment]:
    return moments(wavering(8, sigma=0.1, noise=0.01), HumanModel(), every=2.0)


def test_features_have_the_classes_that_were_learned(seen: list[Moment]) -> None:
    weights = class_weights(features(seen, INDICES), HabitSettings())
    learned = np.array([m.mind.habits.steadiness for m in seen if m.mind.habits is not None])
    np.testing.assert_allclose(weights, learned, atol=1e-9)


def test_the_fast_likelihood_is_that_of_the_lattice(seen: list[Moment]) -> None:
    model = HumanModel()
    fast, watcher = losses(features(seen, INDICES), model), Watcher(model)
    slow = np.array(
        [
            [
                score(masses(density, reach_of(HORIZONS[k])), m.future[k]).log_loss
                for density, k in zip(predict_moment(m, watcher, INDICES), INDICES, strict=True)
            ]
            for m in seen
        ]
    )
    np.testing.assert_allclose(fast.mean(axis=0), slow.mean(axis=0), atol=0.12)


def test_walking_speeds() -> None:
    speeds = walking_speeds({"a": wavering(20, sigma=0.001, speed=1.3)})
    assert speeds["q50"] == pytest.approx(1.3, abs=0.02)
    assert speeds["standing"] == 0.0


def test_a_model_file_keeps_every_number(tmp_path: Path) -> None:
    model = HumanModel(measurement_noise=0.1, habits=HabitSettings(floor=0.05, walking_modes=(0.6, 0.3, 0.1)))
    path = write_human_model(model, tmp_path / "human.toml", {"fitted to": "tracks.csv"})
    assert read_human_model(path) == model
    assert path.read_text().startswith("# fitted to: tracks.csv")
    scenario = load_scenario("crossing", [f"human={path}"])
    assert scenario.human == model
    assert type(scenario).parse(scenario.settings()) == scenario


@pytest.mark.parametrize(
    ("text", "complaint"),
    [("[human]\nflor = 1\n", "flor"), ("[human.habits]\nflor = 1\n", "habits.flor"), ("x = 1\n", r"\[human\]")],
)
def test_a_wrong_model_file_is_refused(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "human.toml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=complaint):
        read_human_model(path)
    with pytest.raises(InvalidFile, match="no such file"):
        read_human_model(tmp_path / "absent.toml")


def write_tracks(recordings: list[Recording], path: Path) -> Path:
    rows = [
        f"{r.name},{t:.2f},{track.agent},{track.kind},{x:.4f},{y:.4f}"
        for r in recordings
        for track in r.tracks
        for t, (x, y) in zip(track.time, track.positions, strict=True)
    ]
    path.write_text("\n".join(["scene,t,agent,kind,x,y", *rows]) + "\n")
    return path


@pytest.mark.slow
def test_the_commands_fit_and_evaluate_people(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = [replace(wavering(12, sigma=0.1, duration=10.0, seed=n), name=f"s{n}") for n in (1, 2)]
    tracks, model = write_tracks(made, tmp_path / "plaza.csv"), tmp_path / "human.toml"
    options = ["--out", str(model), "--most", "10", "--every", "1.6", "--json"]
    assert execute(["fit", str(tracks), *options]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["nll"] <= told["nll_before"]
    assert {r["predictor"] for r in told["left_out"]} == {"sidestep", "sidestep-fitted", "constant-velocity"}
    assert read_human_model(model).habits.scales == pytest.approx(told["model"]["habits"]["scales"])

    page = tmp_path / "evidence" / "results" / "people.json"
    page.parent.mkdir(parents=True)
    options = ["--people", str(tracks), "--model", str(model), "--studies", "prediction", "--moments", "6"]
    assert execute(["evaluate", *options, "--page", str(page), "--out", str(tmp_path / "out"), "--json"]) == 0
    people = json.loads(capsys.readouterr().out)["people"]
    assert {r["file"] for r in people["prediction"]} == {"plaza"}
    assert people["awareness"] == people["replay"] == []
    assert json.loads(page.read_text())["tables"]
    assert (tmp_path / "out" / "people-prediction.png").exists()
    for wrong in (["--vehicle", "tram"], ["--without", "nowhere"]):
        assert execute(["evaluate", "--people", str(tracks), *wrong, "--out", str(tmp_path / "out")]) == 2


def test_nobody_of_a_single_scene_is_scored_who_was_fitted_to(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: list[set[str]] = []
    scored: list[set[str]] = []

    def spied(found: Sequence[Moment], horizons: Sequence[float], indices: Sequence[int]) -> ConstantVelocity:
        fitted.append({m.agent for m in found})
        return fit_baseline(found, horizons, indices)

    def seen(_own: Sequence[Score], _hard: Sequence[Score], tracks: Sequence[str]) -> dict[str, float | None]:
        scored.append({track.partition("/")[2] for track in tracks})
        return {}

    monkeypatch.setattr(people_prediction, "fit_baseline", spied)
    monkeypatch.setattr(people_prediction, "_compared", seen)
    rows = prediction_study({"plaza": wavering(5, sigma=0.1, duration=9.0)}, HumanModel(), most=0, every=3.2)
    assert list(dict.fromkeys(r["scene"] for r in rows)) == [*(f"plaza, part {n}" for n in (1, 2, 3, 4)), "all"]
    for part, others in enumerate(fitted):
        own = scored[2 * len(people_prediction.SCORED) * part]
        assert own
        assert own.isdisjoint(others)
    assert len(set[str]().union(*scored)) == 5


def test_many_scenes_of_one_family_are_not_all_left_out_together() -> None:
    families = fold_names([f"s{n % 2}_{n}" for n in range(45)])
    assert set(families.values()) == {"s0", "s1"}
    folds = fold_names([f"rec_{n:02d}" for n in range(45)])
    assert len(folds) == 45
    assert len(set(folds.values())) == 30


def test_nothing_is_scored_on_the_only_person_there_is() -> None:
    assert prediction_study({"a": wavering(1, sigma=0.1)}, HumanModel(), most=0, every=3.2) == []


def test_the_prediction_study_scores_everybody_on_the_same_moments() -> None:
    scenes = {f"s{n}": replace(wavering(6, sigma=0.1, duration=10.0, seed=n), name=f"s{n}") for n in (1, 2)}
    rows = prediction_study(scenes, HumanModel(), ablations=True, most=6, every=1.6)
    counts = {(r["scene"], r["horizon"]): set[int]() for r in rows}
    for r in rows:
        counts[r["scene"], r["horizon"]].add(r["moments"])
    assert all(len(found) == 1 for found in counts.values())
    assert {"sidestep", "constant-velocity", "sidestep-no-filter"} <= {r["predictor"] for r in rows}
    hard = {(r["scene"], r["horizon"]): r["nll"] for r in rows if r["predictor"] == "constant-velocity"}
    for r in rows:
        assert r["over"] == pytest.approx(r["nll"] - hard[r["scene"], r["horizon"]], abs=1e-9)
        assert r["over_se"] >= 0.0
