"""Sections IV and V of the paper, claim by claim: which points are run, and how."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.simulation.alike import planned_alike
from sidestep.simulation.scenario import Scenario
from sidestep.studies.engines import Store, length, run_kept
from sidestep.studies.paper_points import COLUMNS, WIDTHS, Change, Setting, Trial, run_trials
from sidestep.types import FloatArray

PARAMETERS = ("printed", "authors")
RULES = ("cells", "mass")
HUMANS = ("concerned", "unconcerned")
HORIZONS = tuple(range(1, 11))
LAB_HORIZON = 2  # N_R of Section V
SWEEP_HORIZONS = (1, 4, 5, 7, 10)  # those that claims name; a whole curve at every place would take an hour
PIECE = 20  # seeds that are done, kept and lost together


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where in the space of parameters a claim is judged: a parameter set, a risk rule, and what differs from the set.

    Attributes:
        parameters: "printed" or "authors"; rule: "cells" or "mass".
        changes: what differs from the set.
        horizons: of the curves over the horizon.
    """

    parameters: str
    rule: str
    changes: tuple[Change, ...] = ()
    horizons: tuple[int, ...] = HORIZONS

    @property
    def words(self) -> str:
        """What differs from the parameter set."""
        return ", ".join(c.words for c in self.changes)

    def encounter(self, horizon: int, anticipation: int, human: str = "concerned") -> Setting:
        """Return a point of Section IV."""
        return self._setting(f"paper-{self.parameters}", human, horizon, anticipation)

    def lab(self, human: str) -> Setting:
        """Return a point of Section V: as printed, or with the authors' weights the variant in which the two meet."""
        label = "lab-printed" if self.parameters == "printed" else "lab-meeting"
        return self._setting(label, human, LAB_HORIZON, LAB_HORIZON)

    def settings(self) -> list[Setting]:
        """Return every point: Section IV over the horizon, with and without anticipation, and Section V."""
        section_four = [self.encounter(n, ahead, h) for h in HUMANS for n in self.horizons for ahead in (0, n)]
        return section_four + [self.lab(h) for h in HUMANS]

    def _setting(self, label: str, human: str, horizon: int, anticipation: int) -> Setting:
        return Setting(
            label=label,
            rule=self.rule,
            human=human,
            horizon=horizon,
            anticipation=anticipation,
            changes=self.changes,
        )


PLACES = tuple(Place(parameters=p, rule=r) for p in PARAMETERS for r in RULES)
"""Where every claim is judged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Some consecutive seeds of one setting.

    Attributes:
        setting: the point; scenario: all of its numbers; start, stop: seeds start … stop − 1.
        widths: whether the columns `WIDTHS` are measured, too.
    """

    setting: Setting
    scenario: Scenario
    start: int
    stop: int
    widths: bool

    @property
    def name(self) -> str:
        """What it is kept under, with a digest of all numbers of its scenario: no other one is taken for it."""
        numbers = json.dumps(self.scenario.settings(), sort_keys=True).encode()
        what = f"{self.setting.name}--{self.start}-{self.stop}{'--widths' if self.widths else ''}"
        return f"{what}--{hashlib.sha256(numbers).hexdigest()[:12]}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """What was run: setting → (seeds, len(COLUMNS)) numbers."""

    values: Mapping[Setting, FloatArray]

    def column(self, setting: Setting, name: str) -> FloatArray:
        """(seeds,) one number."""
        return self.values[setting][:, COLUMNS.index(name)]

    def have(self, settings: Iterable[Setting]) -> bool:
        """Whether all of these were run."""
        return all(s in self.values for s in settings)


def sweep(rule: str = "cells") -> list[Place]:
    """Return the neighbourhood of the authors' values: danger weight and rate, ω_H, and the speeds of both agents."""
    around: list[tuple[Change, ...]] = [
        (Change("human.danger_weight", w), Change("human.danger_rate", r))
        for w in (2.5, 25.0, 100.0, 400.0)
        for r in (0.008, 0.06, 0.3)
    ]
    around += [(Change("human.randomness", w),) for w in (0.05, 0.1, 0.5, 1.0)]
    around += [
        (Change("human.walking_speed", v, times=True), Change("robot.max_speed", u, times=True))
        for v in (0.5, 1.0, 1.5)
        for u in (0.5, 1.0, 1.5)
        if (v, u) != (1.0, 1.0)
    ]
    return [Place(parameters="authors", rule=rule, changes=c, horizons=SWEEP_HORIZONS) for c in around]


def run_points(
    settings: Sequence[Setting],
    bases: Mapping[str, Scenario],
    *,
    columns: Mapping[Setting, Collection[str]],
    seeds: int,
    workers: int,
    store: Store | None,
    progress: Callable[[int, int], object] | None = None,
) -> Points:
    """Run `seeds` seeds of every setting; finished pieces are kept in `store` and not run again.

    Args:
        settings: points.
        bases: label → scenario.
        columns: setting → what is asked of it; how wide predictions are is measured only where that is.
        seeds: per point.
        workers: processes.
        store: of finished pieces.
        progress: called with (seeds done, all seeds).
    """
    pieces = [
        Piece(
            setting=s,
            scenario=s.scenario(bases[s.label]),
            start=k,
            stop=min(k + PIECE, seeds),
            widths=not WIDTHS.isdisjoint(columns.get(s, ())),
        )
        for s in settings
        for k in range(0, seeds, PIECE)
    ]
    found = run_kept(_work, pieces, store=store, size=length, together=_alike, workers=workers, progress=progress)
    gathered: dict[Setting, list[FloatArray]] = {s: [] for s in settings}
    for piece in pieces:
        gathered[piece.setting].append(np.array(found[piece.name], dtype=np.float64))
    return Points(values={s: np.concatenate(rows) for s, rows in gathered.items()})


def _alike(piece: Piece) -> tuple[str, int]:
    """A planner cannot tell whom it will meet: both kinds of people are run at once."""
    return planned_alike(piece.scenario), piece.start


def _work(group: Sequence[Piece]) -> list[tuple[Piece, list[list[float]]]]:
    trials = [
        Trial(scenario=piece.scenario.model_copy(update={"seed": seed}), widths=piece.widths)
        for piece in group
        for seed in range(piece.start, piece.stop)
    ]
    rows = iter(run_trials(trials))
    return [(piece, [next(rows) for _ in range(length(piece))]) for piece in group]
