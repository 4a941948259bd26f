"""What a danger signal gains: the same encounters with a robot that may ring, and with one that may not."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.scenario import Scenario
from sidestep.studies.arms import Columns, Row, Study
from sidestep.studies.statistics import bootstrap_mean

WITH, WITHOUT = "may signal", "may not"


def encounter(seed: int, *, heeds: float = 0.5) -> Scenario:
    """Return an unconcerned person whose way crosses the robot's; they heed a signal with probability `heeds`.

    As the shipped scenario `signal`, from any side.
    """
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, 7])))
    angle = math.radians(90.0 + generator.uniform(-80.0, 80.0))  # of the person's way; the robot goes along +y
    along = np.array([math.sin(angle), math.cos(angle)]) * (1.0 if generator.random() < 0.5 else -1.0)
    meet = np.array([generator.uniform(-0.3, 0.3), 0.0])
    person = {
        "kind": "unconcerned",
        "start": (meet - 5.0 * along).tolist(),
        "goal": (meet + 5.0 * along).tolist(),
        "arrives_with": along.tolist(),
        "heeds_signal": heeds,
    }
    return Scenario.parse(
        {
            "name": "signal",
            "seed": seed,
            "duration": 60.0,
            "robot": {"start": (0.0, -5.0), "goal": (0.0, 5.0)},
            "planner": {"signal_belief": 0.2},
            "people": [person],
        }
    )


def episode(seed: int, *, signal: bool) -> Row:
    """Return the numbers of one encounter."""
    scenario = encounter(seed)
    if not signal:
        scenario = scenario.model_copy(update={"planner": replace(scenario.planner, signal_belief=None)})
    record = simulate(scenario, snapshots=0)
    m = measure(record)
    return {
        "time": m.time_to_goal,
        "moving_contact": float(m.contacts_moving > 0),
        "standing_contact": float(m.contacts_standing > 0),
        "heeded": float((record.people_awareness == 1).any()),
        "path": m.path_length,
    }


def gain(found: Columns) -> tuple[float, float, float]:
    """Return the mean time that signalling saves, s, over paired seeds, and its 95 % interval."""
    saved = found[WITHOUT]["time"] - found[WITH]["time"]
    low, high = bootstrap_mean(saved, np.random.Generator(np.random.PCG64(0)))
    return float(np.nanmean(saved)), low, high


def _rows(found: Columns) -> list[list[Any]]:
    return [
        [
            arm,
            len(c["time"]),
            f"{np.nanmean(c['time']):.2f}",
            f"{np.nanmedian(c['time']):.2f}",
            f"{np.nanmean(c['path']):.2f}",
            f"{c['heeded'].mean():.2f}",
            int(c["moving_contact"].sum()),
            int(c["standing_contact"].sum()),
        ]
        for arm, c in found.items()
    ]


def _remarks(found: Columns) -> list[str]:
    mean, low, high = gain(found)
    share = 100 * mean / float(np.nanmean(found[WITHOUT]["time"]))
    heeded = found[WITH]["heeded"] > 0
    saved = (found[WITHOUT]["time"] - found[WITH]["time"])[heeded]
    told = f"; {np.nanmean(saved):.2f} s where the person became concerned" if len(saved) else ""
    return [f"Signalling saves {mean:.2f} s of a trip ({low:.2f} to {high:.2f}, 95 %), {share:.1f} %{told}."]


SIGNAL = Study(
    name="signal",
    title="What a danger signal gains",
    lead="A robot crosses the way of an unconcerned person, from any side, so that both would meet. Where it believes "
    "that the person is unconcerned (P < 0.2) and the risk is not negligible, it may signal; at each decision the "
    "person heeds that with probability 0.5 and is concerned from then on. The same seeds with and without.",
    arms={WITH: partial(episode, signal=True), WITHOUT: partial(episode, signal=False)},
    header=("the robot", "episodes", "time s, mean", "median", "path m", "persons who became concerned",
            "moving contacts", "standing contacts"),
    rows=_rows,
    remarks=_remarks,
    episodes=200,
)  # fmt: skip
