"""`sidestep lab`: one JSON object, the tracker's score, one line per mistake."""

import json

import numpy as np
import pytest

from made_scans import Film, line, room
from sidestep.cli import BAD_INPUT, execute
from sidestep.commands import lab_tracker
from sidestep.io.scans import read_scan_recording, write_scan_recording
from sidestep.perception.classifier import load_classifier
from sidestep.perception.scan import Annotations, LegLabels, ScanRecording
from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import RPLIDAR_A2M8, Scanner
from sidestep.studies.leg_training import recorded_samples, simulated_samples


@pytest.fixture
def recording(tmp_path):
    film = Film(room(), [line((-2, 1.5), (2, 1.5), 1.0, begins=1.0)])
    truth, scans = [], []
    while film.time < 4.0:
        truth.append(film.truth(film.time)[0])
        scans.append(film.next())
    write_scan_recording(
        ScanRecording(
            name="walk",
            beams=RPLIDAR_A2M8,
            times=np.array([s.time for s in scans]),
            ranges=np.array([s.ranges for s in scans]),
            people=Annotations(
                scan=np.arange(len(scans)), person=np.ones(len(scans), dtype=int), positions=np.array(truth)
            ),
        ),
        tmp_path / "walk.npz",
    )
    return tmp_path / "walk.npz"


def test_score_prints_one_json_object_beside_the_simplest_tracker(recording, capsys):
    assert execute(["lab", "--score", str(recording), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["recording"] == "walk"
    assert found["scans"] == 40
    assert found["recall"] > 0.8
    assert found["id_switches"] == 0
    assert set(found["trivial"]) >= {"recall", "precision", "id_switches", "error_m", "reports"}


def test_score_prints_a_table(recording, capsys):
    assert execute(["lab", "--score", str(recording)]) == 0
    text = capsys.readouterr().out
    assert "identity switches" in text
    assert "trivial tracker" in text


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["--score", "nowhere.npz"], "nowhere.npz: got 'no such file'"),
        (["--score", "a.npz", "--train", "b.npz"], "--score"),
        (["--labelled", "a.npz"], "--labelled"),
        (["--train", "legs.txt"], "ends in .npz"),
        (["--score", "a.npz", "--human", "concerned"], "--human: got 'concerned'; allowed: only without --score"),
        (["--score", "a.npz", "--planner-rate", "4"], "--planner-rate: got 4.0; allowed: only without --score"),
        (["--score", "a.npz", "--seed", "1"], "--seed: got 1; allowed: only without --score"),
        (["--train", "b.npz", "--out", "there"], "--out: got 'there'; allowed: only without --score and --train"),
        (["--train", "b.npz", "--classifier", "c.npz"], "--classifier: got 'c.npz'; allowed: only without --train"),
        (["--human", "curious"], "concerned"),
        (["--planner-rate", "3"], "planner_rate"),
        (["--seeds", "0", "--kinematic"], "--seeds"),
    ],
)
def test_a_mistake_is_one_line(arguments, names, capsys):
    assert execute(["lab", *arguments]) == BAD_INPUT
    message = capsys.readouterr().err.strip()
    assert names in message
    assert "\n" not in message


def test_a_classifier_of_another_kind_is_refused(recording, tmp_path, capsys):
    np.savez(tmp_path / "other.npz", base=np.zeros(3))
    assert execute(["lab", "--score", str(recording), "--classifier", str(tmp_path / "other.npz")]) == BAD_INPUT
    assert "other.npz" in capsys.readouterr().err


