"""Many people at once.

Eight people cross a square, half of them with their eyes on a phone. The risks of all of them add
up; each has a belief of their own.
"""

import sys
from pathlib import Path

import numpy as np

import sidestep
from sidestep.simulation.metrics import measure
from sidestep.viewer.figures import run_figure, save_figure


def main(folder: Path) -> None:
    generator = np.random.default_rng(5)
    people = []
    for k in range(8):
        angle = 2 * np.pi * (k + 0.5) / 8 + generator.uniform(-0.2, 0.2)
        start = 7.0 * np.array([np.cos(angle), np.sin(angle)])
        goal = -start + generator.uniform(-1.0, 1.0, size=2)
        kind = "concerned" if k % 2 else "unconcerned"
        people.append({"kind": kind, "start": start.tolist(), "goal": goal.tolist(), "goal_known": False})
    scenario = sidestep.Scenario.parse(
        {"name": "square", "duration": 30.0, "robot": {"start": [0.5, -8.0], "goal": [0.5, 8.0]}, "people": people}
    )
    record = sidestep.simulate(scenario, seed=1)
    numbers = measure(record)
    print(
        f"{record.time[-1]:.1f} s, nearest {numbers.min_distance:.2f} m, "
        f"{numbers.plan_median:.0f} ms per plan, {numbers.status_counts}"
    )
    for name, awareness, belief in zip(record.people, record.people_awareness[0], record.beliefs[-1], strict=True):
        print(f"  {name}: {'concerned' if awareness else 'unconcerned'}, belief at the end {belief:.2f}")
    save_figure(run_figure(record), folder / "04_many_people.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
