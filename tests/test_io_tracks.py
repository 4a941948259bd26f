"""Tracks: plain and gzipped CSV, all recorded sets, and what is wrong with a file in one line."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from sidestep.errors import InvalidFile, InvalidInput, UnknownName
from sidestep.io.tracks import read_recording, read_recordings, scene_names
from sidestep.simulation.people import Recorded
from sidestep.simulation.recordings import Recording, Track, check_people

HEADER = "scene,t,agent,kind,x,y\n"
ROWS = "s,0.4,a,ped,1.0,0.0\ns,0.0,a,ped,0.0,0.0\ns,0.8,a,ped,3.0,0.0\ns,0.0,v,veh,9.0,9.0\nu,1.0,a,ped,0,0\n"
DATA = Path(os.environ.get("SIDESTEP_DATA", Path(__file__).parents[2] / "shared" / "data"))


@pytest.fixture
def tracks(tmp_path):
    path = tmp_path / "tracks.csv"
    path.write_text(HEADER + ROWS)
    return path


def test_a_scene_is_read_in_the_order_of_time(tracks):
    scene = read_recording(tracks, "s")
    a, v = scene.tracks
    np.testing.assert_allclose(a.time, [0.0, 0.4, 0.8])
    np.testing.assert_allclose(a.positions, [[0, 0], [1, 0], [3, 0]])
    assert (v.agent, v.kind) == ("v", "veh")
    assert [t.agent for t in scene.of_kinds(["ped"]).tracks] == ["a"]
    assert (scene.start, scene.end, scene.interval) == (0.0, 0.8, 0.4)
    assert scene.snapped(0.55) == pytest.approx(0.4)


def test_gzip_and_further_columns_in_any_order_make_no_difference(tracks, tmp_path):
    lines = [line.split(",") for line in (HEADER + ROWS).splitlines()]
    swapped = "\n".join(",".join([row[5], row[4], "7", *row[:4]]) for row in lines).replace("7,scene", "vx,scene", 1)
    path = tmp_path / "tracks.csv.gz"
    with gzip.open(path, "wt") as file:
        file.write(swapped)
    for name, scene in read_recordings(tracks).items():
        other = read_recordings(path)[name]
        for a, b in zip(scene.tracks, other.tracks, strict=True):
            np.testing.assert_array_equal(a.positions, b.positions)


def test_positions_between_samples_and_velocities_of_the_past(tracks):
    a = read_recording(tracks, "s").tracks[0]
    np.testing.assert_allclose(a.at(0.6), [2.0, 0.0])
    assert np.isnan(a.at(np.array([-0.1, 0.9]))).all()
    assert a.velocity_before(0.0, 0.4) is None
    np.testing.assert_allclose(a.velocity_before(0.4, 0.4), [2.5, 0.0])
    np.testing.assert_allclose(a.velocity_before(0.79, 0.4), [2.5, 0.0])
    np.testing.assert_allclose(a.velocity_before(0.8, 0.4), [5.0, 0.0])
    np.testing.assert_allclose(a.velocity_before(0.8, 0.8), [3.75, 0.0])


def test_a_file_with_one_scene_needs_no_name(tmp_path, tracks):
    path = tmp_path / "one.csv"
    path.write_text(HEADER + "only,0,a,ped,0,0\n")
    assert read_recording(path).name == "only"
    with pytest.raises(InvalidFile, match="it holds s, u; choose one with --scene"):
        read_recording(tracks)
    with pytest.raises(UnknownName, match=r"'ss'.*did you mean 's'"):
        read_recording(tracks, "ss")
    assert scene_names(tracks) == ["s", "u"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scene,t,agent,x,y\n", "add kind"),
        ("", "add scene, t"),
        (HEADER, "at least one row"),
        (HEADER + "s,0,a,ped,0\n", "line 2"),
        (HEADER + "s,0,a,ped,0,zero\n", "line 2, y: got 'zero'"),
        (HEADER + "s,0,a,ped,0,0\ns,nan,a,ped,0,0\n", "line 3, t: got 'nan'"),
        (HEADER + "s,0,a,ped,inf,0\n", "line 2, x"),
        (HEADER + "s,0,a,ped,,0\n", "line 2, x: got ''; allowed: a finite number; leave the line out"),
        ("scene;t;agent;kind;x;y\ns;0;a;ped;0;0\n", "put commas between the columns"),
        (HEADER + "s,0,a,ped,0,0\ns,0.0,a,ped,1,0\n", "agent 'a', t: got 0.0"),
    ],
)
def test_each_fault_in_a_file_gives_one_line(tmp_path, text, words):
    path = tmp_path / "tracks.csv"
    path.write_text(text)
    with pytest.raises(InvalidFile) as caught:
        read_recordings(path)
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_file_without_rows_is_named_whatever_scene_is_asked_for(tmp_path):
    path = tmp_path / "tracks.csv"
    path.write_text(HEADER)
    with pytest.raises(InvalidFile, match="no rows"):
        read_recording(path, "s")


@pytest.mark.parametrize("name", ["tracks.csv", "tracks.csv.gz"])
def test_the_mark_that_spreadsheets_put_before_text_is_no_part_of_it(tmp_path, name):
    text = (HEADER + "only,0,a,ped,0,0\n").encode("utf-8-sig")
    (tmp_path / name).write_bytes(gzip.compress(text) if name.endswith("gz") else text)
    assert scene_names(tmp_path / name) == ["only"]


def test_absent_and_damaged_files(tmp_path):
    with pytest.raises(InvalidFile, match="no such file"):
        scene_names(tmp_path / "absent.csv")
    bad = tmp_path / "bad.csv.gz"
    bad.write_bytes(b"no gzip")
    with pytest.raises(InvalidFile, match=r"bad\.csv\.gz"):
        read_recordings(bad)
    cut = tmp_path / "cut.csv.gz"
    cut.write_bytes(gzip.compress((HEADER + ROWS * 500).encode())[:-30])
    with pytest.raises(InvalidFile, match=r"cut\.csv\.gz"):
        read_recordings(cut)


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "scenes", "interval"), [("eth_ucy", 5, 0.4), ("citr", 19, 0.1), ("dut", 12, 0.1), ("navwareset", 272, 0.1)]
)
def test_the_recorded_sets_are_read(name, scenes, interval):
    path = DATA / name / "tracks.csv.gz"
    if not path.exists():
        pytest.skip(f"no recordings in {DATA}; set SIDESTEP_DATA")
    recordings = read_recordings(path)
    assert len(recordings) >= scenes
    for recording in recordings.values():
        assert recording.interval == pytest.approx(interval)
        people = recording.of_kinds(["ped"]).tracks
        assert people
        speeds = np.concatenate(
            [np.linalg.norm(np.diff(t.positions, axis=0), axis=1) / np.diff(t.time) for t in people]
        )
        assert np.median(speeds) < 3.0


def test_who_bears_a_name_again_after_a_pause_was_away_in_between(tmp_path):
    """Where they turn up says nothing of where they were: nobody slides there, and no velocity leads there."""
    path = tmp_path / "tracks.csv"
    rows = [f"s,{0.1 * k:.1f},a,ped,{0.1 * k:.1f},0" for k in range(50)]
    again = [f"s,{25 + 0.1 * k:.1f},a,ped,9,{0.1 * k:.1f}" for k in range(50)]
    path.write_text(HEADER + "\n".join(rows + again) + "\n")
    (a,) = read_recording(path).tracks
    np.testing.assert_allclose(a.stays, [[0.0, 4.9], [25.0, 29.9]])
    assert np.isnan(a.at(np.array([5.0, 15.0, 24.9]))).all()
    np.testing.assert_allclose(a.at(np.array([4.9, 25.0])), [[4.9, 0.0], [9.0, 0.0]])
    assert a.velocity_before(25.0, 0.4) is None
    np.testing.assert_allclose(a.velocity_before(25.1, 0.4), [0.0, 1.0])
    person = Recorded(a, 2.0, 0.3)
    assert [person.position(t) is None for t in (0.0, 2.9, 3.0, 22.9, 23.0)] == [False, False, True, True, False]


def test_samples_that_are_always_rare_and_one_that_is_missing_are_no_gaps(tmp_path):
    path = tmp_path / "tracks.csv"
    rare = [f"s,{k},a,ped,{k},0" for k in range(9)]
    missing = [f"s,{0.4 * k:.1f},b,ped,{0.4 * k:.1f},0" for k in range(9) if k != 4]
    path.write_text(HEADER + "\n".join(rare + missing) + "\n")
    for track in read_recording(path).tracks:
        assert len(track.stays) == 1
        np.testing.assert_allclose(track.at(1.7), [1.7, 0.0])


def test_spaces_around_a_value_are_no_part_of_it(tmp_path, tracks):
    """Kind " ped" was nobody: a robot drove through an empty square."""
    path = tmp_path / "spaced.csv"
    path.write_text((HEADER + ROWS).replace(",", " , "))
    for name, scene in read_recordings(tracks).items():
        other = read_recordings(path)[name]
        assert [(t.agent, t.kind) for t in other.tracks] == [(t.agent, t.kind) for t in scene.tracks]


def square(kind="ped", unit=1.0, second=1.0):
    """Two who walk 10 m at 1.3 m/s, and one who stands, in units of `unit` m and `second` s."""
    time = np.arange(0.0, 7.7, 0.1)
    ways = [np.outer(time, (1.3, 0.0)), np.outer(time, (0.0, 1.3)), np.zeros((len(time), 2))]
    tracks = [Track(agent=str(n), kind=kind, time=time / second, positions=way / unit) for n, way in enumerate(ways)]
    return Recording(name="square", tracks=tuple(tracks))


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (square("pedestrian"), "square.csv: kind: got 'pedestrian'; allowed: ped for people"),
        (square(unit=0.001), "got 'people at 1300 m/s'"),
        (square(unit=0.025), "got 'people at 52 m/s'"),
        (square(second=0.001), "got '100 s between samples'; allowed: at most 10 s; convert to seconds"),
    ],
)
def test_recordings_without_people_or_in_other_units_are_refused(scene, words):
    with pytest.raises(InvalidInput) as caught:
        check_people([scene], ("ped",), "square.csv")
    assert words in str(caught.value)


def test_people_in_metres_and_seconds_are_people():
    fast = square(unit=1 / 6)  # on bicycles
    check_people([square(), fast, Recording(name="empty", tracks=())], ("ped",), "square.csv")
