"""The figures of the reproduction, from points and a few single runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sidestep.simulation.scenario import Scenario
    from sidestep.studies.paper import Points
    from sidestep.studies.paper_points import Setting


def draw(
    points: Points, bases: dict[str, Scenario], grid: list[dict[str, Any]], replays: list[tuple[str, Any, Any]]
) -> dict[str, Figure]:
    """Return name → figure; those that need points that were not run are left out."""
    import numpy as np

    from sidestep.simulation.loop import simulate
    from sidestep.studies.paper import HORIZONS, HUMANS, PARAMETERS, PLACES
    from sidestep.studies.paper_claims import median_interval
    from sidestep.studies.paper_reasons import reasons
    from sidestep.viewer import figure_paper

    figures: dict[str, Figure] = {}
    for place in PLACES:
        if place.rule == "cells":
            pair = [simulate(_of(place.encounter(5, ahead), bases), seed=0, snapshots=12) for ahead in (0, 5)]
            names = ("without prediction", "with prediction")
            figures[f"comparison-{place.parameters}"] = figure_paper.comparison_figure(pair[0], pair[1], names)
            lab_runs = {h: simulate(_of(place.lab(h), bases), seed=0, snapshots=12) for h in HUMANS}
            figures[f"lab-{place.parameters}"] = figure_paper.lab_figure(lab_runs)
        if not points.have(place.settings()):
            continue
        for suffix, unit in (("", "m²"), ("_lateral", "m")):
            curves: dict[str, dict[str, Any]] = {}
            for index in ("PI_R", "PI_H", "PI_T"):
                curves[index] = {}
                for human in HUMANS:
                    for ahead in (True, False):
                        bands = [
                            median_interval(points.column(place.encounter(n, n if ahead else 0, human), index + suffix))
                            for n in HORIZONS
                        ]
                        name = f"{human}, {'with' if ahead else 'without'} prediction"
                        curves[index][name] = tuple(np.array(bands).T)
            figures[f"indices-{place.parameters}-{place.rule}{suffix.replace('_', '-')}"] = figure_paper.indices_figure(
                curves, HORIZONS, unit
            )
    models = {p: bases[f"paper-{p}"].human for p in PARAMETERS}
    found = reasons(models, time_step=0.5, states=150, generator=np.random.default_rng(0))
    figures["reasons"] = figure_paper.reasons_figure(
        found.danger_weights, found.differing, found.own_weight, found.steps, found.mass
    )
    if grid:
        figures["regions"] = figure_paper.region_figure(grid)
    if replays:
        figures["replay"] = figure_paper.replay_figure(replays)
    return figures


def _of(setting: Setting, bases: dict[str, Scenario]) -> Scenario:
    return setting.scenario(bases[setting.label])
