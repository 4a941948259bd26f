"""The studies on recorded people, on tracks made by hand whose answers are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from made_tracks import straight, track
from sidestep.human.model import HumanModel
from sidestep.io.checkpoints import Checkpoints
from sidestep.simulation.recordings import Recording, Track
from sidestep.studies.people_awareness import CAR, ROBOT, awareness_study, beliefs, vehicle_model
from sidestep.studies.people_encounters import encounters, placebos
from sidestep.studies.people_grid import Density, masses, score
from sidestep.studies.people_replay import choose_trips, replay_study
from sidestep.types import FloatArray


def car() -> Track:
    """Drives along x at 3 m/s and crosses the people's way after 6 s."""
    moving = straight("v", (-18.0, 0.0), (3.0, 0.0))
    return Track(agent="v", kind="veh", time=moving.time, positions=moving.positions)


def crossing(stops: bool, at: float = -3.6) -> Track:
    """A person who would be at the crossing point with the car; one who stops does so `at` m on their way to it."""
    time = np.arange(0.0, 12.0, 0.1)
    y = -1.2 * (6.0 - time)
    return track("p", np.stack([np.zeros_like(y), np.minimum(y, at) if stops else y], axis=1), step=0.1)


def scene(*tracks: Track, name: str = "made") -> Recording:
    return Recording(name=name, tracks=tracks)


def test_who_stops_for_the_car_reacted_and_who_walks_on_did_not() -> None:
    for stops in (True, False):
        (found,) = encounters(scene(crossing(stops), car()), CAR.near)
        assert found.reacted == stops
        assert found.kept < CAR.near
        assert not found.placebo
        np.testing.assert_allclose(found.vehicle_from(found.onset + 1.0, 3, 0.5)[:, 1], 0.0, atol=1e-9)
        reached = -18.0 + 3.0 * (found.onset + np.array([1.0, 1.5, 2.0]))
        np.testing.assert_allclose(found.vehicle_from(found.onset + 1.0, 3, 0.5)[:, 0], reached, atol=1e-6)


@pytest.mark.parametrize(("away", "met"), [((2.0, 3.5), 0), ((4.0, 5.5), 1), ((5.0, 7.0), 1)])
def test_a_vehicle_is_met_before_or_after_a_gap_in_its_track_never_in_it(away: tuple[float, float], met: int) -> None:
    """Clearances were NaN in the gap, which passed for an encounter to which nobody reacted."""
    whole = car()
    there = (whole.time <= away[0]) | (whole.time >= away[1])
    gappy = Track(agent="v", kind="veh", time=whole.time[there], positions=whole.positions[there])
    found = encounters(scene(crossing(True), gappy), CAR.near)
    assert len(found) == met
    assert all(e.reacted and np.isfinite(e.vehicle).all() and e.kept < CAR.near for e in found)


def test_no_encounter_without_a_collision_course() -> None:
    away = straight("p", (0.0, 2.0), (0.0, 1.2))
    assert encounters(scene(away, car()), CAR.near) == []
    standing = track("p", np.zeros((120, 2)), step=0.1)
    assert encounters(scene(standing, car()), CAR.near) == []


def test_placebos_are_people_with_no_vehicle_near() -> None:
    with_car = scene(crossing(True), car())
    alone = scene(straight("q", (100.0, 100.0), (0.0, 1.2)), name="alone")
    real = encounters(with_car, CAR.near)
    recordings = {"made": with_car, "alone": alone}
    found = placebos(recordings, real, CAR.near, np.random.default_rng(0))
    assert {e.agent for e in found} <= {"q"}
    assert all(e.placebo and not e.reacted for e in found)
    assert found, "a transplanted car must meet somebody who walks as its own person did"


def test_a_larger_vehicle_is_minded_from_further_away() -> None:
    model = HumanModel()
    assert vehicle_model(model, ROBOT).danger_rate == pytest.approx(model.danger_rate)
    assert vehicle_model(model, CAR).danger_rate < model.danger_rate


def test_beliefs_are_causal() -> None:
    """What a person does after the belief is read cannot change it."""
    (walks,) = encounters(scene(crossing(False), car()), CAR.near)
    model = vehicle_model(HumanModel(), CAR)
    early = beliefs(walks, model, CAR)
    later = walks.track.positions + np.where(walks.track.time > walks.onset + 0.55, 3.0, 0.0)[:, None]
    changed = Track(agent="p", kind="ped", time=walks.track.time, positions=later)
    other = beliefs(_with_track(walks, changed), model, CAR)
    assert early[0] == other[0]
    assert ((early > 0.0) & (early < 1.0)).all()


def _with_track(encounter, changed):  # type: ignore[no-untyped-def]
    from dataclasses import replace

    return replace(encounter, track=changed)


def test_the_awareness_study_counts_what_there_is() -> None:
    recordings = {
        "stops": scene(crossing(True, at=-4.8), car(), name="stops"),
        "walks": scene(crossing(False), car(), name="walks"),
    }
    rows = awareness_study(recordings, HumanModel(), CAR)
    assert [r["delay"] for r in rows] == [0.5, 1.0, 1.5, 2.0]
    for r in rows:
        assert (r["encounters"], r["reacted"]) == (2, 1)
        assert r["base_log_loss"] == pytest.approx(np.log(2.0))
        low, high = r["auc_ci95"]
        assert low <= r["auc"] <= high
    assert [r["auc"] for r in rows] == [0.5, 1.0, 1.0, 1.0]  # they stop 0.6 s after the onset
    assert [r["begun"] for r in rows] == [0.0, 1.0, 1.0, 1.0]
    assert [r["gain_auc"] for r in rows] == [0.5, 1.0, 1.0, 1.0]
    nobody = awareness_study({"empty": scene(straight("q", (0.0, 0.0), (1.0, 0.0)))}, HumanModel(), CAR)
    assert nobody[0]["encounters"] == 0
    assert nobody[0]["auc"] is None


