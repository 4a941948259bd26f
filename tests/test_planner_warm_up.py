"""After `warm_up` nothing is compiled or loaded any more: a kernel's first call can take longer than a deadline."""

from __future__ import annotations

import subprocess
import sys

import pytest

import sidestep
from sidestep import rehearsal
from sidestep.robots import Holonomic

COUNT = """
import importlib, pkgutil, sys
import numpy as np
import sidestep, sidestep._kernels as kernels
from sidestep.obstacles import Obstacles
from sidestep.robots import DifferentialDrive, Holonomic, RobotState

def loaded():
    modules = [importlib.import_module(m.name) for m in pkgutil.iter_modules(kernels.__path__, "sidestep._kernels.")]
    compiled = {f"{m.__name__}.{n}": f for m in modules for n, f in vars(m).items() if hasattr(f, "overloads")}
    return {name: set(map(str, f.overloads)) for name, f in compiled.items()}

def drive(planner, seed, steps=30):
    generator = np.random.default_rng(seed)
    place = np.zeros(2)
    people = generator.uniform(-4, 4, (3, 2))
    velocities = generator.uniform(-1, 1, (3, 2))
    planner.reset()
    for k in range(steps):
        seen = [
            sidestep.PersonObservation(id=str(n), position=x + 0.1 * k * v, velocity=v if n else None)
            for n, (x, v) in enumerate(zip(people, velocities))
        ]
        state = RobotState(position=place, heading=0.3, velocity=(0.1, 0.2))
        plan = planner.step(time=0.1 * k, robot=state, people=seen if k % 7 else [])
        place = plan.positions[0] + 0.1 * plan.velocity if plan.positions.size else place

def late(planner):
    before = loaded()
    for seed in range(4):
        drive(planner, seed)
    return {name: kinds - before[name] for name, kinds in loaded().items() if kinds - before[name]}
"""

PLANNERS = {
    "deadline": "sidestep.Planner(robot=Holonomic(), goal=(3.0, 4.0), horizon=40, deadline=0.05)",
    "paper's rule": "sidestep.Planner(robot=Holonomic(), goal=(3.0, 4.0), horizon=5, risk_rule='cells', midway=False)",
    "walls": "sidestep.Planner(robot=DifferentialDrive(max_acceleration=1.0), goal=(3.0, 4.0), "
    "obstacles=Obstacles(polygons=[[(-1, 2), (2, 2), (2, 2.2)]]))",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNERS)
def test_nothing_is_loaded_after_the_warm_up(name):
    warm = "" if name == "deadline" else "planner.warm_up()\n"  # where there is a deadline it is done by itself
    counted = "assert any(loaded().values())\nfound = late(planner)\nassert not found, found\n"
    code = f"{COUNT}\nplanner = {PLANNERS[name]}\n{warm}{counted}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.slow
def test_without_it_kernels_would_be_loaded_late():
    code = f"{COUNT}\nplanner = {PLANNERS['walls']}\nassert late(planner)\n"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_the_rehearsal_meets_everything_from_nobody_to_somebody_too_close(dimension):
    calls = list(rehearsal.calls(Holonomic(), dimension))
    assert len({time for time, _, _ in calls}) == len(calls)
    assert {len(people) for _, _, people in calls} == {0, 1, 2}
    planner = sidestep.Planner(robot=Holonomic(), goal=rehearsal.goal(dimension))
    plans = [planner.step(time=time, robot=state, people=people) for time, state, people in calls]
    statuses = {plan.status for plan in plans}
    assert statuses == ({"least_risk"} if dimension == 1 else {"certified", "least_risk"})  # no way around on a line


def test_warming_up_leaves_the_planner_as_it_was():
    planner = sidestep.Planner(robot=Holonomic(), goal=(3.0, 4.0))
    near = sidestep.PersonObservation(id="p", position=(1.5, 1.0), velocity=(-0.5, 0.0))
    state = sidestep.RobotState(position=(0.0, 0.0))
    other = sidestep.Planner(robot=Holonomic(), goal=(3.0, 4.0))
    other.warm_up()
    first, second = (p.step(time=0.0, robot=state, people=[near]) for p in (planner, other))
    assert (first.positions == second.positions).all()
    assert list(second.people) == ["p"]


@pytest.mark.parametrize("human", [{"goals": [[1.0, 2.0]]}, {"goals": "exits"}, {"speed_range": [0.5, 2.0]}])
def test_whatever_can_be_planned_with_can_be_planned_with_in_time(human):
    walls = sidestep.Obstacles(polygons=[[(20.0, 20.0), (21.0, 20.0), (21.0, 21.0)]])
    for radius in (0.3, 9.0):
        planner = sidestep.Planner(
            robot=Holonomic(radius=radius), goal=(3.0, 4.0), human=sidestep.HumanModel(**human), horizon=2,
            obstacles=walls, deadline=60.0,
        )  # fmt: skip
        plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, 0.0)), people=[])
        assert plan.status == "certified"
