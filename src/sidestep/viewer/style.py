"""How our figures look: colours that colour-blind people can tell apart, sizes that stay legible at half size."""

from __future__ import annotations

from typing import Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import AbstractPathEffect, withStroke

ROBOT: Final = "#0072B2"
"""Blue of the Okabe–Ito palette: always the robot."""
OTHER_ROBOT: Final = "#00476B"
"""A darker blue: another robot in the same run."""
PEOPLE: Final = ("#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""The other Okabe–Ito colours, in the order in which people get them; further people are `CROWD`."""
CROWD: Final = "#8C8C8C"
LIMIT: Final = "#222222"
WALL: Final = "#B8B8B8"
INK: Final = "#222222"

TEXT: Final = 11.0
"""Points; 5.5 at half size, the least that print allows."""
SMALL: Final = 9.5
LINE: Final = 2.0


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of `width` × `height` inches, laid out by constraints, without any global state."""
    figure = Figure(figsize=(width, height), dpi=150, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def style_axes(axes: Axes, *, x: str, y: str, title: str = "", grid: bool = True) -> None:
    """Label `axes` with units, and take away what carries no information."""
    axes.set_xlabel(x, fontsize=TEXT)
    axes.set_ylabel(y, fontsize=TEXT)
    if title:
        axes.set_title(title, fontsize=TEXT, loc="left", color=INK)
    axes.tick_params(labelsize=SMALL, colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if grid:
        axes.grid(visible=True, color="#E4E4E4", linewidth=0.8)
        axes.set_axisbelow(True)


def person_colour(rank: int) -> str:
    """Return the colour of the person with this rank (0 came nearest to the robot)."""
    return PEOPLE[rank] if rank < len(PEOPLE) else CROWD


def halo(width: float = 2.5) -> list[AbstractPathEffect]:
    """Return the white outline that keeps text readable on top of lines."""
    return [withStroke(linewidth=width, foreground="white")]
