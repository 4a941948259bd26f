"""The same studies on a Ray cluster: same results, killed workers replaced, interrupted studies taken up again."""

import os
import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from sidestep.io.checkpoints import Checkpoints
from sidestep.studies.engines import WorkersLost, each, length, run_kept, run_pieces
from sidestep.studies.evaluate import Piece, evaluate, work

pytestmark = pytest.mark.slow
CONDITIONS, NAVIGATORS = ("straight-robot-faster", "half-random-2hz"), ("stop-and-go",)


@pytest.fixture(scope="module", autouse=True)
def cluster():
    ray = pytest.importorskip("ray")
    from sidestep.studies.engines import start_ray

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)  # workers import what is below
        start_ray(ray, 2, None)
        yield
        ray.shutdown()


def square_once_killed(piece):
    """The first worker to take piece 3 dies as if the system had killed it."""
    x, marker = piece
    if x == 3 and not Path(marker).exists():
        Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x, x * x


@dataclass(frozen=True)
class Deadly:
    """Two episodes; whoever takes any but the first piece dies as long as the marker lies there."""

    start: int
    stop: int
    marker: str

    @property
    def name(self):
        return f"{self.start}-{self.stop}"


def episodes_unless_deadly(piece):
    if piece.start > 0 and Path(piece.marker).exists():
        os.kill(os.getpid(), signal.SIGKILL)
    asked = Piece(condition=CONDITIONS[0], navigator=NAVIGATORS[0], start=piece.start, stop=piece.stop, seed=5)
    return piece, work(asked)[1]["rows"]


def test_a_killed_worker_is_replaced(tmp_path):
    pieces = [(x, str(tmp_path / "killed")) for x in range(8)]
    assert sorted(run_pieces(square_once_killed, pieces, workers=2, engine="ray")) == [(x, x * x) for x in range(8)]
    assert (tmp_path / "killed").exists()


def test_the_numbers_are_those_of_one_process():
    one = evaluate(CONDITIONS, NAVIGATORS, episodes=3, seed=5)
    two = evaluate(CONDITIONS, NAVIGATORS, episodes=3, seed=5, workers=2, engine="ray")
    for key, batch in one.batches.items():
        np.testing.assert_array_equal(batch.values, two.batches[key].values)


def test_a_study_whose_workers_were_killed_goes_on_where_it_was(tmp_path):
    marker, store = tmp_path / "deadly", Checkpoints(tmp_path / "pieces")
    marker.touch()
    pieces = [Deadly(k, k + 2, str(marker)) for k in (0, 2, 4)]
    with pytest.raises(WorkersLost, match="run the same command again"):
        run_kept(each(episodes_unless_deadly), pieces, store=store, size=length, workers=1, engine="ray")
    assert store.load("0-2") is not None  # what was finished is kept
    assert store.load("2-4") is None
    marker.unlink()
    told = []
    found = run_kept(
        each(episodes_unless_deadly), pieces, store=store, size=length, workers=2, engine="ray",
        progress=lambda *so_far: told.append(so_far),
    )  # fmt: skip
    assert len(told) == 2  # the first piece was not run again
    rows = [row for piece in pieces for row in found[piece.name]]
    plain = evaluate(CONDITIONS[:1], NAVIGATORS, episodes=6, seed=5).batches[CONDITIONS[0], NAVIGATORS[0]].values
    np.testing.assert_array_equal(np.array(rows, dtype=np.float64), plain)
