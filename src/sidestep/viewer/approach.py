"""How near the robot and each person came, between the samples too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.simulation.record import Record
from sidestep.types import BoolArray, FloatArray, IntArray, Vector


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
    found = [_closest(record, person) for person in range(len(record.people))]
    return sorted((a for a in found if a is not None), key=lambda a: a.distance)


def people_by_nearness(record: Record) -> IntArray:
    """Return the (P,) rank of each person: 0 came nearest to the robot; those never seen come last."""
    ranks = np.full(len(record.people), len(record.people), dtype=np.int64)
    for rank, approach in enumerate(closest_approaches(record)):
        ranks[approach.person] = rank
    return ranks


def _closest(record: Record, person: int) -> Approach | None:
    relative = record.people_positions[:, person] - record.robot_positions  # (T+1, d)
    seen: BoolArray = np.asarray(np.isfinite(relative).all(axis=-1))
    if not seen.any():
        return None
    step, share = int(np.flatnonzero(seen)[0]), 0.0
    best = float(np.linalg.norm(relative[step]))
    change = np.diff(relative, axis=0)
    for k in range(len(change)):
        if not (seen[k] and seen[k + 1]):
            continue
        square = float(change[k] @ change[k])
        s = float(np.clip(-(relative[k] @ change[k]) / square, 0.0, 1.0)) if square > 0 else 0.0
        distance = float(np.linalg.norm(relative[k] + s * change[k]))
        if distance < best:
            best, step, share = distance, k, s
    after = min(step + 1, len(record.time) - 1)

    def between(values: FloatArray) -> Vector:
        return values[step] if share == 0.0 else (1 - share) * values[step] + share * values[after]

    return Approach(
        person=person,
        time=float(between(record.time)),
        distance=best,
        robot_position=between(record.robot_positions),
        person_position=between(record.people_positions[:, person]),
    )
