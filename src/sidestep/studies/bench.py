"""How fast planning is: cases with targets, and other planners on the same scenes in the same run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np

from sidestep.errors import MissingExtra
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.obstacles import Obstacles
from sidestep.planner import Planner
from sidestep.robots import Holonomic, RobotState
from sidestep.simulation.navigators import Navigator
from sidestep.types import FloatArray

STEP = 0.5  # s, of all planners here
DOORWAY = tuple(((x, 2.0), (side, 2.0), (side, 2.2), (x, 2.2)) for x, side in ((-8.0, -0.8), (8.0, 0.8)))  # m


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One scene and the planner that is timed in it.

    Attributes:
        name: for the table; target: ms at the 95th percentile.
        horizon: steps; people: how many; dimension: d.
        goals: candidate goals per person: 1 is known, more are candidates.
        reach: largest action in cells; (2·reach + 1)^d actions.
        doorway: the way leads through `DOORWAY`.
    """

    name: str
    target: float
    horizon: int
    people: int = 1
    dimension: int = 2
    goals: int = 1
    reach: int = 2
    doorway: bool = False

    @property
    def plain(self) -> bool:
        """Whether only the horizon tells this case from the first one."""
        return replace(self, name="", target=0.0) == Case(name="", target=0.0, horizon=self.horizon)


