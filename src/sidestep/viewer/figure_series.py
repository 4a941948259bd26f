"""What changed over time: distance, belief, collision probability."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sidestep.simulation.record import Record
from sidestep.types import FloatArray
from sidestep.viewer import style
from sidestep.viewer.nearest import closest_approaches, distances, people_by_nearness

FLOOR = 1e-4
"""Probabilities below this are drawn on the lower edge: no sample of ours can tell them from zero."""
NOT_CERTIFIED = {"least_risk": "#F0E442", "stopped": "#A0A0A0"}


def draw_distance(axes: Axes, record: Record) -> None:
    """Draw the distance to each person over time, the clearance, the contact distance, and the nearest point."""
    ranks = people_by_nearness(record)
    time, values = distances(record, between=8)
    for person in np.argsort(-ranks):
        rank = int(ranks[person])
        crowd = rank >= len(style.PEOPLE)
        axes.plot(
            time,
            values[:, person],
            color=style.person_colour(rank),
            linewidth=0.9 if crowd else style.LINE,
            zorder=2 if crowd else 3,
        )
    near = closest_approaches(record)
    heights = [(record.clearance, "clearance", "--", "bottom")]
    if near:
        contact = record.robot_radius + float(record.people_radii[near[0].person])
        heights.append((contact, "contact", ":", "top"))
    late = bool(near) and near[0].time > (record.time[0] + record.time[-1]) / 2
    for height, text, dashes, side in heights:
        axes.axhline(height, color=style.LIMIT, linestyle=dashes, linewidth=1.3)
        axes.annotate(
            f"{text} {height:.2f} m",
            (float(record.time[0] if late else record.time[-1]), height),  # where the curve is not
            xytext=(3 if late else -3, 2 if side == "bottom" else -2),
            textcoords="offset points",
            fontsize=style.SMALL,
            ha="left" if late else "right",
            va=side,
            path_effects=style.halo(),
        )
    for approach in near[:1]:
        axes.plot(approach.time, approach.distance, color=style.INK, marker="o", markersize=6, zorder=5)
        axes.annotate(
            f"{approach.distance:.2f} m",
            (approach.time, approach.distance),
            xytext=(0, 12),
            textcoords="offset points",
            fontsize=style.TEXT,
            ha="center",
            fontweight="bold",
            path_effects=style.halo(3),
        )
    style.style_axes(axes, x="", y="distance (m)")
    axes.set_ylim(0.0, _distance_top(record, values))


def draw_belief(axes: Axes, record: Record) -> None:
    """Draw P(concerned) per person, and the truth as a thin dashed line where there is one."""
    ranks = people_by_nearness(record)
    time = record.time[:-1]
    for person in np.argsort(-ranks):
        rank = int(ranks[person])
        colour = style.person_colour(rank)
        crowd = rank >= len(style.PEOPLE)
        axes.plot(time, record.beliefs[:, person], color=colour, linewidth=0.9 if crowd else style.LINE)
        if not crowd:
            truth = record.people_awareness[:, person]
            axes.step(record.time, truth, color=colour, linewidth=1.2, linestyle=(0, (2, 2)), where="post")
    known = bool(np.isfinite(record.people_awareness).any())
    if known:
        handles = [
            Line2D([], [], color=style.INK, linewidth=style.LINE, label="belief"),
            Line2D([], [], color=style.INK, linewidth=1.2, linestyle=(0, (2, 2)), label="truth"),
        ]
        _legend_above(axes, handles)
    style.style_axes(axes, x="", y="P(concerned)")
    axes.set_ylim(-0.06, 1.06)
    axes.set_yticks([0.0, 0.5, 1.0])


def draw_risk(axes: Axes, record: Record) -> None:
    """Draw what the risk rule limits, the collision probability at its largest over the horizon, and P_th."""
    time = record.time[:-1]
    limited = np.maximum(record.limited_risk, FLOOR)
    axes.plot(time, limited, color=style.ROBOT, linewidth=style.LINE, label="risk that is limited")
    axes.plot(
        time,
        _largest(record.collision_probability),
        color=style.INK,
        linewidth=style.LINE,
        linestyle="-.",
        label="collision",
    )
    axes.axhline(record.risk_limit, color=style.LIMIT, linestyle="--", linewidth=1.3)
    axes.annotate(
        f"limit {record.risk_limit:g}",
        (float(record.time[-1]), record.risk_limit),
        xytext=(0, 2),
        textcoords="offset points",
        fontsize=style.SMALL,
        ha="right",
        va="bottom",
        path_effects=style.halo(),
    )
    handles: list[Line2D | Patch] = list(axes.get_lines()[:2])
    for status, colour in NOT_CERTIFIED.items():
        if _shade(axes, record, status, colour):
            handles.append(Patch(facecolor=colour, alpha=0.5, label=status.replace("_", " ")))
    axes.set_yscale("log")
    axes.set_ylim(FLOOR, 1.0)
    _legend_above(axes, handles)
    style.style_axes(axes, x="time (s)", y="probability")


def _legend_above(axes: Axes, handles: Sequence[Line2D | Patch]) -> None:
    axes.legend(
        handles=handles,
        fontsize=style.SMALL,
        frameon=False,
        loc="lower left",
        bbox_to_anchor=(-0.02, 0.95),
        ncols=len(handles),
        columnspacing=1.4,
        handlelength=1.8,
    )


def _largest(values: FloatArray) -> FloatArray:
    """Return the largest entry of each row ((T, N) → (T,)), NaN for rows without any, not below `FLOOR`."""
    filled = np.where(np.isfinite(values), values, -np.inf).max(axis=1, initial=-np.inf)
    return np.where(np.isfinite(filled), np.maximum(filled, FLOOR), np.nan)


def _shade(axes: Axes, record: Record, status: str, colour: str) -> bool:
    """Shade the control steps with `status`; say whether there were any."""
    steps = [k for k, s in enumerate(record.status) if s == status]
    for k in steps:
        axes.axvspan(float(record.time[k]), float(record.time[k + 1]), color=colour, alpha=0.5, linewidth=0, zorder=0)
    return bool(steps)


def _distance_top(record: Record, values: FloatArray) -> float:
    """Return an upper limit that shows the encounter and not how far away people were before it."""
    if not np.isfinite(values).any():
        return 2 * record.clearance
    nearest = np.where(np.isfinite(values), values, np.inf).min(axis=1)
    largest = float(nearest[np.isfinite(nearest)].max())
    return min(max(1.08 * largest, 2.0 * record.clearance), 6.0 * record.clearance)
