"""How well people are predicted: ours and the baseline on the same moments, one scene left out at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sidestep.human.model import HumanModel
from sidestep.simulation.recordings import Recording
from sidestep.studies.people_baseline import fit_baseline
from sidestep.studies.people_grid import Density, Score, masses, mean_scores, reach_of, score
from sidestep.studies.people_samples import HORIZONS, Moment, Watcher, moments

SCORED = (0.4, 1.2, 2.4, 3.6, 4.8)
"""Seconds ahead at which predictions are scored."""
FOLDS = 30  # more scenes than this are put together by the first part of their names
NEGLIGIBLE = 1e-7  # mass of a lattice cell that is left out of the mixture


def predict_moment(moment: Moment, watcher: Watcher, indices: Sequence[int]) -> list[Density]:
    """Return our density at the horizons `indices` (of `HORIZONS`): lattice mass, smeared by steadiness."""
    prediction = watcher.ahead(moment.mind, max(indices) + 1)
    occupancy = prediction.occupancy
    places = (occupancy.lattice.positions().reshape(-1, 2) - moment.position) @ moment.frame
    times = np.array(HORIZONS)[list(indices)]
    spread = moment.mind.spread(times)
    found: list[Density] = []
    for row, k in enumerate(indices):
        mass = occupancy.probability[k + 1].reshape(-1)
        kept = mass > NEGLIGIBLE
        weights, sigmas = (np.ones(1), np.full(1, 1e-3)) if spread is None else (spread[0], spread[1][row])
        share = np.outer(mass[kept], weights)
        found.append(
            Density(
                weights=share.reshape(-1) / share.sum(),
                means=np.repeat(places[kept], len(weights), axis=0),
                sigmas=np.repeat(np.tile(sigmas, int(kept.sum()))[:, None], 2, axis=1),
            )
        )
    return found


def prediction_study(
    recordings: Mapping[str, Recording],
    model: HumanModel,
    *,
    every: float = 0.8,
    progress: Callable[[int, int], object] | None = None,
) -> list[dict[str, Any]]:
    """Score ours and the baseline, scene by scene; the baseline is fitted on the other scenes.

    Args:
        recordings: by scene.
        model: of the people.
        every: s between the moments of a track.
        progress: called with (scenes done, all scenes).

    Returns:
        Rows per scene (and "all"), predictor and horizon, JSON-able: nll (nat), brier, coverage_*, area_* (m²).
    """
    folds = fold_names(list(recordings))
    indices = [HORIZONS.index(h) for h in SCORED]
    of_fold: dict[str, list[Moment]] = {}
    for scene, recording in recordings.items():
        of_fold.setdefault(folds[scene], []).extend(moments(recording, model, every=every))
    of_fold = {fold: found for fold, found in of_fold.items() if found}
    watcher = Watcher(model)
    scores: dict[tuple[str, str, int], list[Score]] = {}
    for done, (fold, own) in enumerate(of_fold.items()):
        others = [m for other, found in of_fold.items() if other != fold for m in found]
        baseline = fit_baseline(others or own, HORIZONS, indices)
        for moment in own:
            ours = predict_moment(moment, watcher, indices)
            for n, h in enumerate(SCORED):
                truth = moment.future[indices[n]]
                for name, density in (("sidestep", ours[n]), ("constant-velocity", baseline.predict(moment, n))):
                    scores.setdefault((fold, name, n), []).append(score(masses(density, reach_of(h)), truth))
        if progress is not None:
            progress(done + 1, len(of_fold))
    return _rows(list(of_fold), scores)


def fold_names(scenes: Sequence[str]) -> dict[str, str]:
    """Return scene → the name under which it is left out: its own, or its family's where there are very many."""
    if len(scenes) <= FOLDS:
        return {scene: scene for scene in scenes}
    return {scene: scene.replace("/", "_").split("_")[0] for scene in scenes}


def _rows(folds: Sequence[str], scores: Mapping[tuple[str, str, int], list[Score]]) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for scene in (*folds, "all"):
        for name in ("sidestep", "constant-velocity"):
            for n, horizon in enumerate(SCORED):
                own = [s for fold in (folds if scene == "all" else (scene,)) for s in scores.get((fold, name, n), [])]
                if own:
                    rows.append(
                        {"scene": scene, "predictor": name, "horizon": horizon, "moments": len(own), **mean_scores(own)}
                    )
    return rows
