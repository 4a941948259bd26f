"""Runs a scenario from its start to its end, with one robot or with several."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from sidestep.checks import of_kind
from sidestep.simulation.navigators import Navigator
from sidestep.simulation.people import Builder
from sidestep.simulation.record import Record
from sidestep.simulation.recordings import Recording
from sidestep.simulation.run import Run, Step
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.team import TeamRun

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles

__all__ = ["Run", "Step", "simulate"]


def simulate(
    scenario: Scenario,
    *,
    navigator: Navigator | None = None,
    seed: int | None = None,
    recording: Recording | None = None,
    obstacles: Obstacles | None = None,
    kinds: Mapping[str, Builder] | None = None,
    on_step: Callable[[Step], object] | None = None,
    snapshots: int = 6,
    keep_interrupted: bool = False,
) -> Record:
    """Run a scenario from its start to the goal, or until its duration is over.

    With further robots in the scenario the record is that of the first one (`sidestep.simulation.team` gives all).
    The same scenario and seed give the same run; people, sensor and robot each draw from a stream of their own, so
    that runs of different navigators are paired.

    Args:
        scenario: the run.
        navigator: drives the robot; None: the planner that the scenario describes.
        seed: instead of the scenario's.
        recording: the recorded people that `scenario.recording` names.
        obstacles: walls; None: the scenario's polygons.
        kinds: builders for kinds of people that this room does not know.
        on_step: called after each step, before the robot moves on.
        snapshots: steps of which predicted occupancies are kept in the record.
        keep_interrupted: on KeyboardInterrupt return the whole steps done so far.

    Raises:
        InvalidInput: something is inside a wall or too close at the start, or a name is unknown.
    """
    of_kind(
        "simulate.scenario", scenario, Scenario, mend="sidestep.io.scenarios.load_scenario reads one, by name or file"
    )
    if seed is not None:
        scenario = scenario.model_copy(update={"seed": seed})
    if scenario.robots:
        team = TeamRun(
            scenario,
            navigator=navigator,
            recording=recording,
            obstacles=obstacles,
            kinds=kinds,
            on_step=on_step,
            snapshots=snapshots,
        )
        return team.finish(keep_interrupted=keep_interrupted)[0]
    run = Run(
        scenario,
        navigator=navigator,
        recording=recording,
        obstacles=obstacles,
        kinds=kinds,
        on_step=on_step,
        snapshots=snapshots,
    )
    return run.finish(keep_interrupted=keep_interrupted)
