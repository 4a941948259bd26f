"""The smallest loop.

A planner, a robot that does what it is told, and one person who walks straight on and never looks
up. Ten times per second the planner hears where everybody is and answers with a velocity.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import sidestep


def main(folder: Path) -> None:
    planner = sidestep.Planner(robot=sidestep.Holonomic(max_speed=1.0, radius=0.3, shape="disc"), goal=(0.0, 5.0))
    robot, step = np.array([0.0, -5.0]), 0.1  # m, s
    robots, persons = [robot], []
    for tick in range(150):
        time = tick * step
        person = np.array([-5.0 + 1.0 * time, 0.0])  # m; walks at 1 m/s
        plan = planner.step(
            time=time,
            robot=sidestep.RobotState(position=robot),
            people=[sidestep.PersonObservation(id="walker", position=person, velocity=(1.0, 0.0))],
        )
        robot = robot + step * plan.velocity
        robots.append(robot)
        persons.append(person)
        if np.linalg.norm(robot - planner.goal) < 0.2:
            break

    gap = np.linalg.norm(np.array(robots[:-1]) - np.array(persons), axis=1)
    print(f"arrived after {time:.1f} s; nearest {gap.min():.2f} m; last status: {plan.status}")
    axes = Figure(figsize=(5, 5), layout="constrained").add_subplot(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    for path, colour, name in ((robots, "#0072B2", "robot"), (persons, "#D55E00", "person")):
        axes.plot(*np.array(path).T, color=colour, label=name)
        axes.plot(*np.array(path)[::20].T, "o", color=colour)  # every 2 s
    axes.legend()
    axes.figure.savefig(folder / "01_minimal_loop.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
