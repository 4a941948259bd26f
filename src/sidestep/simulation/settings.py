"""The tables of a scenario: robot, people, measurement, recording. Every number is checked where it is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from functools import partial
from typing import Annotated, Any, Literal, cast, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.planning.settings import PlannerSettings
from sidestep.types import LARGEST, Shape


def _without_truths(kind: type[Any], place: str, table: Any) -> Any:
    """Return the table of a dataclass as it came; `true` is not the number 1, though pydantic would take it for that.

    Raises:
        InvalidInput: a truth value stands where none belongs.
    """
    for name, wanted in get_type_hints(kind).items() if isinstance(table, Mapping) else ():
        value = table.get(name)
        if isinstance(wanted, type) and is_dataclass(wanted):
            _without_truths(wanted, f"{place}.{name}", value)
        elif wanted is not bool and any(isinstance(x, bool) for x in (value if isinstance(value, list) else [value])):
            raise InvalidInput(f"{place}.{name}", value, "a number or a word, no truth value")
    return table


PlannerTable = Annotated[PlannerSettings, BeforeValidator(partial(_without_truths, PlannerSettings, "planner"))]
HumanTable = Annotated[HumanModel, BeforeValidator(partial(_without_truths, HumanModel, "human"))]

NONE = "none"
"""In a scenario file, `field = "none"` switches off what a default would switch on: TOML has no other word for it."""


def without_none(value: Any) -> Any:
    """Return the same nested tables and lists with None for each "none"."""
    if isinstance(value, Mapping):
        return {key: without_none(inner) for key, inner in cast(Mapping[str, Any], value).items()}
    if isinstance(value, list):
        return [without_none(inner) for inner in cast(list[Any], value)]
    return None if value == NONE else value


Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number; `true` and "3" are not numbers."""
Number = Annotated[Finite, Field(ge=-LARGEST, le=LARGEST)]
"""A number that can be counted with: its square is finite, too."""
Positive = Annotated[Finite, Field(gt=0, le=LARGEST)]
NotNegative = Annotated[Finite, Field(ge=0, le=LARGEST)]
Period = Annotated[Finite, Field(ge=0.001, le=LARGEST)]
"""s; more than a thousand steps per second of a run would never end."""
Probability = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=1)]
Point = Annotated[tuple[Number, ...], Field(min_length=1, max_length=3)]
"""(d,) m; d = 1, 2 or 3."""
Polygon = Annotated[tuple[Annotated[tuple[Number, Number], Field()], ...], Field(min_length=3)]
"""Closed, (V, 2) m; the last corner joins the first."""

MODEL_KINDS = ("concerned", "unconcerned", "switching", "random")
"""People who decide by Eq. 2."""


class Settings(BaseModel):
    """A table of a scenario: frozen, and a misspelt name is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class RobotSettings(Settings):
    """The robot and its trip.

    Attributes:
        kind: "holonomic" (Eq. 10) or "differential" (a reference point ahead of the axle obeys Eq. 10).
        start, goal: (d,) m.
        heading: rad, at the start; differential only; None looks toward the goal.
        max_speed: m/s, per axis for shape "box", of the velocity for "disc".
        radius: m, of the body.
        shape: "box" is the paper's U_R, "disc" limits the speed in every direction alike.
        max_acceleration: m/s², or None.
        max_turn_rate: rad/s, max_turn_acceleration: rad/s² or None; differential only.
        reference_offset: m, ℓ, differential only; None wastes no speed.
        goal_tolerance: m, within which the goal counts as reached.
    """

    kind: Literal["holonomic", "differential"] = "holonomic"
    start: Point
    goal: Point
    heading: Number | None = None
    max_speed: Positive = 1.0
    radius: Positive = 0.3
    shape: Shape = "disc"
    max_acceleration: Positive | None = None
    max_turn_rate: Positive = 3.14
    max_turn_acceleration: Positive | None = None
    reference_offset: Positive | None = None
    goal_tolerance: Positive = 0.3


class GoalChange(Settings):
    """A person's mind changes about where to go.

    Attributes:
        time: s, from when on.
        goal: (d,) m, or "robot": where the robot is at that time.
    """

    time: NotNegative
    goal: Point | Literal["robot"]


class PersonSettings(Settings):
    """One simulated person. What is not given here behaves as the predictor's model `[human]` says.

    Attributes:
        id: identity; None is "p1", "p2", … in order.
        kind: "concerned", "unconcerned", "switching" (awareness flips at `switch_times`) and "random" decide by Eq. 2,
            "straight" walks to its goal at constant velocity, "standing" does not move; "social-force", "orca",
            "half-random" and "…-unconcerned" follow other models (`sidestep.simulation.crowd_people`).
        start, goal: (d,) m.
        waypoints: places on the way to the goal.
        goal_changes: changes of mind, in the order of time.
        goal_known: the planner is told the goal; otherwise it has to infer it.
        radius: m; None is the predictor's.
        speed: m/s, fastest pace per axis, reach·v; None is the predictor's.
        randomness: ω of this person; None is the predictor's (1 for kind "random").
        behaviour: fields of the human model that differ from the predictor's, e.g. `{ danger_weight = 50.0 }`.
        decision_interval: s between decisions; None is the planner's time step (in whole control steps).
        initially_concerned: awareness before the first switch.
        switch_times: s, at which awareness flips; kind "switching".
        heeds_signal: probability of becoming concerned at each decision while the robot signals (method §7).
        arrives_with: (d,) m/s, velocity before the start, which the sensor saw; None: nobody was watching.
        appears, vanishes: s, when the person enters and leaves, at the control instant then or next; None: stays.
    """

    id: str | None = Field(default=None, min_length=1)
    kind: str = "concerned"
    start: Point
    goal: Point | None = None
    waypoints: tuple[Point, ...] = ()
    goal_changes: tuple[GoalChange, ...] = ()
    goal_known: bool = True
    radius: Positive | None = None
    speed: Positive | None = None
    randomness: Probability | None = None
    behaviour: dict[str, Any] = Field(default_factory=dict)
    decision_interval: Positive | None = None
    initially_concerned: bool = False
    switch_times: tuple[NotNegative, ...] = (3.0,)
    heeds_signal: Probability = 0.0
    arrives_with: Point | None = None
    appears: NotNegative = 0.0
    vanishes: Positive | None = None


class MeasurementSettings(Settings):
    """What the sensor sees of people, at every control step.

    Attributes:
        position_noise: m, standard deviation per axis.
        dropout: probability that a person is not seen at a control step.
        velocity_window: s of the past over which the velocity is taken; None: one control step, but at least 0.3 s
            where positions are noisy. With `velocity = false` no velocity is passed on.
        velocity: pass a velocity on (always from the past only).
        range: m, beyond which people are not seen; None: no limit.
        occlusion: people behind walls are not seen.
    """

    position_noise: NotNegative = 0.0
    dropout: Probability = 0.0
    velocity_window: Annotated[Finite, Field(gt=0, le=60)] | None = None
    velocity: bool = True
    range: Positive | None = None
    occlusion: bool = False


class RecordingSettings(Settings):
    """Recorded people, who do not react.

    Attributes:
        file: CSV of tracks, `scene,t,agent,kind,x,y[,vx,vy]`, plain or gzipped.
        scene: name in the file.
        start: s, time of the recording at which the robot starts.
        kinds: kinds of agents that count as people.
        radius: m, of each; None is the predictor's.
    """

    file: str
    scene: str
    start: Finite
    kinds: tuple[str, ...] = ("ped",)
    radius: Positive | None = None
