"""Which legs belong to whom: every track may take two, every leg goes to one; and which new legs make pairs."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from sidestep.perception.legs import LegCandidates
from sidestep.perception.table import TrackTable
from sidestep.types import BoolArray, FloatArray, IntArray

LEG_SPREAD = 0.17
"""m; standard deviation per axis of a leg about the middle of its person."""
STRIDE = 0.65
"""m; two legs farther apart belong to two people."""
PAIR_DEVIATION = 0.06
"""m; standard deviation per axis of the middle of two legs about the middle of their person."""
_GATE = 3.0  # half the squared Mahalanobis distance up to which a leg may belong to a track
_CROWDING = 0.05  # 1/m²; density of things that look like legs and belong to no track
_SECOND = 0.5  # cost of taking a second leg, in log likelihood
_SECOND_EVIDENCE = -1.0  # log likelihood ratio from which something is taken for a second leg
_PERSON = 1.0  # gain in log likelihood of a leg going to somebody who is known to be a person
_MIDDLE_GATE = 4.5  # half the squared Mahalanobis distance that two legs' middle may have
_BOTH = 0.5  # probability of being both legs, from which a cluster needs no second one
_NEVER = 1e3


def assign_legs(tracks: TrackTable, legs: LegCandidates, evidence: FloatArray) -> IntArray:
    """Return (T, 2): the candidates that each track takes, −1 for none; a single one stands in the first column.

    The sum of the log likelihoods is maximised (linear assignment with each track twice), so that a thing which stands
    beside a person, and is tracked as such, is not taken for a leg of that person.

    Args:
        tracks: predicted to the time of the scan.
        legs: K candidates.
        evidence: (K,) log likelihood ratio of being a leg.
    """
    taken = np.full((len(tracks), 2), -1, dtype=np.int64)
    if len(tracks) == 0 or len(legs) == 0:
        return taken
    predicted = tracks.position[:, None] + legs.delays[None, :, None] * tracks.velocity[:, None]
    variance = (tracks.covariance[:, 0] + LEG_SPREAD**2)[:, None]
    half = np.sum((legs.positions - predicted) ** 2, axis=2) / (2 * variance)
    cost = half + np.log(2 * np.pi * variance * _CROWDING) - 0.5 * evidence
    cost -= _PERSON * (tracks.person[:, None] & (evidence > 0.0))
    cost = np.where(half < _GATE, np.minimum(cost, -1e-3), _NEVER)
    unfit = (legs.both > _BOTH) | (evidence < _SECOND_EVIDENCE)
    again = np.where(unfit, _NEVER, np.minimum(cost + _SECOND, _NEVER))
    alone = np.zeros((2 * len(tracks), 2 * len(tracks)))
    table = np.concatenate((np.concatenate((cost, again)), alone), axis=1)
    for row, column in zip(*linear_sum_assignment(table), strict=True):
        if column < len(legs) and table[row, column] < 0:
            taken[row % len(tracks), row // len(tracks)] = column
    _tidy(taken, half, legs, tracks)
    return taken


def _tidy(taken: IntArray, half: FloatArray, legs: LegCandidates, tracks: TrackTable) -> None:
    """Put single legs first; of two drop the farther, if no stride can span them or their middle lies off the track."""
    only_second = (taken[:, 0] < 0) & (taken[:, 1] >= 0)
    taken[only_second] = taken[only_second][:, ::-1]
    for row in np.flatnonzero(taken[:, 1] >= 0):
        a, b = taken[row]
        off = (legs.positions[a] + legs.positions[b]) / 2 - tracks.position[row]
        middle = np.sum(off**2) / (2 * (tracks.covariance[row, 0] + PAIR_DEVIATION**2))
        if np.hypot(*(legs.positions[a] - legs.positions[b])) > STRIDE or middle > _MIDDLE_GATE:
            taken[row] = (a if half[row, a] <= half[row, b] else b, -1)


def pair_legs(legs: LegCandidates, evidence: FloatArray, free: BoolArray) -> list[tuple[int, int]]:
    """Return the `free` (K,) candidates as pairs (i, j), nearest and likeliest first; (i, −1) where one stays alone."""
    rows = np.flatnonzero(free)
    points = legs.positions[rows]
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    single = legs.both[rows] <= _BOTH
    possible = np.triu((apart < 0.85 * STRIDE) & single[:, None] & single[None], k=1)
    first, second = np.nonzero(possible)
    liking = apart[first, second] - 0.1 * (evidence[rows[first]] + evidence[rows[second]])
    left = np.ones(rows.size, dtype=np.bool_)
    pairs: list[tuple[int, int]] = []
    for k in np.argsort(liking, kind="stable"):
        i, j = first[k], second[k]
        if left[i] and left[j]:
            left[i] = left[j] = False
            pairs.append((int(rows[i]), int(rows[j])))
    return pairs + [(int(rows[i]), -1) for i in np.flatnonzero(left)]
