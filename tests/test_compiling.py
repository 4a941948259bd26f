"""The first time every processor compiles a share of the kernels: what is listed, found, and left behind."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sidestep import compiling
from sidestep.commands import bars
from sidestep.compiling import Needed, code_of, compile_together, kind_of, missing, needed, pending

ROOT = Path(__file__).parent.parent
SMALL = ("frames.turned", "evidence.relaxed", "blocks.take_steps")

TOGETHER = """
import sys
from sidestep import compiling
small = sys.argv[1:]
rows = [row for row in compiling.needed() if row.kernel in small]
assert len(rows) == len(small)
compiling.missing = lambda *, walls=False: rows
compiling.processors = lambda: 2
compiling.WORTH = 0.0
told = []
compiling.compile_together(tell=told.append)
assert told and told[0] == 0.0 and max(told) <= 1.0, told
"""
FOUND = """
import sys
from importlib import import_module
from sidestep.compiling import kind_of, needed
for row in needed():
    if row.kernel in sys.argv[1:]:
        module, _, name = row.kernel.partition(".")
        kernel = getattr(import_module(f"sidestep._kernels.{module}"), name)
        kernel.compile(tuple(map(kind_of, row.arguments)))
        assert kernel.stats.cache_hits and not kernel.stats.cache_misses, row
"""


def in_process(code: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_the_list_is_what_a_first_run_calls() -> None:
    code = (
        f"import json, sys; sys.path.insert(0, {str(ROOT / 'tools')!r}); import list_kernels; "
        "seconds, always = list_kernels.listed(); print(json.dumps([list(seconds), always]))"
    )
    done = in_process(code)
    assert done.returncode == 0, done.stderr[-2000:]
    called, always = json.loads(done.stdout.splitlines()[-1])
    listed = [[row.kernel, list(row.arguments)] for row in needed()]
    hint = "run tools/list_kernels.py: the list is outdated"
    assert sorted(called[:always]) == sorted(listed[: sum(not row.walls for row in needed())]), hint
    assert sorted(called) == sorted(listed), hint


def test_what_is_compiled_side_by_side_is_found_and_nothing_else_is_left(tmp_path: Path) -> None:
    done = in_process(TOGETHER, *SMALL, NUMBA_CACHE_DIR=str(tmp_path))
    assert done.returncode == 0, done.stderr[-2000:]
    (folder,) = tmp_path.iterdir()
    assert {file.name.rpartition("-")[0] for file in folder.glob("*.nbi")} == set(SMALL)
    assert not list(folder.glob("part-*"))
    found = in_process(FOUND, *SMALL, NUMBA_CACHE_DIR=str(tmp_path))
    assert found.returncode == 0, found.stderr[-2000:]


def test_words_say_what_numba_says() -> None:
    words = {word for row in needed() for word in row.arguments}
    assert {"f", "i", "b", "f2", "f2r", "s3", "i2", "b4"} <= words
    assert all(code_of(kind_of(word)) == word for word in words)
    from numba import types

    with pytest.raises(ValueError, match="no word"):
        code_of(types.Array(types.float64, 2, "F"))


def test_only_what_is_not_there_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path / "not there yet")
    assert missing(walls=True) == list(needed())
    assert pending()
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    for row in needed():
        if row.kernel != "push_horizon.propagate" and not row.walls:
            (tmp_path / f"{row.kernel}-12.py311.nbi").touch()
    assert [row.kernel for row in missing()] == ["push_horizon.propagate"]
    assert {row.walls for row in missing(walls=True)} == {False, True}
    monkeypatch.setattr(compiling, "_cache_folder", lambda: None)  # NUMBA_DISABLE_JIT
    assert not missing(walls=True)


class Helper:
    """A process that has ended, or does not until it is told to."""

    begun: list[Helper]

    def __init__(self, returncode: int | None) -> None:
        self.returncode = returncode
        self.begun.append(self)

    def poll(self) -> int | None:
        return self.returncode

    def terminate(self) -> None:
        self.returncode = -15 if self.returncode is None else self.returncode

    def wait(self) -> None:
        assert self.returncode is not None


@pytest.fixture
def cold(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A cache with nothing in it, and three processors."""
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    monkeypatch.setattr(compiling, "processors", lambda: 3)
    monkeypatch.setattr(Helper, "begun", [], raising=False)
    return tmp_path


