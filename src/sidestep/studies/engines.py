"""Many independent pieces of work on one core, on all cores, or on a Ray cluster: the same results from each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from sidestep.errors import InvalidInput, MissingExtra, SidestepError

Piece = TypeVar("Piece")
Result = TypeVar("Result")
ATTEMPTS = 3  # at a piece whose worker was killed


class WorkersLost(SidestepError):  # noqa: N818 (reads as a sentence where it is caught)
    """Workers were killed again and again; what was finished is kept, and the same command goes on from there."""

    def __init__(self, left: int) -> None:
        self.left = left
        super().__init__(
            f"workers: killed {ATTEMPTS} times with {left} pieces of work left; "
            "what is done is kept: run the same command again, with fewer --workers if memory is short"
        )


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
        MissingExtra: the engine is not installed.
        WorkersLost: workers were killed more than three times in a row.
    """
    if workers < 1:
        raise InvalidInput("workers", workers, "an integer ≥ 1")
    if engine == "ray":
        yield from _with_ray(work, pieces, workers, address)
    elif engine != "joblib":
        raise InvalidInput("engine", engine, "joblib or ray")
    elif workers == 1:
        yield from map(work, pieces)
    else:
        yield from _with_joblib(work, pieces, workers)


def _with_joblib(work: Callable[[Piece], Result], pieces: Sequence[Piece], workers: int) -> Iterator[Result]:
    try:
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError
    except ImportError:
        raise MissingExtra("more than one worker", "studies") from None
    left = list(range(len(pieces)))
    for _ in range(ATTEMPTS):
        done: set[int] = set()
        jobs = (delayed(_numbered)(work, i, pieces[i]) for i in left)
        try:
            pool: Any = Parallel(n_jobs=workers, return_as="generator_unordered")
            for i, result in pool(jobs):
                done.add(i)
                yield result
        except TerminatedWorkerError:  # a worker was killed; the others' unfinished pieces are lost with it
            left = [i for i in left if i not in done]
            continue
        return
    raise WorkersLost(len(left))


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
        local: dict[str, Any] = {} if address else {"num_cpus": workers, "include_dashboard": False}
        ray.init(address=address, log_to_driver=False, **local)
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


def _numbered(work: Callable[[Piece], Result], number: int, piece: Piece) -> tuple[int, Result]:
    return number, work(piece)
