"""Films play as long as the run, show what moves, and leave nothing behind when they fail."""

from __future__ import annotations

import shutil
import sys
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from made_records import made_record
from sidestep.cli import execute
from sidestep.errors import InvalidInput, MissingExtra, OutputError
from sidestep.io.records import write_record
from sidestep.viewer import video
from sidestep.viewer.animation import animate


def frames(path) -> list[np.ndarray]:
    found = []
    with Image.open(path) as picture:
        for k in range(picture.n_frames):
            picture.seek(k)
            found.append(np.asarray(picture.convert("RGB")).astype(int))
    return found


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_a_gif_has_the_pictures_of_the_run_and_they_move(dimension, tmp_path):
    record = made_record(dimension=dimension, people=2, steps=6)
    path = animate(record, tmp_path / "run.gif", fps=4, speed=1.0)
    shown = frames(path)
    assert len(shown) == 13  # 3 s at 4 per second, both ends
    assert all(np.abs(a - b).sum() > 1000 for a, b in pairwise(shown))
    assert [p.name for p in tmp_path.iterdir()] == ["run.gif"]


def test_speed_shortens_the_film(tmp_path):
    record = made_record(steps=6)
    assert len(frames(animate(record, tmp_path / "fast.gif", fps=4, speed=3.0))) == 5


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg on this machine")
def test_an_mp4_is_written(tmp_path):
    path = animate(made_record(steps=4), tmp_path / "run.mp4", fps=5)
    assert path.read_bytes()[4:8] == b"ftyp"


def test_people_who_come_late_and_lonely_robots_are_filmed(tmp_path):
    animate(made_record(people=3, late=True, steps=8), tmp_path / "late.gif", fps=2)
    animate(made_record(people=0, steps=4), tmp_path / "alone.gif", fps=2)


@pytest.mark.parametrize(
    ("name", "options", "field"),
    [
        ("run.avi", {}, "path"),
        ("run", {}, "path"),
        ("run.gif", {"fps": 0}, "fps"),
        ("run.gif", {"fps": 100}, "fps"),
        ("run.gif", {"speed": 0.0}, "speed"),
        ("run.gif", {"speed": float("nan")}, "speed"),
        ("run.gif", {"speed": 1e-4}, "speed: got 0.0001; allowed: a number > 0 and ≥ .* for this run"),
        ("run.gif", {"speed": 1e-300}, "speed"),
    ],
)
def test_wrong_wishes_are_named(name, options, field, tmp_path):
    with pytest.raises(InvalidInput, match=f"^{field}: "):
        animate(made_record(steps=3), tmp_path / name, **options)


@pytest.mark.parametrize("suffix", ["gif", "mp4"])
def test_a_folder_that_is_not_there_is_named(suffix, tmp_path):
    if suffix == "mp4" and shutil.which("ffmpeg") is None:
        pytest.skip("no ffmpeg on this machine")
    with pytest.raises(OutputError, match="nowhere"):
        animate(made_record(steps=3), tmp_path / "nowhere" / f"run.{suffix}", fps=2)


@pytest.mark.parametrize("suffix", ["gif", "mp4"])
@pytest.mark.parametrize("name", ["folder", "file/run", 250 * "n"])
def test_a_film_in_place_of_something_else_is_refused(suffix, name, tmp_path):
    if suffix == "mp4" and shutil.which("ffmpeg") is None:
        pytest.skip("no ffmpeg on this machine")
    (tmp_path / "file").touch()
    (tmp_path / f"folder.{suffix}").mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        animate(made_record(steps=3), tmp_path / f"{name}.{suffix}", fps=2)
    assert {path.name for path in tmp_path.iterdir()} == {"file", f"folder.{suffix}"}


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg on this machine")
def test_a_name_with_a_colon_is_a_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    animate(made_record(steps=3), "run-17:10.mp4", fps=2)
    assert (tmp_path / "run-17:10.mp4").stat().st_size > 0


def test_mp4_without_ffmpeg_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setattr(video.shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtra, match=r"sidestep\[live\]"):
        animate(made_record(steps=3), tmp_path / "run.mp4", fps=2)


def test_the_command_makes_a_film_beside_the_record(tmp_path, capsys):
    record = write_record(made_record(steps=4), tmp_path / "run.npz")
    assert execute(["animate", str(record), "--out", str(tmp_path / "film.gif"), "--fps", "4", "--speed", "2"]) == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'film.gif'}\n"
    assert len(frames(tmp_path / "film.gif")) == 5
    folder = tmp_path / "folder.gif"
    folder.mkdir()
    for wrong in (
        ["nothing.npz"],
        [str(record), "--out", str(tmp_path / "film.avi")],
        [str(record), "--out", str(folder)],
        [str(record), "--fps", "900"],
    ):
        assert execute(["animate", *wrong]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
