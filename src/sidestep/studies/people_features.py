"""What a prediction of people whom nobody disturbs is made of, as arrays over many moments: fast enough to be fitted.

Where no robot is near and no goal is known, the lattice prediction is a mixture over "keeps the present velocity",
"keeps the mean velocity" and "comes to a stop", over steadiness classes, and over whether a random action was taken.
Here each part is one Gaussian; the random part is lumped into its mean and variance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from sidestep.human.habit_settings import HabitSettings, class_tables
from sidestep.human.habits import Habits
from sidestep.human.model import HumanModel
from sidestep.studies.people_grid import log_losses
from sidestep.studies.people_samples import HORIZONS, STEP, Moment
from sidestep.types import BoolArray, FloatArray, IntArray

_EVIDENCE = 40  # most velocity changes that count per moment; more than window / spacing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Features:
    """S moments, in the frame of each.

    Attributes:
        offset: (S, 2) m, filtered position from the measured one.
        present, average: (S, 2) m/s, velocity that is extrapolated, and the mean one.
        standing: (S,) both velocities below walking; slow: (S,) the present one is.
        evidence: (S, E, 3) squared velocity change, s over which, noise variance per axis; NaN where there is none.
        sensed: (S, K) m², what a sensor worse than the habitual one adds.
        counts: (S, 2) forgetful counts of changed and unchanged velocities.
        future: (S, K, 2) m.
        horizons: (K,) steps of 0.4 s.
    """

    offset: FloatArray
    present: FloatArray
    average: FloatArray
    standing: BoolArray
    slow: BoolArray
    evidence: FloatArray
    sensed: FloatArray
    counts: FloatArray
    future: FloatArray
    horizons: IntArray

    def of(self, chosen: IntArray | BoolArray) -> Self:
        """Return some of the moments."""
        parts = {f.name: getattr(self, f.name)[chosen] for f in fields(self) if f.name != "horizons"}
        return replace(self, **parts)


def features(moments: Sequence[Moment], indices: Sequence[int]) -> Features:
    """Lay out the moments for the horizons `indices` (of `HORIZONS`).

    Moments of people without habits (`motion_filter` off) cannot be laid out and are left out.
    """
    known = [(m, m.mind.habits) for m in moments if m.mind.habits is not None]
    times = np.array([HORIZONS[k] for k in indices])
    none = np.zeros((0, 2))
    return Features(
        offset=np.array([(h.position - m.position) @ m.frame for m, h in known] or none),
        present=np.array([h.extrapolated_velocity @ m.frame for m, h in known] or none),
        average=np.array([h.mean_velocity @ m.frame for m, h in known] or none),
        standing=np.array([h.standing for _, h in known], dtype=np.bool_),
        slow=np.array([np.linalg.norm(h.velocity) < h.settings.standing_speed for _, h in known], dtype=np.bool_),
        evidence=np.array([_changes(h) for _, h in known] or np.zeros((0, _EVIDENCE, 3))),
        sensed=np.array([_sensed(h, times) for _, h in known] or np.zeros((0, len(times)))),
        counts=np.array([(h.changed, h.unchanged) for _, h in known] or none),
        future=np.array([m.future[list(indices)] for m, _ in known] or np.zeros((0, len(times), 2))),
        horizons=np.array(indices, dtype=np.int64) + 1,
    )


def _sensed(habits: Habits, times: FloatArray) -> FloatArray:
    """(K,) m²: the spread without what the habits themselves say."""
    s = habits.settings
    q = s.standing_exponent if habits.standing else s.walking_exponent
    return habits.spread(times)[1][:, 0] ** 2 - s.floor**2 - (times**q * s.scales[0]) ** 2


def _changes(habits: Habits) -> FloatArray:
    """(E, 3): the velocity changes that `_kernels.habits.steadiness_evidence` weighs, NaN-padded."""
    history, s = habits.history, habits.settings
    d = habits.position.size
    found = np.full((_EVIDENCE, 3), np.nan)
    ages = history[0, 0] - history[:, 0]
    picked = [0]
    for i in range(1, len(ages)):
        if not ages[i] <= s.window + 1e-9:  # NaN: empty
            break
        if ages[i] - ages[picked[-1]] >= s.spacing - 1e-9:
            picked.append(i)
    places, noise = history[picked, 1 : 1 + d], history[picked, 1 + 2 * d : 1 + 3 * d].sum(axis=1)
    for n in range(min(len(picked) - 2, _EVIDENCE)):
        first, second = ages[picked[n + 1]] - ages[picked[n]], ages[picked[n + 2]] - ages[picked[n + 1]]
        change = (places[n] - places[n + 1]) / first - (places[n + 1] - places[n + 2]) / second
        jitter = noise[n] / first**2 + noise[n + 1] * (1 / first + 1 / second) ** 2 + noise[n + 2] / second**2
        found[n] = change @ change, first + second, jitter / d
    return found


def class_weights(data: Features, settings: HabitSettings) -> FloatArray:
    """(S, C) probabilities of the steadiness classes, as the learning has them."""
    tables, s = class_tables(settings), settings
    change, span, jitter = (data.evidence[..., n, None] for n in range(3))
    variance = tables.scales**2 * span + jitter
    log = -np.log(variance) - 0.5 * (s.freedom + 2) * np.log1p(change / (s.freedom * variance))
    prior = np.where(data.standing[:, None], tables.standing, tables.walking)
    total = s.tempering * np.nansum(log, axis=1) + prior
    weights = np.exp(total - total.max(axis=1, keepdims=True))
    return weights / weights.sum(axis=1, keepdims=True)


def losses(data: Features, model: HumanModel) -> FloatArray:
    """(S, K) nat, negative log-likelihood on cells of what the model predicts."""
    s = model.habits
    classes = class_weights(data, s)
    modes = np.where(data.slow[:, None], s.standing_modes, s.walking_modes)
    modes = modes / modes.sum(axis=1, keepdims=True)
    brief = np.where(data.slow, 0.0, s.slowing_time)[:, None, None]
    exponent = np.where(data.standing, s.standing_exponent, s.walking_exponent)[:, None]
    weights = (modes[:, :, None] * classes[:, None]).reshape(len(classes), -1)
    randomness = _randomness(data, model)
    found = np.empty((len(classes), len(data.horizons)))
    for n, steps in enumerate(data.horizons.tolist()):
        t = steps * STEP
        slowing = brief * -np.expm1(-t / np.maximum(brief, 1e-9))  # (S, 1, 1) s, at the present pace, of who stops
        present, average = data.present[:, None], data.average[:, None]
        ways = np.concatenate([t * present, t * average, slowing * present], axis=1)  # (S, 3, 2) m
        habit = (t**exponent * class_tables(s).scales) ** 2
        sigma = np.tile(np.sqrt(s.floor**2 + habit + data.sensed[:, n, None]), (1, 3))
        steady = ((1.0 - randomness) ** steps)[:, None]
        lump, kept = _lumped(data, model, randomness, steps)
        means = [np.repeat(data.offset[:, None] + ways * share, classes.shape[1], axis=1) for share in (1.0, kept)]
        sigmas = np.concatenate([sigma, np.sqrt(sigma**2 + lump[:, None])], axis=1)
        found[:, n] = log_losses(
            data.future[:, n],
            np.concatenate([weights * steady, weights * (1.0 - steady)], axis=1),
            np.concatenate(means, axis=1),
            np.repeat(sigmas[..., None], 2, axis=2),
        )
    return found


def _randomness(data: Features, model: HumanModel) -> FloatArray:
    """(S,) ω."""
    if not model.online_randomness:
        return np.full(len(data.counts), model.randomness)
    s = model.habits
    raw = (data.counts[:, 0] + s.changed_before) / (data.counts.sum(axis=1) + s.counts_before)
    return np.clip(raw, *s.randomness_range)


def _lumped(data: Features, model: HumanModel, randomness: FloatArray, steps: int) -> tuple[FloatArray, FloatArray]:
    """(S,) m² per axis that random actions in `steps` add, if any, and (S, 1, 1) the share of the way they leave."""
    speed = np.linalg.norm(data.present, axis=1)
    low, high = model.speed_range
    unit = np.clip(speed, low, high) / model.reach * STEP
    uniform = unit**2 * model.reach * (model.reach + 1) / 3.0  # variance of m·v·ΔT, m uniform in −reach … reach
    once = 1.0 - (1.0 - randomness) ** steps
    expected = steps * randomness / np.maximum(once, 1e-12)  # random actions, given that there was one
    share = np.minimum(expected / steps, 1.0)
    return expected * (uniform + (1.0 - share) * (speed * STEP) ** 2 / 2.0), (1.0 - share)[:, None, None]
