"""Another planner in our simulator.

Anything with `reset` and `step` can drive: the same people, sensor, limits and seeds. Here a
potential field, twenty lines, against our planner, six runs each.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import sidestep
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.metrics import measure
from sidestep.simulation.navigators import steering


class PotentialField:
    """Pulled by the goal, pushed by people."""

    def __init__(self, goal, max_speed):
        self.goal, self.max_speed = np.array(goal), max_speed

    def reset(self):
        """Nothing to forget."""

    def step(self, *, time, robot, people):
        pull = self.goal - robot.position
        velocity = pull / max(np.linalg.norm(pull), 0.5) * self.max_speed
        for person in people:
            away = robot.position - person.position
            distance = np.linalg.norm(away)
            velocity = velocity + 1.5 * np.exp(-distance) * away / distance
        return steering(velocity, self.max_speed)


def main(folder: Path) -> None:
    scenario = load_scenario("crossing", ["people.0.kind=unconcerned"])
    axes = Figure(figsize=(5.5, 4), layout="constrained").add_subplot(xlabel="nearest (m)", ylabel="time to goal (s)")
    for name, colour in (("potential field", "#D55E00"), ("sidestep", "#0072B2")):
        results = []
        for seed in range(6):
            field = PotentialField(scenario.robot.goal, scenario.robot.max_speed)
            record = sidestep.simulate(scenario, seed=seed, navigator=field if name == "potential field" else None)
            results.append((measure(record).min_distance, record.time[-1]))
        nearest, duration = np.array(results).T
        print(f"{name}: nearest {nearest.min():.2f} m in six runs, on average {duration.mean():.1f} s")
        axes.plot(nearest, duration, "o", color=colour, alpha=0.5, label=name)
    axes.axvline(0.6, color="black", linestyle=":", label="contact")
    axes.legend()
    axes.figure.savefig(folder / "07_other_planner.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
