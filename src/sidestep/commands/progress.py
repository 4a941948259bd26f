"""A progress bar on stderr while a scenario runs."""

from __future__ import annotations

import sys
from collections.abc import Callable

from sidestep.errors import SidestepError
from sidestep.io.scenarios import load_obstacles
from sidestep.planning.plan import Plan
from sidestep.simulation.loop import Step, simulate
from sidestep.simulation.record import Record
from sidestep.simulation.recordings import Recording
from sidestep.simulation.scenario import Scenario

_FAULT = "internal error"  # how a planner's stop begins that is a fault of ours


def watched(scenario: Scenario, recording: Recording | None) -> Record:
    """Run a scenario, or the part of it that was done when it was interrupted; show how far it is, in a terminal.

    Raises:
        SidestepError: the planner stopped because of a fault of its own: safe, but the run would tell nothing.
    """
    obstacles = load_obstacles(scenario)

    def run(on_step: Callable[[Step], None]) -> Record:
        return simulate(scenario, recording=recording, obstacles=obstacles, on_step=on_step, keep_interrupted=True)

    if not sys.stderr.isatty():
        return run(_faultless)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[state]}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(scenario.name, total=None, state="getting ready")

        def show(step: Step) -> None:
            if step.index == 0:
                bar.update(task, total=step.distance)
            total = bar.tasks[0].total or 0.0
            state = f"{step.time:.1f} s, {step.distance:.1f} m to go, {step.motion.status.replace('_', ' ')}"
            bar.update(task, completed=max(total - step.distance, 0.0), state=state)

        return run(_both(_faultless, show))


def _both(first: Callable[[Step], None], second: Callable[[Step], None]) -> Callable[[Step], None]:
    def call(step: Step) -> None:
        first(step)
        second(step)

    return call


def _faultless(step: Step) -> None:
    if isinstance(step.motion, Plan) and step.motion.reason.startswith(_FAULT):
        raise SidestepError(f"the planner stopped at {step.time:g} s: {step.motion.reason}; please report it")
