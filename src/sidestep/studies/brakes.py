"""Robots that cannot stop at once, among people who do not look: contacts by base and by rate of planning."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from sidestep.simulation.scenario import Scenario
from sidestep.studies.arms import Columns, Row, Study
from sidestep.studies.scale import encounter, met
from sidestep.studies.statistics import clopper_pearson

BASES: Mapping[str, Mapping[str, Any]] = {
    "any acceleration": {},
    "2 m/s²": {"max_acceleration": 2.0},
    "1 m/s²": {"max_acceleration": 1.0},
    "0.5 m/s²": {"max_acceleration": 0.5},
    "two wheels, 1 m/s²": {
        "kind": "differential", "radius": 0.2, "max_acceleration": 1.0, "max_turn_acceleration": 4.0,
    },
}  # fmt: skip
RATES = {"2 Hz": 0.5, "10 Hz": 0.1}  # s between plans
CONTROL_STEP = 0.1  # s, at which everything moves and is measured


def meeting(seed: int, base: str, period: float) -> Scenario:
    """Return an encounter of `studies.scale` with a person who does not look, for one of the `BASES`."""
    data = encounter(seed, "unconcerned").settings()
    trip = {name: data["robot"][name] for name in ("start", "goal", "max_speed")}
    shape = {} if "kind" in BASES[base] else {"shape": "disc"}
    return Scenario.parse(
        data | {"robot": trip | shape | dict(BASES[base]), "control_step": CONTROL_STEP, "planning_period": period}
    )


def episode(seed: int, *, base: str, period: float) -> Row:
    """Return the numbers of one encounter."""
    return met(meeting(seed, base, period))


def _rows(found: Columns) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for arm, c in found.items():
        hits, count = int(c["moving_contact"].sum()), len(c["time"])
        low, high = clopper_pearson(hits, count)
        rows.append(
            [
                *arm.split(" · "),
                count,
                hits,
                f"{low:.3f} to {high:.3f}",
                int(c["standing_contact"].sum()),
                f"{c['promised'].sum():.1f}",
                f"{c['reached'].mean():.3f}",
                f"{np.nanmean(c['time']):.2f}" if np.isfinite(c["time"]).any() else "–",
                f"{c['certified'].mean():.3f}",
            ]
        )
    return rows


def _remarks(found: Columns) -> list[str]:
    del found
    return [
        "The contacts that were promised are what the plans in force said of the time that each of them was in force: "
        "P_coll(1|t) by the part of its step that had passed until the next plan.",
        "A base that stands when it is reached has a standing contact: the person walked into it.",
    ]


BRAKES = Study(
    name="brakes",
    title="Robots that cannot stop at once",
    lead="A person who does not look crosses the robot's way at any angle so that both would be there at the same "
    "time; 0.8 to 1.2 m/s, one decision in twenty at random. The robot drives at up to 1 m/s and plans over 5 steps of "
    "0.5 s. A base of 1 m/s² needs half a metre to stop, one of 0.5 m/s² a whole one.",
    arms={
        f"{base} · {rate}": partial(episode, base=base, period=period)
        for rate, period in RATES.items()
        for base in BASES
    },
    header=("base", "planned at", "episodes", "moving contacts", "99 % interval of the rate", "standing contacts",
            "contacts promised", "arrived", "time, s", "steps certified"),
    rows=_rows,
    remarks=_remarks,
    episodes=400,
    piece=20,
)  # fmt: skip
