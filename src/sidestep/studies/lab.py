"""The laboratory over many rooms: who is told apart, what is touched, what it costs, how well people are tracked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from sidestep.perception.classifier import LegClassifier
from sidestep.simulation.lab import LabRun, run_lab
from sidestep.simulation.lab_room import LabSettings
from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record
from sidestep.studies.engines import run_pieces

KINDS = ("concerned", "unconcerned")
_AFTER = 1.0  # s after the last decision that mattered: one time step to act, one to be seen acting


@dataclass(frozen=True, slots=True, kw_only=True)
class LabOutcome:
    """One run of the laboratory in numbers.

    Attributes:
        human: kind of the person who crosses; seed: of the room.
        contacts_moving, contacts_standing: as in `simulation.metrics`; bumped: s of contact with furniture (MuJoCo).
        reached: the robot came to its goal, in the frame of its odometry; time_to_goal: s, NaN where it did not.
        min_distance: m, between the true centres, of anybody.
        had_to_react: decisions in which awareness made a difference.
        belief: P(concerned) when the last of these had been seen, NaN where nobody was tracked then.
        PI_R: Σ‖x − g‖², m².
        plans: made; planner_hz: rate at which they were: the wanted one, unless planning took longer than its period.
        plan_ms: mean time per plan; scan_hz: rate of the scans that arrived; scan_age: s, mean, when planning.
        drift: m, error of the odometry in the end.
        truths, matches, false_positives, id_switches, squared_error: CLEAR MOT of the people as told to the planner;
            squared_error in m², summed over the matches.
    """

    human: str
    seed: int
    contacts_moving: int
    contacts_standing: int
    bumped: float
    reached: bool
    time_to_goal: float
    min_distance: float
    had_to_react: int
    belief: float
    PI_R: float
    plans: int
    planner_hz: float
    plan_ms: float
    scan_hz: float
    scan_age: float
    drift: float
    truths: int
    matches: int
    false_positives: int
    id_switches: int
    squared_error: float

    @property
    def told_apart(self) -> bool:
        """Whether the belief was on the right side."""
        return self.belief > 0.5 if self.human == "concerned" else self.belief < 0.5


def lab_study(
    settings: LabSettings,
    *,
    seeds: int,
    workers: int = 1,
    classifier: LegClassifier | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[list[LabOutcome], dict[str, Record]]:
    """Run both kinds of person through `seeds` rooms.

    Args:
        settings: of all runs; its seed is that of the first room.
        seeds: rooms.
        workers: processes.
        classifier: of the tracker.
        progress: called with what is done and how much there is.

    Returns:
        The outcomes, by seed and kind, and the records of the first room by kind.
    """
    pieces = [
        _Piece(replace(settings, human=kind, seed=settings.seed + k), classifier, record=k == 0)
        for k in range(seeds)
        for kind in KINDS
    ]
    outcomes: list[LabOutcome] = []
    records: dict[str, Record] = {}
    for outcome, record in run_pieces(_run, pieces, workers=workers):
        outcomes.append(outcome)
        if record is not None:
            records[outcome.human] = record
        if progress is not None:
            progress(len(outcomes), len(pieces))
    outcomes.sort(key=lambda o: (o.seed, o.human))
    return outcomes, {kind: records[kind] for kind in KINDS}


def lab_summary(outcomes: Sequence[LabOutcome], human: str | None) -> dict[str, Any]:
    """Return the totals over the runs with one kind of person, or with both (None); shares in [0, 1].

    `belief_correct` is the share of the runs in which the person had to react; `pi_r_ratio` is PI_R with unconcerned
    people over PI_R with concerned ones, in the same rooms.
    """
    chosen = [o for o in outcomes if human in (None, o.human)]
    reacting = [o for o in chosen if o.had_to_react]
    indices = {kind: float(np.mean([o.PI_R for o in outcomes if o.human == kind])) for kind in KINDS}
    return {
        "human": human or "both",
        "seeds": len({o.seed for o in chosen}),
        "runs": len(chosen),
        "contacts_moving": sum(o.contacts_moving for o in chosen),
        "contacts_standing": sum(o.contacts_standing for o in chosen),
        "bumped_s": sum(o.bumped for o in chosen),
        "reached": _mean(o.reached for o in chosen),
        "had_to_react": len(reacting),
        "belief_correct": _mean(o.told_apart for o in reacting),
        "pi_r_ratio": indices["unconcerned"] / indices["concerned"],
        "planner_hz": _mean(o.planner_hz for o in chosen),
        "plan_ms": _mean(o.plan_ms for o in chosen),
        "scan_hz": _mean(o.scan_hz for o in chosen),
        "scan_age_ms": 1e3 * _mean(o.scan_age for o in chosen),
        "min_distance_m": min(o.min_distance for o in chosen),
        "time_to_goal_s": _mean(o.time_to_goal for o in chosen if o.reached),
        "tracker": _tracker(chosen),
    }


def outcome_rows(outcomes: Sequence[LabOutcome]) -> list[Mapping[str, Any]]:
    """Return every run as a dictionary."""
    return [asdict(o) | {"told_apart": o.told_apart} for o in outcomes]


@dataclass(frozen=True, slots=True)
class _Piece:
    settings: LabSettings
    classifier: LegClassifier | None
    record: bool


def _run(piece: _Piece) -> tuple[LabOutcome, Record | None]:
    found = run_lab(piece.settings, classifier=piece.classifier, snapshots=32 if piece.record else 0)
    return outcome_of(found), found.record if piece.record else None


def outcome_of(run: LabRun) -> LabOutcome:
    """Return one run in numbers."""
    numbers, mot, record = measure(run.record), run.tracking, run.record
    spent = record.planning_time[record.plan_age <= 1e-9]
    period = 1 / run.settings.planner_rate
    return LabOutcome(
        human=run.settings.human,
        seed=run.settings.seed,
        contacts_moving=numbers.contacts_moving,
        contacts_standing=numbers.contacts_standing,
        bumped=run.bumped,
        reached=record.reached_goal,
        time_to_goal=float(record.time[-1]) if record.reached_goal else float("nan"),
        min_distance=numbers.min_distance,
        had_to_react=len(run.reactions),
        belief=_belief(run),
        PI_R=numbers.PI_R,
        plans=len(spent),
        planner_hz=len(spent) / float(np.maximum(spent, period).sum()),
        plan_ms=1e3 * float(spent.mean()),
        scan_hz=run.arrived / numbers.duration,
        scan_age=run.scan_age,
        drift=run.drift,
        truths=mot.truths,
        matches=mot.matches,
        false_positives=mot.false_positives,
        id_switches=mot.id_switches,
        squared_error=mot.rmse**2 * mot.matches if mot.matches else 0.0,
    )


def _belief(run: LabRun) -> float:
    """P(concerned) of the person who crosses, `_AFTER` s after the last decision that mattered, or just before that."""
    if not run.reactions:
        return float("nan")
    beliefs = run.record.beliefs[run.record.time[:-1] <= max(run.reactions) + _AFTER, 0]
    known = beliefs[np.isfinite(beliefs)]
    return float(known[-1]) if known.size else float("nan")


def _tracker(outcomes: Sequence[LabOutcome]) -> dict[str, float]:
    matches = sum(o.matches for o in outcomes)
    reported = matches + sum(o.false_positives for o in outcomes)
    truths = sum(o.truths for o in outcomes)
    return {
        "precision": matches / reported if reported else float("nan"),
        "recall": matches / truths if truths else float("nan"),
        "id_switches": sum(o.id_switches for o in outcomes),
        "rmse_m": float(np.sqrt(sum(o.squared_error for o in outcomes) / matches)) if matches else float("nan"),
    }


def _mean(values: Any) -> float:
    known = list(values)
    return float(np.mean(known)) if known else float("nan")
