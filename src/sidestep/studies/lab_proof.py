"""The laboratory as a study: the same rooms with scans at once, with late and lost ones, and in MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from typing import Any

from sidestep.simulation.lab import run_lab
from sidestep.simulation.lab_room import LabSettings
from sidestep.studies.arms import Columns, Row, Study
from sidestep.studies.lab import KINDS, LabOutcome, lab_summary, outcome_of
from sidestep.studies.statistics import upper_bound

AT_ONCE = "scans at once"
LATE = "200 ms late, 20 % lost"
_SEPARATOR = " · "


def arm_name(condition: str, kind: str) -> str:
    """Name of the arm of one kind of person."""
    return f"{condition}{_SEPARATOR}{kind}"


def episode(seed: int, *, settings: LabSettings) -> Row:
    """Return the numbers of one room."""
    numbers = asdict(outcome_of(run_lab(replace(settings, seed=seed), snapshots=0)))
    return {name: float(value) for name, value in numbers.items() if name != "human"}


def outcomes(found: Columns) -> dict[str, list[LabOutcome]]:
    """Return condition → outcomes of both kinds of people."""
    sorted_out: dict[str, list[LabOutcome]] = {}
    for arm, columns in found.items():
        condition, kind = arm.split(_SEPARATOR)
        runs = zip(*columns.values(), strict=True)
        rows: list[dict[str, Any]] = [dict(zip(columns, map(float, values), strict=True)) for values in runs]
        sorted_out.setdefault(condition, []).extend(LabOutcome(human=kind, **row) for row in rows)
    return sorted_out


def _rows(found: Columns) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for condition, runs in outcomes(found).items():
        for kind in KINDS:
            s = lab_summary(runs, kind)
            tracker = s["tracker"]
            rows.append(
                [
                    condition,
                    kind,
                    s["runs"],
                    f"{s['contacts_moving']:.0f} / {s['contacts_standing']:.0f}",
                    f"{100 * s['reached']:.0f} %",
                    f"{100 * s['belief_correct']:.0f} % of {s['had_to_react']}",
                    f"{s['pi_r_ratio']:.2f}",
                    f"{s['min_distance_m']:.2f}",
                    f"{s['planner_hz']:.2f}",
                    f"{s['scan_age_ms']:.0f}",
                    f"{tracker['precision']:.3f} / {tracker['recall']:.3f}",
                    int(tracker["id_switches"]),
                    f"{tracker['rmse_m']:.2f}",
                ]
            )
    return rows


def _remarks(found: Columns) -> list[str]:
    told: list[str] = []
    for condition, runs in outcomes(found).items():
        both, touched = lab_summary(runs, None), sum(o.contacts_moving > 0 for o in runs)
        lost = ", ".join(f"{o.seed:.0f} ({o.human})" for o in runs if not o.reached)
        told.append(
            f"{condition.capitalize()}: {100 * both['belief_correct']:.0f} % of the {both['had_to_react']} runs in "
            f"which the person had to react were told apart; contacts while moving in {touched} of {both['runs']} runs "
            f"(99 % confidence: in at most {100 * upper_bound(touched, len(runs)):.0f} % of them); goal reached in "
            f"{100 * both['reached']:.0f} %" + (f", not in rooms {lost}." if lost else ".")
        )
    return [
        *told,
        "Bodies touch at 0.48 m between centres. PI_R is over all rooms, unconcerned over concerned. Told apart means "
        "that the belief was on the right side of ½ one second after the last decision in which awareness mattered.",
    ]


_HEADER = (
    "scans", "person", "runs", "contacts, moving / standing", "goal reached", "told apart, of those who had to react",
    "PI_R ratio", "nearest, m", "planner, Hz", "scan age, ms", "precision / recall", "identity switches", "rmse, m",
)  # fmt: skip


def _study(name: str, title: str, lead: str, conditions: Mapping[str, LabSettings], episodes: int) -> Study:
    arms = {
        arm_name(condition, kind): partial(episode, settings=replace(settings, human=kind))
        for condition, settings in conditions.items()
        for kind in KINDS
    }
    return Study(
        name=name,
        title=title,
        lead=lead,
        arms=arms,
        header=_HEADER,
        rows=_rows,
        remarks=_remarks,
        episodes=episodes,
        piece=5,
    )


_LEAD = (
    "A LoCoBot-sized base drives through furnished rooms and knows people from a leg tracker alone; somebody crosses "
    "its way, somebody stands about. Every room is crossed by a concerned and by an unconcerned person; the planner "
    "works at 2 Hz and is told where who walks is going, as in the paper."
)

LAB = _study(
    "lab",
    "The laboratory, room by room",
    _LEAD + " The base follows its commands exactly.",
    {AT_ONCE: LabSettings(), LATE: LabSettings(latency=0.2, dropout=0.2)},
    episodes=100,
)
LAB_MUJOCO = _study(
    "lab-mujoco",
    "The laboratory in MuJoCo",
    _LEAD + " Wheels, casters, friction and furniture are MuJoCo's, and so are the beams.",
    {AT_ONCE: LabSettings(physics="mujoco")},
    episodes=100,
)
