"""A navigator that drives straight to a goal and writes down what it was told; and scenarios for it."""

from dataclasses import dataclass, field

import numpy as np

from sidestep.simulation.scenario import Scenario


@dataclass
class Drive:
    velocity: np.ndarray
    status: str = "least_risk"


@dataclass
class BlindDriver:
    """Straight on at `speed`, whoever is in the way."""

    goal: tuple[float, ...]
    speed: float = 1.0
    interrupt_at: float = np.inf
    heard: list = field(default_factory=list)
    resets: int = 0

    def reset(self):
        self.resets += 1
        self.heard.clear()

    def step(self, *, time, robot, people):
        if time >= self.interrupt_at:
            raise KeyboardInterrupt
        self.heard.append((time, robot, list(people)))
        way = np.array(self.goal) - robot.position
        distance = np.linalg.norm(way)
        return Drive(velocity=way / max(distance, 1e-9) * min(self.speed, distance / 0.1))


def crossing(*, people=None, **changes):
    """A robot that goes up along y, and one person who crosses from the left at 1 m/s unless told otherwise."""
    one = {"id": "a", "kind": "straight", "start": (-5.0, 0.0), "goal": (5.0, 0.0), "speed": 1.0}
    data = {
        "name": "crossing",
        "robot": {"start": (0.0, -5.0), "goal": (0.0, 5.0)},
        "people": [one] if people is None else people,
    }
    return Scenario.parse(data | changes)
