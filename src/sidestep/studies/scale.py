"""Encounters by the thousand: how rare is a contact, do predicted contacts add up, and what does all that cost?"""

from __future__ import annotations

import math
from functools import partial
from time import perf_counter, process_time
from typing import Any

import numpy as np

from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.scenario import Scenario
from sidestep.studies.arms import Columns, Row, Study
from sidestep.studies.engines import run_pieces
from sidestep.studies.statistics import clopper_pearson

HORIZON = 5  # steps
MILLION = 1_000_000
TIMED = 20  # episodes per piece when the efficiency of several workers is measured


def encounter(seed: int, kind: str) -> Scenario:
    """Return a person of this kind whose way crosses the robot's at any angle, planned at 2 Hz over 5 steps."""
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, 11])))
    angle = generator.uniform(math.radians(20.0), math.radians(340.0))  # of the ways; 180° is head-on
    along = np.array([math.sin(angle), math.cos(angle)])
    pace = generator.uniform(0.8, 1.2)
    meet = np.array([generator.uniform(-0.3, 0.3), generator.uniform(-1.5, 1.5)])
    person = {
        "kind": kind,
        "start": (meet - pace * (5.0 + meet[1]) * along).tolist(),  # the robot is there as soon
        "goal": (meet + 5.0 * along).tolist(),
        "arrives_with": (pace * along).tolist(),
        "speed": pace,
        "randomness": 0.05,
    }
    return Scenario.parse(
        {
            "name": "encounter",
            "seed": seed,
            "duration": 60.0,
            "robot": {"start": (0.0, -5.0), "goal": (0.0, 5.0)},
            "planner": {"horizon": HORIZON},
            "people": [person],
        }
    )


def episode(seed: int, *, kind: str) -> Row:
    """Return the numbers of one encounter; `seconds` of processor time are what this machine took."""
    began = process_time()
    numbers = met(encounter(seed, kind))
    return numbers | {"seconds": process_time() - began}


def met(scenario: Scenario) -> Row:
    """Return the numbers of one encounter.

    Promised contacts are what the plans said of the time that each was in force: P_coll(1|t) by the part of its step.
    """
    record = simulate(scenario, snapshots=0)
    m = measure(record)
    promised = np.nansum(record.collision_probability[:, 0]) * record.control_step / scenario.planner.time_step
    return {
        "moving_contact": float(m.contacts_moving > 0),
        "standing_contact": float(m.contacts_standing > 0),
        "promised": float(promised),
        "reached": float(m.reached_goal),
        "time": m.time_to_goal,
        "certified": m.status_counts.get("certified", 0) / max(m.steps, 1),
    }


def _rows(found: Columns) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for arm, c in found.items():
        count, hits = len(c["time"]), int(c["moving_contact"].sum())
        low, high = clopper_pearson(hits, count)
        rows.append(
            [
                arm,
                count,
                hits,
                f"{low:.2g} to {high:.2g}",
                int(c["standing_contact"].sum()),
                f"{c['promised'].sum():.1f}",
                f"{c['reached'].mean():.4f}",
                f"{np.nanmean(c['time']):.2f}",
                f"{c['certified'].mean():.3f}",
                f"{1.0 / c['seconds'].mean():.1f}",
            ]
        )
    return rows


def _remarks(found: Columns) -> list[str]:
    seconds = np.concatenate([c["seconds"] for c in found.values()]).mean()
    hours = MILLION * seconds / 3600.0
    return [
        f"One episode takes {1e3 * seconds:.1f} ms of one core, everything included. A million of them take "
        f"{hours:.1f} core-hours: {hours / 2:.1f} h on 2 cores, {60 * hours / 64:.0f} min on 64.",
        "The contacts that were promised are the sums of P_coll(1|t) over all steps: what the plans said would happen "
        "in the step at hand.",
    ]


def efficiency(workers: int, pieces: int = 12) -> list[str]:
    """Say how much faster `workers` processes are than one, by running the same episodes with each."""
    rates: dict[int, float] = {}
    for count in dict.fromkeys((1, workers)):
        list(run_pieces(_timed, range(count), workers=count))  # everybody is there, with everything loaded
        began = perf_counter()
        done = sum(run_pieces(_timed, range(pieces), workers=count))
        rates[count] = done / (perf_counter() - began)
    told = ", ".join(f"{n} worker{'s' * (n > 1)} {rate:.1f}" for n, rate in rates.items())
    share = rates[workers] / (workers * rates[1])
    return [f"Episodes per second of wall clock: {told}; parallel efficiency {share:.2f}."]


def _timed(piece: int) -> int:
    for seed in range(piece * TIMED, (piece + 1) * TIMED):
        episode(seed, kind="unconcerned")
    return TIMED


SCALE = Study(
    name="scale",
    title="Encounters by the thousand",
    lead="One person, concerned or not, whose way crosses the robot's at any angle (20° to 340°, 180° is head-on) so "
    "that both would be there at the same time; 0.8 to 1.2 m/s, one decision in twenty at random. The robot plans at "
    "2 Hz over 5 steps. Rates this small need many episodes.",
    arms={kind: partial(episode, kind=kind) for kind in ("concerned", "unconcerned")},
    header=("person", "episodes", "moving contacts", "99 % interval of the rate", "standing contacts",
            "contacts promised", "arrived", "time, s", "steps certified", "episodes per s and core"),
    rows=_rows,
    remarks=_remarks,
    episodes=50_000,
    piece=250,
    measured=efficiency,
)  # fmt: skip
