"""Every number of a run in one frozen value, the seed included."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, replace
from typing import Annotated, Any, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.planning.settings import CLEARANCE_MARGIN, PlannerSettings
from sidestep.simulation.faults import one_line
from sidestep.simulation.settings import (
    HumanTable,
    MeasurementSettings,
    Period,
    PersonSettings,
    PlannerTable,
    Point,
    Polygon,
    Positive,
    RecordingSettings,
    RobotSettings,
    Settings,
)


class Scenario(Settings):
    """One run: robot, people, what the planner assumes of them, the sensor, the walls, and the seed.

    Use `Scenario.parse` where the data come from people or files: it answers with one line per mistake.

    Attributes:
        name: for titles and file names.
        description: one line.
        seed: of the random generator that the run owns.
        duration: s, after which the run ends at the latest.
        planning_period: s between two calls of the planner; None is the planner's time step.
        control_step: s between two recorded instants, a whole fraction of `planning_period`; None is that.
        stop_at_goal: the run ends when the robot has reached its goal.
        robots: further robots, each of which gives way to those before it; the planner's settings hold for all.
        robot, planner, human, people, measurement, recording: see their own pages; `human` is the predictor's model.
        walls: polygons that neither people nor the robot enter (2-D).
        map: ROS map file with walls, relative to the scenario file; None: no map.
    """

    name: str = Field(default="unnamed", min_length=1)
    description: str = ""
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    duration: Positive = 40.0
    planning_period: Period | None = None
    control_step: Period | None = None
    stop_at_goal: bool = True
    robot: RobotSettings
    robots: tuple[RobotSettings, ...] = ()
    planner: PlannerTable = PlannerSettings()
    human: HumanTable = HumanModel()
    people: tuple[PersonSettings, ...] = ()
    measurement: MeasurementSettings = MeasurementSettings()
    recording: RecordingSettings | None = None
    walls: tuple[Polygon, ...] = ()
    map: str | None = None

    @classmethod
    def parse(cls, data: Mapping[str, Any], source: str = "") -> Self:
        """Return the scenario that `data` describe.

        Args:
            data: as a TOML file holds them.
            source: file or name, put before each line of a complaint.

        Raises:
            InvalidInput: one line per mistake: field, value, what is allowed, and the nearest name of an unknown one.
        """
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise one_line(error, cls, source) from None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        for check in (_dimensions, _names, _timing, _behaviours, _weights, _robots_apart, _room_at_the_start):
            check(self)
        return self

    @property
    def dimension(self) -> int:
        """Number of axes d."""
        return len(self.robot.start)

    @property
    def period(self) -> float:
        """Seconds between two calls of the planner."""
        return self.planner.time_step if self.planning_period is None else self.planning_period

    @property
    def step(self) -> float:
        """Seconds between two recorded instants."""
        return self.period if self.control_step is None else self.control_step

    @property
    def clearance(self) -> float:
        """Metres between the middles of robot and person that count as kept; where left open, for the widest person.

        The planner keeps as much from the point that it moves; where left open, more by the offset of that point.
        """
        if self.planner.clearance is not None:
            return self.planner.clearance
        widest = max((p.radius or self.human.radius for p in self.people), default=self.human.radius)
        return self.robot.radius + widest + CLEARANCE_MARGIN

    def identity(self, index: int) -> str:
        """Identity of person `index`."""
        return self.people[index].id or f"p{index + 1}"

    def model_of(self, person: PersonSettings) -> HumanModel:
        """How `person` really behaves: the predictor's model with the person's own parameters in it."""
        own: dict[str, Any] = dict(person.behaviour)
        if person.speed is not None:
            own.setdefault("walking_speed", person.speed / own.get("reach", self.human.reach))
        if person.radius is not None:
            own.setdefault("radius", person.radius)
        if person.randomness is not None:
            own.setdefault("randomness", person.randomness)
        elif person.kind == "random":
            own.setdefault("randomness", 1.0)
        if not person.behaviour:  # numbers that are numbers already
            return replace(self.human, **own) if own else self.human
        return _HUMAN.validate_python(asdict(self.human) | own)

    def changed(self, **values: Any) -> Self:
        """Return this scenario with other values of top-level fields, checked again.

        Raises:
            InvalidInput: as `parse`.
        """
        return self.parse(self.settings() | values)

    def settings(self) -> dict[str, Any]:
        """Every number, as JSON can hold it; `Scenario.parse` of it gives an equal scenario."""
        return _plain(self.model_dump())


_HUMAN: TypeAdapter[HumanModel] = TypeAdapter(HumanTable)


def _plain(value: Any) -> Any:
    """Lists for tuples and words for infinity, which JSON does not know."""
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def _points(scenario: Scenario) -> Iterator[tuple[str, Point]]:
    yield "robot.start", scenario.robot.start
    yield "robot.goal", scenario.robot.goal
    for i, robot in enumerate(scenario.robots):
        yield f"robots.{i}.start", robot.start
        yield f"robots.{i}.goal", robot.goal
    for i, person in enumerate(scenario.people):
        yield f"people.{i}.start", person.start
        if person.goal is not None:
            yield f"people.{i}.goal", person.goal
        if person.arrives_with is not None:
            yield f"people.{i}.arrives_with", person.arrives_with
        for j, point in enumerate(person.waypoints):
            yield f"people.{i}.waypoints.{j}", point
        for j, change in enumerate(person.goal_changes):
            if not isinstance(change.goal, str):
                yield f"people.{i}.goal_changes.{j}.goal", change.goal
    for i, goal in enumerate(scenario.human.candidates):
        yield f"human.goals.{i}", goal


def _dimensions(scenario: Scenario) -> None:
    d = scenario.dimension
    for name, point in _points(scenario):
        if len(point) != d:
            raise InvalidInput(name, point, f"{d} coordinates, as robot.start has", "use one dimension throughout")
    flat_only = scenario.walls or scenario.map or scenario.recording
    if flat_only and d != 2:
        raise InvalidInput("robot.start", scenario.robot.start, "2 coordinates where there are walls or recordings")
    if scenario.robot.kind == "differential" and d != 2:
        raise InvalidInput("robot.kind", "differential", "holonomic, outside 2-D")


def _names(scenario: Scenario) -> None:
    seen: set[str] = set()
    for i in range(len(scenario.people)):
        name = scenario.identity(i)
        if name in seen:
            raise InvalidInput(
                f"people.{i}.id", name, "an id that no other person has", "give each person their own id"
            )
        seen.add(name)


def _timing(scenario: Scenario) -> None:
    ratio = scenario.period / scenario.step
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
        raise InvalidInput(
            "control_step", scenario.step, f"a whole fraction of the planning period, {scenario.period} s"
        )
    for i, person in enumerate(scenario.people):
        if person.decision_interval is not None:
            ratio = person.decision_interval / scenario.step
            if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
                allowed = f"a whole multiple of the control step, {scenario.step} s"
                raise InvalidInput(f"people.{i}.decision_interval", person.decision_interval, allowed)
        if person.vanishes is not None and person.vanishes <= person.appears:
            raise InvalidInput(f"people.{i}.vanishes", person.vanishes, f"later than appears = {person.appears} s")


def _behaviours(scenario: Scenario) -> None:
    known = {field.name for field in fields(HumanModel)}
    for i, person in enumerate(scenario.people):
        for name in person.behaviour:
            if name not in known:
                near = difflib.get_close_matches(name, known, n=1)
                mend = f"did you mean {near[0]!r}?" if near else ""
                raise InvalidInput(f"people.{i}.behaviour.{name}", person.behaviour[name], "a field of [human]", mend)
        try:
            scenario.model_of(person)
        except (ValidationError, InvalidInput) as error:
            fault = one_line(error, HumanModel) if isinstance(error, ValidationError) else error
            field = fault.field.removeprefix("human.")
            raise InvalidInput(f"people.{i}.behaviour.{field}", fault.value, fault.allowed, fault.mend) from None


def _weights(scenario: Scenario) -> None:
    d = scenario.dimension
    for table, settings in (("human", scenario.human), ("planner", scenario.planner)):
        for name in ("goal_weight", "effort_weight"):
            weight = getattr(settings, name)
            if isinstance(weight, tuple) and len(weight) != d:
                raise InvalidInput(f"{table}.{name}", weight, f"one number, or {d} (one per axis)")


def _robots_apart(scenario: Scenario) -> None:
    everyone = (scenario.robot, *scenario.robots)
    for i, robot in enumerate(everyone[1:], start=1):
        if robot.kind == "differential" and scenario.dimension != 2:
            raise InvalidInput(f"robots.{i - 1}.kind", "differential", "holonomic, outside 2-D")
        for other in everyone[:i]:
            for name in ("start", "goal"):
                gap = math.dist(getattr(robot, name), getattr(other, name))
                if gap < robot.radius + other.radius + CLEARANCE_MARGIN:
                    allowed = "room for both bodies and 0.1 m between them"
                    raise InvalidInput(f"robots.{i - 1}.{name}", getattr(robot, name), f"{allowed} ({gap:.2f} m)")


def _room_at_the_start(scenario: Scenario) -> None:
    start = scenario.robot.start
    for i, person in enumerate(scenario.people):
        if person.appears > 0:
            continue
        gap = sum((a - b) ** 2 for a, b in zip(start, person.start, strict=True)) ** 0.5
        if gap < scenario.clearance:
            raise InvalidInput(
                "robot.start",
                start,
                f"at least the clearance, {scenario.clearance:g} m, from {scenario.identity(i)!r} ({gap:.2f} m)",
                "move the robot's or the person's start, or lower planner.clearance",
            )
