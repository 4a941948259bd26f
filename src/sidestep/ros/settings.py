"""Parameters of the node: the tables robot, planner and human of a scenario file, and `node`: what only a node has."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.planning.settings import PlannerSettings
from sidestep.ros.geometry import Pose2
from sidestep.simulation.faults import one_line
from sidestep.simulation.settings import (
    HumanTable,
    Number,
    PlannerTable,
    Point,
    Polygon,
    Positive,
    RobotSettings,
    Settings,
    without_none,
)
from sidestep.simulation.tables import read_human_table, read_tables

_HERE = (0.0, 0.0)
LOOPBACK = ("127.0.0.1", "localhost", "::1")


class RobotParameters(RobotSettings):
    """The robot, as in a scenario; where it starts is measured, and a goal may come later."""

    kind: Literal["holonomic", "differential"] = "differential"
    start: Point = _HERE
    goal: Point = _HERE
    max_speed: Positive = 0.5
    goal_tolerance: Positive = 0.2

    @property
    def first_goal(self) -> Point | None:
        """The goal, where one was given."""
        return self.goal if "goal" in self.model_fields_set else None


class RemoteSettings(Settings):
    """Control from a second computer.

    Attributes:
        enabled: listen for a station; the robot then moves only while a station has started it and its link lives.
        host: address to listen on; beyond this machine only with a token.
        port: TCP; 0 takes a free one and says which.
        link_timeout: s without a word from the station that drives, after which the robot stops.
        state_rate: Hz, at which stations are told the state.
        token: word that a station must know; required where `host` is not the loopback.
    """

    enabled: bool = False
    host: str = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535)] = 7070
    link_timeout: Positive = 1.0
    state_rate: Positive = 5.0
    token: str = ""

    @model_validator(mode="after")
    def _guarded(self) -> Self:
        if self.enabled and self.host not in LOOPBACK and len(self.token) < 8:
            raise InvalidInput(
                "node.remote.token",
                self.token,
                "a word of 8 letters or more where others can reach the robot",
                f"set it, or listen on 127.0.0.1 instead of {self.host}",
            )
        return self


class NodeParameters(Settings):
    """What only a node has.

    Attributes:
        people_from: "scan" tracks legs in a LaserScan; "poses" takes a PoseArray, "markers" a MarkerArray.
        frame: in which everything is planned; base_frame: of the robot.
        same_frames: frames that coincide with `frame`, for set-ups without tf.
        mount: x m, y m, yaw rad of the scanner on the robot, used where tf does not know it.
        control_rate: Hz of `cmd_vel`; planner_rate: Hz of planning.
        timeout: s without scan, odometry or people after which the robot stops.
        unknown_is_free: unknown cells of the map are free.
        map_for_scans: what stands on the map, or within 0.1 m of its walls, is nobody's legs; switch it off where the
            map may lie wrong.
        grid_resolution: m per cell, grid_size: m, of the predicted occupancy that is published around the robot.
        diagnostics_rate: Hz; picture_rate: Hz at most, of the predicted occupancy.
        remote: control from a second computer.
    """

    people_from: Literal["scan", "poses", "markers"] = "scan"
    frame: str = Field(default="odom", min_length=1)
    base_frame: str = Field(default="base_link", min_length=1)
    same_frames: tuple[str, ...] = ()
    mount: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    control_rate: Positive = 10.0
    planner_rate: Positive = 5.0
    timeout: Positive = 0.5
    unknown_is_free: bool = True
    map_for_scans: bool = True
    grid_resolution: Positive = 0.1
    grid_size: Positive = 8.0
    diagnostics_rate: Positive = 1.0
    picture_rate: Positive = 2.0
    remote: RemoteSettings = RemoteSettings()

    @property
    def scanner_mount(self) -> Pose2:
        """`mount` as a pose."""
        return Pose2(*self.mount)

    @property
    def plan_lifetime(self) -> float:
        """Seconds for which a plan may be followed: two planning periods, so that one late plan is no stop."""
        return 2.0 / self.planner_rate


class NodeSettings(Settings):
    """Everything that a node is told at its start.

    Attributes:
        robot, planner, human: as in a scenario file.
        walls: polygons in the planning frame, as in a scenario file.
        node: what only a node has.
    """

    robot: RobotParameters = RobotParameters()
    planner: PlannerTable = PlannerSettings()
    human: HumanTable = HumanModel()
    walls: tuple[Polygon, ...] = ()
    node: NodeParameters = NodeParameters()

    @model_validator(mode="after")
    def _flat(self) -> Self:
        goal = self.robot.first_goal
        if goal is not None and len(goal) != 2:
            raise InvalidInput("robot.goal", goal, "2 coordinates; a node drives on the floor")
        return self

    @classmethod
    def parse(cls, data: Mapping[str, Any], source: str = "parameters") -> Self:
        """Return the settings that nested `data` describe; the key `scenario` names a file whose tables they change.

        As in a scenario file, "none" is no value, and `human` may name a file that `sidestep fit` wrote.

        Raises:
            InvalidInput: one line per mistake: field, value, what is allowed.
        """
        own = without_none(data)
        base = own.pop("scenario", None)
        if isinstance(own.get("human"), str):
            own["human"] = read_human_table(own["human"])
        merged = _merged(_tables(Path(str(base))), own) if base else own
        try:
            return cls.model_validate(merged)
        except ValidationError as error:
            raise one_line(error, cls, source) from None


def _tables(path: Path) -> dict[str, Any]:
    """Tables of a scenario file that a node can use; where the robot starts and goes belongs to the simulated run."""
    data = read_tables(path, "a scenario file (TOML)")
    known = {name: data[name] for name in ("robot", "planner", "human", "walls", "node") if name in data}
    if isinstance(known.get("robot"), Mapping):
        known["robot"] = {k: v for k, v in known["robot"].items() if k not in ("start", "goal", "heading")}
    if isinstance(known.get("human"), str):
        known["human"] = read_human_table(path.parent / known["human"])
    return known


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    both = dict(base)
    for key, value in over.items():
        inner = both.get(key)
        both[key] = _merged(inner, value) if isinstance(inner, Mapping) and isinstance(value, Mapping) else value
    return both
