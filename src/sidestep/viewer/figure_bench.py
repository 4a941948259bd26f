"""Figures of speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from sidestep.viewer.style import CROWD, LINE, PEOPLE, ROBOT, SMALL, new_figure, style_axes


def horizon_figure(
    horizons: Sequence[int], times: Sequence[float], floors: Mapping[int, float], peers: Mapping[str, float]
) -> Figure:
    """Return time per planning step over the horizon, with the floor of the sweeps and other planners as lines.

    Args:
        horizons: N; times: ms at these; floors: N → ms of arithmetic alone; peers: name → ms.
    """
    figure = new_figure(6.4, 4.2)
    axes = figure.subplots()
    axes.plot(horizons, times, color=ROBOT, marker="o", linewidth=LINE, label="sidestep, whole step")
    axes.plot(list(floors), list(floors.values()), color=CROWD, marker=".", linestyle="--", label="floor of one sweep")
    for i, (name, value) in enumerate(peers.items()):
        axes.axhline(value, color=PEOPLE[i % len(PEOPLE)], linestyle=":", linewidth=LINE, label=name)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(list(horizons), [str(n) for n in horizons])
    axes.minorticks_off()
    style_axes(axes, x="horizon N (steps)", y="time per planning step (ms)")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2, fontsize=SMALL, frameon=False)
    return figure


def growth_figure(series: Sequence[Sequence[float]]) -> Figure:
    """Return time per planning step over the number of people: (people, ms) pairs."""
    figure = new_figure(5.0, 3.6)
    axes = figure.subplots()
    axes.plot([p for p, _ in series], [t for _, t in series], color=ROBOT, marker="o", linewidth=LINE)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.set_xticks([0, *(p for p, _ in series)])
    style_axes(axes, x="people", y="time per planning step, N = 10 (ms)")
    return figure
