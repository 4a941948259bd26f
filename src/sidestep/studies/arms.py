"""Studies with a few arms: the same seeded episodes with something and without it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sidestep.checks import counted, one_of, seeded
from sidestep.studies.engines import Store, each, length, run_kept
from sidestep.types import FloatArray

Row = dict[str, float]
Episode = Callable[[int], Row]
"""(seed) → numbers of one episode; NaN where there is no such thing."""


Columns = Mapping[str, Mapping[str, FloatArray]]
"""Arm → column → (E,) numbers of its episodes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A question, and the arms that answer it.

    Attributes:
        name, title: for commands and tables.
        lead: what is compared, in a few sentences.
        arms: name of an arm → its episode.
        episodes: of each arm, unless asked otherwise; controls: arms of which a tenth is enough, and not paired.
        piece: episodes that are done, kept and lost together.
        header, rows: of the table; rows from the numbers of every arm.
        remarks: (numbers) → what must be said beside the table.
        measured: (workers) → remarks on this machine, found by running something once more; None: nothing.
    """

    name: str
    title: str
    lead: str
    arms: Mapping[str, Episode]
    header: tuple[str, ...]
    rows: Callable[[Columns], list[list[Any]]]
    remarks: Callable[[Columns], list[str]]
    episodes: int
    piece: int = 20
    controls: frozenset[str] = frozenset()
    measured: Callable[[int], list[str]] | None = None

    def count(self, arm: str, episodes: int) -> int:
        """Return how many of `episodes` an arm gets."""
        return -(-episodes // 10) if arm in self.controls else episodes


@dataclass(frozen=True, slots=True)
class ArmPiece:
    """Episodes `start` … `stop` − 1 of one arm of one study."""

    study: str
    arm: str
    start: int
    stop: int
    seed: int

    @property
    def name(self) -> str:
        """What it is kept under."""
        return f"{self.study}--{self.arm}--{self.seed}--{self.start}-{self.stop}"


def studies() -> Mapping[str, Study]:
    """Return all studies by name."""
    from sidestep.studies.brakes import BRAKES
    from sidestep.studies.filtering import FILTER
    from sidestep.studies.hidden_goals import HIDDEN_GOALS
    from sidestep.studies.lab_proof import LAB, LAB_MUJOCO
    from sidestep.studies.robots import ROBOTS
    from sidestep.studies.scale import SCALE
    from sidestep.studies.signalling import SIGNAL

    return {study.name: study for study in (ROBOTS, FILTER, SIGNAL, HIDDEN_GOALS, LAB, LAB_MUJOCO, SCALE, BRAKES)}


def run_study(
    name: str,
    *,
    episodes: int | None = None,
    seed: int = 0,
    workers: int = 1,
    engine: str = "joblib",
    address: str | None = None,
    store: Store | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, dict[str, FloatArray]]:
    """Run a study; the numbers depend on name and seed alone, not on workers or interruptions.

    Args:
        name: of `studies()`.
        episodes: per arm; None: as many as the study asks for.
        seed: added to the episodes' numbers.
        workers, engine, address: see `run_pieces`.
        store: where finished pieces are kept and looked for.
        progress: called with (episodes done, all episodes).

    Returns:
        arm → column → (E,).

    Raises:
        UnknownName: there is no such study.
    """
    one_of("study", [name], studies())
    study = studies()[name]
    count = counted("episodes", study.episodes if episodes is None else episodes)
    seeded("seed", seed)
    pieces = [
        ArmPiece(name, arm, k, min(k + study.piece, study.count(arm, count)), seed)
        for k in range(0, count, study.piece)
        for arm in study.arms
        if k < study.count(arm, count)
    ]
    found = run_kept(
        each(work), pieces, store=store, size=length, workers=workers, engine=engine, address=address, progress=progress
    )
    return {arm: _columns([row for p in pieces if p.arm == arm for row in found[p.name]]) for arm in study.arms}


def work(piece: ArmPiece) -> tuple[ArmPiece, list[dict[str, float | None]]]:
    """Run one piece; what comes back can be written as JSON."""
    episode = studies()[piece.study].arms[piece.arm]
    rows = [episode(piece.seed + number) for number in range(piece.start, piece.stop)]
    return piece, [{k: None if np.isnan(v) else float(v) for k, v in row.items()} for row in rows]


def _columns(rows: list[dict[str, Any]]) -> dict[str, FloatArray]:
    return {name: np.array([row[name] for row in rows], dtype=np.float64) for name in rows[0]}
