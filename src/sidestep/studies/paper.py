"""Sections IV and V of the paper, claim by claim: which points are run, and how."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.simulation.scenario import Scenario
from sidestep.studies.engines import Store, length, run_kept
from sidestep.studies.paper_points import COLUMNS, Setting, run_seed
from sidestep.types import FloatArray

PARAMETERS = ("printed", "authors")
RULES = ("cells", "mass")
HUMANS = ("concerned", "unconcerned")
HORIZONS = tuple(range(1, 11))
LAB_HORIZON = 2  # N_R of Section V
SWEEP = {"danger_weight": (2.5, 25.0, 100.0, 400.0), "danger_rate": (0.008, 0.06, 0.3), "randomness": (0.1, 0.2, 0.5)}
"""Values tried where a claim fails under both parameter sets."""
PIECE = 20  # seeds that are done, kept and lost together


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Some consecutive seeds of one setting.

    Attributes:
        setting: the point; scenario: all of its numbers; start, stop: seeds start … stop − 1.
    """

    setting: Setting
    scenario: Scenario
    start: int
    stop: int

    @property
    def name(self) -> str:
        """What it is kept under."""
        return f"{self.setting.name}--{self.start}-{self.stop}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Points:
    """What was run: setting → (seeds, len(COLUMNS)) numbers."""

    values: Mapping[Setting, FloatArray]

    def column(self, setting: Setting, name: str) -> FloatArray:
        """(seeds,) one number."""
        return self.values[setting][:, COLUMNS.index(name)]


def section_four() -> list[Setting]:
    """Every horizon, with and without anticipation, both kinds of people, both rules, both parameter sets."""
    return [
        Setting(label=f"paper-{p}", rule=rule, human=human, horizon=n, anticipation=ahead)
        for p in PARAMETERS
        for rule in RULES
        for human in HUMANS
        for n in HORIZONS
        for ahead in (0, n)
    ]


def section_five() -> list[Setting]:
    """The lab: as printed, and the variant in which the two do meet with the authors' weights."""
    return [
        Setting(label=label, rule=rule, human=human, horizon=LAB_HORIZON, anticipation=LAB_HORIZON)
        for label in ("lab-printed", "lab-meeting")
        for rule in RULES
        for human in HUMANS
    ]


def sweep(rule: str = "cells") -> list[Setting]:
    """The neighbourhood of the authors' values, one field at a time and danger weight against rate, N_R = 5."""
    grid: list[tuple[tuple[str, float], ...]] = [
        (("danger_weight", w), ("danger_rate", r)) for w in SWEEP["danger_weight"] for r in SWEEP["danger_rate"]
    ]
    grid += [(("randomness", w),) for w in SWEEP["randomness"]]
    return [
        Setting(label="paper-authors", rule=rule, human=human, horizon=5, anticipation=ahead, changes=changes)
        for changes in grid
        for human in HUMANS
        for ahead in ((0, 5) if human == "concerned" else (5,))
    ]


def run_points(
    settings: Sequence[Setting],
    bases: Mapping[str, Scenario],
    *,
    seeds: int,
    workers: int,
    store: Store | None,
    progress: Callable[[int, int], object] | None = None,
) -> Points:
    """Run `seeds` seeds of every setting; finished pieces are kept in `store` and not run again.

    Args:
        settings: points.
        bases: label → scenario.
        seeds: per point.
        workers: processes.
        store: of finished pieces.
        progress: called with (seeds done, all seeds).
    """
    pieces = [
        Piece(setting=s, scenario=s.scenario(bases[s.label]), start=k, stop=min(k + PIECE, seeds))
        for s in settings
        for k in range(0, seeds, PIECE)
    ]
    found = run_kept(_work, pieces, store=store, size=length, workers=workers, progress=progress)
    gathered: dict[Setting, list[FloatArray]] = {s: [] for s in settings}
    for piece in pieces:
        gathered[piece.setting].append(np.array(found[piece.name], dtype=np.float64))
    return Points(values={s: np.concatenate(rows) for s, rows in gathered.items()})


def _work(piece: Piece) -> tuple[Piece, list[list[float]]]:
    return piece, [run_seed(piece.scenario, seed) for seed in range(piece.start, piece.stop)]
