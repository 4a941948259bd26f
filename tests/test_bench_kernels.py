"""Every kernel timed on what the work it is for gives it, and guarded against growing slow.

`pytest tests/test_bench_kernels.py --benchmark-only` prints the times. The guard compares each kernel with a loop of
fixed work in the same process, best of several runs each, by turns; it allows five times the largest ratio that was
seen on quiet machines of two makes. A kernel above that is timed again for some seconds before it is called slow:
what a busy neighbour does to a machine passes, what an edit does to a kernel stays.
A kernel is what another room calls of `_kernels`; the rooms are searched for them, so that none is forgotten.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator
from time import perf_counter, sleep
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

import sidestep
from made_masses import person
from made_scans import Film, line, room
from sidestep._kernels.ceilings import min_plus_repeatedly
from sidestep.belief import action_likelihood, observe, prior
from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.policy import action_values
from sidestep.io.scenarios import load_scenario
from sidestep.lattice import Lattice
from sidestep.obstacles import Obstacles
from sidestep.perception.tracks import Tracker
from sidestep.planner import Planner
from sidestep.planning.geodesic import open_ways
from sidestep.planning.problem import PlanningProblem
from sidestep.prediction.collision import RiskField
from sidestep.prediction.first_step import FirstStep
from sidestep.prediction.occupancy import predict
from sidestep.robots import Holonomic, RobotState
from sidestep.simulation.loop import simulate

SMALL = 0.03
"""Of kernels that take little more than the call itself."""
RATIOS: dict[str, float] = {  # kernel → the time of its largest call below over that of the loop
    "action_weights": SMALL,
    "add_midway": 0.06,
    "add_midway among walls": 0.3,
    "add_products": 0.1,
    "axis_policies": SMALL,
    "cast": 0.24,
    "cheapest_path": 0.4,
    "choose": 1.9,
    "choose among walls": 2.4,
    "choose_near": 18,
    "class_profiles": 0.34,
    "closest_approach": SMALL,
    "compact": 0.25,
    "contact_shares": 0.15,
    "costs_to_go": 0.34,
    "danger_tables": 0.22,
    "drawn": SMALL,
    "field_box": 1.7,
    "filter_step": SMALL,
    "first_action_costs": 0.048,
    "first_step_costs": 0.24,
    "forbid_changes": SMALL,
    "free_points": 0.32,
    "free_segments": 21,
    "gentle_path": 7,
    "goal_box": 0.04,
    "goal_costs": SMALL,
    "goal_likelihood": SMALL,
    "goals_relaxed": SMALL,
    "grown": SMALL,
    "half_instants": SMALL,
    "head_for": SMALL,
    "interpolate": SMALL,
    "is_another": SMALL,
    "lay_out_actions": SMALL,
    "lay_out_danger": 1.2,
    "lay_out_distances": 0.12,
    "lay_out_squares": SMALL,
    "learn": SMALL,
    "local": SMALL,
    "mark_admissible": 0.23,
    "mass_near": 0.14,
    "mass_near_along": 0.2,
    "mass_within": SMALL,
    "mass_within_along": SMALL,
    "mixed": SMALL,
    "mixed_profiles": SMALL,
    "motion_cost": SMALL,
    "normalised": SMALL,
    "observed": SMALL,
    "odds_of": SMALL,
    "oldest_within": SMALL,
    "part_way": SMALL,
    "program_around": 0.15,
    "promised_gain": SMALL,
    "propagate": 2.9,
    "propagate among walls": 1.2,
    "range_around": SMALL,
    "rasterise_all": 5.3,
    "relaxed": SMALL,
    "remember": SMALL,
    "row_count": SMALL,
    "row_spans": 0.1,
    "seen_off": SMALL,
    "sensed_variance": SMALL,
    "shade": 0.65,
    "shifted": SMALL,
    "shortest_ways": 8,
    "slowing_policies": SMALL,
    "spread_sigmas": SMALL,
    "straight_motion_cost": SMALL,
    "sum_of_leaves": 0.19,
    "sweep": SMALL,
    "sweep_risk": SMALL,
    "take_steps": SMALL,
    "top_speed": SMALL,
    "traversed": 0.36,
    "tube": 0.21,
    "turned": SMALL,
    "usable": SMALL,
    "wall_box": 0.088,
    "wall_distances": 7.4,
    "wall_off": SMALL,
    "weigh_action": SMALL,
}
WALLED = " among walls"
SLACK = 5.0
ROUNDS, PAUSE = 25, 0.2
"""How often a kernel that seems slow is timed, and the s in between."""
MEASURES = ("copy_repeatedly", "min_plus_repeatedly")  # of the machine, not of ours

Calls = dict[str, tuple[Callable[..., Any], list[Any]]]


def _rooms() -> Iterator[ModuleType]:
    """All modules that may call kernels and whose extras are here."""
    for found in pkgutil.walk_packages(sidestep.__path__, "sidestep."):
        if "._kernels" not in found.name and not found.name.endswith("__main__"):
            try:
                yield importlib.import_module(found.name)
            except ImportError:
                continue


def _kernels(module: ModuleType) -> Iterator[tuple[str, str | None, Any]]:
    """(Name of a kernel that a module calls, the name under which the kernel's own module is known there, it)."""
    for name, value in list(vars(module).items()):
        if isinstance(value, CPUDispatcher):
            yield name, None, value
        elif isinstance(value, ModuleType) and value.__name__.startswith("sidestep._kernels."):
            source = inspect.getsource(module)
            for inner, kernel in vars(value).items():
                if isinstance(kernel, CPUDispatcher) and f"{name}.{inner}(" in source:
                    yield inner, name, kernel


def _copied(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else value


def _size(arguments: Any) -> int:
    return sum(a.size for a in arguments if isinstance(a, np.ndarray))


@pytest.fixture(scope="module")
def calls() -> Calls:
    """Kernel → (it, the arguments of its largest call) in all the work below."""
    found: Calls = {}
    where = [""]

    def spied(name: str, kernel: Any) -> Callable[..., Any]:
        def spy(*arguments: Any) -> Any:
            known = found.get(name + where[0])
            if known is None or _size(arguments) >= _size(known[1]):
                found[name + where[0]] = kernel, [_copied(a) for a in arguments]
            return kernel(*arguments)

        return spy

    with pytest.MonkeyPatch.context() as patch:
        for module in list(_rooms()):
            for value in vars(module).values():
                if hasattr(value, "cache_clear"):
                    value.cache_clear()  # what is kept is not computed
            for name, within, kernel in list(_kernels(module)):
                if name in MEASURES:
                    continue
                if within is None:
                    patch.setattr(module, name, spied(name, kernel))
                    continue
                names = vars(getattr(module, within))
                patch.setattr(module, within, SimpleNamespace(**{**names, name: spied(name, kernel)}))
        _plan(None)
        where[0] = WALLED
        _plan(Obstacles(polygons=[[(-6.0, y), (6.0, y), (6.0, y + 0.2), (-6.0, y + 0.2)] for y in (-1.4, 1.2)]))
        where[0] = ""
        _simulate()
        _look()
        _ask()
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


def _simulate() -> None:
    """Shipped scenarios of every kind, shortened."""
    for name in ("crossing", "doorway", "lab-meeting", "paper-printed"):
        simulate(load_scenario(name, ["duration=4.0"]), snapshots=1)
    simulate(load_scenario("circle", ["duration=1.0"]), snapshots=0)
    simulate(load_scenario("crossing", ["duration=2.0", "human.perception_noise=0.2"]), snapshots=0)
    quick = Planner(robot=Holonomic(max_acceleration=1.0), goal=(6.0, 0.0), risk_rule="cells", recourse=None)
    for step in range(8):
        seen = PersonObservation(id="a", position=(6.0 - 0.5 * step, 0.2))
        robot = RobotState(position=(0.2 * step, 0.0), velocity=(0.4, 0.0))
        quick.step(time=0.5 * step, robot=robot, people=[seen])


def _look() -> None:
    """The scanner and the leg tracker."""
    film, tracker = Film(room(), [line((-2.0, 1.0), (2.0, 1.0), 1.0)]), Tracker()
    for _ in range(12):
        tracker.update(film.next())


def _ask() -> None:
    """What is asked of single values: a place, a cell, a motion."""
    people = RiskField(people=[person(horizon=3, spread=True), person(horizon=3)], distances=np.array([0.7, 0.7]))
    people.at(4, np.zeros((200, 2)))
    far = np.linspace((0.0, -5.0), (0.0, 25.0), 61)
    predict(
        model=HumanModel(frame="world"), lattice=Lattice(origin=np.array([-5.0, 0.0]), spacing=0.25, radius=0),
        goals=[PointGoal((5.0, 0.0))], weights=[[0.5, 0.5]], robot_path=far, horizon=30, time_step=0.5,
    )  # fmt: skip
    action_values(
        HumanModel(frame="world", horizon=3), Lattice(origin=np.zeros(2), spacing=0.5, radius=4), PointGoal((3.0, 0.0)),
        np.zeros((4, 2)), 1, 0.5,
    )  # fmt: skip
    walls = Obstacles(polygons=[[(1.0, -1.0), (1.2, -1.0), (1.2, 1.0), (1.0, 1.0)]])
    walls.segment_free(np.zeros((50, 2)), np.ones((50, 2)), 0.1)
    walls.distance(np.zeros((200, 2)))
    open_ways((9.0, 0.0), (-8.0, -8.0), (8.0, 8.0)).field(np.array([[0.0, 0.0], [0.5, 0.8]]), np.ones(2))
    FirstStep(
        positions=np.zeros((1, 2)), sigmas=np.zeros(1), person=np.zeros(1, np.int64), velocities=np.ones((1, 2)),
        probabilities=np.ones(1), distances=np.ones(1), interval=0.5,
    ).risk(np.ones(2), np.zeros((9, 2)))  # fmt: skip
    PlanningProblem(start=np.zeros(2), goal=np.ones(2), time_step=0.5, horizon=3, max_speed=1.0).goal_costs(
        np.zeros((50, 2))
    )
    actions = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    told = action_likelihood(np.full((2, 2, 3), 1 / 3), actions, np.array([0.4, 0.1]), 0.5, 0.01 * np.eye(2))
    observe(prior(2, 0.5), told)


def _best(work: Callable[[], object], best: float, repeats: int = 15) -> float:
    """Least time of some runs, in s, and of those before, `best`."""
    for _ in range(repeats):
        began = perf_counter()
        work()
        best = min(best, perf_counter() - began)
    return best


def test_no_kernel_is_forgotten(calls: Calls) -> None:
    known = {name for module in _rooms() for name, _, _ in _kernels(module)} - set(MEASURES)
    assert known == {name.removesuffix(WALLED) for name in RATIOS}
    assert set(RATIOS) <= set(calls)


@pytest.mark.parametrize("name", RATIOS)
def test_kernel(name: str, calls: Calls, benchmark: Any) -> None:
    kernel, arguments = calls[name]
    benchmark(kernel, *arguments)


@pytest.mark.parametrize("name", RATIOS)
def test_no_kernel_has_grown_slow(name: str, calls: Calls) -> None:
    kernel, arguments = calls[name]
    line = np.linspace(0, 1, 2048, dtype=np.float32)
    out = np.empty_like(line)
    loop = taken = np.inf
    for tried in range(ROUNDS):
        loop = _best(lambda: min_plus_repeatedly(line, out, 1000), loop)
        taken = _best(lambda: kernel(*arguments), taken)
        if taken < SLACK * RATIOS[name] * loop:
            return
        sleep(PAUSE * (tried > 0))
    pytest.fail(f"{name} takes {taken / loop:.3g} times the loop, more than {SLACK:g} times {RATIOS[name]}")
