"""Worlds in which navigators are compared: each a name and a generator of scenarios from a seed.

The robot's trip is 10 m long, from (0, 0) to (10, 0). Nobody's coming action can be seen in their velocity, and
nobody's goal is told.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.simulation.scenario import Scenario

TRIP = 10.0  # m
CONTROL_STEP = 0.1  # s, at which everything moves and is measured
PATIENCE = 4.0  # times the shortest time, after which a trip has failed
CORRIDOR_HALF = 1.5  # m, half the width of the corridor
DOOR_HALF = 0.75  # m, half the width of the door

People = list[dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """One world.

    Attributes:
        name: for tables.
        description: one line.
        people: draws the people of an episode, as tables of a scenario.
        robot_speed: m/s; person_speed: m/s, nominal pace.
        noise: m, of measured positions, per axis.
        rate: Hz, of planning.
        walls: polygons.
        quick: part of `--quick`.
        needs_peers: its people come from the extra [peers].
    """

    name: str
    description: str
    people: Callable[[Condition, np.random.Generator], People]
    robot_speed: float = 1.0
    person_speed: float = 1.0
    noise: float = 0.0
    rate: float = 10.0
    walls: tuple[tuple[tuple[float, float], ...], ...] = ()
    quick: bool = False
    needs_peers: bool = False
    extra: Mapping[str, Any] = field(default_factory=dict)

    def scenario(self, episode: int, base_seed: int = 0) -> Scenario:
        """Return episode number `episode`; the same for every navigator and every number of workers."""
        source = np.random.SeedSequence([base_seed, zlib.crc32(self.name.encode()), episode])
        generator = np.random.Generator(np.random.PCG64(source))
        shortest = TRIP / self.robot_speed
        data: dict[str, Any] = {
            "name": f"{self.name}-{episode}",
            "duration": PATIENCE * shortest,
            "planning_period": 1.0 / self.rate,
            "control_step": CONTROL_STEP,
            "robot": {"start": (0.0, 0.0), "goal": (TRIP, 0.0), "max_speed": self.robot_speed},
            "measurement": {"position_noise": self.noise},
            "walls": self.walls,
        }
        for _ in range(200):
            people = self.people(self, generator)
            data["seed"] = int(generator.integers(2**31))
            try:
                return Scenario.parse(data | {"people": people} | dict(self.extra))
            except InvalidInput as error:
                if error.field != "robot.start":  # somebody would begin inside the robot's clearance: draw again
                    raise
        raise InvalidInput("condition", self.name, "one whose people begin at a distance from the robot")


def one_person(
    kind: str, angles: tuple[float, float] = (-180.0, 180.0), **options: Any
) -> Callable[[Condition, np.random.Generator], People]:
    """Return a generator of one person who would meet the robot somewhere on its way, if both went straight.

    Args:
        kind: of person.
        angles: degrees, of the walking direction against the robot's; 180 is head-on, 0 overtaking or being overtaken.
        options: further fields of the person's table; a callable value is drawn from the generator.
    """

    def draw(condition: Condition, generator: np.random.Generator) -> People:
        angle = math.radians(generator.uniform(*angles)) * generator.choice([-1.0, 1.0])
        return [_meeting(condition, generator, kind, angle, options)]

    return draw


def crowd(count: int, unconcerned: float) -> Callable[[Condition, np.random.Generator], People]:
    """Return a generator of `count` ORCA people who cross the robot's way in all directions.

    Args:
        count: of people.
        unconcerned: share of those who never heed the robot.
    """

    def draw(condition: Condition, generator: np.random.Generator) -> People:
        blind = round(unconcerned * count)
        people = People()
        while len(people) < count:
            kind = "orca-unconcerned" if len(people) < blind else "orca"
            new = _meeting(condition, generator, kind, generator.uniform(-math.pi, math.pi), {}, spread=2.0)
            if all(math.dist(new["start"], other["start"]) > 0.8 for other in people) and math.hypot(*new["start"]) > 1:
                people.append(new)
        return people

    return draw


def circle(count: int = 6) -> Callable[[Condition, np.random.Generator], People]:
    """Return a generator of ORCA people who change places across the circle of which the trip is a diameter."""

    def draw(condition: Condition, generator: np.random.Generator) -> People:
        people = People()
        for i in range(count):
            angle = 2 * math.pi * (i + 1) / (count + 1) + math.pi + generator.normal(0.0, 0.08)
            radius = TRIP / 2 + generator.uniform(0.0, 0.4)
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            kind = "orca" if generator.random() < 0.5 else "orca-unconcerned"
            people.append(_person(condition, kind, (TRIP / 2 + x, y), (TRIP / 2 - x, -y)))
        return people

    return draw


def counter_flow(count: int = 4) -> Callable[[Condition, np.random.Generator], People]:
    """Return a generator of social-force people who come the other way through the corridor."""

    def draw(condition: Condition, generator: np.random.Generator) -> People:
        people = People()
        for i in range(count):
            y = generator.uniform(-CORRIDOR_HALF + 0.4, CORRIDOR_HALF - 0.4)
            x = 5.0 + 2.5 * i + generator.uniform(-0.8, 0.8)
            kind = "social-force" if generator.random() < 0.5 else "social-force-unconcerned"
            people.append(_person(condition, kind, (x, y), (x - 25.0, y)))
        return people

    return draw


def door_traffic(condition: Condition, generator: np.random.Generator) -> People:
    """Draw one or two people who come through the door that the robot wants to pass."""
    people = People()
    for i in range(int(generator.integers(1, 3))):
        x = 6.5 + 1.8 * i + generator.uniform(0.0, 1.0)
        y = generator.uniform(-1.5, 1.5)
        kind = "orca" if generator.random() < 0.5 else "orca-unconcerned"
        person = _person(condition, kind, (x, y), (-6.0, generator.uniform(-3.0, 3.0)))
        person["waypoints"] = [(5.0, generator.uniform(-0.2, 0.2))]
        people.append(person)
    return people


def _meeting(
    condition: Condition,
    generator: np.random.Generator,
    kind: str,
    angle: float,
    options: Mapping[str, Any],
    spread: float = 0.6,
) -> dict[str, Any]:
    """One person whose straight way passes a place of the trip within `spread` s of the robot."""
    where = generator.uniform(3.0, 7.0)
    when = where / condition.robot_speed + generator.uniform(-spread, spread)
    pace = condition.person_speed * generator.uniform(0.9, 1.1)
    if abs(math.cos(angle)) > 0.98 and math.cos(angle) > 0 and abs(pace - condition.robot_speed) < 0.3:
        pace = 0.6 * condition.robot_speed  # whoever walks along at the same pace is never met
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]]) * generator.uniform(-0.3, 0.3)
    meet = np.array([where, 0.0]) + across
    progress = 0.5 * pace if kind == "half-random" else pace  # half of their steps lead nowhere, on average
    start, goal = meet - along * progress * when, meet + along * 20.0
    drawn = {k: v(generator) if callable(v) else v for k, v in options.items()}
    return _person(condition, kind, tuple(start.tolist()), tuple(goal.tolist()), pace) | drawn


def _person(
    condition: Condition, kind: str, start: tuple[float, ...], goal: tuple[float, ...], pace: float | None = None
) -> dict[str, Any]:
    pace = condition.person_speed if pace is None else pace
    way = np.array(goal) - np.array(start)
    arrives = way / np.linalg.norm(way) * pace
    return {
        "kind": kind,
        "start": start,
        "goal": goal,
        "goal_known": False,
        "speed": pace,
        "decision_interval": 0.5 if kind == "half-random" else CONTROL_STEP,
        "arrives_with": tuple(arrives.tolist()),
    }


def _rectangle(x0: float, x1: float, y0: float, y1: float) -> tuple[tuple[float, float], ...]:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


CORRIDOR = (
    _rectangle(-8.0, 24.0, CORRIDOR_HALF, CORRIDOR_HALF + 0.3),
    _rectangle(-8.0, 24.0, -CORRIDOR_HALF - 0.3, -CORRIDOR_HALF),
)
DOORWAY = (_rectangle(4.9, 5.1, DOOR_HALF, 6.0), _rectangle(4.9, 5.1, -6.0, -DOOR_HALF))


def _turns_on_the_robot(generator: np.random.Generator) -> list[dict[str, Any]]:
    return [{"time": float(generator.uniform(1.0, 5.0)), "goal": "robot"}]


def _some_time(generator: np.random.Generator) -> tuple[float]:
    return (float(generator.uniform(1.0, 4.0)),)


def conditions() -> Mapping[str, Condition]:
    """Return all conditions by name, in the order of the table."""
    straight, half = one_person("straight"), one_person("half-random")
    toward = one_person("straight", goal_changes=_turns_on_the_robot)
    late = one_person("orca-unconcerned", switch_times=_some_time)
    distracted = one_person("orca", switch_times=_some_time)
    every = [
        Condition(name="straight", description="keeps walking", people=straight, quick=True),
        Condition(name="half-random", description="acts at random half of the time", people=half, quick=True),
        Condition(name="toward-robot", description="turns toward the robot", people=toward, quick=True),
        Condition(name="late-looker", description="looks up late", people=late, needs_peers=True),
        Condition(name="distracted", description="stops minding the robot", people=distracted, needs_peers=True),
        Condition(name="social-force", description="walks by social force", people=one_person("social-force"),
                  quick=True, needs_peers=True),
        Condition(name="orca-person", description="walks by ORCA", people=one_person("orca"), needs_peers=True),
        Condition(name="straight-noise-0.1", description="0.1 m of noise", people=straight, noise=0.1),
        Condition(name="straight-noise-0.2", description="0.2 m of noise", people=straight, noise=0.2),
        Condition(name="half-random-noise-0.1", description="random, 0.1 m of noise", people=half, noise=0.1),
        Condition(name="toward-robot-noise-0.1", description="turns, 0.1 m of noise", people=toward, noise=0.1),
        Condition(name="straight-robot-faster", description="robot at 1.5 m/s", people=straight, robot_speed=1.5),
        Condition(name="straight-robot-slower", description="robot at 0.5 m/s", people=straight, robot_speed=0.5),
        Condition(name="half-random-robot-faster", description="robot 1.5 m/s", people=half, robot_speed=1.5),
        Condition(name="half-random-robot-slower", description="robot 0.5 m/s", people=half, robot_speed=0.5),
        Condition(name="toward-robot-slower", description="turns; robot 0.5 m/s", people=toward, robot_speed=0.5),
        Condition(name="straight-2hz", description="planned at 2 Hz", people=straight, rate=2.0),
        Condition(name="half-random-2hz", description="random, planned at 2 Hz", people=half, rate=2.0),
        Condition(name="toward-robot-2hz", description="turns, planned at 2 Hz", people=toward, rate=2.0),
        Condition(name="head-on", description="from ahead", people=one_person("straight", (165.0, 180.0))),
        Condition(name="crossing", description="from the side", people=one_person("straight", (70.0, 110.0))),
        Condition(name="overtaking", description="the same way, slower", people=one_person("straight", (0.0, 10.0))),
        Condition(name="corridor", description="counter-flow, 3 m wide", people=counter_flow(), walls=CORRIDOR,
                  needs_peers=True),
        Condition(name="doorway", description="a 1.5 m door", people=door_traffic, walls=DOORWAY, needs_peers=True),
        Condition(name="circle", description="7 change places", people=circle(), needs_peers=True),
    ]  # fmt: skip
    for count in (5, 12):
        for share, word in ((0.0, "none"), (0.5, "half"), (1.0, "all")):
            every.append(
                Condition(
                    name=f"crowd-{count}-{word}-unconcerned",
                    description=f"{count} people, {word} unconcerned",
                    people=crowd(count, share),
                    needs_peers=True,
                    quick=count == 5 and share == 0.5,
                )
            )
    return {c.name: c for c in every}
