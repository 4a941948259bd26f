"""Sections IV and V of the paper as points: one setting, many seeds, a row of numbers for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sidestep.planning.plan import PersonPlan, Plan
from sidestep.simulation.alike import simulate_alike
from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record
from sidestep.simulation.run import Step
from sidestep.simulation.scenario import Scenario
from sidestep.types import FloatArray, IntArray

COLUMNS = (
    "PI_R",
    "PI_H",
    "PI_T",
    "PI_R_lateral",
    "PI_H_lateral",
    "PI_T_lateral",
    "robot_length",
    "human_length",
    "robot_turning",
    "human_turning",
    "entropy",
    "entropy_first",
    "entropy_decided",
    "peak_first",
    "peak_decided",
    "belief_at_closest",
    "steps_to_identify",
    "max_collision_probability",
    "uncertified",
    "plan_p95",
)
"""What is kept of each run. Lengths in m, turning in rad, entropies in nat, times in ms; NaN where there is none."""
WIDTHS = frozenset(c for c in COLUMNS if c.startswith(("entropy", "peak")))
"""Those about how wide predictions are: of people too far away to matter they are made for these alone."""


@dataclass(frozen=True, slots=True)
class Change:
    """One field of a scenario that differs.

    Attributes:
        field: "section.field"; value: the new one, or where `times` is true the factor to the old one.
    """

    field: str
    value: float
    times: bool = False

    @property
    def words(self) -> str:
        """As people read it: "danger_weight 25", "max_speed × 0.5"."""
        return f"{self.field.partition('.')[2]} {'× ' if self.times else ''}{self.value:g}"

    def applied(self, data: dict[str, Any]) -> dict[str, Any]:
        """Return the settings of a scenario with this one changed."""
        section, _, name = self.field.partition(".")
        value = self.value * data[section][name] if self.times else self.value
        return data | {section: data[section] | {name: value}}


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One point of the study.

    Attributes:
        label: "paper-printed", … : the scenario that it starts from.
        rule: "cells" or "mass".
        human: "concerned" or "unconcerned".
        horizon: N_R; anticipation: N_H.
        changes: further fields that differ.
    """

    label: str
    rule: str
    human: str
    horizon: int
    anticipation: int
    changes: tuple[Change, ...] = ()

    @property
    def name(self) -> str:
        """What its results are kept under."""
        more = "".join(f"--{change.words}" for change in self.changes)
        return f"{self.label}--{self.rule}--{self.human}--R{self.horizon}--H{self.anticipation}{more}"

    def scenario(self, base: Scenario) -> Scenario:
        """Return the scenario of this point."""
        data = base.settings()
        for change in self.changes:
            data = change.applied(data)
        data["human"] = data["human"] | {"horizon": self.anticipation}
        data["planner"] = data["planner"] | {"horizon": self.horizon, "risk_rule": self.rule}
        if self.rule == "mass":  # P(person within contact + 0.1 m) ≤ P_th; the paper's metres are a distance to cells
            data["planner"] = data["planner"] | {"clearance": None}
        data["people"] = [dict(p) | {"kind": self.human} for p in data["people"]]
        return Scenario.parse(data)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """One run that is to be measured.

    Attributes:
        scenario: with its seed; widths: whether the columns `WIDTHS` are asked for.
    """

    scenario: Scenario
    widths: bool


def run_trials(trials: Sequence[Trial]) -> list[list[float]]:
    """Run trials that are planned alike; of each the numbers in the order of `COLUMNS`, NaN where not asked for."""
    watchers = [_Watcher(predictions=trial.widths) for trial in trials]
    records = simulate_alike([trial.scenario for trial in trials], watchers)
    return [_numbers(*each) for each in zip(trials, records, watchers, strict=True)]


class _Watcher:
    """Notes how long each plan took, whichever run it was made in, and what was predicted where that is asked for."""

    def __init__(self, *, predictions: bool) -> None:
        self.times: list[float] = []
        self.people: list[PersonPlan] = []
        self._predictions = predictions

    def __call__(self, step: Step) -> None:
        if step.planned and isinstance(step.motion, Plan):
            self.times.append(1e3 * step.motion.duration)
            if self._predictions:
                self.people.extend(step.motion.people.values())


def _numbers(trial: Trial, record: Record, seen: _Watcher) -> list[float]:
    """What is kept of one run."""
    m = measure(record)
    closest = _closest(record)
    belief = record.beliefs[:, 0] if record.beliefs.size else np.full(1, np.nan)
    true_concerned = trial.scenario.people[0].kind == "concerned"
    decided = np.flatnonzero(belief > 0.9 if true_concerned else belief < 0.1)
    found = {
        "PI_R": m.PI_R,
        "PI_H": m.PI_H,
        "PI_T": m.PI_T,
        "PI_R_lateral": m.PI_R_lateral,
        "PI_H_lateral": m.PI_H_lateral,
        "PI_T_lateral": m.PI_T_lateral,
        "robot_length": m.path_length,
        "human_length": m.human_path_length,
        "robot_turning": m.turning,
        "human_turning": m.human_turning,
        "belief_at_closest": float(belief[min(closest, len(belief) - 1)]),
        "steps_to_identify": float(decided[0]) if decided.size else float("nan"),
        "max_collision_probability": m.max_collision_probability,
        "uncertified": 1.0 - m.status_counts["certified"] / max(m.steps, 1),
        "plan_p95": float(np.percentile(seen.times, 95)),
        **_widths(seen.people, closest, decided),
    }
    return [found[column] for column in COLUMNS]


def _widths(seen: list[PersonPlan], closest: int, decided: IntArray) -> dict[str, float]:
    """How wide the predictions `seen` were until the closest approach, at first, and where the belief was decided."""
    found = dict.fromkeys(WIDTHS, float("nan"))
    if not seen:
        return found
    met = [width(person) for person in seen[: closest + 1]]
    known = [met[k] if k < len(met) else width(seen[k]) for k in decided if k < len(seen)]
    found["entropy"] = float(np.mean([entropy for entropy, _ in met]))
    found["entropy_first"], found["peak_first"] = met[0]
    if known:
        found["entropy_decided"], found["peak_decided"] = np.mean(known, axis=0).tolist()
    return found


def width(person: PersonPlan) -> tuple[float, float]:
    """Return entropy (nat) and likeliest cell of what a plan assumed of a person at its end.

    Whoever was too far away to matter is predicted for it; so it is asked only where the number is used.
    """
    cells = person.occupancy.probability[-1]
    return entropy(cells), float(cells.max())


def entropy(probability: FloatArray) -> float:
    """Return −Σ p ln p in nat."""
    p = probability[probability > 0]
    return float(-(p * np.log(p)).sum())


def _closest(record: Record) -> int:
    """Step of the closest approach."""
    apart = np.linalg.norm(record.people_positions[:, 0] - record.robot_positions, axis=1)
    return int(np.nanargmin(apart))
