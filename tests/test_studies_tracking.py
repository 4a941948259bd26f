"""The score of a tracker, on cases counted by hand, against Stone Soup's, and on real recordings."""

import os
from pathlib import Path

import numpy as np
import pytest

from alternatives.stone_soup import GnnTracker, clear_mot
from made_scans import Film, line, room
from sidestep.io.scans import read_scan_recording
from sidestep.perception.classifier import load_classifier
from sidestep.perception.clear_mot import ClearMot
from sidestep.perception.scan import Annotations, ScanRecording
from sidestep.perception.tracks import Tracker
from sidestep.simulation.lidar import RPLIDAR_A2M8
from sidestep.studies.leg_training import confusion, recorded_samples, simulated_samples, train
from sidestep.studies.tracking import score
from sidestep.studies.trivial_tracker import TrivialTracker

DATA = Path(os.environ.get("SIDESTEP_DATA", Path(__file__).parents[2] / "shared" / "data")) / "leg_tracker"
EVERYWHERE = (-np.pi, np.pi)


def recorded(name):
    if not (DATA / f"{name}.npz").is_file():
        pytest.skip(f"no recordings in {DATA}; set SIDESTEP_DATA")
    return read_scan_recording(DATA / f"{name}.npz")


def test_counts_by_hand():
    mot = ClearMot()
    here, there = [0.0, 0.0], [2.0, 0.0]
    mot.update([1, 2], np.array([here, there]), ["a", "b"], np.array([[0.1, 0.0], [2.0, 0.2]]))
    mot.update([1, 2], np.array([here, there]), ["a"], np.array([[0.1, 0.0]]))  # a miss
    mot.update([1, 2], np.array([here, there]), ["a", "c"], np.array([[0.0, 0.0], [2.0, 0.0]]))  # b → c: a switch
    mot.update([1], np.array([here]), ["a", "c"], np.array([[0.0, 0.0], [5.0, 0.0]]))  # a false positive
    found = mot.score()
    assert (found.truths, found.matches, found.misses, found.false_positives, found.id_switches) == (7, 6, 1, 1, 1)
    assert found.error == pytest.approx((0.1 + 0.2 + 0.1) / 6)
    assert found.recall == pytest.approx(6 / 7)
    assert found.precision == pytest.approx(6 / 7)
    assert found.accuracy == pytest.approx(1 - 3 / 7)


def test_a_pair_lasts_although_another_track_comes_nearer():
    mot = ClearMot()
    mot.update([1], np.zeros((1, 2)), ["a"], np.array([[0.5, 0.0]]))
    pairs = mot.update([1], np.zeros((1, 2)), ["a", "b"], np.array([[0.5, 0.0], [0.0, 0.0]]))
    assert pairs == {"a": 1}


def test_nobody_at_all_scores_nothing():
    found = ClearMot().score()
    assert np.isnan([found.recall, found.precision, found.error]).all()


def test_clear_mot_is_stone_soups_where_pairs_are_plain():
    pytest.importorskip("stonesoup")
    rng = np.random.default_rng(0)
    people = np.cumsum(rng.normal(0, 0.05, (40, 3, 2)), axis=0) + np.array([[0, 0], [4, 0], [0, 4]])
    mot, tracks = ClearMot(), {}
    for k in range(40):
        names = [f"{p}{'x' if k > 20 and p == 1 else ''}" for p in range(3) if not (p == 2 and 10 < k < 15)]
        places = np.array([people[k, int(n[0])] for n in names]) + rng.normal(0, 0.05, (len(names), 2))
        if k > 30:
            names, places = [*names, "ghost"], np.vstack([places, [9.0, 9.0]])
        mot.update([0, 1, 2], people[k], names, places)
        for name, place in zip(names, places, strict=True):
            tracks.setdefault(name, {})[k] = place
    motp, mota = clear_mot({p: dict(enumerate(people[:, p])) for p in range(3)}, tracks, distance=0.75)
    assert mot.score().error == pytest.approx(motp)
    assert mot.score().accuracy == pytest.approx(mota)


