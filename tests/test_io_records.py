"""Records survive the file exactly; what is not a record says so."""

import json
import os
from dataclasses import fields

import numpy as np
import pytest

from blind_driver import BlindDriver, crossing
from sidestep.errors import InvalidFile, OutputError
from sidestep.io.records import read_record, write_record
from sidestep.simulation.loop import simulate
from sidestep.simulation.record import Snapshot

WALL = [(3.0, 3.0), (4.0, 3.0), (4.0, 4.0)]


def run():
    late = {"id": "b", "kind": "straight", "start": (5, 2), "goal": (-5, 2), "appears": 3.0, "goal_known": False}
    a = {"id": "a", "kind": "straight", "start": (-5, 0), "goal": (5, 0)}
    scenario = crossing(people=[a, late], walls=[WALL], human={"rationality": float("inf")}, duration=5.0)
    return simulate(scenario, navigator=BlindDriver(goal=(0.0, 5.0)))


def with_snapshot(record):
    from dataclasses import replace

    shot = Snapshot(
        step=2,
        person=1,
        origin=np.zeros(2),
        spacing=0.25,
        rotation=np.eye(2),
        probability=np.random.default_rng(0).random((2, 5, 5)),
        instants=np.array([1, 4]),
    )
    return replace(record, snapshots=(shot,))


def same(a, b):
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    else:
        assert a == b


def test_a_record_comes_back_exactly_and_read_only(tmp_path):
    record = with_snapshot(run())
    path = write_record(record, tmp_path / "run.npz")
    back = read_record(path)
    for field in fields(record):
        a, b = getattr(record, field.name), getattr(back, field.name)
        if field.name in ("snapshots", "walls"):
            assert len(a) == len(b) == 1
        else:
            same(a, b)
        if isinstance(b, np.ndarray):
            assert not b.flags.writeable
    for field in fields(Snapshot):
        same(getattr(record.snapshots[0], field.name), getattr(back.snapshots[0], field.name))
    same(record.walls[0], back.walls[0])
    assert not back.snapshots[0].probability.flags.writeable


def test_the_file_is_plain_arrays_and_json(tmp_path):
    path = write_record(run(), tmp_path / "run")
    assert path.name == "run.npz"
    with np.load(path, allow_pickle=False) as held:
        meta = json.loads(str(held["meta"]))
        assert meta["format"] == "sidestep-record"
        assert held["robot_positions"].shape[1] == 2


def test_nothing_else_is_left_in_the_folder(tmp_path):
    write_record(run(), tmp_path / "run.npz")
    write_record(run(), tmp_path / "run.npz")
    assert os.listdir(tmp_path) == ["run.npz"]


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = write_record(run(), tmp_path / "run.npz")
    before = path.read_bytes()

    def broken(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", broken)
    with pytest.raises(OutputError, match="No space left"):
        write_record(run(), path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["run.npz"]


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OutputError, match="nowhere"):
        write_record(run(), tmp_path / "nowhere" / "run.npz")


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 broken"])
def test_what_is_not_a_record_says_so_in_one_line(tmp_path, content):
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidFile) as caught:
        read_record(path)
    assert "x.npz" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_other_archives_newer_versions_and_absent_files_are_told_apart(tmp_path):
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(InvalidFile, match="meta"):
        read_record(tmp_path / "other.npz")
    meta = json.dumps({"format": "sidestep-record", "version": 99})
    np.savez(tmp_path / "newer.npz", meta=np.array(meta))
    with pytest.raises(InvalidFile, match="update sidestep"):
        read_record(tmp_path / "newer.npz")
    with pytest.raises(InvalidFile, match="no such file"):
        read_record(tmp_path / "absent.npz")


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n...", b'description = "A scenario."\n'])
def test_a_picture_or_a_scenario_is_not_said_to_hold_pickles(tmp_path, content):
    """NumPy takes whatever it does not know for one, and speaks of files that are to be trusted."""
    (tmp_path / "figure.png").write_bytes(content)
    with pytest.raises(InvalidFile, match="a file of another kind"):
        read_record(tmp_path / "figure.png")


def test_pickles_are_refused(tmp_path):
    np.savez(tmp_path / "evil.npz", meta=np.array({"a": 1}, dtype=object))
    with pytest.raises(InvalidFile, match="pickle"):
        read_record(tmp_path / "evil.npz")
