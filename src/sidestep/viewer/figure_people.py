"""Figures of the studies on recorded people: log loss and coverage over the horizon, beliefs, trips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from sidestep.viewer.style import CROWD, INK, PEOPLE, ROBOT, SMALL, new_figure, style_axes

OURS, FITTED, BASELINE = "sidestep", "sidestep-fitted", "constant-velocity"
_LOOKS = {OURS: (ROBOT, "o", "-"), FITTED: ("#56B4E9", "s", "-"), BASELINE: (PEOPLE[0], "^", "--")}
AIM = (0.92, 0.98)  # of the coverage of the 95 % region
MARKS = "osD^vP*X"

Row = Mapping[str, Any]


def people_figures(people: Mapping[str, Sequence[Row]]) -> dict[str, Figure]:
    """Return the figures that the results allow, by study."""
    draw = {"prediction": prediction_figure, "awareness": awareness_figure, "replay": replay_figure}
    return {study: draw[study](rows) for study, rows in people.items() if rows}


def prediction_figure(rows: Sequence[Row]) -> Figure:
    """Draw log loss against the baseline's and coverage of the 95 % region, one column per recording."""
    whole = [r for r in rows if r["scene"] == "all" and r["predictor"] in _LOOKS]
    files = list(dict.fromkeys(r["file"] for r in whole))
    figure = new_figure(3.1 * len(files) + 1.0, 5.6)
    panels = figure.subplots(2, len(files), sharex=True, sharey="row", squeeze=False)
    for column, file in enumerate(files):
        top, bottom = panels[:, column]
        hard = {r["horizon"]: r["nll"] for r in whole if r["file"] == file and r["predictor"] == BASELINE}
        for predictor, (tint, mark, line) in _LOOKS.items():
            own = [r for r in whole if r["file"] == file and r["predictor"] == predictor]
            look: dict[str, Any] = {"color": tint, "marker": mark, "ls": line, "ms": 5, "label": predictor}
            top.plot([r["horizon"] for r in own], [r["nll"] - hard[r["horizon"]] for r in own], **look)
            bottom.plot([r["horizon"] for r in own], [r["coverage_95"] for r in own], **look)
        bottom.axhspan(*AIM, color=CROWD, alpha=0.2, lw=0)
        first = column == 0
        style_axes(top, x="", y="log loss over\nconstant velocity, nat" if first else "", title=file)
        style_axes(bottom, x="seconds ahead", y="95 % region covers" if first else "")
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=3, fontsize=SMALL, frameon=False)
    return figure


def awareness_figure(rows: Sequence[Row]) -> Figure:
    """Draw AUC, log loss against the base rate's, and false concern over the delay after the onset."""
    rows = [r for r in rows if r.get("evidence", "clearance") == "clearance"]
    files = list(dict.fromkeys(r["file"] for r in rows if r["encounters"]))
    figure = new_figure(9.0, 3.2)
    panels = figure.subplots(1, 3)
    names = ("AUC of P(concerned)", "log loss over the base rate's, nat", "false concern")
    for n, file in enumerate(files):
        own = [r for r in rows if r["file"] == file]
        delay = [r["delay"] for r in own]
        loss = [_number(r["log_loss"]) - _number(r["base_log_loss"]) for r in own]
        values = ([_number(r["auc"]) for r in own], loss, [_number(r["false_concern"]) for r in own])
        for axes, value in zip(panels, values, strict=True):
            axes.plot(
                delay, value, color=PEOPLE[n % len(PEOPLE)], marker=MARKS[n % len(MARKS)], label=file, clip_on=False
            )
    for axes, name, level in zip(panels, names, (0.5, 0.0, 0.1), strict=True):
        axes.axhline(level, color=INK, lw=1.0, ls=":")
        style_axes(axes, x="seconds after the onset", y=name)
    panels[0].set_ylim(0.0, 1.0)
    panels[2].set_ylim(bottom=0.0)
    panels[0].legend(fontsize=SMALL, frameon=False)
    return figure


def replay_figure(rows: Sequence[Row]) -> Figure:
    """Draw contact while moving (99 % upper bounds as bars) against time, one mark per navigator and recording."""
    files = list(dict.fromkeys(r["file"] for r in rows))
    drivers = sorted(dict.fromkeys(r["navigator"] for r in rows), key=lambda name: name != OURS)
    figure = new_figure(3.4 * len(files) + 1.2, 3.8)
    panels = figure.subplots(1, len(files), sharex=True, sharey=True, squeeze=False)[0]
    arrived = [r for r in rows if r["time_ratio"] is not None]
    highest = max((r["collision_moving_upper99"] for r in arrived), default=1.0)
    for axes, file in zip(panels, files, strict=True):
        for r in (r for r in arrived if r["file"] == file):
            n = drivers.index(r["navigator"])
            tint = ROBOT if r["navigator"] == OURS else PEOPLE[(n - 1) % len(PEOPLE)]
            above = r["collision_moving_upper99"] - r["collision_moving"]
            axes.errorbar(
                [r["time_ratio"]],
                [r["collision_moving"]],
                yerr=[[0.0], [above]],
                color=tint,
                marker=MARKS[n % len(MARKS)],
                ls="",
                ms=7,
                elinewidth=0.8,
                label=r["navigator"],
            )
        axes.set_ylim(-0.04 * highest, 1.05 * highest)
        y = "contact while moving (to 99 % bound)" if axes is panels[0] else ""
        style_axes(axes, x="time over the shortest", y=y, title=file)
    handles: dict[str, Any] = {}
    for axes in panels:
        found, labels = axes.get_legend_handles_labels()
        handles |= dict(zip(labels, found, strict=True))
    columns = min(5, 2 * len(files) + 1)  # as many as the width holds
    figure.legend(
        handles.values(), handles.keys(), loc="outside upper center", ncols=columns, fontsize=SMALL, frameon=False
    )
    return figure


def _number(value: float | None) -> float:
    return np.nan if value is None else float(value)
