"""Measure where the method gets into trouble, for the page "Where it fails".

python tools/measure_limits.py [--episodes 100] [--out docs/evidence/results/60-limits.json]

Each row changes one thing about the person, the robot or the model. The person starts at random so that, if nobody did
anything, robot and person would meet within half a second of each other.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from scipy.stats import binomtest

import sidestep
from sidestep.commands.evidence import write_evidence
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.metrics import Metrics, measure

ROOT = Path(__file__).resolve().parents[1]

FAR = 100.0  # m to a goal that only says which way


def zigzag(generator: np.random.Generator) -> dict[str, Any]:
    """Turns by 60 to 115° and back, every 0.6 to 1.6 s, on the way past the middle of the robot's way."""
    speed, way, turn = generator.uniform(0.8, 1.6), generator.uniform(1.0, 5.3), generator.uniform(0.5, 1.0)
    period, first = generator.uniform(0.6, 1.6), generator.uniform(0.0, 1.0)
    both = [FAR * np.array([np.cos(way + side), np.sin(way + side)]) for side in (turn, -turn)]
    start = np.array([4.0, 0.0]) - 0.05 * speed * np.mean(both, axis=0) / np.cos(turn)
    turns = [{"time": first * period + period * k, "goal": both[k % 2].tolist()} for k in range(40)]
    before = (speed / FAR * both[1]).tolist()
    return {
        "speed": speed,
        "start": start.tolist(),
        "goal": both[1].tolist(),
        "goal_changes": turns,
        "arrives_with": before,
    }


def steps_back(generator: np.random.Generator) -> dict[str, Any]:
    """Walks before the robot as fast or a little slower, stands for 0.4 s, and comes back."""
    speed, stops = generator.uniform(0.7, 1.1), generator.uniform(2.0, 5.0)
    start = np.array([generator.uniform(1.2, 2.0), generator.uniform(-0.3, 0.3)])
    stood = (start + np.array([speed * stops, 0.0])).tolist()
    back = [{"time": stops + 0.4, "goal": [-FAR, start[1]]}]
    return {"speed": speed, "start": start.tolist(), "goal": stood, "goal_changes": back, "arrives_with": [speed, 0.0]}


def sets_off(generator: np.random.Generator) -> dict[str, Any]:
    """Stands 0.8 to 1.8 m beside the way, and walks across it when the robot is 1.2 to 2.5 m before."""
    start = np.array([generator.uniform(3.0, 5.0), generator.choice([-1.0, 1.0]) * generator.uniform(0.8, 1.8)])
    askew, speed = generator.uniform(-0.5, 0.5), generator.uniform(0.8, 1.8)
    across = start + FAR * np.array([np.sin(askew), -np.sign(start[1]) * np.cos(askew)])
    when = start[0] - generator.uniform(0.5, 2.0)  # s; the robot takes about one for a metre
    goes = [{"time": when, "goal": across.tolist()}]
    return {
        "speed": speed,
        "start": start.tolist(),
        "goal": start.tolist(),
        "goal_changes": goes,
        "arrives_with": [0, 0],
    }


CORRIDORS = [[[4 + x, y], [4 + 9 * x, y], [4 + 9 * x, 30 * y], [4 + x, 30 * y]] for x in (-1, 1) for y in (-1, 1)]  # m


def out_of_a_corridor(generator: np.random.Generator) -> dict[str, Any]:
    """Comes out of the one of two corridors of 2 m just as the robot comes to it along the other."""
    speed, side = generator.uniform(0.8, 1.8), generator.choice([-1.0, 1.0])
    aside, when = generator.uniform(-0.6, 0.6), generator.uniform(3.3, 4.7)
    start, goal = [4.0 + aside, -side * speed * when], [4.0 + aside, 25.0 * side]
    return {"speed": speed, "start": start, "goal": goal, "arrives_with": [0.0, side * speed]}


