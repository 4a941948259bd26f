"""The constants by which a person's past is read."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.types import FloatArray, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True)
class HabitSettings:
    """The constants of the learning; the defaults were scored on recorded pedestrians and in closed loop.

    Attributes:
        acceleration_density: m²/s³, q of the constant-velocity filter.
        measurement_noise: m, standard deviation per axis where an observation brings no covariance.
        unknown_speed: m/s, standard deviation per axis of a velocity before it was ever seen.
        scales: m/s^q, σ_c of the steadiness classes, smallest first.
        prior_class, prior_width: middle and standard deviation of the bell-shaped prior over the class index c.
        floor: m, spread of every class at once: σ(t)² = floor² + (σ_c·t^q)².
        walking_exponent, standing_exponent: q above and below `standing_speed` (m/s).
        window: s of velocity changes that count as evidence on steadiness; spacing: s between the velocities compared.
        tempering: exponent on that evidence (neighbouring changes are not independent); freedom: of its Student-t.
        change_speed: m/s, and change_time: s: a velocity that moved by more within that time changed its mind.
        changed_before, counts_before: prior counts of ω = (n₁ + changed_before)/(n₀ + n₁ + counts_before).
        forgetting: factor on both counts per `change_time`.
        randomness_range: ω is kept within.
        mean_time: s over which the mean velocity is taken.
        extrapolation: e of v̂ = v₁ + e·(v₁ − v₂); extrapolation_time: s between v₁ and v₂.
        top_speed_time: s in which the remembered top speed falls to 1/e.
        gap: s between remembered instants.
        time_out: s without an observation after which the person is met anew.
        top_speed: m/s; a displacement faster than this (and beyond the noise) is another person.

    """

    acceleration_density: float = 1.0
    measurement_noise: float = 0.03
    unknown_speed: float = 1.5
    scales: tuple[float, ...] = tuple(0.006 * 2.0**c for c in range(6))
    prior_class: float = 4.0
    prior_width: float = 1.2
    floor: float = 0.03
    walking_exponent: float = 1.5
    standing_exponent: float = 1.0
    standing_speed: float = 0.3
    window: float = 3.2
    spacing: float = 0.4
    tempering: float = 0.5
    freedom: float = 4.0
    change_speed: float = 0.3
    change_time: float = 0.5
    changed_before: float = 1.8
    counts_before: float = 6.0
    forgetting: float = 0.93
    randomness_range: tuple[float, float] = (0.09, 0.6)
    mean_time: float = 3.0
    extrapolation: float = 0.3
    extrapolation_time: float = 0.4
    top_speed_time: float = 20.0
    gap: float = 0.09
    time_out: float = 3.0
    top_speed: float = 6.0
    scale_array: FloatArray = field(init=False, repr=False, compare=False)
    log_prior: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("acceleration_density", "measurement_noise", "unknown_speed", "prior_width", "window", "spacing",
                     "freedom", "change_time", "counts_before", "mean_time", "extrapolation_time", "top_speed_time",
                     "time_out", "top_speed"):  # fmt: skip
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidInput(f"habits.{name}", getattr(self, name), "a finite number > 0")
        if not self.scales or min(self.scales) <= 0:
            raise InvalidInput("habits.scales", self.scales, "one or more numbers > 0")
        if not 0 < self.forgetting <= 1:
            raise InvalidInput("habits.forgetting", self.forgetting, "more than 0, at most 1")
        bell = -0.5 * ((np.arange(len(self.scales)) - self.prior_class) / self.prior_width) ** 2
        object.__setattr__(self, "scale_array", frozen_array(self.scales))
        object.__setattr__(self, "log_prior", frozen_array(bell - np.log(np.exp(bell).sum())))
