"""Two wheels instead of any direction.

A differential drive cannot step aside; it has to turn. The planner plans for a point a little ahead
of the axle, which can, and `Plan.command` is what the wheels take: forward speed and turn rate.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import sidestep


def main(folder: Path) -> None:
    base = sidestep.DifferentialDrive(max_speed=0.8, max_turn_rate=3.0, radius=0.25)
    planner = sidestep.Planner(robot=base, goal=(6.0, 0.0))
    state, step = sidestep.RobotState(position=(0.0, 0.0), heading=1.2), 0.1  # looks away from its goal
    poses, commands = [], []
    for tick in range(200):
        time = tick * step
        person = sidestep.PersonObservation(id="a", position=(7.0 - 0.9 * time, 0.3), velocity=(-0.9, 0.0))
        plan = planner.step(time=time, robot=state, people=[person])
        state = base.executed(plan.command, state, step)
        poses.append((*state.position, state.heading))
        commands.append(plan.command)
        if np.linalg.norm(base.reference(state) - planner.goal) < 0.2:  # the point, not the axle, is to be there
            break

    poses, commands = np.array(poses), np.array(commands)
    print(
        f"arrived after {time:.1f} s; forward at most {commands[:, 0].max():.2f} m/s, "
        f"turning at most {np.abs(commands[:, 1]).max():.2f} rad/s"
    )
    figure = Figure(figsize=(7, 4.5), layout="constrained")
    above, below = figure.subplots(2, 1)
    above.plot(poses[:, 0], poses[:, 1], color="#0072B2")
    above.quiver(*poses[::8, :2].T, np.cos(poses[::8, 2]), np.sin(poses[::8, 2]), color="#0072B2", width=0.004)
    above.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="where the robot looked")
    below.plot(step * np.arange(len(commands)), commands, label=["forward (m/s)", "turn (rad/s)"])
    below.set(xlabel="time (s)")
    below.legend()
    figure.savefig(folder / "03_custom_robot.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
