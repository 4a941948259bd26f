"""Figures of the comparison with other navigators: how often they collide, and how long they take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sidestep.viewer import style

OURS = "sidestep"
AIM_COLLISION, AIM_TIME = 0.05, 1.05
MARKS = "osD^vP*X"

Row = Mapping[str, Any]


def overall_figure(pooled: Sequence[Row]) -> Figure:
    """Return collisions against time, one mark per navigator over all conditions that it ran in.

    Args:
        pooled: "navigator", "collision_moving", "collision_moving_ci99" (low, high), "time_ratio" of time to goal by
            shortest time; "kind" of contestant: ablations have hollow marks.
    """
    beside = len(pooled) > 8  # a column of its own, where rows of names would not fit above
    figure = style.new_figure(8.4 if beside else 6.4, 0.24 * len(pooled) + 1.6 if len(pooled) > 12 else 4.4)
    axes = figure.subplots()
    others = [row["navigator"] for row in pooled if row["navigator"] != OURS]
    for n, row in enumerate(pooled):
        low, high = row["collision_moving_ci99"]
        p = row["collision_moving"]
        ours = row["navigator"] == OURS
        colour = style.ROBOT if ours else style.PEOPLE[others.index(row["navigator"]) % len(style.PEOPLE)]
        axes.errorbar(
            [row["time_ratio"]],
            [100 * p],
            yerr=[[100 * (p - low)], [100 * (high - p)]],
            color=colour,
            marker=MARKS[n % len(MARKS)],
            mfc="none" if row.get("kind") == "ablation" else colour,
            ls="",
            ms=8,
            elinewidth=1.2,
            capsize=3,
            label=row["navigator"],
            zorder=4 if ours else 3,
            clip_on=False,
        )
    axes.axhline(100 * AIM_COLLISION, color=style.LIMIT, ls=":", lw=1.2)
    axes.set_ylim(bottom=-0.5)
    axes.margins(x=0.1)
    style.style_axes(axes, x="mean time to goal over the shortest", y="episodes with a moving contact (%)")
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="outside right upper" if beside else "outside upper center",
        ncols=1 if beside else 4,
        fontsize=style.SMALL,
        frameon=False,
    )
    return figure


def by_condition_figure(rows: Sequence[Row], aims: Sequence[Row], shown: Sequence[str]) -> Figure:
    """Return one line per condition: collision rates of a few navigators, and our time over the fastest safe one's.

    Hollow: ours takes longer than is aimed at.

    Args:
        rows: of the table; aims: of `evaluate_table.aims`; shown: navigators, ours first.
    """
    names = list(dict.fromkeys(row["name"] for row in rows))
    figure = style.new_figure(9.0, 0.24 * len(names) + 1.6)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.6, 1.0))
    for n in reversed(range(len(shown))):  # ours last, on top
        _collisions(left, rows, names, shown[n], n)
    ratios = {a["name"]: a["time_ratio"] for a in aims}
    known = [(names.index(name), ratio) for name, ratio in ratios.items() if ratio is not None]
    inside = [style.ROBOT if ratio <= AIM_TIME else "none" for _, ratio in known]
    times, lines = [ratio for _, ratio in known], [at for at, _ in known]
    right.scatter(times, lines, c=inside, edgecolors=style.ROBOT, s=30, zorder=3)
    left.axvline(100 * AIM_COLLISION, color=style.LIMIT, ls=":", lw=1.2)
    right.axvline(AIM_TIME, color=style.LIMIT, ls=":", lw=1.2)
    right.axvline(1.0, color=style.CROWD, lw=0.8)
    left.set_yticks(range(len(names)), names, fontsize=style.SMALL)
    left.set_ylim(len(names) - 0.4, -0.6)
    left.set_xlim(left=-1.0)
    style.style_axes(left, x="episodes with a moving contact (%)\nbar: ours to the 99 % bound", y="")
    style.style_axes(right, x="our time by that of the fastest\nopponent below 20 % contacts", y="")
    handles, labels = (part[::-1] for part in left.get_legend_handles_labels())
    figure.legend(handles, labels, loc="outside upper center", ncols=5, fontsize=style.SMALL, frameon=False)
    return figure


def parts_figure(pooled: Sequence[Row]) -> Figure:
    """Return one line per navigator, ours first: collisions with their intervals, and time over the shortest.

    Args:
        pooled: as for `overall_figure`.
    """
    rows = sorted(pooled, key=lambda row: row["navigator"] != OURS)
    names = [row["navigator"].removeprefix(f"{OURS}-").replace("-", " ") for row in rows]
    colours = [style.ROBOT if row["navigator"] == OURS else style.PEOPLE[0] for row in rows]
    figure = style.new_figure(8.4, 0.3 * len(rows) + 1.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for at, (row, colour) in enumerate(zip(rows, colours, strict=True)):
        low, high = (100 * bound for bound in row["collision_moving_ci99"])
        left.hlines(at, low, high, color=colour, lw=1.4)
        left.plot(100 * row["collision_moving"], at, "o", ms=6, color=colour, clip_on=False, zorder=3)
        if row["time_ratio"] is not None:  # somebody arrived
            right.plot(row["time_ratio"], at, "o", ms=6, color=colour, zorder=3)
            if at == 0:
                right.axvline(row["time_ratio"], color=style.CROWD, lw=0.8)
    left.axvline(100 * AIM_COLLISION, color=style.LIMIT, ls=":", lw=1.2)
    left.set_yticks(range(len(rows)), names, fontsize=style.SMALL)
    left.set_ylim(len(rows) - 0.4, -0.6)
    left.set_xlim(left=-0.3)
    style.style_axes(left, x="episodes with a moving contact (%)\nbar: 99 % interval", y="")
    style.style_axes(right, x="mean time to goal over the shortest", y="")
    return figure


def _collisions(axes: Axes, rows: Sequence[Row], names: Sequence[str], navigator: str, number: int) -> None:
    """Rates of one navigator as marks; ours with a bar to the upper bound."""
    own = [row for row in rows if row["navigator"] == navigator]
    aside = 0.0 if number == 0 else 0.14 * (number - 2.5)  # none hides another
    at = [names.index(row["name"]) + aside for row in own]
    rate = [100 * row["collision_moving"] for row in own]
    colour = style.ROBOT if number == 0 else style.PEOPLE[(number - 1) % len(style.PEOPLE)]
    if number == 0:
        axes.hlines(at, rate, [100 * row["collision_moving_upper99"] for row in own], color=colour, lw=1.4)
    mark = MARKS[number % len(MARKS)]
    axes.plot(rate, at, ls="", marker=mark, ms=6 if number == 0 else 5, color=colour, label=navigator, clip_on=False)
