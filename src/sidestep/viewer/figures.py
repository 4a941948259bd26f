"""Record → matplotlib figures. Nothing here computes what the record does not say."""

from __future__ import annotations

import os
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec, GridSpecFromSubplotSpec
from matplotlib.lines import Line2D

from sidestep.errors import OutputError
from sidestep.simulation.metrics import arrival
from sidestep.simulation.record import Record
from sidestep.viewer import style
from sidestep.viewer.figure_occupancy import (
    ahead_labels,
    chosen_steps,
    draw_prediction,
    draw_prediction_over_time,
    frame_predictions,
)
from sidestep.viewer.figure_scene import draw_paths, draw_paths_over_time
from sidestep.viewer.figure_series import draw_belief, draw_distance, draw_risk
from sidestep.viewer.nearest import closest_approaches


def run_figure(record: Record) -> Figure:
    """Return the figure of one run, 1-D, 2-D or 3-D, any number of people.

    Left: the paths with marks at round instants (s), discs to scale at the closest approach. Right: distance, belief
    and risk over time. Below: the predicted occupancy at chosen steps (`Record.snapshots`) with the plan made then.
    Agg backend, no `pyplot`: safe in threads and servers.
    """
    steps = chosen_steps(record)
    figure = style.new_figure(11.5, 9.6 if steps else 6.2)
    figure.suptitle(_summary(record), fontsize=style.TEXT + 2, x=0.01, ha="left", color=style.INK)
    rows = figure.add_gridspec(2 if steps else 1, 1, height_ratios=(1.75, 1.0) if steps else (1.0,))
    top = rows[0].subgridspec(3, 2, width_ratios=(1.25, 1.0))
    _draw_scene(figure, top, record)
    _draw_series(figure, top, record)
    if steps:
        _draw_predictions(figure, rows, record, steps)
    return figure


def save_figure(figure: Figure, path: Path | str) -> Path:
    """Write `figure` (png, pdf or svg by its suffix); a reader never sees half a file.

    Raises:
        OutputError: the folder does not exist or is not writable, or a folder has that name.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        figure.savefig(temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise OutputError(target, error.strerror or str(error)) from error
    finally:
        temporary.unlink(missing_ok=True)
    return target


def _summary(record: Record) -> str:
    near = closest_approaches(record)
    parts = [record.scenario, f"seed {record.seed}"]
    if record.reached_goal:
        parts.append(f"goal reached after {arrival(record):.1f} s")
    else:
        parts.append(f"goal not reached within {record.time[-1]:.1f} s")
    if near:
        parts.append(f"closest {near[0].distance:.2f} m")
    return "  ·  ".join(parts)


def _draw_scene(figure: Figure, grid: GridSpecFromSubplotSpec, record: Record) -> None:
    dimension = record.robot_goal.size
    if dimension == 1:
        draw_paths_over_time(figure.add_subplot(grid[:, 0]), record, title="positions")
    elif dimension == 2:
        draw_paths(figure.add_subplot(grid[:, 0]), record, title="paths, marks in s")
    else:
        top = figure.add_subplot(grid[:2, 0])
        draw_paths(top, record, (0, 1), title="from above, marks in s", shape=1.6)
        draw_paths(figure.add_subplot(grid[2, 0]), record, (0, 2), title="from the side", names=False, shape=3.6)


def _draw_series(figure: Figure, grid: GridSpecFromSubplotSpec, record: Record) -> None:
    distance = figure.add_subplot(grid[0, 1])
    belief = figure.add_subplot(grid[1, 1], sharex=distance)
    risk = figure.add_subplot(grid[2, 1], sharex=distance)
    draw_distance(distance, record)
    draw_belief(belief, record)
    draw_risk(risk, record)
    for axes in (distance, belief):
        axes.tick_params(labelbottom=False)
    distance.set_xlim(float(record.time[0]), float(record.time[-1]))


def _draw_predictions(figure: Figure, rows: GridSpec, record: Record, steps: list[int]) -> None:
    grid = rows[1].subgridspec(1, len(steps))
    flat = record.robot_goal.size == 1
    panels = [figure.add_subplot(grid[0, column]) for column in range(len(steps))]
    for axes, step in zip(panels, steps, strict=True):
        if flat:
            draw_prediction_over_time(axes, record, step)
        else:
            draw_prediction(axes, record, step)
    for axes in panels[1:]:
        axes.set_ylabel("")
        if flat:
            axes.sharey(panels[0])
    if not flat:
        frame_predictions(panels, record, steps)
        handles = [
            Line2D([], [], color=colour, marker="s", linestyle="", markersize=9, label=text)
            for colour, text in ahead_labels(record, steps[0])
        ]
        figure.legend(
            handles=handles,
            loc="outside lower center",
            ncols=len(handles) + 1,
            frameon=False,
            fontsize=style.TEXT,
            title="predicted occupancy (shaded) and planned robot (circles), ahead by",
            title_fontsize=style.TEXT,
        )
