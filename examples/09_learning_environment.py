"""An environment for reinforcement learning.

The simulator behind the Gymnasium interface: observations are the goal and the person relative to
the robot, actions are velocities, the reward is progress minus a price for coming near. Needs `pip
install 'sidestep[gym]'`. The policy here is random search over a linear one, a few seconds of it:
enough to see the return rise.
"""

import sys
from pathlib import Path

import gymnasium
import numpy as np
from matplotlib.figure import Figure

from sidestep.io.scenarios import load_scenario
from sidestep.simulation.loop import Run
from sidestep.simulation.navigators import steering


class Hand:
    """Drives as it was told last, and keeps what was seen of people."""

    def __init__(self):
        self.velocity, self.seen = np.zeros(2), np.zeros(4)

    def reset(self):
        self.__init__()

    def step(self, *, time, robot, people):
        for person in people:
            self.seen = np.concatenate([person.position, person.velocity])
        return steering(self.velocity, max_speed=1.0)


class Passing(gymnasium.Env):
    """Pass one person."""

    def __init__(self, kind="straight"):
        self.scenario = load_scenario("crossing", [f"people.0.kind={kind}"], duration=20.0)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (6,), np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        changed = self.scenario.changed(seed=int(self.np_random.integers(2**31)))
        self.hand = Hand()
        self.run = Run(changed, navigator=self.hand, snapshots=0)
        return self._observation(), {}

    def step(self, action):
        self.hand.velocity = np.asarray(action, dtype=float)
        before = np.linalg.norm(self.run.goal - self.run.state.position)
        arrived = self.run.advance()
        here = self.run.state.position
        near = np.linalg.norm(self.run.places[0] - here)
        reward = before - np.linalg.norm(self.run.goal - here) - 5.0 * max(0.9 - near, 0.0)
        late = self.run.time >= self.scenario.duration
        return self._observation(), float(reward), bool(arrived), bool(late), {"nearest": float(near)}

    def _observation(self):
        here = self.run.state.position
        return np.concatenate([self.run.goal - here, self.run.places[0] - here, self.hand.seen[2:]])


class Driver:
    """A linear policy: velocity = tanh(W · observation)."""

    def __init__(self, weights):
        self.weights = weights

    def episode(self, environment, seed):
        seen, _ = environment.reset(seed=seed)
        total, done = 0.0, False
        while not done:
            seen, reward, arrived, late, _ = environment.step(np.tanh(self.weights @ seen))
            total, done = total + reward, arrived or late
        return total


def main(folder: Path) -> None:
    environment, generator = Passing(), np.random.default_rng(0)
    best = np.hstack([0.5 * np.eye(2), np.zeros((2, 4))])  # straight to the goal
    score = np.mean([Driver(best).episode(environment, seed) for seed in range(3)])
    scores = [score]
    for _ in range(60):
        trial = best + 0.3 * generator.standard_normal(best.shape)
        value = np.mean([Driver(trial).episode(environment, seed) for seed in range(3)])
        if value > score:
            best, score = trial, value
        scores.append(score)
    print(f"mean return {scores[0]:.2f} at first, {scores[-1]:.2f} after 60 trials")
    axes = Figure(figsize=(5.5, 3.5), layout="constrained").add_subplot(xlabel="trial", ylabel="mean return")
    axes.plot(scores, color="#0072B2")
    axes.figure.savefig(folder / "09_learning_environment.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
