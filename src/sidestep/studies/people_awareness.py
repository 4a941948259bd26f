"""Does the belief tell early who will react? Scored on recorded encounters, and on placebos where nobody can."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sidestep import minds
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.human.reaction import Way
from sidestep.mind import Mind
from sidestep.prediction.occupancy import Workspace
from sidestep.simulation.recordings import Recording
from sidestep.studies.people_encounters import BEFORE, GAINED, Encounter, encounters, placebos
from sidestep.studies.statistics import area_interval, area_under_curve, clopper_pearson, log_loss
from sidestep.subjects import Circumstances, Subject
from sidestep.types import FloatArray

DELAYS = (0.5, 1.0, 1.5, 2.0)
"""Seconds after the onset at which the belief is read; people would be nearest up to 4 s after it."""
TIME_STEP, HORIZON = 0.5, 8  # of the planner's defaults
CONCERNED = 0.5  # probability above which somebody counts as believed to be concerned


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """What drives around in a recording, as a disc.

    Attributes:
        radius: m, of the vehicle.
        near: m between centres: too close.
    """

    radius: float
    near: float


CAR = Vehicle(radius=1.5, near=2.5)
CART = Vehicle(radius=1.0, near=2.0)
ROBOT = Vehicle(radius=0.3, near=1.0)


def vehicle_model(model: HumanModel, vehicle: Vehicle) -> HumanModel:
    """Return the model with the danger's reach in proportion to the distance at which bodies touch.

    The default rate belongs to a robot of 0.3 m; with the squared decay it scales by the inverse square.
    """
    ratio = (0.3 + model.radius) / (vehicle.radius + model.radius)
    power = 2 if model.danger_decay == "squared_distance" else 1
    return replace(model, danger_rate=model.danger_rate * ratio**power, horizon=model.horizon or HORIZON)


def beliefs(encounter: Encounter, model: HumanModel, vehicle: Vehicle) -> FloatArray:
    """Return P(concerned) at `DELAYS` after the onset, one each, seen causally; the vehicle knows its own way ahead."""
    workspace = Workspace()
    around = Circumstances(time_step=TIME_STEP, horizon=1, robot_radius=vehicle.radius, interval=TIME_STEP)
    steps = (model.horizon or HORIZON) + 2
    known: Mind | None = None
    read = np.full(len(DELAYS), model.prior_concerned)
    track = encounter.track
    last = encounter.onset + DELAYS[-1] + 1e-6
    seen = (track.time >= encounter.onset - BEFORE - 1e-6) & (track.time <= last)
    for t, position in zip(track.time[seen].tolist(), track.positions[seen], strict=True):
        observation = PersonObservation(id=track.agent, position=position)
        known = minds.meet(observation, model, t) if known is None else minds.observe(known, observation, t, TIME_STEP)
        subject, way = Subject(known, around), encounter.vehicle_from(t, steps, TIME_STEP)
        if known.anchor is None:
            ahead = subject.predicted(way, workspace)
            known = minds.expect(known, ahead.action_probabilities, ahead.velocities, t)
        known = minds.face(known, Way(time=t, positions=way, step=TIME_STEP), subject.contact, t)
        for n, delay in enumerate(DELAYS):
            if t <= encounter.onset + delay + 1e-6:
                read[n] = known.belief.concerned
    return read


def awareness_study(
    recordings: Mapping[str, Recording],
    model: HumanModel,
    vehicle: Vehicle,
    *,
    seed: int = 0,
    progress: Callable[[int, int], object] | None = None,
) -> list[dict[str, Any]]:
    """Score the belief on all encounters of some scenes.

    Args:
        recordings: by scene, people and vehicles.
        model: of the people, for a robot of 0.3 m; it is scaled to the vehicle.
        vehicle: its size.
        seed: of the placebos.
        progress: called with (encounters done, all).

    Returns:
        One row per delay, JSON-able: encounters, reacted, placebos, placebo_reacted, auc and its bootstrap 95 %
        interval, gain_auc (of the clearance gained so far itself), begun (share of those who reacted whose course is
        clear already), log_loss, base_log_loss (of the constant base rate), false_concern and its exact 99 % interval.
    """
    real = [e for r in recordings.values() for e in encounters(r, vehicle.near)]
    control = placebos(recordings, real, vehicle.near, np.random.Generator(np.random.PCG64(seed)))
    scaled = vehicle_model(model, vehicle)
    rows: list[FloatArray] = []
    for n, encounter in enumerate((*real, *control)):
        rows.append(beliefs(encounter, scaled, vehicle))
        if progress is not None:
            progress(n + 1, len(real) + len(control))
    values = np.array(rows).reshape(-1, len(DELAYS))
    return _scores(real, control, values, seed)


def _scores(
    real: Sequence[Encounter], control: Sequence[Encounter], values: FloatArray, seed: int
) -> list[dict[str, Any]]:
    reacted = np.array([e.reacted for e in real], dtype=np.float64)
    base = float(reacted.mean()) if len(reacted) else 0.5
    found: list[dict[str, Any]] = []
    for n, delay in enumerate(DELAYS):
        own, other = values[: len(real), n], values[len(real) :, n]
        alarms = int((other > CONCERNED).sum())
        gains = np.array([e.gain_by(delay) for e in real])
        found.append(
            {
                "delay": delay,
                "encounters": len(real),
                "reacted": int(reacted.sum()),
                "placebos": len(control),
                "placebo_reacted": sum(e.reacted for e in control),
                "auc": _plain(area_under_curve(own, reacted)),
                "auc_ci95": [
                    _plain(v) for v in area_interval(own, reacted, np.random.Generator(np.random.PCG64(seed)))
                ],
                "gain_auc": _plain(area_under_curve(gains, reacted)),
                "begun": float((gains[reacted > 0] >= GAINED).mean()) if reacted.any() else None,
                "log_loss": _plain(log_loss(own, reacted)),
                "base_log_loss": _plain(log_loss(np.full(len(real), base), reacted)),
                "false_concern": alarms / len(control) if control else None,
                "false_concern_ci99": list(clopper_pearson(alarms, len(control))),
            }
        )
    return found


def _plain(value: float) -> float | None:
    return value if np.isfinite(value) else None
