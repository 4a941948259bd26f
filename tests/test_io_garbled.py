"""Files that were cut off or garbled on their way: read, or refused in plain words; never an error of ours."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from sidestep.commands.replay import _parameters as parameters_of
from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.io.human_models import read_human_model, write_human_model
from sidestep.io.maps import read_map
from sidestep.io.records import read_record, write_record
from sidestep.io.scans import read_scan_recording, write_scan_recording
from sidestep.io.scenarios import load_scenario, shipped_text
from sidestep.io.tracks import read_recordings
from sidestep.perception.classifier import load_classifier
from sidestep.perception.scan import Beams, ScanRecording
from sidestep.ros.settings import NodeSettings
from sidestep.simulation.loop import simulate

TRACKS = b"scene,t,agent,kind,x,y\n" + b"".join(b"a,%.1f,1,ped,%.2f,0.5\n" % (0.1 * k, 0.1 * k) for k in range(40))
MAP = b"image: plan.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.1]\nnegate: 0\n"
PLAN = b"P5\n# drawn by hand\n12 9\n255\n" + bytes(range(100, 208))
WORDS = (b"nan", b"-inf", b"1e309", b"", b"\x00", b"[", b"\xff", b"true", b'"', b"{}", b"\n", b"9" * 20)


def a_map(folder: Path) -> Path:
    (folder / "plan.pgm").write_bytes(PLAN)
    (folder / "plan.yaml").write_bytes(MAP)
    return folder / "plan.yaml"


def a_plan(folder: Path) -> Path:
    a_map(folder)
    return folder / "plan.pgm"


def tracks(folder: Path) -> Path:
    (folder / "tracks.csv").write_bytes(TRACKS)
    return folder / "tracks.csv"


def packed_tracks(folder: Path) -> Path:
    (folder / "tracks.csv.gz").write_bytes(gzip.compress(TRACKS))
    return folder / "tracks.csv.gz"


def a_human(folder: Path) -> Path:
    return write_human_model(HumanModel(), folder / "human.toml")


def a_scenario(folder: Path) -> Path:
    (folder / "mine.toml").write_text(shipped_text("corridor"))
    return folder / "mine.toml"


def a_record(folder: Path) -> Path:
    return write_record(simulate(load_scenario("crossing", ["duration=1.0"]), seed=0), folder / "record.npz")


def scans(folder: Path) -> Path:
    beams = Beams(count=30, angle_min=-1.0, angle_increment=0.05, range_min=0.1, range_max=10.0)
    ranges = np.random.default_rng(0).uniform(0.2, 9.0, (4, 30))
    recording = ScanRecording(name="scans", beams=beams, times=0.1 * np.arange(4), ranges=ranges)
    write_scan_recording(recording, folder / "scans.npz")
    return folder / "scans.npz"


def a_classifier(folder: Path) -> Path:
    with (folder / "legs.npz").open("wb") as file:
        load_classifier().save(file)
    return folder / "legs.npz"


def bag(folder: Path) -> Path:
    pytest.importorskip("rosbags")
    from test_io_recordings import write_some

    write_some(folder / "run.bag")
    return folder / "run.bag"


def mcap(folder: Path) -> Path:
    pytest.importorskip("rosbags")
    from test_io_recordings import write_some

    write_some(folder / "run.mcap")
    return folder / "run.mcap"


def read_messages(path: Path) -> None:
    from sidestep.io.recordings import read_messages as read

    for _ in read(path):
        pass


CASES = {
    a_map: read_map,
    a_plan: lambda path: read_map(path.with_suffix(".yaml")),
    tracks: read_recordings,
    packed_tracks: read_recordings,
    a_human: read_human_model,
    a_scenario: load_scenario,
    a_record: read_record,
    scans: read_scan_recording,
    a_classifier: load_classifier,
    bag: read_messages,
    mcap: read_messages,
}


def garbled(content: bytes, generator: np.random.Generator) -> bytes:
    """The same cut off, with a hole, a wrong byte, a foreign word or a piece that came twice."""
    at, length = int(generator.integers(len(content))), int(generator.integers(1, 40))
    how = generator.integers(5)
    if how == 0:
        return content[:at]
    if how == 1:
        return content[:at] + content[at + length :]
    if how == 2:
        return content[:at] + generator.bytes(1) + content[at + 1 :]
    if how == 3:
        return content[:at] + WORDS[generator.integers(len(WORDS))] + content[at:]
    return content[:at] + content[at : at + length] + content[at:]


@pytest.mark.parametrize("make", CASES, ids=lambda make: make.__name__)
def test_what_is_garbled_is_read_or_refused(make, tmp_path):
    path = make(tmp_path)
    whole, read = path.read_bytes(), CASES[make]
    read(path)
    refusals: list[str] = []
    for seed in range(60):
        path.write_bytes(garbled(whole, np.random.default_rng(seed)))
        try:
            read(path)
        except InvalidInput as error:
            refusals.append(str(error))
    assert refusals
    assert all(path.parent.name in line for line in refusals)


DEEP = [
    "x = " + 2000 * "[" + 2000 * "]",
    "x = " + 2000 * "{a=" + "1" + 2000 * "}",
    "x" + 2000 * ".a" + " = 1",
    "[human" + 2000 * ".a" + "]",
    "x = " + 100 * "[" + 100 * "]",
]


@pytest.mark.parametrize("text", DEEP, ids=("lists", "tables", "dotted", "header", "fewer"))
@pytest.mark.parametrize(
    "read",
    [
        load_scenario,
        read_human_model,
        lambda path: NodeSettings.parse({"scenario": str(path)}),
        lambda path: parameters_of(path, ()),
    ],
    ids=("scenario", "human", "node", "replay"),
)
def test_what_is_nested_without_end_is_refused(read, text, tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text(text + "\n")
    with pytest.raises(InvalidInput, match="nested more than 50 deep"):
        read(path)


@pytest.mark.parametrize("change", [2000 * "a." + "a=1", "people=" + 2000 * "[" + 2000 * "]"])
def test_a_change_nested_without_end_is_refused(change):
    with pytest.raises(InvalidInput, match=r"^--set: got|^people: got"):
        load_scenario("crossing", [change])
    if "." in change:
        with pytest.raises(InvalidInput, match="--set: got"):
            parameters_of(None, (change,))