def film_recording(people, seconds, seed=0):
    film = Film(room(cylinders=[(2.5, -2.0, 0.04), (2.9, -2.0, 0.04), (-2.2, -1.5, 0.12)]), people, seed=seed)
    times, ranges, scans, ids, places = [], [], [], [], []
    while film.time < seconds:
        truth = film.truth(film.time)
        for k, place in truth.items():
            scans.append(len(times)), ids.append(k), places.append(place)
        times.append(film.time)
        ranges.append(film.next().ranges)
    return ScanRecording(
        name="film",
        beams=RPLIDAR_A2M8,
        times=np.array(times),
        ranges=np.array(ranges),
        poses=np.zeros((len(times), 3)),
        people=Annotations(scan=np.array(scans), person=np.array(ids), positions=np.array(places)),
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_never_behind_a_global_nearest_neighbour_tracker_on_the_same_detections():
    pytest.importorskip("stonesoup")
    people = [
        line((-3.5, 1.2), (3.5, 1.6), 1.1, begins=1.0),
        line((3.5, 2.2), (-3.5, 1.9), 0.9, begins=1.5),
        line((0.5, -3.5), (0.2, 3.5), 1.0, begins=1.0),
        line((-3.5, 2.9), (-1.5, 2.9), 1.0, begins=0.5),
    ]
    recording = film_recording(people, 8.0)
    ours = score(recording, Tracker(), sector=EVERYWHERE).mot
    assert ours.recall > 0.9
    for likely in (0.0, 1.0, 2.0):
        check_not_behind(ours, score(recording, GnnTracker(load_classifier(), likely), sector=EVERYWHERE).mot)


def check_not_behind(ours, theirs):
    """The others may report more and so miss less: what counts is everything that is wrong, together."""
    assert ours.accuracy >= theirs.accuracy
    assert ours.precision >= theirs.precision
    assert ours.id_switches <= theirs.id_switches
    assert ours.error <= theirs.error + 0.005


def test_the_score_counts_only_annotated_scans_and_the_sector():
    recording = film_recording([line((1.5, 0.5), (1.5, 0.5), 1.0), line((-1.5, 0.5), (-1.5, 0.5), 1.0)], 5.0)
    ahead = score(recording, Tracker(), sector=(-1.0, 1.0))
    assert ahead.mot.truths == len(recording)
    assert ahead.mot.recall > 0.8
    assert ahead.mot.precision > 0.95  # the one behind is neither missed nor false
    assert ahead.annotated_scans == ahead.scans == len(recording)
    assert set(ahead.as_dict()) >= {"recall", "precision", "id_switches", "error_m", "rmse_m", "ms_mean"}


def test_training_learns_and_leaves_a_sound_classifier(tmp_path):
    pytest.importorskip("sklearn")
    features, classes = simulated_samples(np.random.default_rng(0), scans=80)
    trees = train(features, classes, seed=0, rounds=10)
    path = tmp_path / "legs.npz"
    with path.open("wb") as file:
        trees.save(file)
    back = load_classifier(path)
    np.testing.assert_array_equal(back.probabilities(features), trees.probabilities(features))
    again = train(features, classes, seed=0, rounds=10)
    np.testing.assert_array_equal(again.values, trees.values)
    shares = confusion(back, *simulated_samples(np.random.default_rng(1), scans=60))
    assert shares["leg"]["leg"] > 0.6
    assert shares["other"]["other"] > 0.65


@pytest.mark.data
def test_recordings_of_legs_and_of_nobody_can_be_learned_from():
    features, classes = recorded_samples([recorded("legs_2"), recorded("negative_2_left")])
    assert np.bincount(classes)[1:].sum() > 80
    assert np.bincount(classes)[0] > 1000
    shipped = load_classifier().probabilities(features)
    assert np.mean(shipped[classes > 0, 0] < 0.5) > 0.8
    assert np.mean(shipped[classes == 0, 0] > 0.5) > 0.75


@pytest.mark.data
@pytest.mark.slow
def test_the_aims_hold_on_the_recording_of_someone_who_is_followed():
    found = score(recorded("following_outdoor_1_first_half"), Tracker()).mot
    assert found.recall >= 0.97
    assert found.id_switches <= 5
    assert found.error <= 0.08


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize("side", ["left", "right"])
def test_empty_rooms_raise_a_fifth_of_the_simplest_trackers_alarms(side):
    recording = recorded(f"negative_2_{side}")
    assert 5 * score(recording, Tracker()).reports <= score(recording, TrivialTracker()).reports


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_never_behind_a_global_nearest_neighbour_tracker_outdoors():
    pytest.importorskip("stonesoup")
    whole = recorded("following_outdoor_1_first_half")
    rows = slice(0, 600)
    people = whole.people
    first = people.scan < 600
    part = ScanRecording(
        name="part", beams=whole.beams, times=whole.times[rows], ranges=whole.ranges[rows],
        people=Annotations(scan=people.scan[first], person=people.person[first], positions=people.positions[first]),
    )  # fmt: skip
    check_not_behind(score(part, Tracker()).mot, score(part, GnnTracker(load_classifier(), 1.0)).mot)
