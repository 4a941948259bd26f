"""Do robots that announce their plans keep out of each other's way, and what does it cost them?"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.metrics import measure
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.team import TeamRun
from sidestep.studies.arms import Columns, Row, Study
from sidestep.studies.statistics import clopper_pearson

HALF_WAY = 4.0  # m


def meeting(seed: int) -> Scenario:
    """Return two robots whose ways cross at about the same time, and two people who cross them."""
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, 5])))
    for _ in range(200):
        angle = generator.uniform(0.0, 2 * math.pi) + np.array([0.0, generator.uniform(math.radians(30), math.pi)])
        robots = [_way(a, generator, 0.5) for a in angle]
        people = [_way(generator.uniform(0.0, 2 * math.pi), generator, 1.5) for _ in range(2)]
        data = {
            "name": "two-robots",
            "seed": seed,
            "duration": 60.0,
            "robot": dict(zip(("start", "goal"), robots[0], strict=True)),
            "robots": [dict(zip(("start", "goal"), robots[1], strict=True))],
            "people": [
                {"kind": kind, "start": start, "goal": goal, "goal_known": False, "speed": 1.0}
                for kind, (start, goal) in zip(("concerned", "unconcerned"), people, strict=True)
            ],
        }
        try:
            scenario = Scenario.parse(data)
        except InvalidInput:
            continue  # somebody would begin in somebody else
        if all(math.dist(p.start, r) > 1.0 for p in scenario.people for r in (robots[0][0], robots[1][0])):
            return scenario
    raise InvalidInput("study.seed", seed, "a seed that leaves room for everybody")


def episode(seed: int, *, announce: bool) -> Row:
    """Return the numbers of one meeting; without announcements the robots do not know of each other."""
    scenario = meeting(seed)
    team = TeamRun(scenario, snapshots=0)
    if not announce:
        for run in team.runs:
            run.navigator = planner_of(run.scenario, run.obstacles)
    found = [measure(record) for record in team.finish()]
    stopped = sum(m.status_counts["stopped"] for m in found) / sum(m.steps for m in found)
    return {
        "robot_contact": float(found[0].robot_contacts > 0),
        "robot_min_distance": found[0].robot_min_distance,
        "moving_contact": float(any(m.contacts_moving > 0 for m in found)),
        "standing_contact": float(any(m.contacts_standing > 0 for m in found)),
        "reached": float(all(m.reached_goal for m in found)),
        "time_first": found[0].time_to_goal,
        "time_second": found[1].time_to_goal,
        "stopped": stopped,
    }


def _way(angle: float, generator: np.random.Generator, offset: float) -> tuple[list[float], list[float]]:
    along = np.array([math.cos(angle), math.sin(angle)])
    aside = np.array([-along[1], along[0]]) * generator.uniform(-offset, offset)
    start = aside - (HALF_WAY + generator.uniform(0.0, 0.5)) * along
    return start.tolist(), (aside + HALF_WAY * along).tolist()


def _rows(found: Columns) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for arm, c in found.items():
        hits, count = int(c["robot_contact"].sum()), len(c["robot_contact"])
        low, high = clopper_pearson(hits, count)
        rows.append(
            [
                arm,
                count,
                hits,
                f"{low:.4f}–{high:.4f}",
                f"{c['robot_min_distance'].min():.3f}",
                int(c["moving_contact"].sum()),
                int(c["standing_contact"].sum()),
                f"{c['reached'].mean():.3f}",
                f"{np.nanmean(c['time_first']):.2f}",
                f"{np.nanmean(c['time_second']):.2f}",
                f"{c['stopped'].mean():.4f}",
            ]
        )
    return rows


def _remarks(found: Columns) -> list[str]:
    del found
    return [
        "Contacts with people are those of either robot. Bodies of two robots touch below 0.6 m between centres; the "
        "distance is exact between the samples. That there is none follows from the rule that every first motion must "
        "clear what the others do now, and their standing still; the episodes check the program."
    ]


ROBOTS = Study(
    name="robots",
    title="Several robots",
    lead="Two robots of 1 m/s meet in the middle of their ways (8 m, 30° to 180° between them) among two people, one "
    "concerned and one not. The second plans around what the first has announced; without announcements, each takes "
    "the floor for its own.",
    arms={"announced": partial(episode, announce=True), "unaware of each other": partial(episode, announce=False)},
    header=("robots", "episodes", "robot–robot contacts", "99 % interval", "least distance m", "people, moving",
            "people, standing", "both arrive", "first, s", "second, s", "steps stopped"),
    rows=_rows,
    remarks=_remarks,
    episodes=1000,
    controls=frozenset({"unaware of each other"}),
)  # fmt: skip
