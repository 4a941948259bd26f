"""The recorded robot runs, fed to our belief update: what it infers beside what was logged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sidestep import belief as bayes
from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.planning.anticipate import extended
from sidestep.prediction.occupancy import action_velocities, first_action_probabilities, frame_of
from sidestep.types import FloatArray

STEP = 5.0  # s of wall clock between recorded steps
GOAL = (-2.0, 0.0)  # m, of the person, as printed in Section V
ROBOT_GOAL = (0.0, -3.0)
HORIZON = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replay:
    """One recorded run.

    Attributes:
        name: of the recording; people, robot: (T, 2) m; beliefs: (T,) P(concerned) that our update infers.
    """

    name: str
    people: FloatArray
    robot: FloatArray
    beliefs: FloatArray


def replay(name: str, people: FloatArray, robot: FloatArray, human: HumanModel) -> Replay:
    """Update the belief along a recording; the robot's own later positions stand for the plan that was anticipated.

    Args:
        name: of the recording.
        people: (T, 2) m; robot: (T, 2) m, at the same instants, one planning step apart.
        human: weights; the walking speed is set so that half a metre per step is one action, as recorded.
    """
    model = replace(human, walking_speed=0.5 / STEP, horizon=HORIZON, measurement_noise=0.0, action_noise=0.0)
    believed = bayes.prior(1, model.prior_concerned)
    beliefs = [believed.concerned]
    for t in range(len(people) - 1):
        lattice = frame_of(model, people[t], None, STEP)
        path = extended(robot[t : t + HORIZON + 1], np.array(ROBOT_GOAL), steps=2 * HORIZON + 1)
        p = first_action_probabilities(
            model=model, lattice=lattice, goals=[PointGoal(GOAL)], robot_path=path, horizon=HORIZON, time_step=STEP
        )
        velocities = action_velocities(model, lattice, STEP)
        moved = people[t + 1] - people[t]
        likelihood = bayes.action_likelihood(p, velocities, moved, STEP, np.zeros((2, 2)))
        believed = bayes.observe(believed, likelihood)
        beliefs.append(believed.concerned)
    return Replay(name=name, people=people, robot=robot, beliefs=np.array(beliefs))
