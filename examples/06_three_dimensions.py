"""Up and down too.

Give positions three numbers and everything works in space: here a small aircraft passes another one
whose pilot may or may not have seen it. The same lattice, the same rules; 125 actions instead of
25.
"""

import sys
from pathlib import Path

import sidestep
from sidestep.simulation.metrics import measure
from sidestep.viewer.figures import run_figure, save_figure


def main(folder: Path) -> None:
    scenario = sidestep.Scenario.parse(
        {
            "name": "in space",
            "duration": 25.0,
            "robot": {"start": [0.0, -4.0, 1.5], "goal": [0.0, 4.0, 1.5], "max_speed": 1.0},
            "planner": {"horizon": 5},
            "people": [{"kind": "unconcerned", "start": [-4.0, 0.0, 1.5], "goal": [4.0, 0.0, 1.5]}],
        }
    )
    record = sidestep.simulate(scenario, seed=3)
    numbers = measure(record)
    height = record.robot_positions[:, 2]
    print(f"{record.time[-1]:.1f} s, nearest {numbers.min_distance:.2f} m")
    print(f"height {height.min():.2f} to {height.max():.2f} m")
    save_figure(run_figure(record), folder / "06_three_dimensions.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