def test_what_failed_is_left_to_whoever_calls_it(monkeypatch: pytest.MonkeyPatch, cold: Path) -> None:
    def helper(shared: Path, name: str, rows: list[Needed]) -> Helper:
        made = shared / f"of-{name}" / "kernels"
        made.mkdir(parents=True)
        for kernel in list(dict.fromkeys(row.kernel for row in rows))[int(name) :: 3]:
            (shared / kernel).write_text(name)
            for ending in ("1.nbc", "nbi"):
                (made / f"{kernel}-7.py311.{ending}").touch()
        (made / "inner.called_by_them-7.py311.nbi").touch()
        return Helper(0 if name != "1" else 1)

    monkeypatch.setattr(compiling, "_helper", helper)
    absent = list(dict.fromkeys(row.kernel for row in missing()))
    compile_together()
    assert len(Helper.begun) == 3
    assert list(dict.fromkeys(row.kernel for row in missing())) == absent[1::3]
    assert not [file.name for file in cold.iterdir() if "part-" in file.name or "inner" in file.name]


def test_nothing_is_begun_where_it_would_gain_nothing(monkeypatch: pytest.MonkeyPatch, cold: Path) -> None:
    monkeypatch.setattr(compiling, "_helper", lambda *_: pytest.fail("a process is begun"))
    monkeypatch.setattr(compiling, "processors", lambda: 1)
    compile_together()
    monkeypatch.setattr(compiling, "processors", lambda: 2)
    for row in needed():
        (cold / f"{row.kernel}-12.py311.nbi").touch()
    compile_together(walls=True)


@pytest.mark.parametrize(("program", "some"), [("/usr/bin/python3.11", True), ("/opt/app/viewer", False), ("", False)])
def test_a_program_that_embeds_python_is_not_started_again(
    monkeypatch: pytest.MonkeyPatch, program: str, some: bool
) -> None:
    monkeypatch.setattr(compiling.os, "sched_getaffinity", lambda _: {0, 1, 2}, raising=False)
    monkeypatch.setattr(compiling.sys, "executable", program)
    assert (compiling.helpers_at_most() > 1) == some


def test_whoever_interrupts_ends_the_processes(monkeypatch: pytest.MonkeyPatch, cold: Path) -> None:
    monkeypatch.setattr(compiling, "_helper", lambda *_: Helper(None))

    def interrupted(share: float) -> None:
        assert share == 0.0
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        compile_together(tell=interrupted)
    assert [helper.returncode for helper in Helper.begun] == [-15] * 3
    assert not list(cold.iterdir())


def test_without_processes_everything_is_compiled_later(monkeypatch: pytest.MonkeyPatch, cold: Path) -> None:
    def helper(*_: object) -> Helper:
        if Helper.begun:
            raise OSError("no more processes")
        return Helper(None)

    monkeypatch.setattr(compiling, "_helper", helper)
    compile_together()
    assert [helper.returncode for helper in Helper.begun] == [-15]
    assert not list(cold.iterdir())


def test_what_was_left_of_a_killed_run_goes(monkeypatch: pytest.MonkeyPatch, cold: Path) -> None:
    for name, age in (("part-old", 7200.0), ("part-young", 60.0)):
        (cold / name / "of-0").mkdir(parents=True)
        past = (cold / name).stat().st_mtime - age
        os.utime(cold / name, (past, past))
    monkeypatch.setattr(compiling, "_helper", lambda *_: Helper(0))
    compile_together()
    assert [path.name for path in cold.iterdir()] == ["part-young"]


def test_the_planner_says_once_what_takes_so_long(cold: Path, caplog: pytest.LogCaptureFixture) -> None:
    compiling.announce.cache_clear()
    with caplog.at_level(logging.WARNING):
        compiling.announce(walls=False)
        compiling.announce(walls=False)
    assert [record.message[:32] for record in caplog.records] == ["compiling the inner loops, once:"]
    for row in needed():
        (cold / f"{row.kernel}-12.py311.nbi").touch()
    compiling.announce.cache_clear()
    compiling.announce(walls=True)
    assert len(caplog.records) == 1


def test_commands_say_it_before_they_begin(
    monkeypatch: pytest.MonkeyPatch, cold: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    begun: list[bool] = []
    monkeypatch.setattr(compiling, "compile_together", lambda *, walls, tell=None: begun.append(walls))
    with bars.progress_bar("work"):
        assert begun == [False]
    assert capsys.readouterr().err == "compiling the inner loops, once, on 3 processors: about a minute\n"
    for row in needed():
        (cold / f"{row.kernel}-12.py311.nbi").touch()
    bars.first_time(walls=True)
    assert begun == [False]
    assert not capsys.readouterr().err
