"""How near the robot and each person came, between the samples too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.simulation.approach import closest_within_steps
from sidestep.simulation.record import Record
from sidestep.types import FloatArray, IntArray, Vector


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Approach:
    """The instant at which a person and the robot were nearest.

    Attributes:
        person: index into `Record.people`.
        time: s; distance: m between centres.
        robot_position, person_position: (d,) m.
    """

    person: int
    time: float
    distance: float
    robot_position: Vector
    person_position: Vector


def distances(record: Record, *, between: int = 1) -> tuple[FloatArray, FloatArray]:
    """Return times (M,) s and the (M, P) m distances between centres, NaN where a person is absent.

    `between` is the number of instants per control step; more than one shows the dip between two samples.
    """
    samples = len(record.time)
    fine = np.interp(np.arange((samples - 1) * between + 1) / between, np.arange(samples), record.time)
    moved = record.people_positions - record.robot_positions[:, None, :]  # (T+1, P, d)
    flat = moved.reshape(samples, -1)
    columns = [np.interp(fine, record.time, flat[:, c]) for c in range(flat.shape[1])]
    relative = np.stack(columns, axis=1).reshape(len(fine), *moved.shape[1:]) if columns else moved[: len(fine)]
    return fine, np.linalg.norm(relative, axis=-1)


def closest_approaches(record: Record) -> list[Approach]:
    """Return each person's nearest instant, the nearest person first; both move straight between samples."""
    gaps = closest_within_steps(record.robot_positions, record.people_positions)  # (T, P) m
    found = [_closest(record, gaps[:, p], p) for p in range(gaps.shape[1]) if np.isfinite(gaps[:, p]).any()]
    return sorted(found, key=lambda a: a.distance)


def people_by_nearness(record: Record) -> IntArray:
    """Return the (P,) rank of each person: 0 came nearest to the robot; those never seen come last."""
    ranks = np.full(len(record.people), len(record.people), dtype=np.int64)
    for rank, approach in enumerate(closest_approaches(record)):
        ranks[approach.person] = rank
    return ranks


def _closest(record: Record, gaps: FloatArray, person: int) -> Approach:
    step = int(np.nanargmin(gaps))
    path = record.people_positions[step : step + 2, person]
    path = np.where(np.isnan(path), path[::-1], path)  # comes or goes during this step: only one end is known
    robot = record.robot_positions[step : step + 2]
    if np.isnan(record.people_positions[step : step + 2, person]).any():
        robot = np.broadcast_to(robot[int(np.isnan(record.people_positions[step, person]).any())], robot.shape)
    relative = path - robot
    change = relative[1] - relative[0]
    square = float(change @ change)
    share = float(np.clip(-(relative[0] @ change) / square, 0.0, 1.0)) if square > 0 else 0.0
    return Approach(
        person=person,
        time=float((1 - share) * record.time[step] + share * record.time[step + 1]),
        distance=float(gaps[step]),
        robot_position=(1 - share) * robot[0] + share * robot[1],
        person_position=(1 - share) * path[0] + share * path[1],
    )
