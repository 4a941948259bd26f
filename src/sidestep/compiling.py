"""The first time: a second process compiles the search for a motion, while this one compiles predictions.

Both keep what they compile in numba's cache, where the other finds it. What is compiled twice costs nothing but time on
a processor that would be idle.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from sidestep import minds
from sidestep._kernels.decide import odds_of
from sidestep._kernels.evidence import weigh_action
from sidestep.crew import Crew
from sidestep.human.cost import TIE
from sidestep.human.decision import first_action_costs
from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.planning.anticipate import straight
from sidestep.planning.polish import polish
from sidestep.planning.search import Outlook, search
from sidestep.planning.settings import PlannerSettings
from sidestep.prediction.occupancy import action_velocities
from sidestep.robots import Holonomic, RobotState
from sidestep.situation import Situation, circumstances
from sidestep.subjects import Subject
from sidestep.types import frozen_array, sealed

_HELP = "from sidestep.compiling import rehearse_backwards; rehearse_backwards()"


def compiled() -> bool:
    """Whether numba's cache holds what is compiled last, or keeps nothing (then a second process is of no help)."""
    folder = getattr(getattr(weigh_action, "stats", None), "cache_path", None)  # NUMBA_DISABLE_JIT
    return folder is None or any(Path(folder).glob("evidence.weigh_action-*.nbi"))


@contextmanager
def helped() -> Generator[None]:
    """Have a second process compile ahead where nothing is compiled yet; it ends with the block at the latest."""
    if compiled() or (os.cpu_count() or 1) < 2:
        yield
        return
    quiet = subprocess.DEVNULL
    helper = subprocess.Popen([sys.executable, "-c", _HELP], stdin=quiet, stdout=quiet, stderr=quiet)
    try:
        yield
    finally:
        helper.terminate()
        helper.wait()


def rehearse_backwards() -> None:
    """Do what the first process comes to last: search and polish, decide as a person would, weigh what was seen.

    Everything by the default settings, in the plane. What is needed first, predictions, is left to the first process.
    """
    settings, human, robot = PlannerSettings(), HumanModel(), Holonomic(max_speed=1.0, radius=0.3)
    start, goal, step = frozen_array([0.0, 0.0]), frozen_array([0.0, 8.0]), settings.time_step
    around = circumstances(settings, robot, horizon=settings.horizon, interval=step, dimension=2, obstacles=None)
    alone = Situation(
        time=0.0,
        robot=robot,
        state=RobotState(position=start),
        start=start,
        goal=goal,
        settings=settings,
        around=around,
        everybody=(),
        field=None,
        crew=Crew(),
        outlook=Outlook(),
    )
    way = straight(start, goal, speed=1.0, time_step=step, steps=alone.steps)
    problem = alone.problem_under(alone.foresee(way))
    polish(problem, search(problem))
    mind = minds.meet(PersonObservation(id="", position=(2.0, 2.0), velocity=(-1.0, 0.0)), human, 0.0)
    there = Subject(mind, around)
    costs = first_action_costs(replace(human, horizon=1), there.lattice, PointGoal(goal), way, 1, step)
    odds_of(costs, human.rationality, TIE)
    anything = sealed(np.full((len(mind.goals), 2, len(costs)), 1.0 / len(costs)))
    mind = minds.expect(mind, anything, sealed(action_velocities(human, there.lattice, step)), 0.0)
    minds.observe(mind, PersonObservation(id="", position=(1.5, 2.0)), step, step)
