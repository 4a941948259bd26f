"""Figures of the paper's kinds, from what the reproduction measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sidestep.simulation.record import Record, Snapshot
from sidestep.types import FloatArray
from sidestep.viewer.style import INK, LIMIT, LINE, PEOPLE, ROBOT, SMALL, TEXT, new_figure, style_axes

Band = tuple[FloatArray, FloatArray, FloatArray]
"""Median, lower and upper end of its interval, over the horizons."""


def comparison_figure(without: Record, ahead: Record, names: tuple[str, str]) -> Figure:
    """Return two runs side by side: paths on top, predicted distributions at one instant of each below."""
    figure = new_figure(7.2, 7.0)
    grid = figure.subplots(2, 2)
    for column, (record, name) in enumerate(zip((without, ahead), names, strict=True)):
        _paths(grid[0, column], record, name)
        _distribution(grid[1, column], record)
    return figure


def _paths(axes: Axes, record: Record, title: str) -> None:
    person = record.people_positions[:, 0]
    axes.plot(*record.robot_positions.T, color=ROBOT, linewidth=LINE, marker="o", markersize=3, label="robot")
    axes.plot(*person.T, color=PEOPLE[0], linewidth=LINE, marker="s", markersize=3, label="person")
    axes.plot(*record.robot_goal, marker="*", color=ROBOT, markersize=11, linestyle="none")
    axes.plot(*record.people_goals[0], marker="X", color=PEOPLE[0], markersize=8, linestyle="none")
    axes.legend(fontsize=SMALL, frameon=False, loc="upper left")
    axes.set_aspect("equal", adjustable="datalim")
    style_axes(axes, x="x (m)", y="y (m)", title=title)


def _distribution(axes: Axes, record: Record) -> None:
    snapshot = _near_the_meeting(record)
    last = snapshot.probability[-1]
    radius = (last.shape[0] - 1) // 2
    half = (radius + 0.5) * snapshot.spacing
    x, y = snapshot.origin
    seen = np.log10(np.maximum(last.T, 1e-4))
    image = axes.imshow(
        seen, origin="lower", extent=(x - half, x + half, y - half, y + half), cmap="magma_r", vmin=-4, vmax=0
    )
    axes.plot(x, y, marker="s", color=PEOPLE[0], linestyle="none")
    axes.plot(*record.plans[snapshot.step].T, color=ROBOT, marker="o", markersize=3)
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.8, ticks=[-4, -3, -2, -1, 0])
    bar.ax.set_yticklabels(["≤10⁻⁴", "10⁻³", "10⁻²", "0.1", "1"], fontsize=SMALL)
    ahead = int(snapshot.instants[-1])
    style_axes(
        axes, x="x (m)", y="y (m)", title=f"P at {record.time[snapshot.step]:.1f} s, {ahead} steps ahead", grid=False
    )


def _near_the_meeting(record: Record) -> Snapshot:
    apart = np.linalg.norm(record.people_positions[:, 0] - record.robot_positions, axis=1)
    closest = int(np.nanargmin(apart))
    before = [s for s in record.snapshots if s.step <= closest] or list(record.snapshots[:1])
    return before[-1]


def indices_figure(curves: Mapping[str, Mapping[str, Band]], horizons: Sequence[int], unit: str) -> Figure:
    """Return PI_R, PI_H and PI_T over the horizon with interval bands.

    Args:
        curves: index → name of the curve → band; horizons: of its points; unit: of the indices.
    """
    figure = new_figure(9.0, 3.6)
    for axes, (index, named) in zip(figure.subplots(1, len(curves)), curves.items(), strict=True):
        for i, (name, (middle, low, high)) in enumerate(named.items()):
            colour = (ROBOT, *PEOPLE)[i]
            style = "-" if i % 2 == 0 else "--"
            axes.plot(
                horizons, middle, color=colour, linestyle=style, linewidth=LINE, marker="o", markersize=3, label=name
            )
            axes.fill_between(horizons, low, high, color=colour, alpha=0.2, linewidth=0)
        style_axes(axes, x="horizon N (steps)", y=f"{index} ({unit})")
        highest = axes.dataLim.y1
        axes.set_ylim(0.0, 1.15 * highest if highest > 0 else None)  # the margin is of the height, not of the spread
        axes.set_xticks(list(horizons)[1::2])
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=SMALL, frameon=False
    )
    return figure


def lab_figure(records: Mapping[str, Record]) -> Figure:
    """Return one lab run for each kind of person: paths, belief, and the predicted distribution."""
    figure = new_figure(7.2, 8.0)
    grid = figure.subplots(3, len(records), height_ratios=[3, 1.3, 3])
    for column, (name, record) in enumerate(records.items()):
        _paths(grid[0, column], record, name)
        axes = grid[1, column]
        axes.plot(record.time[:-1], record.beliefs[:, 0], color=PEOPLE[0], linewidth=LINE)
        axes.set_ylim(-0.03, 1.03)
        style_axes(axes, x="time (s)", y="P(concerned)")
        _distribution(grid[2, column], record)
    return figure


def reasons_figure(
    weights: FloatArray,
    differing: Mapping[str, FloatArray],
    own: Mapping[str, float],
    steps: FloatArray,
    mass: Mapping[str, FloatArray],
) -> Figure:
    """Return why claims fail: awareness that changes no action, and cells that no longer reach P_th.

    Args:
        weights: (W,) danger weights; differing: label → (W,) shares; own: label → its own weight.
        steps: (N,); mass: label → (N,) probability in cells with P ≥ P_th.
    """
    figure = new_figure(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    for i, label in enumerate(differing):
        colour = (ROBOT, PEOPLE[0])[i % 2]
        left.plot(weights, 100 * differing[label], color=colour, linewidth=LINE, marker="o", label=label)
        left.axvline(own[label], color=colour, linestyle=":", linewidth=1.5)
        right.plot(steps, 100 * mass[label], color=colour, linewidth=LINE, marker="o", label=label)
    left.set_xscale("log")
    style_axes(left, x="danger weight θ₃ (dotted: as used)", y="best action differs (% of states)")
    style_axes(right, x="steps ahead", y="probability in cells ≥ P_th (%)")
    for axes in (left, right):
        axes.set_ylim(-3, 103)
        axes.legend(fontsize=SMALL, frameon=False)
    return figure


def replay_figure(runs: Sequence[tuple[str, FloatArray, FloatArray]]) -> Figure:
    """Return recorded runs: the logged belief and the one that our update infers, step by step."""
    figure = new_figure(9.0, 2.6)
    for axes, (name, logged, ours) in zip(np.atleast_1d(figure.subplots(1, len(runs), sharey=True)), runs, strict=True):
        axes.plot(logged, color=LIMIT, linestyle="--", linewidth=LINE, label="recorded")
        axes.plot(ours, color=ROBOT, linewidth=LINE, marker="o", markersize=3, label="ours")
        axes.set_ylim(-0.03, 1.03)
        style_axes(axes, x="step (5 s)", y="", title=name)
    figure.axes[0].set_ylabel("P(concerned)", fontsize=TEXT)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=SMALL, frameon=False
    )
    return figure


def region_figure(grid: Sequence[Mapping[str, object]]) -> Figure:
    """Return where claims hold in the neighbourhood of the authors' values: a column per claim, a mark per place."""
    claims = list(dict.fromkeys(map(_claim, grid)))
    places = list(dict.fromkeys(str(e["at"]) for e in grid))
    figure = new_figure(4.6 + 0.62 * len(claims), 2.2 + 0.3 * len(places))
    axes = figure.subplots()
    marks = {"holds": ("o", ROBOT), "undecided": ("s", PEOPLE[3]), "does not hold": ("x", PEOPLE[0])}
    for verdict, (mark, colour) in marks.items():
        spots = [e for e in grid if e["verdict"] == verdict]
        x = [claims.index(_claim(e)) for e in spots]
        y = [places.index(str(e["at"])) for e in spots]
        axes.plot(x, y, mark, color=colour, markersize=9, markeredgewidth=2, label=verdict)
    axes.set_xticks(range(len(claims)), claims, fontsize=SMALL, rotation=30, ha="left")
    axes.xaxis.tick_top()
    axes.set_yticks(range(len(places)), places, fontsize=SMALL)
    axes.set_xlim(-0.5, len(claims) - 0.5)
    axes.invert_yaxis()
    for side in ("bottom", "right"):
        axes.spines[side].set_visible(False)
    axes.set_ylabel("the authors' values, but for", fontsize=TEXT, color=INK)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False)
    return figure


def _claim(entry: Mapping[str, object]) -> str:
    """A claim, and by which index."""
    return f"{entry['id']}{' (lateral)' if entry['index_name'] == 'lateral' else ''}"