def test_a_prediction_that_knows_scores_best_and_covers() -> None:
    def at(mean: FloatArray, sigma: float) -> Density:
        return Density(weights=np.ones(1), means=np.array([mean]), sigmas=np.full((1, 2), sigma))

    truth = np.array([1.0, 0.0])
    right, wrong = (score(masses(at(np.array(m), 0.1), 10), truth) for m in ([1.0, 0.0], [-1.0, 0.0]))
    assert right.log_loss == pytest.approx(-np.log(1.0 / 0.25), abs=0.05)
    assert right.log_loss < wrong.log_loss
    assert right.brier < wrong.brier
    assert wrong.covered.max() == 0.0
    draws = np.random.default_rng(0).normal(0.0, 1.0, (3000, 2))
    mass = masses(at(np.zeros(2), 1.0), 20)
    covered = np.mean([score(mass, d).covered for d in draws], axis=0)
    np.testing.assert_allclose(covered, [0.5, 0.9, 0.95, 0.99], atol=0.02)


def crowd(path: Path) -> Path:
    """Somebody walks up and down where a blind robot would drive; enough people to make trips of."""
    lines = ["scene,t,agent,kind,x,y"]
    for n in range(6):
        for k in range(300):
            t = 0.2 * k
            lines.append(f"s,{t:.1f},p{n},ped,{12.0 * abs((0.1 * t + n / 6) % 2 - 1):.3f},{1.5 * n - 4.0:.3f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.slow
def test_trips_are_the_same_for_everybody_and_finished_ones_are_kept(tmp_path: Path) -> None:
    from sidestep.io.tracks import read_recordings

    file = crowd(tmp_path / "tracks.csv")
    recordings = read_recordings(file)
    trips = choose_trips(file, recordings, trips=2, kinds=("ped",), seed=1)
    assert len(trips) == 2
    assert choose_trips(file, recordings, trips=2, kinds=("ped",), seed=1, crowd=5) == []  # six are always there
    assert choose_trips(file, recordings, trips=2, kinds=("ped",), seed=1, crowd=6) == trips
    for trip in trips:
        start, goal = np.array(trip.robot.start), np.array(trip.robot.goal)
        assert 7.0 <= np.linalg.norm(goal - start) <= 10.0
    store = Checkpoints(tmp_path / "pieces")
    rows = replay_study(file, ["stop-and-go", "chance"], trips=2, seed=1, store=store)
    assert [r["navigator"] for r in rows] == ["stop-and-go", "chance"]
    assert all(r["trips"] == 2 for r in rows)
    assert len(list(store.folder.iterdir())) == 4
    again = replay_study(file, ["stop-and-go", "chance"], trips=2, seed=1, store=store)
    assert again == rows  # planning times, too: nothing was run anew


@pytest.mark.slow
def test_trips_depend_on_the_model_and_on_what_the_file_holds(tmp_path: Path) -> None:
    """Neither is what was kept of another one; that the file has the same name is not enough."""
    from sidestep.io.tracks import read_recordings

    file, store = crowd(tmp_path / "tracks.csv"), Checkpoints(tmp_path / "pieces")

    def told(human: HumanModel | None = None) -> dict[str, Any]:
        (row,) = replay_study(file, ["sidestep"], trips=1, seed=1, human=human, store=store)
        return row

    def pieces() -> int:
        return len(list(store.folder.iterdir()))

    first = told()
    assert told(HumanModel()) == first
    assert pieces() == 1
    wary = told(HumanModel(randomness=0.9, online_randomness=False, steadiness=False))
    assert wary["time_ratio"] != first["time_ratio"]
    assert pieces() == 2
    trips = choose_trips(file, read_recordings(file), trips=1, kinds=("ped",), seed=1)
    file.write_text(file.read_text().replace("s,59.8,p5,ped,2.240", "s,59.8,p5,ped,2.250"))
    assert choose_trips(file, read_recordings(file), trips=1, kinds=("ped",), seed=1) == trips
    told()
    assert pieces() == 3


def test_nobody_comes_out_of_nothing_on_the_way_of_a_trip(tmp_path: Path) -> None:
    from sidestep.io.tracks import read_recordings

    file = crowd(tmp_path / "tracks.csv")
    with file.open("a") as more:
        for n in range(30):  # one every 2 s, somewhere, for 1 s
            for k in range(5):
                more.write(f"s,{2.0 * n + 0.2 * k:.1f},q{n},ped,{1.3 * n % 12:.2f},{0.7 * n % 8 - 4:.2f}\n")
    recordings = read_recordings(file)
    trips = choose_trips(file, recordings, trips=6, kinds=("ped",), seed=1)
    assert trips
    for trip in trips:
        start, goal = np.array(trip.robot.start), np.array(trip.robot.goal)
        way = start + np.linspace(0.0, 1.0, 400)[:, None] * (goal - start)
        assert trip.recording is not None
        begin = trip.recording.start
        for t in recordings["s"].between(begin, begin + float(np.linalg.norm(goal - start))):
            if t.time[0] > begin:
                assert np.linalg.norm(way - t.positions[0], axis=1).min() > 1.4
