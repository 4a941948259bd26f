"""Messages and parts for the tests of the node that need no ROS."""

from __future__ import annotations

from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np

from sidestep.planning.plan import PersonPlan, Plan


class NamespaceMaker:
    """Messages as plain namespaces, stamps as in ROS 2."""

    def __call__(self, name: str, /, **fields: Any) -> Any:
        return SimpleNamespace(kind=name, **fields)

    def stamp(self, seconds: float) -> Any:
        whole = round(seconds * 1e9)
        return SimpleNamespace(sec=whole // 10**9, nanosec=whole % 10**9)

    duration = stamp

    def numbers(self, kind: str, values: Any) -> Any:
        return np.asarray(values, dtype=kind)

    def level(self, value: int) -> Any:
        return value


def stamp1(seconds: float) -> SimpleNamespace:
    """A stamp as ROS 1 has it."""
    return SimpleNamespace(secs=int(seconds), nsecs=round((seconds % 1) * 1e9))


def namespace_pose(x: float, y: float, quaternion: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> SimpleNamespace:
    return SimpleNamespace(
        position=SimpleNamespace(x=x, y=y, z=0.0),
        orientation=SimpleNamespace(**dict(zip("xyzw", quaternion, strict=True))),
    )


def plan_of(
    time: float,
    velocity: tuple[float, float] = (0.4, 0.0),
    status: str = "certified",
    people: int = 0,
    start=(0.0, 0.0),
) -> Plan:
    """A plan straight on, past `people` who stand."""
    steps = np.arange(4)[:, None]
    positions = 0.5 * steps * np.asarray(velocity)
    return Plan(
        time=time,
        time_step=0.5,
        velocity=np.asarray(velocity, dtype=float),
        command=np.asarray(velocity, dtype=float),
        positions=positions,
        velocities=np.tile(velocity, (3, 1)).astype(float),
        collision_probability=np.zeros(3),
        risk=np.zeros(3),
        risk_limit=0.02,
        status=status,
        reason="" if status == "certified" else f"{status} for the test",
        people=MappingProxyType({f"p{i}": _person() for i in range(people)}),
        horizon_used=3,
        rounds=1,
        cost=0.0,
        duration=0.001,
        signal=False,
    )


def _person() -> PersonPlan:
    from sidestep.lattice import Lattice
    from sidestep.prediction.occupancy import Occupancy  # compiled kernels: slow to import

    lattice = Lattice(origin=np.array([1.0, 1.0]), spacing=0.25, radius=1)
    mass = np.zeros((4, 3, 3))
    mass[:, 1, 1] = 1.0
    return PersonPlan(
        belief=0.75,
        foretell=lambda: Occupancy(lattice=lattice, probability=mass, time_step=0.5),
        collision_probability=np.zeros(3),
        goals=MappingProxyType({}),
        randomness=0.1,
        position=np.array([1.0, 1.0]),
        velocity=np.array([0.3, 0.0]),
    )


class StraightPlanner:
    """Plans a constant velocity, and counts."""

    def __init__(self, velocity: tuple[float, float] = (0.4, 0.0), status: str = "certified") -> None:
        self.velocity, self.status = velocity, status
        self.calls: list[Any] = []

    def step(self, *, time: float, robot: Any, people: Any) -> Plan:
        self.calls.append((time, robot, people))
        return plan_of(time, self.velocity, self.status)


class Wheels:
    """Takes the velocity as it is."""

    def command(self, velocity: Any, state: Any, *, hold: float = 0.0) -> Any:
        return np.asarray(velocity)

    def reference(self, state: Any) -> Any:
        return state.position


class Eyes:
    """Remembers what it was shown."""

    def __init__(self) -> None:
        self.shown: list[Any] = []
        self.cleared = 0
        self.maps: list[Any] = []

    def map(self, grid: Any) -> None:
        self.maps.append(grid)

    def scan(self, scan: Any, pose: Any, time: float) -> None:
        self.shown.append((scan, pose, time))

    people = scan

    def now(self, time: float) -> list[Any]:
        return []

    def clear(self) -> None:
        self.cleared += 1
