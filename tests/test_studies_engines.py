"""Any number of workers gives the same; a killed worker costs time, not results."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from sidestep.errors import InvalidInput, MissingExtra
from sidestep.io.checkpoints import Checkpoints
from sidestep.studies.engines import WorkersLost, each, length, processes, run_kept, run_pieces


def square(x):
    return x, x * x


def square_once_killed(piece):
    """The first worker to take piece 3 dies as if the system had killed it."""
    x, marker = piece
    if x == 3 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x, x * x


def now_and_then_killed(piece):
    """Every fifth piece is killed the first time, after a while in which others are finished."""
    x, folder = piece
    marker = Path(folder) / str(x)
    if x % 5 == 4 and not marker.exists():
        time.sleep(0.3)
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x, x * x


def always_killed(x):
    os.kill(os.getpid(), signal.SIGKILL)


def holds_back(number):
    return number in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.parametrize("workers", [1, 2])
def test_all_pieces_are_done_once(workers):
    pytest.importorskip("joblib")
    assert sorted(run_pieces(square, list(range(20)), workers=workers)) == [(x, x * x) for x in range(20)]


def test_ctrl_c_is_answered_by_who_began_the_workers_alone():
    """A terminal tells it to all of them; whichever was importing something wrote a traceback of its own."""
    pytest.importorskip("joblib")
    assert all(run_pieces(holds_back, [signal.SIGINT] * 4, workers=2))
    assert not holds_back(signal.SIGINT)


@pytest.mark.slow
def test_a_killed_worker_is_replaced(tmp_path):
    pytest.importorskip("joblib")
    pieces = [(x, str(tmp_path / "killed")) for x in range(12)]
    found = sorted(run_pieces(square_once_killed, pieces, workers=2))
    assert (tmp_path / "killed").exists()
    assert found == [(x, x * x) for x in range(12)]


@pytest.mark.slow
def test_workers_that_die_now_and_then_do_not_end_a_long_run(tmp_path):
    pytest.importorskip("joblib")
    pieces = [(x, str(tmp_path)) for x in range(50)]
    assert sorted(run_pieces(now_and_then_killed, pieces, workers=2)) == [(x, x * x) for x in range(50)]
    assert len(list(tmp_path.iterdir())) == 10


@pytest.mark.slow
def test_workers_that_die_again_and_again_are_reported():
    pytest.importorskip("joblib")
    with pytest.raises(WorkersLost, match="run the same command again"):
        list(run_pieces(always_killed, [1, 2, 3], workers=2))


def test_no_worker_is_not_taken_for_all_of_them():
    assert processes(3) == 3
    assert processes(None) >= 1
    with pytest.raises(InvalidInput, match="workers: got 0; allowed: an integer ≥ 1 and ≤ 1024; leave it out"):
        processes(0)


def test_bad_requests_are_named():
    with pytest.raises(InvalidInput, match="workers"):
        list(run_pieces(square, [1], workers=0))
    with pytest.raises(InvalidInput, match="engine"):
        list(run_pieces(square, [1], engine="dask"))


@pytest.mark.parametrize(("module", "engine", "extra"), [("joblib", "joblib", "studies"), ("ray", "ray", "ray")])
def test_a_missing_engine_names_its_extra(monkeypatch, module, engine, extra):
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MissingExtra, match=extra):
        list(run_pieces(square, [1], workers=2, engine=engine))


def test_checkpoints_return_what_was_kept(tmp_path):
    kept = Checkpoints(tmp_path / "deep" / "folder")
    assert kept.load("a/b c") is None
    kept.keep("a/b c", {"rows": [[1.0, None]]})
    assert kept.load("a/b c") == {"rows": [[1.0, None]]}
    assert Checkpoints(tmp_path / "deep" / "folder").load("a/b c") == {"rows": [[1.0, None]]}


def test_checkpoints_of_another_program_or_torn_files_do_not_count(tmp_path):
    kept = Checkpoints(tmp_path)
    kept.keep("a", 1)
    file = next(tmp_path.glob("*.json"))
    whole = file.read_text()
    file.write_text(whole[: len(whole) // 2])
    assert kept.load("a") is None
    file.write_text(whole.replace('"program": "', '"program": "x'))
    assert kept.load("a") is None


@dataclass(frozen=True)
class Numbers:
    start: int
    stop: int

    @property
    def name(self):
        return f"{self.start}-{self.stop}"


def squares(piece):
    return piece, [x * x for x in range(piece.start, piece.stop)]


def test_what_is_kept_is_not_done_again(tmp_path):
    pieces, store, told = [Numbers(k, k + 3) for k in (0, 3, 6)], Checkpoints(tmp_path), []
    store.keep("3-6", ["kept"])
    found = run_kept(each(squares), pieces, store=store, size=length, progress=lambda *so_far: told.append(so_far))
    assert found == {"0-3": [0, 1, 4], "3-6": ["kept"], "6-9": [36, 49, 64]}
    assert told == [(6, 9), (9, 9)]
    assert store.load("6-9") == [36, 49, 64]
    assert run_kept(each(squares), pieces[:1], store=None, size=length) == {"0-3": [0, 1, 4]}


def counted(group):
    return [(piece, [len(group)] * length(piece)) for piece in group]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_is_left_of_a_group_is_worked_at_together_and_kept_apart(tmp_path, workers):
    pytest.importorskip("joblib")
    pieces = [Numbers(k, k + 1) for k in range(5)]
    store, told = Checkpoints(tmp_path), []
    for name in ("1-2", "3-4"):
        store.keep(name, ["kept"])
    found = run_kept(
        counted, pieces, store=store, size=length, workers=workers,
        together=lambda piece: piece.start if piece.start > 2 else "first",
        progress=lambda *so_far: told.append(so_far),
    )  # fmt: skip
    assert found == {"0-1": [2], "1-2": ["kept"], "2-3": [2], "3-4": ["kept"], "4-5": [1]}
    assert told == [(3, 5), (4, 5), (5, 5)]
    assert store.load("2-3") == [2]
