"""`sidestep run`: a robot past people; table, record, figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from sidestep.simulation.metrics import Metrics
    from sidestep.simulation.record import Record
    from sidestep.simulation.recordings import Recording
    from sidestep.simulation.scenario import Scenario

INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it; the finished part of the run is kept."""


def run(
    scenario: str = "crossing",
    /,
    *,
    human: Literal["concerned", "unconcerned", "switching"] | None = None,
    seed: int | None = None,
    horizon: int | None = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative="")] = (),
    out: Path | None = None,
    messages: Annotated[Path | None, Parameter(name="--record")] = None,
    people: Path | None = None,
    scene: str | None = None,
    start: float | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Send a robot past people: a table, a record (.npz), the scenario (.toml) and a figure (.png).

    Args:
        scenario: name of a scenario (`sidestep scenarios`), or path of a TOML file.
        human: kind of all simulated people.
        seed: of the random generator.
        horizon: planning steps, N_R.
        set_: change any field: --set planner.risk_limit=0.05 --set people.0.speed=1.4 (repeatable).
        out: folder for the results; runs/<scenario>-<human>-<seed> unless given.
        messages: also write the run as standard messages: FILE.mcap (ROS 2) or FILE.bag (ROS 1).
        people: CSV of recorded people, scene,t,agent,kind,x,y, plain or .gz, instead of the simulated ones.
        scene: of that file.
        start: s, when in the scene the robot sets out; chosen by the seed unless given.
        json: print exactly one JSON object on stdout.
    """
    from sidestep.commands import recorded
    from sidestep.commands.console import emit_json, say, show, table
    from sidestep.io.files import ready_folder

    chosen, recording = _scenario(scenario, human, seed, horizon, set_, recorded.Source(people, scene, start))
    folder = ready_folder(out or Path("runs") / _folder_name(chosen))
    if messages is not None:
        _check_messages(chosen, messages)
    from sidestep.commands.bars import first_time
    from sidestep.commands.progress import watched  # heavy: after everything that may be wrong with the input
    from sidestep.commands.summary import rows, summary
    from sidestep.simulation.metrics import measure

    first_time(walls=bool(chosen.walls or chosen.map))
    record = watched(chosen, recording)
    metrics = measure(record)
    if not record.status:
        say("interrupted before the first step was done; nothing is kept")
        return INTERRUPTED
    files = _write(chosen, record, folder)
    if messages is not None:
        files.append(_write_messages(record, messages))
    if json:
        emit_json(summary(record, metrics) | {"files": [str(file) for file in files]})
    else:
        table(rows(record, metrics), title=_title(chosen))
        show("wrote " + ", ".join(str(file) for file in files))
    return _status(metrics, record)


def _scenario(
    name: str,
    human: str | None,
    seed: int | None,
    horizon: int | None,
    changes: tuple[str, ...],
    source: Any,
) -> tuple[Scenario, Recording | None]:
    """The scenario with all changes, and the recording that it needs."""
    from sidestep.errors import InvalidInput
    from sidestep.io.scenarios import load_scenario

    extra = list(changes)
    for option, field, number in (("--horizon", "planner.horizon", horizon), ("--seed", "seed", seed)):
        if number is not None:
            _refuse_twice(changes, field, option)
            extra.append(f"{field}={number}")
    if source.file is not None:
        if human is not None:
            raise InvalidInput(
                "--human", human, "only without --people", "recorded people cannot be turned into others"
            )
        return source.scenario(name, extra)
    for option, value in (("--scene", source.scene), ("--start", source.start)):
        if value is not None:
            raise InvalidInput(option, value, "only together with --people TRACKS.csv")
    chosen = load_scenario(name, extra)
    if human is not None:
        if not chosen.people:
            raise InvalidInput("--human", human, "only where people are simulated", f"{chosen.name} has none")
        chosen = _with_kind(chosen, human)
    return chosen, source.named(chosen)


def _refuse_twice(changes: Sequence[str], field: str, option: str) -> None:
    """Check that no change sets a field that an option of its own sets."""
    from sidestep.errors import InvalidInput

    for change in changes:
        if change.partition("=")[0].strip() == field:
            raise InvalidInput("--set", change, f"only without {option}, which sets the same")


def _with_kind(scenario: Scenario, kind: str) -> Scenario:
    """The scenario with all simulated people of one kind."""
    people = tuple(person.model_copy(update={"kind": kind}) for person in scenario.people)
    return scenario.model_copy(update={"people": people})


def _folder_name(scenario: Scenario) -> str:
    kinds = {person.kind for person in scenario.people} or ({"recorded"} if scenario.recording else {"nobody"})
    kind = kinds.pop() if len(kinds) == 1 else "mixed"
    name = scenario.name
    if scenario.recording is not None:
        name += "-" + scenario.recording.scene
    safe = "".join(c if c.isalnum() or c in "-_." else "-" for c in name)
    return f"{safe}-{kind}-{scenario.seed}"


def _title(scenario: Scenario) -> str:
    r = scenario.robot
    start, goal = (", ".join(f"{x:g}" for x in point) for point in (r.start, r.goal))
    scene = scenario.recording
    where = "" if scene is None else f" among the people of {scene.scene} from {scene.start:g} s"
    return f"{scenario.name}{where}, seed {scenario.seed}: robot from ({start}) to ({goal}) m"


def _write(scenario: Scenario, record: Record, folder: Path) -> list[Path]:
    """Write record, scenario and figure."""
    from sidestep.io.records import write_record
    from sidestep.io.scenarios import write_scenario
    from sidestep.viewer.figures import run_figure, save_figure

    files = [write_record(record, folder / "record.npz")]
    write_scenario(scenario, folder / "scenario.toml")
    files.append(folder / "scenario.toml")
    files.append(save_figure(run_figure(record), folder / "figure.png"))
    return files


def _check_messages(scenario: Scenario, path: Path) -> None:
    """Say what is wrong with `--record` before time is spent on the run."""
    from sidestep.errors import InvalidInput
    from sidestep.io.recordings import check_recordable

    check_recordable(path)
    if scenario.dimension != 2:
        raise InvalidInput("--record", f"a run in {scenario.dimension} dimensions", "2 dimensions; messages are flat")


def _write_messages(record: Record, path: Path) -> Path:
    from sidestep.io.recordings import RecordingWriter
    from sidestep.ros.recorded import record_messages

    with RecordingWriter(path) as recording:
        for message in record_messages(record, recording.make):
            recording.write(*message)
    return path


def _status(metrics: Metrics, record: Record) -> int:
    from sidestep.commands.console import say

    if metrics.finished:
        return 0
    say(f"interrupted after {record.time[-1]:.1f} s; the finished part is kept")
    return INTERRUPTED
