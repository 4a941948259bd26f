"""`sidestep lab`: one JSON object, the tracker's score, one line per mistake."""

import json

import numpy as np
import pytest

from made_scans import Film, line, room
from sidestep.cli import BAD_INPUT, execute
from sidestep.io.scans import write_scan_recording
from sidestep.perception.scan import Annotations, ScanRecording
from sidestep.simulation.lidar import RPLIDAR_A2M8


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
