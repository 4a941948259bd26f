"""How well people are predicted: ours and the baseline on the same moments, one scene left out at a time.

Where there is only one scene, a quarter of its people are left out at a time, those who came about the same time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sidestep.human.model import HumanModel
from sidestep.simulation.recordings import Recording, Track
from sidestep.studies.people_baseline import fit_baseline
from sidestep.studies.people_features import Features, features
from sidestep.studies.people_fit import fit_features, uninformed
from sidestep.studies.people_grid import Density, Score, masses, mean_scores, reach_of, score
from sidestep.studies.people_samples import HORIZONS, PAST, Moment, Watcher, moments, without_gaps

SCORED = (0.4, 1.2, 2.4, 3.6, 4.8)
"""Seconds ahead at which predictions are scored."""
BASELINE = "constant-velocity"
_INDICES = [HORIZONS.index(h) for h in SCORED]
FOLD_ITERATIONS, FOLD_MOMENTS = 12, 400  # of a fit to the other scenes, which starts from round numbers
FOLDS = 30  # more scenes than this are put together by the first part of their names
PARTS = 4  # of the people of a single scene
NEGLIGIBLE = 3e-7  # mass of a lattice cell and class that is left out of the mixture


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
        weights, sigmas = (np.ones(1), np.full(1, 1e-3)) if spread is None else (spread[0], spread[1][row])
        share = np.outer(mass, weights)
        cell, kind = np.nonzero(share > NEGLIGIBLE)
        kept = share[cell, kind]
        found.append(
            Density(
                weights=kept / kept.sum(),
                means=places[cell],
                sigmas=np.repeat(sigmas[kind][:, None], 2, axis=1),
            )
        )
    return found


def prediction_study(
    recordings: Mapping[str, Recording],
    model: HumanModel,
    *,
    kinds: Sequence[str] = ("ped",),
    fitted: bool = False,
    ablations: bool = False,
    every: float = 0.8,
    most: int = 600,
    seed: int = 0,
    progress: Callable[[int, int], object] | None = None,
) -> list[dict[str, Any]]:
    """Score ours and the baseline, scene by scene; what is fitted is fitted on the other scenes.

    Of a single scene it is part by part. Nothing is scored where only one person was seen long enough.

    Args:
        recordings: by scene.
        model: of the people.
        kinds: of agents that are people.
        fitted: also score the model as it comes out of a fit to the other scenes that knows no defaults,
            "sidestep-fitted".
        ablations: also score the model with one part taken away, "sidestep-no-…".
        every: s between the moments of a track.
        most: about so many moments are scored, the same for everybody, of tracks chosen at random; 0: all.
        seed: of that choice.
        progress: called with (scenes done, all scenes).

    Returns:
        Rows per scene (and "all"), predictor and horizon, JSON-able: nll (nat), over (nat, above the baseline's) and
        over_se (its standard error, tracks being independent), brier, coverage_*, area_* (m²).
    """
    recordings = apart(recordings, kinds)
    folds = fold_names(list(recordings))
    of_fold: dict[str, list[Moment]] = {}
    for scene, recording in recordings.items():
        seen = moments(recording, model, kinds=kinds, every=every, expecting=False)
        of_fold.setdefault(folds[scene], []).extend(seen)
    of_fold = {fold: found for fold, found in of_fold.items() if found}
    if len(of_fold) < 2:  # nobody to fit to
        return []
    chosen = _thinned(recordings, folds, kinds, every, most / max(len(of_fold), 1), seed)
    scores: dict[tuple[str, str, int], list[Score]] = {}
    walked: dict[str, list[str]] = {}
    for done, fold in enumerate(of_fold):
        others = [m for other, found in of_fold.items() if other != fold for m in found]
        models = {"sidestep": model}
        if fitted:
            models["sidestep-fitted"] = fit_features(
                _sample(others, seed), uninformed(model), iterations=FOLD_ITERATIONS
            )
        if ablations:
            models |= ablated(model)
        _score_ours(fold, [r for scene, r in chosen.items() if folds[scene] == fold], models, kinds, every, scores)
        baseline = fit_baseline(others, HORIZONS, _INDICES)
        scored = [m for s, r in chosen.items() if folds[s] == fold for m in _quick(r, model, kinds, every)]
        walked[fold] = [f"{m.scene}/{m.agent}" for m in scored]
        for moment in scored:
            for n in range(len(SCORED)):
                _keep(scores, (fold, BASELINE, n), baseline.predict(moment, n), moment)
        if progress is not None:
            progress(done + 1, len(of_fold))
    return _rows(list(of_fold), scores, walked)


def ablated(model: HumanModel) -> dict[str, HumanModel]:
    """Return the model with one part taken away each, by the name it has in tables."""
    return {
        "sidestep-no-steadiness": replace(model, steadiness=False),
        "sidestep-fixed-randomness": replace(model, online_randomness=False),
        "sidestep-no-filter": replace(model, motion_filter=False, steadiness=False, online_randomness=False),
        "sidestep-noise-twice": replace(model, habits=replace(model.habits, habitual_noise=0.0)),
    }


def _score_ours(
    fold: str,
    recordings: Sequence[Recording],
    models: Mapping[str, HumanModel],
    kinds: Sequence[str],
    every: float,
    scores: dict[tuple[str, str, int], list[Score]],
) -> None:
    for name, model in models.items():
        watcher = Watcher(model)
        for recording in recordings:
            for moment in moments(recording, model, kinds=kinds, every=every):
                for n, density in enumerate(predict_moment(moment, watcher, _INDICES)):
                    _keep(scores, (fold, name, n), density, moment)


def _keep(
    scores: dict[tuple[str, str, int], list[Score]], key: tuple[str, str, int], density: Density, moment: Moment
) -> None:
    n = key[2]
    scores.setdefault(key, []).append(score(masses(density, reach_of(SCORED[n])), moment.future[_INDICES[n]]))


def _quick(recording: Recording, model: HumanModel, kinds: Sequence[str], every: float) -> list[Moment]:
    return moments(recording, model, kinds=kinds, every=every, expecting=False)


def _sample(found: Sequence[Moment], seed: int) -> Features:
    generator = np.random.Generator(np.random.PCG64(seed))
    chosen = np.sort(generator.permutation(len(found))[:FOLD_MOMENTS])
    return features([found[i] for i in chosen], _INDICES)


def _thinned(
    recordings: Mapping[str, Recording],
    folds: Mapping[str, str],
    kinds: Sequence[str],
    every: float,
    wanted: float,
    seed: int,
) -> dict[str, Recording]:
    """The recordings with about `wanted` moments per fold, of tracks chosen at random (0: as they are)."""
    if wanted <= 0:
        return dict(recordings)
    generator = np.random.Generator(np.random.PCG64(seed))
    have: dict[str, float] = {}
    kept: dict[str, list[Track]] = {}
    every_track = [(scene, t) for scene, r in recordings.items() for t in r.of_kinds(kinds).tracks]
    for i in generator.permutation(len(every_track)):
        scene, track = every_track[int(i)]
        long = track.time[-1] - track.time[0] - PAST - HORIZONS[-1]
        if long >= 0 and have.get(folds[scene], 0.0) < wanted:
            have[folds[scene]] = have.get(folds[scene], 0.0) + long / every + 1.0
            kept.setdefault(scene, []).append(track)
    return {scene: Recording(name=scene, tracks=tuple(tracks)) for scene, tracks in kept.items()}


def apart(recordings: Mapping[str, Recording], kinds: Sequence[str]) -> dict[str, Recording]:
    """Return what is left out at a time: the scenes, or where people were seen long enough in only one, parts of it."""
    long = {s: tuple(t for t in r.of_kinds(kinds).tracks if _lasts(t)) for s, r in recordings.items()}
    scenes = [scene for scene, tracks in long.items() if tracks]
    if len(scenes) != 1:
        return dict(recordings)
    came = sorted(long[scenes[0]], key=lambda track: (track.time[0], track.agent))
    parts = np.array_split(np.arange(len(came)), min(PARTS, len(came)))
    names = [f"{scenes[0]}, part {n + 1}" for n in range(len(parts))]
    return {
        name: Recording(name=name, tracks=tuple(came[i] for i in part)) for name, part in zip(names, parts, strict=True)
    }


def _lasts(track: Track) -> bool:
    """Whether somebody was seen long enough at a stretch for a moment to lie there."""
    return any(part.time[-1] - part.time[0] >= PAST + HORIZONS[-1] - 1e-6 for part in without_gaps(track))


def fold_names(scenes: Sequence[str]) -> dict[str, str]:
    """Return scene → the name under which it is left out: its own, or where there are very many that of its family.

    A family has the first part of its scenes' names; where all are of one, scenes next to each other are put together.
    """
    if len(scenes) <= FOLDS:
        return {scene: scene for scene in scenes}
    families = {scene: scene.replace("/", "_").split("_")[0] for scene in scenes}
    if len(set(families.values())) > 1:
        return families
    return {scene: f"part {n * FOLDS // len(scenes) + 1}" for n, scene in enumerate(sorted(scenes))}


def _rows(
    folds: Sequence[str], scores: Mapping[tuple[str, str, int], list[Score]], walked: Mapping[str, Sequence[str]]
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for scene in (*folds, "all"):
        chosen = folds if scene == "all" else (scene,)
        tracks = [track for fold in chosen for track in walked[fold]]
        for name in dict.fromkeys(key[1] for key in scores):
            for n, horizon in enumerate(SCORED):
                own, hard = ([s for fold in chosen for s in scores.get((fold, p, n), [])] for p in (name, BASELINE))
                if own:
                    row = {"scene": scene, "predictor": name, "horizon": horizon, "moments": len(own)}
                    rows.append(row | mean_scores(own) | _compared(own, hard, tracks))
    return rows


def _compared(own: Sequence[Score], hard: Sequence[Score], tracks: Sequence[str]) -> dict[str, float | None]:
    """How much worse than the baseline on the same moments; None where they are not the same."""
    if len(own) != len(hard):
        return {"over": None, "over_se": None}
    gap = np.array([a.log_loss - b.log_loss for a, b in zip(own, hard, strict=True)])
    of_track = np.unique(tracks, return_inverse=True)[1]
    sums = np.bincount(of_track, gap - gap.mean())
    return {"over": float(gap.mean()), "over_se": float(np.sqrt((sums**2).sum()) / len(gap))}
