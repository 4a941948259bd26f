"""The simulated lab: a furnished room, a LoCoBot-sized base on its way through, and someone who crosses that way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sidestep.checks import seeded
from sidestep.errors import InvalidInput
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.scene import Scene, rectangle
from sidestep.types import FloatArray, Vector

CONTROL_STEP = 0.05  # s, of the base's own loop
_HALF = (5.5, 4.5)  # m, half the room along x and y
_START, _GOAL = (0.0, 3.0), (0.0, -3.0)
_ROBOT_SPEED = 0.5  # m/s
_PERSON_RADIUS = 0.3  # m
_LANE = 0.9  # m; furniture keeps this far from both straight ways
_DOORS = np.array([(5.0, 0.0), (-5.0, 0.0), (2.5, 4.0), (-2.5, 4.0), (3.0, -4.0), (-3.0, -4.0)])  # m
_TRIES = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class LabSettings:
    """What may be varied in the lab.

    Attributes:
        human: kind of the person who crosses.
        planner_rate: Hz; 20 divided by a whole number.
        latency: s, from the end of a scan until the planner's computer has it.
        dropout: probability that a scan never arrives.
        goals: what the planner is told of where someone who walks is heading: "known", the place, as in the paper;
            "candidates", four places, one of them the right one; or "unknown".
        physics: "kinematic", or "mujoco": wheels, contacts, and MuJoCo's own rays.
        seed: of everything random.
    """

    human: Literal["concerned", "unconcerned"] = "concerned"
    planner_rate: float = 2.0
    latency: float = 0.0
    dropout: float = 0.0
    goals: Literal["known", "candidates", "unknown"] = "known"
    physics: Literal["kinematic", "mujoco"] = "kinematic"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.human not in ("concerned", "unconcerned"):
            raise InvalidInput("lab.human", self.human, "concerned or unconcerned")
        seeded("lab.seed", self.seed)
        steps = 1 / (CONTROL_STEP * self.planner_rate) if self.planner_rate > 0 else 0.0
        if steps < 1 - 1e-9 or abs(steps - round(steps)) > 1e-6 or self.planner_rate < 0.5:
            raise InvalidInput("lab.planner_rate", self.planner_rate, "20, 10, 5, 4, 2.5, 2, 1 or 0.5 (Hz)")
        if not 0 <= self.latency <= 2:
            raise InvalidInput("lab.latency", self.latency, "0 to 2 s (0 to 2000 ms)")
        if not 0 <= self.dropout < 1:
            raise InvalidInput("lab.dropout", self.dropout, "a probability from 0 to below 1")
        if self.goals not in ("known", "candidates", "unknown"):
            raise InvalidInput("lab.goals", self.goals, "known, candidates or unknown")
        if self.physics not in ("kinematic", "mujoco"):
            raise InvalidInput("lab.physics", self.physics, "kinematic or mujoco")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabRoom:
    """One furnished room with one trip through it.

    Attributes:
        scene: what a scanner sees at its height (the legs of a table).
        scenario: the run; its walls are what stands in the way (the whole table).
        destinations: (x, y) m, places that people who walk through this room may be heading for; the first is where
            the one who crosses is going.
    """

    scene: Scene
    scenario: Scenario
    destinations: tuple[tuple[float, ...], ...]


def lab_room(settings: LabSettings) -> LabRoom:
    """Draw room, furniture, bystander and the crossing person; the same for both kinds of human.

    The person walks so that both would be at the crossing at about the same time, if nobody reacted.
    """
    generator = np.random.default_rng(np.random.SeedSequence((settings.seed, 0x1AB)))
    start, goal, velocity = _crossing(generator)
    lanes = ((np.array(_START), np.array(_GOAL)), (start - 2.0 * velocity, goal))
    bystander = _free_place(generator, lanes, (), 1.2)
    seen, solid = _walls()
    cylinders: list[tuple[float, float, float]] = []
    taken: list[Vector] = [bystander]
    for maker in (_table, _table, _chair, _chair, _chair, _cupboard, _cupboard, _bin, _bin):
        place = _free_place(generator, lanes, tuple(taken), _LANE)
        taken.append(place)
        more_seen, more_round, outline = maker(generator, place)
        seen += more_seen
        cylinders += more_round
        solid.append(outline)
    scene = Scene(polygons=tuple(seen), cylinders=np.array(cylinders).reshape(-1, 3))
    scenario = _scenario(settings, generator, solid, (start, goal, velocity), bystander)
    others = [tuple(place.tolist()) for place in generator.permutation(_DOORS)[:3]]
    return LabRoom(scene=scene, scenario=scenario, destinations=(tuple(goal.tolist()), *others))


def _scenario(
    settings: LabSettings,
    generator: np.random.Generator,
    solid: list[FloatArray],
    way: tuple[Vector, Vector, Vector],
    bystander: Vector,
) -> Scenario:
    start, goal, velocity = way
    person: dict[str, Any] = {
        "id": "person",
        "kind": settings.human,
        "start": start.tolist(),
        "goal": goal.tolist(),
        "goal_known": False,
        "arrives_with": velocity.tolist(),
        "speed": float(np.hypot(*velocity)),
        "randomness": 0.1,
        "radius": _PERSON_RADIUS,
    }
    stander = {"id": "bystander", "kind": "standing", "start": bystander.tolist(), "radius": _PERSON_RADIUS}
    return Scenario.parse(
        {
            "name": "lab",
            "description": "A furnished room; the planner sees what a leg tracker makes of a scanner's beams.",
            "seed": settings.seed,
            "duration": 40.0,
            "planning_period": 1 / settings.planner_rate,
            "control_step": CONTROL_STEP,
            "robot": {
                "kind": "differential",
                "start": list(_START),
                "goal": list(_GOAL),
                "heading": -np.pi / 2 + generator.normal(0.0, 0.1),
                "max_speed": _ROBOT_SPEED,
                "max_turn_rate": 3.14,
                "radius": 0.177,
                "goal_tolerance": 0.25,
            },
            "people": [person, stander],
            "walls": [polygon.tolist() for polygon in solid],
        }
    )


def _crossing(generator: np.random.Generator) -> tuple[Vector, Vector, Vector]:
    """Return start, goal (m) and velocity (m/s) of the person."""
    for _ in range(_TRIES):
        meeting = generator.uniform(3.0, 5.5)  # s until both are there
        crossing = np.array([0.0, _START[1] - _ROBOT_SPEED * meeting])
        angle = generator.choice([-1.0, 1.0]) * generator.uniform(np.radians(40), np.radians(170))
        heading = -np.pi / 2 + angle  # 0 would be the robot's own way
        velocity = generator.uniform(0.7, 1.2) * np.array([np.cos(heading), np.sin(heading)])
        start = crossing - (meeting + generator.normal(0.0, 0.2)) * velocity
        goal = crossing + generator.uniform(2.5, 3.5) * velocity / np.hypot(*velocity)
        inside = [np.all(np.abs(p) < np.array(_HALF) - 0.5) for p in (start, goal)]
        if all(inside) and np.hypot(*(start - _START)) > 2.0:
            return start, goal, velocity
    raise AssertionError("no crossing fits into the room")


def _free_place(
    generator: np.random.Generator,
    lanes: tuple[tuple[Vector, Vector], ...],
    taken: tuple[Vector, ...],
    margin: float,
) -> Vector:
    """Return a place at least `margin` m from the straight ways and 1.3 m from what is placed already."""
    place = np.zeros(2)
    for _ in range(_TRIES):
        place = generator.uniform(-1.0, 1.0, 2) * (np.array(_HALF) - 0.6)
        away = min(_distance(place, *lane) for lane in lanes)
        if away > margin + 0.4 and all(np.hypot(*(place - other)) > 1.3 for other in taken):
            break
    return place


def _distance(point: Vector, start: Vector, end: Vector) -> float:
    way = end - start
    share = np.clip((point - start) @ way / (way @ way), 0.0, 1.0)
    return float(np.hypot(*(point - start - share * way)))


def _walls() -> tuple[list[FloatArray], list[FloatArray]]:
    x, y = _HALF
    walls = [
        rectangle((0.0, y + 0.1), (2 * x + 0.4, 0.2)),
        rectangle((0.0, -y - 0.1), (2 * x + 0.4, 0.2)),
        rectangle((x + 0.1, 0.0), (0.2, 2 * y)),
        rectangle((-x - 0.1, 0.0), (0.2, 2 * y)),
    ]
    return list(walls), list(walls)


_Furniture = tuple[list[FloatArray], list[tuple[float, float, float]], FloatArray]
"""Polygons and cylinders at the height of the scanner, and the outline that nobody enters."""


def _on_legs(generator: np.random.Generator, place: Vector, size: tuple[float, float], thickness: float) -> _Furniture:
    angle = generator.uniform(0, np.pi)
    outline = rectangle((place[0], place[1]), size, angle)
    inner = rectangle((place[0], place[1]), (size[0] - thickness, size[1] - thickness), angle)
    if generator.random() < 0.5:
        return [rectangle((x, y), (thickness, thickness), angle) for x, y in inner], [], outline
    return [], [(x, y, thickness / 2) for x, y in inner], outline


def _table(generator: np.random.Generator, place: Vector) -> _Furniture:
    return _on_legs(generator, place, (generator.uniform(0.9, 1.3), generator.uniform(0.6, 0.8)), 0.06)


def _chair(generator: np.random.Generator, place: Vector) -> _Furniture:
    return _on_legs(generator, place, (0.45, 0.45), generator.uniform(0.025, 0.04))


def _cupboard(generator: np.random.Generator, place: Vector) -> _Furniture:
    size = (generator.uniform(0.4, 1.0), generator.uniform(0.35, 0.5))
    outline = rectangle((place[0], place[1]), size, generator.uniform(0, np.pi))
    return [outline], [], outline


def _bin(generator: np.random.Generator, place: Vector) -> _Furniture:
    radius = generator.uniform(0.1, 0.18)
    return [], [(place[0], place[1], radius)], rectangle((place[0], place[1]), (2 * radius, 2 * radius))
