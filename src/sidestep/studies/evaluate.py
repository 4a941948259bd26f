"""Many episodes: every condition, every navigator, the same seeds; rates with exact intervals, paired tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sidestep.checks import counted, one_of, seeded
from sidestep.errors import InvalidInput
from sidestep.studies.conditions import conditions
from sidestep.studies.engines import Store, each, length, run_kept
from sidestep.studies.episode import columns, histogram, run_episode
from sidestep.studies.opponents import contestants
from sidestep.types import FloatArray

PIECE = 20  # episodes that are done, kept and lost together


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Some consecutive episodes of one condition and one navigator.

    Attributes:
        condition, navigator: names.
        start, stop: episodes start … stop − 1.
        seed: base of all seeds.
    """

    condition: str
    navigator: str
    start: int
    stop: int
    seed: int

    @property
    def name(self) -> str:
        """What it is kept under."""
        return f"{self.condition}--{self.navigator}--{self.seed}--{self.start}-{self.stop}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Batch:
    """All episodes of one condition and one navigator.

    Attributes:
        values: (E, M) the numbers of `columns()`, one row per episode.
        times: histogram of planning times.
    """

    values: FloatArray
    times: FloatArray

    def column(self, name: str) -> FloatArray:
        """(E,) one number over the episodes."""
        return self.values[:, columns().index(name)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evaluation:
    """What was run.

    Attributes:
        batches: (condition, navigator) → batch, in the order of the table.
        seed: base of all seeds.
        skipped: (condition or navigator, why), what could not be run here.
    """

    batches: Mapping[tuple[str, str], Batch]
    seed: int
    skipped: Sequence[tuple[str, str]] = field(default_factory=tuple)


def evaluate(
    condition_names: Sequence[str],
    navigator_names: Sequence[str],
    *,
    episodes: int,
    fewer: Mapping[str, int] | None = None,
    seed: int = 0,
    workers: int = 1,
    engine: str = "joblib",
    address: str | None = None,
    store: Store | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Evaluation:
    """Run `episodes` of every condition with every navigator.

    The numbers depend on the names and the seed alone: not on the number of workers, the engine, or how often the study
    was stopped and taken up again. (Planning times are what the clock said.)

    Args:
        condition_names: of `conditions()`.
        navigator_names: of `contestants()`.
        episodes: per condition and navigator.
        fewer: condition or navigator → at most so many episodes, the first ones; "condition:NAME" or "navigator:NAME"
            where both have the name.
        seed: base of all seeds.
        workers: processes.
        engine: "joblib" or "ray".
        address: of a Ray cluster.
        store: where finished pieces are kept and looked for.
        progress: called with (episodes done, all episodes).

    Raises:
        UnknownName: there is no such condition or navigator.
        InvalidInput: `fewer` has a name that a condition and a navigator share, or a count is no integer ≥ 1.
        MissingExtra: a condition or navigator needs an optional part that is not installed.
    """
    one_of("conditions", condition_names, conditions())
    one_of("navigators", navigator_names, contestants())
    limits = {_whose(name): count for name, count in (fewer or {}).items()}
    for count in (episodes, *limits.values()):
        counted("episodes", count)
    seeded("seed", seed)
    most = {(c, n): _at_most(episodes, limits, c, n) for c in condition_names for n in navigator_names}
    pieces = [
        Piece(condition=c, navigator=n, start=k, stop=min(k + PIECE, count), seed=seed)
        for (c, n), count in most.items()
        for k in range(0, count, PIECE)
    ]
    found = run_kept(
        each(work), pieces, store=store, size=length, workers=workers, engine=engine, address=address, progress=progress
    )
    return Evaluation(batches=_batches(pieces, found), seed=seed)


def work(piece: Piece) -> tuple[Piece, dict[str, Any]]:
    """Run one piece; what comes back can be written as JSON."""
    condition, contestant = conditions()[piece.condition], contestants()[piece.navigator]
    rows: list[list[float | None]] = []
    times = np.zeros(0)
    for episode in range(piece.start, piece.stop):
        outcome, planning = run_episode(condition.scenario(episode, piece.seed), contestant)
        rows.append([None if np.isnan(v) else v for v in outcome.row()])
        times = np.concatenate([times, planning])
    return piece, {"rows": rows, "times": histogram(times).tolist()}


def _batches(pieces: Sequence[Piece], found: Mapping[str, Any]) -> dict[tuple[str, str], Batch]:
    rows: dict[tuple[str, str], list[list[float | None]]] = {}
    times: dict[tuple[str, str], FloatArray] = {}
    for piece in pieces:  # in the order of the episodes, whoever finished first
        key = (piece.condition, piece.navigator)
        rows.setdefault(key, []).extend(found[piece.name]["rows"])
        times[key] = times.get(key, 0.0) + np.array(found[piece.name]["times"], dtype=np.float64)
    return {key: Batch(values=np.array(r, dtype=np.float64), times=times[key]) for key, r in rows.items()}


def _whose(name: str) -> tuple[str, str]:
    """Return ("condition" or "navigator", its name); whichever has it, where the name does not say."""
    known: Mapping[str, Mapping[str, Any]] = {"condition": conditions(), "navigator": contestants()}
    kind, colon, plain = name.partition(":")
    if colon:
        one_of("fewer", [kind], known)
        one_of("fewer", [plain], known[kind])
        return kind, plain
    having = [kind for kind, names in known.items() if name in names]
    if len(having) > 1:
        raise InvalidInput("fewer", name, " or ".join(f"{kind}:{name}" for kind in having), "both have this name")
    one_of("fewer", [name], {**known["condition"], **known["navigator"]})
    return having[0], name


def _at_most(episodes: int, limits: Mapping[tuple[str, str], int], condition: str, navigator: str) -> int:
    named = ("condition", condition), ("navigator", navigator)
    return min([episodes, *(limits[key] for key in named if key in limits)])
