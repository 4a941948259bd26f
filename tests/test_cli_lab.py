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
