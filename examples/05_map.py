"""A map.

Walls bound what the robot may do and what people are expected to do: nobody is predicted to walk
through a wall. The map is an array of cells, here drawn with letters; maps of ROS's map_server are
read in the same way.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import sidestep
from sidestep.obstacles import OccupancyGrid

DRAWING = """
####################
#..................#
#..................#
#########..#########
#..................#
#..................#
#..................#
####################
"""


def main(folder: Path) -> None:
    rows = DRAWING.strip().splitlines()
    occupied = np.array([[cell == "#" for cell in row] for row in reversed(rows)]).T  # [x, y]
    door = sidestep.Obstacles(grid=OccupancyGrid(occupied=occupied, resolution=0.5))
    robot = sidestep.Holonomic(max_speed=0.8, radius=0.25, shape="disc")
    planner = sidestep.Planner(robot=robot, goal=(2.0, 3.0), obstacles=door)

    position, step = np.array([8.0, 1.0]), 0.2
    robots, persons = [position], []
    for tick in range(150):
        time = tick * step
        person = np.array([4.9, min(3.0, 3.1 - 0.5 * time)]) if time < 2 else np.array([4.9 - 0.6 * (time - 2), 1.6])
        person = np.maximum(person, [1.0, 1.0])
        plan = planner.step(
            time=time,
            robot=sidestep.RobotState(position=position),
            people=[sidestep.PersonObservation(id="a", position=person)],
        )
        position = position + step * plan.velocity
        robots.append(position)
        persons.append(person)
        if np.linalg.norm(position - planner.goal) < 0.2:
            break

    robots = np.array(robots)
    print(f"through the door after {time:.1f} s; nearest to a wall {door.distance(robots).min():.2f} m")
    axes = Figure(figsize=(6.5, 3.2), layout="constrained").add_subplot(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.imshow(occupied.T, origin="lower", extent=(0, 10, 0, 4), cmap="Greys", vmax=2)
    axes.plot(*robots.T, color="#0072B2", marker="o", markersize=3, label="robot")
    axes.plot(*np.array(persons).T, color="#D55E00", marker="o", markersize=3, label="person")
    axes.legend(loc="upper right")
    axes.figure.savefig(folder / "05_map.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