CASES: tuple[Case, ...] = (
    Case(name="N = 5, one person", target=1.0, horizon=5),
    Case(name="N = 10, one person", target=5.0, horizon=10),
    Case(name="N = 10, one person, a doorway", target=5.0, horizon=10, doorway=True),
    Case(name="N = 20, one person", target=20.0, horizon=20),
    Case(name="N = 50, one person", target=300.0, horizon=50),
    Case(name="N = 10, ten people", target=20.0, horizon=10, people=10),
    Case(name="N = 10, fifty people", target=100.0, horizon=10, people=50),
    Case(name="N = 5, 3-D, 125 actions", target=10.0, horizon=5, dimension=3),
    Case(name="N = 10, nine candidate goals", target=25.0, horizon=10, goals=9),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timing:
    """What was measured of a case: planning steps of a whole encounter, ms of wall clock."""

    name: str
    target: float
    times: FloatArray = field(repr=False)

    @property
    def median(self) -> float:
        """Milliseconds."""
        return float(np.median(self.times))

    @property
    def p95(self) -> float:
        """Milliseconds."""
        return float(np.percentile(self.times, 95))


def scene(
    case: Case, generator: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return robot (d,), its goal (d,), people (P, d) m, their velocities (P, d) m/s and goals (P, d) m."""
    d = case.dimension
    robot, goal = np.zeros(d), np.zeros(d)
    robot[-1], goal[-1] = -5.0, 5.0
    people, velocities = np.zeros((case.people, d)), np.zeros((case.people, d))
    if case.people == 1:
        people[0, 0], velocities[0, 0] = -5.0, 1.0
    else:
        side = np.sqrt(case.people) * 1.5
        people[:] = generator.uniform(-side, side, (case.people, d))
        near = np.linalg.norm(people - robot, axis=1) < 1.0
        people[near, -1] += 2.0
        angle = generator.uniform(0, 2 * np.pi, case.people)
        velocities[:, 0], velocities[:, -1] = np.cos(angle), np.sin(angle)
    return robot, goal, people, velocities, people + 10.0 * velocities


def time_case(case: Case, *, steps: int, deadline: float | None = None) -> Timing:
    """Time `steps` planning steps, encounter after encounter, after one to warm up."""
    planner = _planner(case, deadline=deadline)
    times: list[float] = []
    encounter = 0
    while len(times) < steps + 4:
        generator = np.random.default_rng(encounter)
        times += _encounter(planner, case, generator)
        encounter += 1
    return Timing(name=case.name, target=case.target, times=np.array(times[4 : steps + 4]))


def thread_ratios(*, encounters: int) -> dict[str, float]:
    """How many times less a step among ten people takes on two threads: medians, encounters of either by turns."""
    ratios: dict[str, float] = {}
    for horizon in (10, 20):
        case = Case(name="", target=math.nan, horizon=horizon, people=10)
        planners = {threads: _planner(case, threads=threads) for threads in (1, 2)}
        times: dict[int, list[float]] = {threads: [] for threads in planners}
        for encounter in range(encounters + 1):
            for threads, planner in planners.items():
                spent = _encounter(planner, case, np.random.default_rng(encounter))
                times[threads] += spent if encounter else []  # the first one warms up
        ratios[f"one_thread_over_two_ten_people_n{horizon}"] = float(np.median(times[1]) / np.median(times[2]))
    return ratios


def _planner(case: Case, **changes: Any) -> Planner:
    goals: tuple[tuple[float, ...], ...] = ()
    if case.goals > 1:
        ring = np.linspace(0, 2 * np.pi, case.goals, endpoint=False)
        goals = tuple((5.0 * float(np.cos(a)), 5.0 * float(np.sin(a))) for a in ring)
    return Planner(
        robot=Holonomic(max_speed=1.0, radius=0.3),
        goal=np.zeros(case.dimension),
        human=HumanModel(goals=goals, reach=case.reach),
        time_step=STEP,
        horizon=case.horizon,
        obstacles=Obstacles(polygons=DOORWAY) if case.doorway else None,
        **changes,
    )


def _encounter(planner: Navigator, case: Case, generator: np.random.Generator, length: int = 20) -> list[float]:
    """Times (ms) of the planning steps of one encounter; people walk on, whatever the robot does."""
    robot, goal, people, velocities, goals = scene(case, generator)
    if isinstance(planner, Planner):
        planner.goal = goal
    planner.reset()
    times: list[float] = []
    for i in range(length):
        known = case.goals == 1
        seen = [
            PersonObservation(id=str(k), position=x, velocity=v, goal=g if known else None)
            for k, (x, v, g) in enumerate(zip(people, velocities, goals, strict=True))
        ]
        state = RobotState(position=robot)
        began = perf_counter()
        answer = planner.step(time=STEP * i, robot=state, people=seen)
        times.append(1e3 * (perf_counter() - began))
        robot = robot + STEP * answer.velocity
        people = people + STEP * velocities
    return times


def time_peers(*, steps: int) -> tuple[dict[str, Timing], list[str]]:
    """Time ORCA and the constant-velocity MPC (15 steps) on the first case's scene; and say which are not installed."""
    from sidestep.simulation.peers_mpc import ConstantVelocityMpc
    from sidestep.simulation.peers_orca import Orca
    from sidestep.simulation.scenario import Scenario
    from sidestep.studies.opponents import trip_of

    scenario = Scenario.parse(
        {
            "name": "bench",
            "robot": {"start": (0.0, -5.0), "goal": (0.0, 5.0), "radius": 0.3},
            "people": [{"start": (-5.0, 0.0), "goal": (5.0, 0.0)}],
        }
    )
    makers: Sequence[tuple[str, Callable[[], Navigator]]] = (
        ("ORCA", lambda: Orca(trip_of(scenario))),
        ("constant-velocity MPC, 15 steps", lambda: ConstantVelocityMpc(trip_of(scenario), stages=15)),
    )
    found: dict[str, Timing] = {}
    missing: list[str] = []
    for name, make in makers:
        try:
            peer = make()
        except MissingExtra as error:
            missing.append(f"{name}: {error}")
            continue
        times: list[float] = []
        while len(times) < steps + 4:
            times += _encounter(peer, CASES[0], np.random.default_rng(0))
        found[name] = Timing(name=name, target=float("nan"), times=np.array(times[4 : steps + 4]))
    return found, missing


def deadline_overruns(*, deadline: float, horizon: int, steps: int) -> dict[str, float]:
    """Return how often and by how much (ms) planning at this horizon runs past a deadline (s)."""
    case = Case(name="deadline", target=1e3 * deadline, horizon=horizon)
    late = time_case(case, steps=steps, deadline=deadline).times - 1e3 * deadline
    return {
        "deadline_ms": 1e3 * deadline,
        "horizon": horizon,
        "steps": steps,
        "share": float((late > 0).mean()),
        "worst_ms": float(max(late.max(), 0.0)),
    }


def exponents(timings: Mapping[str, Sequence[tuple[int, float]]]) -> dict[str, float]:
    """Return the slope of ln time over ln size for each series of (size, ms), by least squares."""
    slopes: dict[str, float] = {}
    for name, series in timings.items():
        x, y = np.log(np.array(series)).T
        slopes[name] = float(np.polyfit(x, y, 1)[0])
    return slopes