def labelled_walk(path, seed):
    """Twenty labelled scans of two people who walk about a room."""
    rng, scanner = np.random.default_rng(seed), Scanner()
    gaits, scans, hits = [Gait.random(rng), Gait.random(rng)], [], []
    for k in range(20):
        time, phase = 0.1 * k, 0.7 * k
        legs = [g.legs(np.array([1.5 * s, s * (time - 1.0)]), np.array([0.0, s]), s * np.pi / 2, phase)
                for g, s in zip(gaits, (1.0, -1.0), strict=True)]  # fmt: skip
        scan, hit = scanner.sense(room(), np.concatenate(legs), np.zeros(3), np.zeros(3), time, rng)
        scans.append(scan)
        hits.append(np.maximum(hit, 0))
    return write_recording(path, scans, LegLabels(scans=np.arange(20), beams=np.array(hits)))


def empty_walk(path):
    """Ten scans of a room with nobody in it."""
    film = Film(room(), [])
    return write_recording(path, [film.next() for _ in range(10)], None)


def write_recording(path, scans, legs):
    """Write scans of one scanner, and return how many beams were labelled."""
    ranges, times = np.array([s.ranges for s in scans]), np.array([s.time for s in scans])
    write_scan_recording(ScanRecording(name=path.stem, beams=RPLIDAR_A2M8, times=times, ranges=ranges, legs=legs), path)
    return 0 if legs is None else int((legs.beams > 0).sum())


@pytest.mark.slow
def test_training_with_labelled_recordings_leaves_a_classifier_that_scores(recording, tmp_path, capsys, monkeypatch):
    """From the files to a classifier that the tracker works with; its clusters are those of simulation and files."""
    pytest.importorskip("sklearn")
    monkeypatch.setattr(lab_tracker, "TRAINING_SCANS", 120)
    monkeypatch.setattr(lab_tracker, "TEST_SCANS", 40)
    files = [tmp_path / name for name in ("one.npz", "two.npz", "empty.npz")]
    assert labelled_walk(files[0], 0) > 100
    labelled_walk(files[1], 1)
    empty_walk(files[2])
    names = [str(file) for file in files]
    trees = tmp_path / "legs.npz"
    assert execute(["lab", "--train", str(trees), "--labelled", *names, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["recordings"] == names
    simulated = len(simulated_samples(np.random.default_rng(0), scans=120)[1])
    assert found["clusters"] == simulated + len(recorded_samples([read_scan_recording(file) for file in files])[1])
    assert found["held_out"]["leg"]["leg"] > 0.6
    assert execute(["lab", "--score", str(recording), "--classifier", str(trees), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["recall"] > 0.5


def test_labels_name_legs_and_what_bears_two_is_both(tmp_path):
    path = tmp_path / "one.npz"
    labelled_walk(path, 0)
    features, classes = recorded_samples([read_scan_recording(path)])
    assert set(classes.tolist()) <= {1, 2}
    assert len(features) == len(classes) >= 40
    judged = load_classifier().probabilities(features)
    assert np.mean(np.argmax(judged, axis=1) > 0) > 0.8


@pytest.mark.slow
def test_a_room_gives_the_promised_numbers_a_figure_and_records(tmp_path, capsys):
    out = tmp_path / "lab"
    options = ["--kinematic", "--human", "unconcerned", "--seed", "1", "--latency", "100", "--out", str(out), "--json"]
    assert execute(["lab", *options]) == 0
    found = json.loads(capsys.readouterr().out)
    promised = {"human", "seeds", "contacts_moving", "contacts_standing", "reached", "belief_correct", "pi_r_ratio"}
    assert promised | {"planner_hz", "tracker"} <= set(found)
    assert set(found["tracker"]) == {"precision", "recall", "id_switches", "rmse_m"}
    assert (found["human"], found["seeds"], found["runs"]) == ("unconcerned", 1, 1)
    assert found["scan_age_ms"] > 150  # a scan takes 100 ms, its way as long
    assert 0 < found["planner_hz"] <= 2.0
    assert {"concerned.npz", "unconcerned.npz", "lab.png", "results.json"} == {file.name for file in out.iterdir()}
    each = json.loads((out / "results.json").read_text())["each"]
    assert [run["human"] for run in each] == ["concerned", "unconcerned"]
