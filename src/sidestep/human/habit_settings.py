"""The constants by which a person's past is read."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from sidestep.checks import Checks
from sidestep.types import FloatArray, IntArray, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True)
class HabitSettings:
    """The constants of the learning; the defaults were fitted to recorded pedestrians and tried in closed loop.

    `sidestep fit` estimates them anew from tracks; they stand in the table [human.habits] of a scenario.

    Attributes:
        acceleration_density: m²/s³, q of the constant-velocity filter.
        measurement_noise: m, standard deviation per axis where an observation brings no covariance.
        unknown_speed: m/s, standard deviation per axis of a velocity before it was ever seen.
        scales: m/s^q, σ_c of the steadiness classes, smallest first.
        prior_class, prior_width: middle and standard deviation of the bell-shaped prior over the class index c, of
            people who walk; standing_class, standing_width: of people who stand (some of them will start to walk).
        floor: m, spread of every class at once: σ(t)² = floor² + (σ_c·t^q)².
        walking_exponent, standing_exponent: q above and below `standing_speed` (m/s).
        window: s of velocity changes that count as evidence on steadiness; spacing: s between the velocities compared.
        habitual_noise: m; what a sensor of this noise makes of the velocity is part of the scales already, and only
            what a worse one adds spreads the prediction further (0: all of it does).
        tempering: exponent on that evidence (neighbouring changes are not independent); freedom: of its Student-t.
        change_speed: m/s, and change_time: s: a velocity that moved by more within that time changed its mind.
        changed_before, counts_before: prior counts of ω = (n₁ + changed_before)/(n₀ + n₁ + counts_before).
        forgetting: factor on both counts per `change_time`.
        randomness_range: ω is kept within.
        walking_modes, standing_modes: prior probabilities that a person keeps the present velocity, keeps the mean
            velocity, comes to a stop.
        slowing_time: s in which the pace of a walker who comes to a stop falls to 1/e; 0: they stop at once, as those
            who stand already.
        off_course: rad off the way to a goal that was told, beyond which somebody who walks is not going there, and is
            predicted by their habits as if nobody had told a goal; π: whoever was told a goal is believed to go there.
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
    scales: tuple[float, ...] = tuple(0.009 * 2.0**c for c in range(6))
    prior_class: float = 4.0
    prior_width: float = 1.2
    standing_class: float = 3.0
    standing_width: float = 10.0
    floor: float = 0.02
    habitual_noise: float = 0.03
    walking_exponent: float = 1.3
    standing_exponent: float = 1.1
    standing_speed: float = 0.3
    window: float = 3.2
    spacing: float = 0.4
    tempering: float = 0.2
    freedom: float = 4.0
    change_speed: float = 0.3
    change_time: float = 0.5
    changed_before: float = 0.05
    counts_before: float = 0.5
    forgetting: float = 0.93
    randomness_range: tuple[float, float] = (0.002, 0.6)
    walking_modes: tuple[float, float, float] = (0.66, 0.26, 0.08)
    standing_modes: tuple[float, float, float] = (0.44, 0.08, 0.48)
    slowing_time: float = 2.0
    off_course: float = 1.0
    mean_time: float = 3.0
    extrapolation: float = 0.0
    extrapolation_time: float = 0.4
    top_speed_time: float = 20.0
    gap: float = 0.09
    time_out: float = 3.0
    top_speed: float = 6.0

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        check = Checks(self, "human.habits")
        check.numbers("acceleration_density", "measurement_noise", "unknown_speed", "prior_width", "standing_width",
                      "window", "spacing", "freedom", "change_time", "counts_before", "mean_time",
                      "extrapolation_time", "top_speed_time", "time_out", "top_speed", above=0.0)  # fmt: skip
        check.numbers("floor", "habitual_noise", "walking_exponent", "standing_exponent", "standing_speed", "tempering",
                      "change_speed", "changed_before", "slowing_time", "gap", least=0.0)  # fmt: skip
        check.numbers("off_course", above=0.0, most=math.pi)
        check.numbers("prior_class", "standing_class", "extrapolation")
        check.numbers("forgetting", above=0.0, most=1.0)
        check.listed("scales", above=0.0)
        check.listed("walking_modes", count=3, above=0.0)
        check.listed("standing_modes", count=3, above=0.0)
        low, high = check.listed("randomness_range", count=2, least=0.0)
        if not low <= high <= 1.0:
            raise check.wrong("randomness_range", "0 ≤ low ≤ high ≤ 1")


_CONSTANTS = (
    "acceleration_density", "gap", "window", "spacing", "freedom", "tempering", "standing_speed", "change_time",
    "change_speed", "forgetting", "top_speed_time", "mean_time", "extrapolation_time", "extrapolation",
)  # fmt: skip
"""In the order in which `_kernels.habits.learn` reads them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClassTables:
    """What follows from the settings alone, as arrays.

    Attributes:
        scales: (C,) m/s^q.
        priors: (2, C) log prior of the classes, of people who walk and of people who stand.
        constants: numbers, in the order that `_kernels.habits.learn` reads them in.
        walking_modes, standing_modes: (3,) see `Habits.modes`.
    """

    scales: FloatArray
    priors: FloatArray
    constants: FloatArray
    walking_modes: FloatArray
    standing_modes: FloatArray

    @property
    def walking(self) -> FloatArray:
        """(C,) log prior of the classes of people who walk."""
        return self.priors[0]

    @property
    def standing(self) -> FloatArray:
        """(C,) log prior of the classes of people who stand."""
        return self.priors[1]


@lru_cache(maxsize=64)
def class_tables(settings: HabitSettings) -> ClassTables:
    """Return the steadiness classes of these settings as arrays."""
    s, index = settings, np.arange(len(settings.scales))
    return ClassTables(
        scales=frozen_array(s.scales),
        priors=frozen_array(
            np.stack(
                [
                    _log_bell(index, s.prior_class, s.prior_width),
                    _log_bell(index, s.standing_class, s.standing_width),
                ]
            )
        ),
        constants=frozen_array([getattr(s, name) for name in _CONSTANTS]),
        walking_modes=frozen_array(s.walking_modes),
        standing_modes=frozen_array(s.standing_modes),
    )


def _log_bell(index: IntArray, middle: float, width: float) -> FloatArray:
    bell = -0.5 * ((index - middle) / width) ** 2
    bell -= bell.max()  # a bell far beyond the classes leaves one of them, not none
    return frozen_array(bell - np.log(np.exp(bell).sum()))
