"""One run of the laboratory for each kind of person, side by side, in the manner of the paper's Fig. 5."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record
from sidestep.viewer import style
from sidestep.viewer.figure_occupancy import ahead_labels, draw_prediction, frame_predictions
from sidestep.viewer.figure_scene import draw_paths

_BEFORE = 1.5  # s before the closest approach, when the prediction is shown


def lab_runs_figure(records: Mapping[str, Record]) -> Figure:
    """Return one column per kind of person: paths, belief over time, and the prediction before they were nearest.

    Args:
        records: kind → record; the first person of each is the one who crosses.
    """
    figure = style.new_figure(9.6, 10.4)
    grid = figure.add_gridspec(3, len(records), height_ratios=(3.0, 1.0, 2.6))
    indices = {kind: measure(record).PI_R for kind, record in records.items()}
    least = min(indices.values())
    for column, (kind, record) in enumerate(records.items()):
        title = f"{kind}: PI$_R$ = {indices[kind] / least:.2f}, marks in s"
        draw_paths(figure.add_subplot(grid[0, column]), record, title=title)
        _draw_belief(figure.add_subplot(grid[1, column]), record)
        steps = {snapshot.step for snapshot in record.snapshots}
        if steps:
            axes = figure.add_subplot(grid[2, column])
            step = min(steps, key=lambda s: abs(float(record.time[s]) - _moment(record)))
            draw_prediction(axes, record, step)
            frame_predictions([axes], record, [step])
            if column == 0:
                _explain(figure, record, step)
    return figure


def _moment(record: Record) -> float:
    """S, shortly before the person who crosses was nearest to the robot."""
    apart = np.linalg.norm(record.people_positions[:, 0] - record.robot_positions, axis=1)
    return float(record.time[int(np.nanargmin(apart))]) - _BEFORE


def _draw_belief(axes: Axes, record: Record) -> None:
    axes.plot(record.time[:-1], record.beliefs[:, 0], color=style.PEOPLE[0], linewidth=style.LINE, label="belief")
    truth = record.people_awareness[:, 0]
    axes.plot(record.time, truth, color=style.PEOPLE[0], linewidth=1.2, linestyle=(0, (2, 2)), label="truth")
    axes.set_xlim(0.0, float(record.time[-1]))
    axes.set_ylim(-0.06, 1.06)
    axes.set_yticks([0.0, 0.5, 1.0])
    axes.legend(fontsize=style.SMALL, frameon=False, loc="best")
    style.style_axes(axes, x="time (s)", y="P(concerned)")


def _explain(figure: Figure, record: Record, step: int) -> None:
    handles = [
        Line2D([], [], color=colour, marker="s", linestyle="", markersize=9, label=text)
        for colour, text in ahead_labels(record, step)
    ]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=len(handles),
        frameon=False,
        fontsize=style.TEXT,
        title="predicted occupancy (shaded) and planned robot (circles), ahead by",
        title_fontsize=style.TEXT,
    )