class InSight:
    """A planner that is told of those whom no wall hides."""

    def __init__(self, planner: sidestep.Planner) -> None:
        self.planner = planner

    def reset(self) -> None:
        """Forget everybody."""
        self.planner.reset()

    def step(
        self, *, time: float, robot: sidestep.RobotState, people: Sequence[sidestep.PersonObservation]
    ) -> sidestep.Plan:
        """Plan for those who are seen."""
        walls = self.planner.obstacles
        seen = [p for p in people if walls is None or walls.segment_free(robot.position, p.position)]
        return self.planner.step(time=time, robot=robot, people=seen)


CORNER = {"walk": out_of_a_corridor, "walls": CORRIDORS}
PURSUIT = [{"time": 2.0 + 0.5 * k, "goal": "robot"} for k in range(16)]
CASES: dict[str, dict[str, Any]] = {
    "a person who walks straight on": {},
    "… and the robot is slow, 0.3 m/s": {"robot": {"max_speed": 0.3}},
    "… and the person runs (2.5 m/s), the robot is slow": {"robot": {"max_speed": 0.3}, "person": {"speed": 2.5}},
    "… and positions are noisy (0.1 m)": {"measurement": {"position_noise": 0.1}},
    "… and is seen only from 3 m on": {"measurement": {"range": 3.0}},
    "every second step random": {"person": {"kind": "unconcerned", "randomness": 0.5}},
    "… and the planner takes ω = 0.05 for granted": {
        "person": {"kind": "unconcerned", "randomness": 0.5},
        "human": {"randomness": 0.05, "online_randomness": False, "steadiness": False},
    },
    "turns once toward the robot, after 3 s": {"person": {"goal_changes": [{"time": 3.0, "goal": "robot"}]}},
    "… and the planner was told another goal": {
        "person": {"goal_changes": [{"time": 3.0, "goal": "robot"}], "goal_known": True}
    },
    "comes for the robot (1 m/s), again and again": {"person": {"goal_changes": PURSUIT}},
    "… faster than the robot (1.5 m/s)": {"person": {"goal_changes": PURSUIT, "speed": 1.5}},
    "… and the robot is slow (0.3 m/s)": {"person": {"goal_changes": PURSUIT}, "robot": {"max_speed": 0.3}},
    "three abreast": {"abreast": 3},
    "walks in zigzag": {"walk": zigzag},
    "walks ahead, stops, and steps back": {"walk": steps_back},
    "stands beside the way, and sets off across it": {"walk": sets_off},
    "comes out of a corridor, unseen before": CORNER,
    "walks straight on; the base brakes at 1 m/s²": {"robot": {"max_acceleration": 1.0}},
    "… and the planner does not know": {"robot": {"max_acceleration": 1.0}, "untold": True},
    "every second step random; the base brakes at 0.5 m/s²": {
        "person": {"kind": "unconcerned", "randomness": 0.5},
        "robot": {"max_acceleration": 0.5},
    },
    "… and the planner does not know either": {
        "person": {"kind": "unconcerned", "randomness": 0.5},
        "robot": {"max_acceleration": 0.5},
        "untold": True,
    },
    "walks in zigzag; the base brakes at 1 m/s²": {"walk": zigzag, "robot": {"max_acceleration": 1.0}},
    "walks ahead, stops, and steps back; 1 m/s²": {"walk": steps_back, "robot": {"max_acceleration": 1.0}},
    "sets off across its way; 1 m/s²": {"walk": sets_off, "robot": {"max_acceleration": 1.0}},
    "comes out of a corridor; 1 m/s²": CORNER | {"robot": {"max_acceleration": 1.0}},
    "… and two wheels": CORNER
    | {"robot": {"max_acceleration": 1.0, "kind": "differential", "max_turn_acceleration": 4.0}},
}


