"""Pictures of whole runs. Each function returns a figure."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import sidestep
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.lab import run_lab
from sidestep.simulation.lab_room import LabSettings
from sidestep.simulation.record import Record
from sidestep.viewer import style
from sidestep.viewer.figure_lab import lab_runs_figure
from sidestep.viewer.figure_scene import draw_paths
from sidestep.viewer.figure_series import draw_distance
from sidestep.viewer.figures import run_figure

SEED = 1
ROOM = 0  # of the laboratory


def crossing(kind: str, seed: int = SEED) -> Record:
    """The default scenario with a person of this kind."""
    return sidestep.simulate(load_scenario("crossing", [f"people.0.kind={kind}", f"seed={seed}"]))


def one_run() -> Figure:
    """What `sidestep run crossing` draws."""
    return run_figure(sidestep.simulate(load_scenario("crossing")))


def two_kinds() -> Figure:
    """The same crossing with a concerned and an unconcerned person, and what the robot came to believe."""
    figure = style.new_figure(11.5, 5.0)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.15, 1.15, 1.0))
    belief = figure.add_subplot(grid[0, 2])
    for column, (kind, dashes) in enumerate((("concerned", "-"), ("unconcerned", "--"))):
        record = crossing(kind)
        draw_paths(figure.add_subplot(grid[:, column]), record, title=f"{kind} person", shape=0.95)
        belief.plot(record.time[:-1], record.beliefs[:, 0], dashes, color=style.PEOPLE[0], linewidth=2)
        if kind == "unconcerned":
            draw_distance(distance := figure.add_subplot(grid[1, 2]), record)
            distance.set_title("unconcerned", fontsize=style.TEXT, loc="left")
            distance.set_xlabel("time (s)", fontsize=style.TEXT)
    handles = [
        Line2D([], [], color=style.PEOPLE[0], linestyle=dashes, linewidth=2, label=kind)
        for kind, dashes in (("concerned", "-"), ("unconcerned", "--"))
    ]
    belief.legend(handles=handles, frameon=False, fontsize=style.SMALL)
    style.style_axes(belief, x="time (s)", y="P(concerned)")
    belief.set(ylim=(-0.05, 1.05), yticks=(0, 0.5, 1))
    return figure


def parameter_sets() -> Figure:
    """The belief under the printed parameters and under the authors', for both kinds of people."""
    figure = style.new_figure(9.0, 3.4)
    for axes, name in zip(figure.subplots(1, 2, sharey=True), ("paper-printed", "paper-authors"), strict=True):
        for kind, colour in (("concerned", style.PEOPLE[1]), ("unconcerned", style.PEOPLE[0])):
            for seed in range(5):
                record = sidestep.simulate(load_scenario(name, [f"people.0.kind={kind}", f"seed={seed}"]))
                label = kind if seed == 0 else None
                axes.plot(record.time[:-1], record.beliefs[:, 0], color=colour, alpha=0.8, label=label)
        style.style_axes(axes, x="time (s)", y="P(concerned)" if name == "paper-printed" else "", title=name)
        axes.set(ylim=(-0.05, 1.05), yticks=(0, 0.5, 1))
        axes.legend(frameon=False, fontsize=style.SMALL, title="the person is, 5 seeds", title_fontsize=style.SMALL)
    return figure


def laboratory() -> Figure:
    """A room of the simulated laboratory, once with a concerned and once with an unconcerned person."""
    rooms = (LabSettings(human="concerned", seed=ROOM), LabSettings(human="unconcerned", seed=ROOM))
    return lab_runs_figure({s.human: run_lab(s, snapshots=32).record for s in rooms})
