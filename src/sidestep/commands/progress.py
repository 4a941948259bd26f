"""A progress bar on stderr while a scenario runs."""

from __future__ import annotations

import sys

from sidestep.io.scenarios import load_obstacles
from sidestep.simulation.loop import Step, simulate
from sidestep.simulation.record import Record
from sidestep.simulation.recordings import Recording
from sidestep.simulation.scenario import Scenario


def watched(scenario: Scenario, recording: Recording | None) -> Record:
    """Run a scenario; where stderr is a terminal, show how far it is."""
    obstacles = load_obstacles(scenario)
    if not sys.stderr.isatty():
        return simulate(scenario, recording=recording, obstacles=obstacles)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[state]}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(scenario.name, total=None, state="getting ready (compiling, the first time)")

        def on_step(step: Step) -> None:
            if step.index == 0:
                bar.update(task, total=step.distance)
            total = bar.tasks[0].total or 0.0
            state = f"{step.time:.1f} s, {step.distance:.1f} m to go, {step.motion.status.replace('_', ' ')}"
            bar.update(task, completed=max(total - step.distance, 0.0), state=state)

        return simulate(scenario, recording=recording, obstacles=obstacles, on_step=on_step)
