"""The scenario schema as a page, from the models that check scenario files."""

from __future__ import annotations

import dataclasses
import math
import re
import types
import typing
from collections.abc import Iterator
from typing import Any

import annotated_types
from docstrings import attributes, summary
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.planning.settings import PlannerSettings
from sidestep.ros.settings import NodeParameters, RemoteSettings
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.settings import (
    GoalChange,
    MeasurementSettings,
    PersonSettings,
    RecordingSettings,
    RobotSettings,
)
from sidestep.types import LARGEST

Row = tuple[str, str, str, str, str]
"""Name, type, allowed, default, meaning."""

TABLES: tuple[tuple[str, str, type], ...] = (
    ("Top level", "", Scenario),
    ("[robot]", "The robot and its trip.", RobotSettings),
    ("[planner]", "How the robot plans.", PlannerSettings),
    ("[human]", "What the planner assumes of people.", HumanModel),
    ("[[people]]", "One table per simulated person.", PersonSettings),
    ("goal_changes of a person", "Entries of `goal_changes`.", GoalChange),
    ("[measurement]", "What the sensor sees.", MeasurementSettings),
    ("[recording]", "Recorded people.", RecordingSettings),
    ("[node]", "Only for the [ROS nodes](../start/ros.md).", NodeParameters),
    ("[node.remote]", "Control of a ROS node from a second computer.", RemoteSettings),
)


def scenario_page() -> str:
    """Return the page as Markdown."""
    parts = [
        "# Scenario files",
        "A scenario is a TOML file that holds every number of a run, the seed included. This page is made from the "
        "models that check the files: names, types, ranges and defaults are those of the code. A misspelt name or a "
        "value out of range is refused with one line that names the field, the value and what is allowed.",
        'Where `none` is allowed, write `"none"`. Numbers are at most 10⁹ in size where nothing smaller is said. '
        "`sidestep run NAME --set robot.max_speed=0.5` changes one field for one run.",
    ]
    for title, lead, model in TABLES:
        parts.append(f"## {_escaped(title)}")
        parts.append(lead or summary(model))
        parts.append(_table(list(_rows(model))))
    return "\n\n".join(parts) + "\n"


def _rows(model: type) -> Iterator[Row]:
    told = attributes(model)
    if issubclass(model, BaseModel):
        for name, info in model.model_fields.items():
            default = "required" if info.default is PydanticUndefined and info.default_factory is None else info.default
            default = info.default_factory() if info.default_factory else default  # type: ignore[call-arg]
            metadata = [*info.metadata, *_inner_metadata(info.annotation)]
            yield name, _type(info.annotation), _bounds(metadata), _shown(default), told.get(name, "")
        return
    for field in dataclasses.fields(model):
        hint = typing.get_type_hints(model)[field.name]
        yield field.name, _type(hint), _allowed(model, field.name), _shown(field.default), told.get(field.name, "")


def _allowed(model: Any, name: str) -> str:
    """Return what the check of a dataclass field says is allowed, by asking it with values that never are."""
    for wrong in (math.nan, -1, (math.nan, math.nan), "?"):
        try:
            model(**{name: wrong})
        except InvalidInput as refusal:
            return refusal.allowed
        except (TypeError, ValueError):
            continue
    return ""


def _inner_metadata(annotation: Any) -> list[Any]:
    """Constraints inside `Annotated` members of a union, e.g. of `Positive | None`."""
    found: list[Any] = []
    for member in typing.get_args(annotation) if _is_union(annotation) else ():
        for extra in getattr(member, "__metadata__", ()):
            found += getattr(extra, "metadata", [extra])
    return found


def _bounds(metadata: list[Any]) -> str:
    words: list[str] = []
    for entry in metadata:
        for kind, sign in ((annotated_types.Gt, ">"), (annotated_types.Ge, "≥"), (annotated_types.Le, "≤")):
            if isinstance(entry, kind) and abs(bound := getattr(entry, kind.__name__.lower())) < LARGEST:
                words.append(f"{sign} {bound:g}")
    return " and ".join(dict.fromkeys(words))


def _is_union(annotation: Any) -> bool:
    return isinstance(annotation, types.UnionType) or typing.get_origin(annotation) is typing.Union


def _type(annotation: Any) -> str:
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return _type(typing.get_args(annotation)[0])
    if _is_union(annotation):
        return " or ".join(_type(a) for a in typing.get_args(annotation) if a is not type(None))
    if origin is typing.Literal:
        return " or ".join(f'"{a}"' for a in typing.get_args(annotation))
    if origin is tuple:
        return f"list of {_type(typing.get_args(annotation)[0])}"
    if origin is dict:
        return "table"
    names = {float: "number", int: "integer", bool: "true or false", str: "text", Any: "anything"}
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or dataclasses.is_dataclass(annotation)):
        return "table"
    return names.get(annotation, getattr(annotation, "__name__", str(annotation)))


def _shown(default: Any) -> str:
    if default is None:
        return "none"
    if isinstance(default, BaseModel) or dataclasses.is_dataclass(default):
        return "its defaults"
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        return "[" + ", ".join(_shown(v) for v in default) + "]"
    return f"{default:g}" if isinstance(default, float) else str(default)


def _table(rows: list[Row]) -> str:
    """Three columns, so that a phone can show them."""
    lines = ["| field | value and default | meaning |", "|---|---|---|"]
    for name, kind, allowed, default, meaning in rows:
        whole = allowed.startswith(("a ", "an ", "one ", "0 to", "strictly"))  # says of which kind it is, too
        value = _escaped(allowed if whole else kind if kind.startswith('"') else f"{kind} {allowed}")
        shown = "**required**" if default == "required" else f"default **{_escaped(default)}**" if default else ""
        lines.append(
            f"| `{name}` | {'; '.join(part for part in (value.strip(), shown) if part)} | {_escaped(meaning)} |"
        )
    return "\n".join(lines)


def _escaped(text: str) -> str:
    return re.sub(r"([|\[\]<>])", r"\\\1", text).replace("\\<", "&lt;").replace("\\>", "&gt;")
