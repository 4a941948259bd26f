"""`sidestep replay`: plan over a recording; predicted against actual positions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

if TYPE_CHECKING:
    from sidestep.studies.replay import Replay
    from sidestep.studies.replay_score import Score


def replay(
    file: Path,
    /,
    *,
    goal: tuple[float, float] | None = None,
    parameters: Path | None = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative="")] = (),
    topic: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    out: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Plan over a recording (.mcap, .bag, .db3): what would have been planned, and where people really went.

    Args:
        file: recording with people_markers, people (PoseArray) or scans, and odometry where the robot moved.
        goal: x y in m; the recorded goals unless given, or else robot.goal, or else where the robot was at last.
        parameters: TOML with the tables robot, planner, human, node, as for the ROS nodes.
        set_: change any parameter: --set planner.horizon=6 --set node.planner_rate=2 (repeatable).
        topic: name a topic where its name does not tell: --topic scan=/front/scan (inputs: odom, people_markers,
            people, scan, goal, map; repeatable).
        out: folder for figure and table; runs/replay-<name> unless given.
        json: print exactly one JSON object on stdout.
    """
    from sidestep.commands.console import emit_json, show, table
    from sidestep.io.files import ready_folder
    from sidestep.studies.replay import replay as replayed
    from sidestep.studies.replay_score import score
    from sidestep.viewer.figures import save_figure

    topics = dict(_pair("--topic", word) for word in topic)
    folder = ready_folder(out or Path("runs") / f"replay-{file.stem}")
    found = replayed(file, _parameters(parameters, set_), goal=goal, topics=topics)
    scored = score(found.forecasts, found.plans[0].time_step)
    files = [save_figure(_figure(file, found, scored), folder / "figure.png")]
    if json:
        emit_json(_summary(file, found, scored) | {"files": [str(path) for path in files]})
    else:
        table(_rows(found), title=f"{file.name}, planned over")
        header = ("ahead (s)", "compared", "error (m)", "constant velocity (m)", "P(within 0.5 m)")
        table(_score_rows(scored), header=header)
        show("wrote " + ", ".join(str(path) for path in files))
    return 0


def _parameters(file: Path | None, changes: tuple[str, ...]) -> dict[str, Any]:
    """Nested parameters: the file's, then the single changes."""
    from sidestep.errors import InvalidInput
    from sidestep.simulation.tables import DEEPEST, read_tables, value_in

    data: dict[str, Any] = {} if file is None else read_tables(file)
    for change in changes:
        name, text = _pair("--set", change)
        *above, last = name.split(".")
        if len(above) > DEEPEST:
            raise InvalidInput("--set", change, f"a parameter at most {DEEPEST} tables deep")
        place = data
        for part in above:
            place = place.setdefault(part, {})
            if not isinstance(place, dict):
                raise InvalidInput("--set", change, "TABLE.FIELD=VALUE")
        place[last] = value_in(text)
    return data


def _pair(option: str, word: str) -> tuple[str, str]:
    from sidestep.errors import InvalidInput

    name, equals, value = word.partition("=")
    if not (name and equals and value):
        raise InvalidInput(option, word, "NAME=VALUE")
    return name, value


def _figure(file: Path, found: Replay, scored: Score) -> Any:
    from sidestep.studies.replay_score import NEARBY
    from sidestep.viewer.figure_replay import Errors, Foreseen, replay_figure

    return replay_figure(
        title=f"{file.name}, planned over",
        robot=found.robot[:, 1:],
        goal=found.goal,
        tracks={name: track.positions for name, track in found.tracks.items()},
        foreseen=[
            Foreseen(person=f.person, time=f.time, predicted=f.predicted, actual=f.actual) for f in found.forecasts
        ],
        errors=Errors(
            lead=scored.lead, predicted=scored.error, straight=scored.straight, nearby=scored.nearby, radius=NEARBY
        ),
    )


def _summary(file: Path, found: Replay, scored: Score) -> dict[str, Any]:
    durations = np.array([plan.duration for plan in found.plans])
    return {
        "recording": str(file),
        "topics": dict(found.topics),
        "goal": found.goal,
        "duration_s": float(found.robot[-1, 0] - found.robot[0, 0]),
        "plans": len(found.plans),
        "status": found.statuses,
        "planning_ms": {"median": 1e3 * float(np.median(durations)), "largest": 1e3 * float(durations.max())},
        "people": len(found.tracks),
        "forecasts": len(found.forecasts),
        "lead_s": scored.lead,
        "compared": scored.count,
        "error_m": scored.error,
        "constant_velocity_error_m": scored.straight,
        "probability_within_half_metre": scored.nearby,
    }


def _rows(found: Replay) -> list[list[str]]:
    durations = 1e3 * np.array([plan.duration for plan in found.plans])
    statuses = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in found.statuses.items())
    return [
        ["used", ", ".join(f"{name} from {topic}" for name, topic in found.topics.items())],
        ["duration", f"{found.robot[-1, 0] - found.robot[0, 0]:.1f} s"],
        ["plans", f"{len(found.plans)}: {statuses}"],
        ["planning time", f"median {np.median(durations):.1f} ms, largest {durations.max():.1f} ms"],
        ["people", f"{len(found.tracks)}"],
    ]


def _score_rows(scored: Score) -> list[list[str]]:
    columns = (scored.lead, scored.count, scored.error, scored.straight, scored.nearby)
    return [
        [f"{lead:.1f}", f"{count:.0f}", f"{error:.2f}", f"{straight:.2f}", f"{nearby:.2f}"]
        for lead, count, error, straight, nearby in zip(*columns, strict=True)
    ]
