"""Many independent pieces of work on one core, on all cores, or on a Ray cluster: the same results from each."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Callable, Generator, Hashable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker
from typing import Any, Protocol, TypeVar

from sidestep.checks import counted
from sidestep.compiling import processors
from sidestep.errors import InvalidInput, MissingExtra, SidestepError

Piece = TypeVar("Piece")
Result = TypeVar("Result")
ATTEMPTS = 3  # at a piece whose worker was killed, or in a row at which none was finished


class WorkersLost(SidestepError):  # noqa: N818 (reads as a sentence where it is caught)
    """Workers were killed again and again; what was finished is kept, and the same command goes on from there."""

    def __init__(self, left: int) -> None:
        self.left = left
        super().__init__(
            f"workers: killed {ATTEMPTS} times in a row, with {left} pieces of work left; "
            "what is done is kept: run the same command again, with fewer --workers if memory is short"
        )


class Store(Protocol):
    """Where finished pieces are kept."""

    def load(self, name: str) -> Any | None:
        """Return what was kept under `name`, or None."""
        ...

    def keep(self, name: str, content: Any) -> None:
        """Keep `content` under `name`."""
        ...


class Named(Protocol):
    """A piece of work with a name of its own, under which its result is kept."""

    @property
    def name(self) -> str:
        """Unique among the pieces of a study."""
        ...


class Span(Protocol):
    """Consecutive episodes start … stop − 1."""

    @property
    def start(self) -> int: ...  # noqa: D102

    @property
    def stop(self) -> int: ...  # noqa: D102


NamedPiece = TypeVar("NamedPiece", bound=Named)


def length(piece: Span) -> int:
    """Return how many episodes a piece has."""
    return piece.stop - piece.start


def run_kept(
    work: Callable[[Sequence[NamedPiece]], Sequence[tuple[NamedPiece, Any]]],
    pieces: Sequence[NamedPiece],
    *,
    store: Store | None,
    size: Callable[[NamedPiece], int],
    together: Callable[[NamedPiece], Hashable] | None = None,
    workers: int = 1,
    engine: str = "joblib",
    address: str | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]:
    """Run the pieces that are not in the store, keep each as it is finished, and return all results by name.

    Args:
        work: as for `run_pieces`, of a group of pieces; returns each piece and what can be written as JSON. See `each`.
        pieces: independent of each other, each with a name of its own.
        store: where finished pieces are kept and looked for.
        size: how much of the work a piece is, for `progress`.
        together: pieces for which this is equal are one group; None: each is worked at by itself.
        workers: and what follows as for `run_pieces`.
        engine: likewise.
        address: likewise.
        progress: called with (done, all) in units of `size`, after each piece.

    Raises:
        InvalidInput, MissingExtra, WorkersLost: as `run_pieces`.
    """
    _check(engine, address)
    found: dict[str, Any] = {}
    left: dict[Hashable, list[NamedPiece]] = {}
    for piece in pieces:
        kept = None if store is None else store.load(piece.name)
        if kept is not None:
            found[piece.name] = kept
        else:
            left.setdefault(piece.name if together is None else together(piece), []).append(piece)
    everything = sum(map(size, pieces))
    done = everything - sum(size(piece) for group in left.values() for piece in group)
    for finished in run_pieces(work, list(left.values()), workers=workers, engine=engine, address=address):
        for piece, result in finished:
            found[piece.name] = result
            if store is not None:
                store.keep(piece.name, result)
            done += size(piece)
            if progress is not None:
                progress(done, everything)
    return found


def each(
    work: Callable[[NamedPiece], tuple[NamedPiece, Any]],
) -> Callable[[Sequence[NamedPiece]], Sequence[tuple[NamedPiece, Any]]]:
    """Return the work on a group of pieces that is `work` on one after another."""
    return partial(_one_by_one, work)


def _one_by_one(
    work: Callable[[NamedPiece], tuple[NamedPiece, Any]], group: Sequence[NamedPiece]
) -> list[tuple[NamedPiece, Any]]:
    return [work(piece) for piece in group]


def processes(workers: int | None) -> int:
    """Return how many processes to use: as asked for, or as many as this one may have cores.

    Raises:
        InvalidInput: fewer than one is asked for.
    """
    if workers is None:
        return processors()
    return counted("workers", workers, most=1024, mend="leave it out to use all cores")


def run_pieces(
    work: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    *,
    workers: int = 1,
    engine: str = "joblib",
    address: str | None = None,
) -> Iterator[Result]:
    """Yield the results as they come, in any order; a result must say to which piece it belongs.

    Args:
        work: a function at module level, so that workers can import it.
        pieces: independent of each other.
        workers: processes; 1 works in this one.
        engine: "joblib" (this machine) or "ray" (a cluster, or this machine).
        address: of the Ray cluster; None starts one here.

    Raises:
        InvalidInput: there is no such engine, or it has no cluster at an address.
        MissingExtra: the engine is not installed.
        WorkersLost: workers were killed `ATTEMPTS` times before any piece was finished.
    """
    workers = processes(workers)
    _check(engine, address)
    if engine == "ray":
        yield from _with_ray(work, pieces, workers, address)
    elif workers == 1:
        yield from map(work, pieces)
    else:
        yield from _with_joblib(work, pieces, workers)


def _check(engine: str, address: str | None) -> None:
    if engine not in ("joblib", "ray"):
        raise InvalidInput("engine", engine, "joblib or ray")
    if address is not None and engine != "ray":
        raise InvalidInput("address", address, "only together with the engine ray")


def _with_joblib(work: Callable[[Piece], Result], pieces: Sequence[Piece], workers: int) -> Iterator[Result]:
    try:
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError
    except ImportError:
        raise MissingExtra("more than one worker", "studies") from None
    left, attempts = list(range(len(pieces))), 0
    while attempts < ATTEMPTS:
        done: set[int] = set()
        jobs = (delayed(_numbered)(work, i, pieces[i]) for i in left)
        try:
            pool: Any = Parallel(n_jobs=workers, return_as="generator_unordered")
            with _uninterrupted():
                results = pool(jobs)
            for i, result in results:
                done.add(i)
                yield result
        except TerminatedWorkerError:  # a worker was killed; the others' unfinished pieces are lost with it
            left = [i for i in left if i not in done]
            attempts = 0 if done else attempts + 1
            continue
        return
    raise WorkersLost(len(left))


@contextmanager
def _uninterrupted() -> Generator[None]:
    """Hold Ctrl-C back while workers are started, and from them for good: this process answers it, and ends them."""
    resource_tracker.ensure_running()  # it would be started with the first worker, and let Ctrl-C through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _with_ray(
    work: Callable[[Piece], Result], pieces: Sequence[Piece], workers: int, address: str | None
) -> Iterator[Result]:
    try:
        import ray  # pyright: ignore[reportMissingImports]
        from ray.exceptions import WorkerCrashedError  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise MissingExtra("--engine ray", "ray") from None
    mine = not ray.is_initialized()
    if mine:
        start_ray(ray, workers, address)
    try:
        remote: Any = ray.remote(max_retries=ATTEMPTS)(_numbered)
        waiting = [remote.remote(work, i, piece) for i, piece in enumerate(pieces)]
        while waiting:
            ready, waiting = ray.wait(waiting, num_returns=1)
            try:
                found = ray.get(ready)
            except WorkerCrashedError:
                raise WorkersLost(len(waiting) + 1) from None
            for _, result in found:
                yield result
    finally:
        if mine:
            ray.shutdown()


def start_ray(ray: Any, workers: int, address: str | None) -> None:
    """Join the cluster at `address`, or start one of `workers` processes here that reports to nobody."""
    if address is not None:
        ray.init(address=address, log_to_driver=False)
        return
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)


def _numbered(work: Callable[[Piece], Result], number: int, piece: Piece) -> tuple[int, Result]:
    result = work(piece)
    gc.freeze()  # what is loaded by now stays; looking through it again and again took a tenth of the time
    return number, result
