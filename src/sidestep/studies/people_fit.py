"""A human model from tracks: maximum likelihood of where people turned up, 0.4 to 4.8 s later.

What tracks of people alone can tell is fitted: how steadily they go (scales, priors, exponents), which velocity they
keep, how random they are, how noisy the positions are. What only shows when somebody stands in the way (the danger's
weight and rate, the rationality) keeps its value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.simulation.recordings import LONGEST_GAP, Recording
from sidestep.studies.people_features import Features, features, losses
from sidestep.studies.people_samples import HORIZONS, moments
from sidestep.types import FloatArray

FITTED = (0.4, 1.2, 2.4, 3.6, 4.8)
"""Seconds ahead at which the likelihood is taken."""
NOISES = (0.003, 0.01, 0.03, 0.1, 0.2)
"""m, standard deviations of measured positions that are tried."""
MOST = 800  # moments that one fit uses
FEWEST = 30
ITERATIONS = 25
RIDGE = 1e-3  # pull to the starting values, per unit² of each parameter: what the tracks do not tell stays
_LOWEST_OMEGA = 1e-4
_SHORTEST_STOP = 0.1  # s
_LEAST = 1e-3  # of what may be 0 in a model, but is sought by its logarithm: tempering, floor (m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """What was found.

    Attributes:
        model: the human model.
        nll: nat, mean over horizons and moments that were fitted; before: the same of the model at the start.
        moments: number of them.
        noises: nll by measurement noise (m) at the starting values.
    """

    model: HumanModel
    nll: float
    before: float
    moments: int
    noises: Mapping[float, float]


def uninformed(model: HumanModel) -> HumanModel:
    """Return `model` with round numbers for what is fitted, which no recording was looked at for.

    Where a fit is to be judged on people who were left out, it must not start from defaults that they had a part in.
    """
    habits = replace(
        model.habits,
        scales=tuple(0.01 * 2.0**c for c in range(6)),
        prior_class=2.5,
        prior_width=3.0,
        standing_class=2.5,
        standing_width=3.0,
        tempering=0.3,
        walking_exponent=1.25,
        standing_exponent=1.0,
        floor=0.03,
        walking_modes=(0.6, 0.3, 0.1),
        slowing_time=2.0,
        standing_modes=(0.4, 0.1, 0.5),
        changed_before=0.05,
    )
    return replace(model, habits=habits)


def packed(model: HumanModel) -> FloatArray:
    """Return the fitted parameters of a model as one unbounded vector (K,)."""
    s = model.habits
    walking, standing = np.log(s.walking_modes), np.log(s.standing_modes)
    random = s.changed_before if model.online_randomness else model.randomness
    return np.array(
        [
            np.log(s.scales[0]), s.prior_class, np.log(s.prior_width), s.standing_class, np.log(s.standing_width),
            np.log(max(s.tempering, _LEAST)), s.walking_exponent, s.standing_exponent, np.log(max(s.floor, _LEAST)),
            *(walking[:2] - walking[2]), *(standing[:2] - standing[2]), np.log(max(random, _LOWEST_OMEGA)),
            np.log(max(s.slowing_time, _SHORTEST_STOP)),
        ]
    )  # fmt: skip


def unpacked(values: FloatArray, model: HumanModel) -> HumanModel:
    """Return `model` with the fitted parameters of `values`; a step of the search that goes far astray is cut short."""
    s = model.habits
    walking, standing = (_shares(values[i : i + 2]) for i in (9, 11))
    random = _positive(values[13], _LOWEST_OMEGA, 1.0)
    smallest = _positive(values[0], 1e-4, 1.0)
    habits = replace(
        s,
        scales=tuple(smallest * (c / s.scales[0]) for c in s.scales),
        prior_class=_between(values[1], -3.0, len(s.scales) + 3.0),
        prior_width=_positive(values[2], 0.05, 60.0),
        standing_class=_between(values[3], -3.0, len(s.scales) + 3.0),
        standing_width=_positive(values[4], 0.05, 60.0),
        tempering=_positive(values[5], _LEAST, 10.0),
        walking_exponent=_between(values[6], 0.0, 4.0),
        standing_exponent=_between(values[7], 0.0, 4.0),
        floor=_positive(values[8], _LEAST, 1.0),
        walking_modes=walking,
        standing_modes=standing,
        slowing_time=_positive(values[14], _SHORTEST_STOP, 60.0) if s.slowing_time > 0 else 0.0,
        changed_before=random if model.online_randomness else s.changed_before,
    )
    return replace(model, habits=habits, randomness=model.randomness if model.online_randomness else random)


def _between(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))


def _positive(logarithm: float, low: float, high: float) -> float:
    return _between(float(np.exp(min(logarithm, 9.0))), low, high)


def fit_features(data: Features, model: HumanModel, *, iterations: int = ITERATIONS) -> HumanModel:
    """Return the model of maximum likelihood (with a slight pull to `model`) on moments that are laid out already."""
    start = packed(model)

    def objective(values: FloatArray) -> float:
        return float(losses(data, unpacked(values, model)).mean() + RIDGE * ((values - start) ** 2).sum())

    found = minimize(objective, start, method="L-BFGS-B", options={"maxiter": iterations})
    return unpacked(found.x, model)


def fit_model(
    recordings: Mapping[str, Recording],
    start: HumanModel,
    *,
    kinds: Sequence[str] = ("ped",),
    noises: Sequence[float] = NOISES,
    every: float = 0.8,
    seed: int = 0,
    progress: Callable[[int, int], object] | None = None,
) -> Fit:
    """Fit a human model to tracks.

    Args:
        recordings: by scene.
        start: whose other parameters are kept.
        kinds: of agents that are people.
        noises: m, measurement noises that are tried; the likeliest is taken.
        every: s between the moments of a track.
        seed: of the choice of moments where there are more than are used.
        progress: called with (steps done, all).

    Raises:
        InvalidInput: too few people were seen long enough, or the model learns no habits.
    """
    if not start.motion_filter:
        raise InvalidInput("human.motion_filter", False, "true: habits are learned from filtered motion")
    best: tuple[float, HumanModel, Features] | None = None
    tried: dict[float, float] = {}
    for n, noise in enumerate(noises):
        model = replace(start, measurement_noise=noise)
        data = laid_out(recordings, model, kinds=kinds, every=every, seed=seed)
        if len(data.future) < FEWEST:
            raise InvalidInput(
                "tracks",
                len(data.future),
                f"≥ {FEWEST} moments with 2.8 s of past and 4.8 s of future, seen every {LONGEST_GAP:g} s at least",
                "longer or denser tracks",
            )
        model = fit_features(data, model, iterations=6)
        tried[noise] = float(losses(data, model).mean())
        if best is None or tried[noise] < best[0]:
            best = tried[noise], model, data
        if progress is not None:
            progress(n + 1, len(noises) + 1)
    if best is None:
        raise InvalidInput("noises", noises, "at least one number > 0")
    before = float(losses(best[2], replace(start, measurement_noise=best[1].measurement_noise)).mean())
    model = fit_features(best[2], best[1])
    if progress is not None:
        progress(len(noises) + 1, len(noises) + 1)
    nll = float(losses(best[2], model).mean())
    return Fit(model=model, nll=nll, before=before, moments=len(best[2].future), noises=tried)


def laid_out(
    recordings: Mapping[str, Recording],
    model: HumanModel,
    *,
    kinds: Sequence[str] = ("ped",),
    every: float = 0.8,
    seed: int = 0,
    most: int = MOST,
) -> Features:
    """Return up to `most` moments of all scenes, chosen at random, laid out."""
    found = [m for r in recordings.values() for m in moments(r, model, kinds=kinds, every=every, expecting=False)]
    generator = np.random.Generator(np.random.PCG64(seed))
    chosen = np.sort(generator.permutation(len(found))[:most])
    return features([found[i] for i in chosen], [HORIZONS.index(h) for h in FITTED])


def walking_speeds(recordings: Mapping[str, Recording], kinds: Sequence[str] = ("ped",)) -> dict[str, Any]:
    """Return quantiles (m/s) of speeds over 0.4 s of those who walk (> 0.3 m/s), and the share of those who stand."""
    found: list[FloatArray] = []
    for recording in recordings.values():
        for track in recording.of_kinds(kinds).tracks:
            times = np.arange(track.time[0] + 0.4, track.time[-1] + 1e-6, 0.4)
            steps = np.linalg.norm(track.at(times) - track.at(times - 0.4), axis=1) / 0.4
            found.append(steps[np.isfinite(steps)])
    speeds = np.concatenate([*found, np.zeros(0)])
    walking = speeds[speeds > 0.3]
    levels = (0.05, 0.25, 0.5, 0.75, 0.95)
    values = np.quantile(walking, levels).tolist() if len(walking) else [None] * len(levels)
    names = [f"q{round(100 * level):02d}" for level in levels]
    return dict(zip(names, values, strict=True)) | {"standing": float((speeds <= 0.3).mean()) if len(speeds) else None}


def _shares(logits: FloatArray) -> tuple[float, float, float]:
    values = np.exp(np.clip([*logits, 0.0], -12.0, 12.0))
    a, b, c = (values / values.sum()).tolist()
    return a, b, c
