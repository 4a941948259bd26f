"""Figures of studies with and without something."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binomtest

from sidestep.types import FloatArray
from sidestep.viewer import style

Columns = Mapping[str, Mapping[str, FloatArray]]
_DASHES = ("-", "--")


def study_figure(name: str, found: Columns) -> Figure | None:
    """Return the figure of a study (arm → column → (E,)), or None for those whose table says it all."""
    if name == "goals":
        return _by_steps_seen(found)
    if name == "signal":
        return _times(found)
    if name == "robots":
        return _distances(found)
    if name.startswith("lab"):
        return _beliefs(found)
    if name == "brakes":
        return _contacts(found)
    return None


def _contacts(found: Columns) -> Figure:
    """Share of encounters with a moving contact, with its 99 % interval, and those with a standing one, by base."""
    bases = list(dict.fromkeys(arm.split(" · ")[0] for arm in found))
    rates = list(dict.fromkeys(arm.split(" · ")[1] for arm in found))
    figure = style.new_figure(7.2, 0.9 + 0.62 * len(bases))
    axes = figure.subplots()
    for i, rate in enumerate(rates):
        colour, shift = (style.ROBOT, style.PEOPLE[0])[i % 2], 0.22 * (i - 0.5 * (len(rates) - 1))
        at = np.arange(len(bases)) + shift
        arms = [found[f"{base} · {rate}"] for base in bases]
        share = np.array([100 * c["moving_contact"].mean() for c in arms])
        tests = [binomtest(int(c["moving_contact"].sum()), len(c["moving_contact"])) for c in arms]
        ends = 100 * np.array([test.proportion_ci(0.99, "exact") for test in tests])
        around = np.abs(ends.T - share)
        axes.errorbar(share, at, xerr=around, fmt="o", color=colour, capsize=3, label=f"moving, planned at {rate}")
        standing = [100 * c["standing_contact"].mean() for c in arms]
        axes.plot(standing, at, "|", color=colour, markersize=12, markeredgewidth=2, label=f"standing, at {rate}")
    axes.axvline(5.0, color=style.LIMIT, linestyle="--", linewidth=1.4)
    axes.set_yticks(range(len(bases)), bases, fontsize=style.TEXT)
    axes.invert_yaxis()
    axes.set_xlim(left=-0.15)
    style.style_axes(axes, x="encounters with a contact (%; bars: 99 %; dashed: P_th)", y="")
    axes.legend(frameon=False, fontsize=style.SMALL, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _by_steps_seen(found: Columns) -> Figure:
    """Mean log-likelihood of the coming step that is lost, ± 2 standard errors, over the steps seen before."""
    figure = style.new_figure(6.4, 4.0)
    axes = figure.subplots()
    told, hidden = found.values()
    steps = np.arange(len(told))
    gaps = np.array([told[f"seen_{k}"] - hidden[f"seen_{k}"] for k in steps])
    error = gaps.std(axis=1, ddof=1) / np.sqrt(gaps.shape[1]) if gaps.shape[1] > 1 else np.zeros(len(steps))
    mean = gaps.mean(axis=1)
    axes.plot(steps, mean, color=style.ROBOT, marker="o", linewidth=style.LINE)
    axes.fill_between(steps, mean - 2 * error, mean + 2 * error, color=style.ROBOT, alpha=0.25, linewidth=0)
    axes.axhline(0.0, color=style.CROWD, linestyle="--", linewidth=1.2)
    axes.axvline(5.0, color=style.CROWD, linestyle=":", linewidth=1.2)
    style.style_axes(
        axes, x="steps of 0.5 s that have been seen", y="log-likelihood lost\nby not knowing the goal (nat)"
    )
    return figure


def _times(found: Columns) -> Figure:
    """Times to the goal of the same encounters, with and without a signal."""
    figure = style.new_figure(6.4, 4.0)
    axes = figure.subplots()
    for (arm, columns), dashes in zip(found.items(), _DASHES, strict=False):
        times = np.sort(columns["time"][np.isfinite(columns["time"])])
        share = np.arange(1, len(times) + 1) / max(len(times), 1)
        colour = style.ROBOT if dashes == "-" else style.PEOPLE[0]
        axes.step(times, share, dashes, where="post", color=colour, linewidth=style.LINE, label=f"the robot {arm}")
    style.style_axes(axes, x="time to the goal (s)", y="share of encounters that are over")
    axes.set_ylim(0.0, 1.02)
    axes.legend(frameon=False, fontsize=style.TEXT, loc="lower right")
    return figure


def _beliefs(found: Columns) -> Figure:
    """What was believed in the end of the people who had to react, by what they were; one panel per condition."""
    conditions = list(dict.fromkeys(arm.split(" · ")[0] for arm in found))
    figure = style.new_figure(4.4 * len(conditions) + 0.4, 3.8)
    panels = figure.subplots(1, len(conditions), sharey=True, squeeze=False)[0]
    edges = np.linspace(0.0, 1.0, 11)
    for axes, condition in zip(panels, conditions, strict=True):
        for kind, colour, hatch in (("concerned", style.ROBOT, ""), ("unconcerned", style.PEOPLE[0], "//")):
            columns = found[f"{condition} · {kind}"]
            known = columns["belief"][(columns["had_to_react"] > 0) & np.isfinite(columns["belief"])]
            axes.hist(known, bins=edges.tolist(), color=colour, alpha=0.6, hatch=hatch, edgecolor="white", label=kind)
        axes.axvline(0.5, color=style.LIMIT, linestyle="--", linewidth=1.4)
        axes.set_title(condition, fontsize=style.TEXT, loc="left")
        style.style_axes(axes, x="P(concerned) after the last decision that mattered", y="runs")
    told = [f"the person was {kind}" for kind in ("concerned", "unconcerned")]
    handles, _ = panels[0].get_legend_handles_labels()
    figure.legend(handles, told, frameon=False, fontsize=style.TEXT, loc="outside upper right", ncols=2)
    return figure


def _distances(found: Columns) -> Figure:
    """How near two robots came to each other, per episode."""
    figure = style.new_figure(6.4, 4.0)
    axes = figure.subplots()
    edges = np.arange(0.0, 3.01, 0.1)
    for (arm, columns), colour in zip(found.items(), (style.ROBOT, style.PEOPLE[0]), strict=False):
        nearest = np.minimum(columns["robot_min_distance"], edges[-1] - 1e-9)
        weights = np.full(len(nearest), 1.0 / len(nearest))
        axes.hist(nearest, bins=edges.tolist(), weights=weights, color=colour, alpha=0.6, label=arm)
    axes.axvline(0.6, color=style.LIMIT, linestyle="--", linewidth=1.4, label="bodies touch")
    style.style_axes(axes, x="least distance between two robots (m)", y="share of episodes")
    axes.legend(frameon=False, fontsize=style.TEXT)
    return figure
