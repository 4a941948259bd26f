"""Predicted probabilities against how often they came true."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sidestep.viewer import style

LEAST = 1e-4
"""Probabilities below this are drawn here."""


def calibration_figure(kinds: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Return one panel per kind of people: frequency over predicted probability with exact 99 % intervals.

    Args:
        kinds: as `sidestep.studies.calibration.calibration_study` returns them.
    """
    columns = min(len(kinds), 2)
    rows = math.ceil(len(kinds) / columns)
    figure = style.new_figure(4.6 * columns, 4.0 * rows)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for k, (axes, (name, found)) in enumerate(zip(panels.flat, kinds.items(), strict=False)):
        _draw(axes, found["bins"])
        title = f"{name.replace('_', ' ')}: error {found['ece']:.4f}, {found['n']} pairs"
        last, first = k >= len(kinds) - columns, k % columns == 0
        style.style_axes(
            axes, x="predicted probability" if last else "", y="share that came true" if first else "", title=title
        )
    return figure


def _draw(axes: Axes, bins: Sequence[Mapping[str, float]]) -> None:
    axes.plot([LEAST, 1.0], [LEAST, 1.0], color=style.CROWD, linestyle="--", linewidth=1.2)
    for one in bins:
        x = max(one["predicted"], LEAST)
        axes.plot([x, x], [max(one["low"], LEAST), max(one["high"], LEAST)], color=style.ROBOT, linewidth=style.LINE)
        hollow = one["frequency"] < LEAST
        axes.plot(
            x,
            max(one["frequency"], LEAST),
            marker="o",
            markersize=7,
            color=style.ROBOT,
            markerfacecolor="white" if hollow else style.ROBOT,
            clip_on=False,
        )
    axes.set(xscale="log", yscale="log", xlim=(LEAST, 1.0), ylim=(LEAST, 1.0))