def scenario(case: dict[str, Any], seed: int) -> sidestep.Scenario:
    """One encounter of a case."""
    generator = np.random.default_rng([seed, 71])
    speed = case.get("robot", {}).get("max_speed", 1.0)
    pace = case.get("person", {}).get("speed", 1.0)
    angle = generator.uniform(np.radians(60), np.radians(300))  # of the person's way against the robot's
    along = np.array([np.cos(angle), np.sin(angle)])
    when = 4.0 + generator.uniform(-0.5, 0.5)  # s until both would be at the same place
    meet = np.array([4.0 * speed, 0.0])
    people = []
    for k in range(case.get("abreast", 1)):
        aside = 0.7 * (k - (case.get("abreast", 1) - 1) / 2) * np.array([-along[1], along[0]])
        start = meet + aside - pace * when * along
        person = {"kind": "straight", "speed": pace, "goal_known": False, "arrives_with": (pace * along).tolist()}
        person |= {"start": start.tolist(), "goal": (meet + aside + 20 * along).tolist(), "decision_interval": 0.5}
        walk = case["walk"](generator) | {"decision_interval": 0.1} if "walk" in case else {}
        people.append(person | walk | case.get("person", {}))
    data = {
        "name": "limits",
        "seed": seed,
        "duration": 10.0 * 4 / speed,
        "planning_period": 0.1,
        "robot": {"start": [0.0, 0.0], "goal": [8.0 * speed, 0.0], **case.get("robot", {})},
        "people": people,
        "walls": case.get("walls", []),
        "measurement": case.get("measurement", {}),
        "human": case.get("human", {}),
    }
    return sidestep.Scenario.parse(data)


def measured(case: dict[str, Any], seed: int) -> Metrics:
    """One encounter in numbers; `untold`: the planner takes the base for one that can do anything at once."""
    met = scenario(case, seed)
    believed = scenario(case | {"robot": {}}, seed) if case.get("untold") else met
    return measure(sidestep.simulate(met, navigator=InSight(planner_of(believed)), snapshots=0))


def row(name: str, case: dict[str, Any], episodes: int) -> list[Any]:
    """The numbers of one case."""
    found = [measured(case, seed) for seed in range(episodes)]
    moving = sum(f.contacts_moving > 0 for f in found)
    standing = sum(f.contacts_standing > 0 and f.contacts_moving == 0 for f in found)
    interval = binomtest(moving, episodes).proportion_ci(0.95)
    steps = sum(f.steps for f in found)
    return [
        name,
        f"{moving / episodes:.2f} ({interval.low:.2f}–{interval.high:.2f})",
        f"{standing / episodes:.2f}",
        f"{np.median([f.min_distance for f in found]):.2f}",
        f"{np.mean([f.reached_goal for f in found]):.2f}",
        f"{sum(f.status_counts['certified'] for f in found) / steps:.2f}",
    ]


def main() -> None:
    """Measure all cases and write the page's data."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "evidence" / "results" / "60-limits.json")
    chosen = parser.parse_args()
    work = (delayed(row)(name, case, chosen.episodes) for name, case in CASES.items())
    rows: list[list[Any]] = []
    for found in Parallel(n_jobs=-1, return_as="generator")(work):
        rows.append(found)
        print(*found, sep="  ", flush=True)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    write_evidence(
        chosen.out,
        title="Where it fails, in numbers",
        lead=[
            "One robot, default settings, 10 Hz, on collision course with the people of each row. Bodies touch below "
            "0.6 m between centres. A contact counts as *moving* when the robot moved on toward the person; as "
            "*standing* when a person walked into a robot that stood. In brackets, the exact 95 % interval."
        ],
        command=f"python tools/measure_limits.py --episodes {chosen.episodes}",
        tables=[
            {
                "title": f"Share of {chosen.episodes} encounters",
                "header": ["the person", "moving contact", "standing only", "nearest, median (m)", "goal reached",
                           "steps certified"],
                "rows": rows,
            }
        ],
    )  # fmt: skip
    print(f"wrote {chosen.out}")


if __name__ == "__main__":
    main()
