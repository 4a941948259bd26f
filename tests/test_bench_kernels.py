"""Every kernel timed on what a planning step of the first bench cases gives it, and guarded against growing slow.

`pytest tests/test_bench_kernels.py --benchmark-only` prints the times. The guard compares each kernel with a loop of
fixed work in the same process, best of several runs each, and allows four times the ratio that it was seen to have.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import pytest

from sidestep._kernels.ceilings import min_plus_repeatedly
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.obstacles import Obstacles
from sidestep.planner import Planner
from sidestep.robots import Holonomic, RobotState

KERNELS = {  # kernel → (the module that calls it, its time over that of the loop at N = 10)
    "lay_out_danger": ("sidestep.human.cost", 0.07),
    "lay_out_actions": ("sidestep.human.cost", 0.02),
    "choose": ("sidestep.human.policy", 1.2),
    "contact_shares": ("sidestep.prediction.propagation", 0.15),
    "propagate": ("sidestep.prediction.propagation", 0.65),
    "add_midway": ("sidestep.prediction.propagation", 0.05),
    "class_profiles": ("sidestep.prediction.profiles", 0.35),
    "mixed_profiles": ("sidestep.prediction.profiles", 0.05),
    "mass_near_along": ("sidestep.prediction.collision", 0.2),
    "compact": ("sidestep.prediction.person_mass", 0.25),
    "rasterise_all": ("sidestep.prediction.collision", 1.6),
    "first_step_costs": ("sidestep.prediction.first_step", 0.02),
    "goal_box": ("sidestep.planning.search_maps", 0.04),
    "costs_to_go": ("sidestep.planning.search_maps", 0.21),
    "tube": ("sidestep.planning.search_maps", 0.11),
    "cheapest_path": ("sidestep.planning.search", 0.4),
    "program_around": ("sidestep.planning.polish", 0.15),
    "straight_motion_cost": ("sidestep.planning.problem", 0.01),
    "choose among walls": ("sidestep.human.policy", 2.4),
    "propagate among walls": ("sidestep.prediction.propagation", 1.2),
    "add_midway among walls": ("sidestep.prediction.propagation", 0.3),
}
WALLED = " among walls"
SLACK = 4.0


def _writable(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else value


@pytest.fixture(scope="module")
def calls() -> dict[str, tuple[Callable[..., Any], list[Any]]]:
    """Kernel → (it, the arguments of its largest call) while a person crosses the robot's way, N = 10."""
    found: dict[str, tuple[Callable[..., Any], list[Any]]] = {}
    with pytest.MonkeyPatch.context() as patch:
        where = [""]
        for name, (module, _) in KERNELS.items():
            if name.endswith(WALLED):
                continue
            kernel = getattr(importlib.import_module(module), name)

            def spy(*arguments: Any, kernel: Any = kernel, name: str = name) -> Any:
                found[name + where[0]] = kernel, [_writable(a) for a in arguments]
                return kernel(*arguments)

            patch.setattr(f"{module}.{name}", spy)
        _plan(None)
        where[0] = WALLED
        _plan(Obstacles(polygons=[[(-6.0, y), (6.0, y), (6.0, y + 0.2), (-6.0, y + 0.2)] for y in (-1.4, 1.2)]))
    return found


def _plan(obstacles: Obstacles | None) -> None:
    """A person crosses the robot's way; where there are walls, both go through the corridor between them."""
    goal, start = ((0.0, 5.0), (0.0, -3.0)) if obstacles is None else ((5.0, 0.5), (0.0, 0.5))
    planner = Planner(robot=Holonomic(), goal=goal, horizon=10, human=HumanModel(), obstacles=obstacles)
    for step in range(5):
        person = PersonObservation(
            id="a", position=(-4.0 + 0.5 * step, 0.0), velocity=(1.0, 0.0), goal=np.array([5.0, 0.0])
        )
        robot = start if obstacles is not None else (0.0, start[1] + 0.4 * step)
        planner.step(time=0.5 * step, robot=RobotState(position=robot), people=[person])


def _best(work: Callable[[], object], repeats: int = 15) -> float:
    times: list[float] = []
    for _ in range(repeats):
        began = perf_counter()
        work()
        times.append(perf_counter() - began)
    return min(times)


@pytest.mark.parametrize("name", KERNELS)
def test_kernel(name: str, calls: dict[str, tuple[Callable[..., Any], list[Any]]], benchmark: Any) -> None:
    kernel, arguments = calls[name]
    benchmark(kernel, *arguments)


@pytest.mark.parametrize("name", KERNELS)
def test_no_kernel_has_grown_slow(name: str, calls: dict[str, tuple[Callable[..., Any], list[Any]]]) -> None:
    kernel, arguments = calls[name]
    line = np.linspace(0, 1, 2048, dtype=np.float32)
    loop = _best(lambda: min_plus_repeatedly(line, np.empty_like(line), 1000))
    ratio = _best(lambda: kernel(*arguments)) / loop
    assert ratio < SLACK * KERNELS[name][1], f"{name} takes {ratio:.3g} times the loop"
