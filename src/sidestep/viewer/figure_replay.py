"""A replayed recording as a figure: where people went, where they were predicted to go, and how far off that was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sidestep.types import FloatArray, Vector
from sidestep.viewer import style


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Foreseen:
    """One prediction of one person.

    Attributes:
        person: id; time: s.
        predicted: (N+1, 2) m, mean; actual: (N+1, 2) m, NaN where not seen.
    """

    person: str
    time: float
    predicted: FloatArray
    actual: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Errors:
    """Mean errors by lead time. N steps; NaN where nothing could be compared.

    Attributes:
        lead: (N,) s; predicted: (N,) m; straight: (N,) m, of constant velocity.
        nearby: (N,) predicted probability near the actual position; radius: m, what "near" means.
    """

    lead: FloatArray
    predicted: FloatArray
    straight: FloatArray
    nearby: FloatArray
    radius: float


def replay_figure(
    *, title: str, robot: FloatArray, goal: Vector, tracks: Mapping[str, FloatArray], foreseen: Sequence[Foreseen],
    errors: Errors, every: float = 2.0,
) -> Figure:  # fmt: skip
    """Return the figure.

    Args:
        title: above it.
        robot: (T, 2) m.
        goal: (2,) m.
        tracks: id → (M, 2) m, where that person was seen.
        foreseen: predictions; of each person one every `every` s is drawn.
        errors: of all predictions.
        every: s.
    """
    figure = style.new_figure(11.5, 5.6)
    figure.suptitle(title, fontsize=style.TEXT + 2, x=0.01, ha="left", color=style.INK)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.35, 1.0))
    scene = figure.add_subplot(grid[:, 0])
    _draw_scene(scene, robot, goal, tracks, _thinned(foreseen, every))
    _draw_errors(figure.add_subplot(grid[0, 1]), errors)
    _draw_nearby(figure.add_subplot(grid[1, 1]), errors)
    return figure


def _thinned(foreseen: Sequence[Foreseen], every: float) -> list[Foreseen]:
    chosen: list[Foreseen] = []
    last: dict[str, float] = {}
    for f in foreseen:
        if f.time >= last.get(f.person, -np.inf) + every - 1e-6:
            last[f.person] = f.time
            chosen.append(f)
    return chosen


def _draw_scene(
    axes: Axes, robot: FloatArray, goal: Vector, tracks: Mapping[str, FloatArray], foreseen: Sequence[Foreseen]
) -> None:
    colours = {name: style.person_colour(rank) for rank, name in enumerate(tracks)}
    for name, track in tracks.items():
        axes.plot(*track.T, color=colours[name], linewidth=style.LINE, alpha=0.55, solid_capstyle="round")
    for f in foreseen:
        colour = colours[f.person]
        axes.plot(*f.predicted.T, color=colour, linewidth=1.2, linestyle=(0, (3, 2)))
        axes.plot(*f.predicted[0], marker="o", markersize=3.5, color=colour)
        known = np.flatnonzero(np.isfinite(f.actual).all(axis=1))
        for k in known[known > 0][1::2]:  # every second instant: predicted and actual, joined
            axes.plot(*np.stack([f.predicted[k], f.actual[k]]).T, color=style.CROWD, linewidth=0.7)
    axes.plot(*robot.T, color=style.ROBOT, linewidth=style.LINE)
    axes.plot(*goal, marker="*", markersize=12, color=style.ROBOT, linestyle="none")
    style.style_axes(axes, x="x (m)", y="y (m)", title="Where people went, and where they were predicted to go")
    axes.set_aspect("equal", adjustable="datalim")
    keys = [
        Line2D([], [], color=style.ROBOT, linewidth=style.LINE, label="robot, and its goal"),
        Line2D([], [], color=style.PEOPLE[0], linewidth=style.LINE, alpha=0.55, label="person, as seen"),
        Line2D([], [], color=style.PEOPLE[0], linewidth=1.2, linestyle=(0, (3, 2)), label="mean of a prediction"),
        Line2D([], [], color=style.CROWD, linewidth=0.7, label="predicted to actual"),
    ]
    axes.legend(handles=keys, fontsize=style.SMALL, frameon=False, loc="best")


def _draw_errors(axes: Axes, errors: Errors) -> None:
    axes.plot(errors.lead, errors.predicted, color=style.INK, linewidth=style.LINE, marker="o", markersize=4)
    axes.plot(errors.lead, errors.straight, color=style.CROWD, linewidth=style.LINE, linestyle="--")
    style.style_axes(axes, x="", y="mean error (m)", title="Mean prediction (line), constant velocity (dashed)")
    axes.set_ylim(bottom=0.0)


def _draw_nearby(axes: Axes, errors: Errors) -> None:
    axes.plot(errors.lead, errors.nearby, color=style.INK, linewidth=style.LINE, marker="o", markersize=4)
    title = f"Predicted probability within {errors.radius:g} m of the actual place"
    style.style_axes(axes, x="time ahead (s)", y="probability", title=title)
    axes.set_ylim(0.0, 1.0)
