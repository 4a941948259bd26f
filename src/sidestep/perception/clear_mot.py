"""The CLEAR MOT measures (Bernardin and Stiefelhagen, 2008), counted as the authors of the recordings count them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

from sidestep.types import FloatArray

MATCH_DISTANCE = 0.75
"""m; a track farther from a person does not stand for them."""
_FAR = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class MotScore:
    """What a tracker got right.

    Attributes:
        truths: annotated positions, over all scans.
        matches: of these, with a track (identity switches included).
        misses: of these, without.
        false_positives: reported positions without a person, in scans that count.
        id_switches: a person's track changed its identity, or a track its person.
        error: m, mean distance of the matches (MOTP).
        rmse: m, root mean square of the same.
        hypotheses: different identities reported.
    """

    truths: int
    matches: int
    misses: int
    false_positives: int
    id_switches: int
    error: float
    rmse: float
    hypotheses: int

    @property
    def recall(self) -> float:
        """Return matches per annotated position, NaN without any."""
        return self.matches / self.truths if self.truths else float("nan")

    @property
    def precision(self) -> float:
        """Return matches per reported position, NaN without any."""
        reported = self.matches + self.false_positives
        return self.matches / reported if reported else float("nan")

    @property
    def accuracy(self) -> float:
        """Return MOTA = 1 − (misses + false positives + switches) per annotated position, NaN without any."""
        wrong = self.misses + self.false_positives + self.id_switches
        return 1.0 - wrong / self.truths if self.truths else float("nan")


@dataclass(slots=True)
class ClearMot:
    """Counts scan by scan; pairs last as long as they stay within `distance` (m)."""

    distance: float = MATCH_DISTANCE
    _pairs: dict[str, int] = field(default_factory=dict[str, int])
    _seen: set[str] = field(default_factory=set[str])
    _errors: list[float] = field(default_factory=list[float])
    _truths: int = 0
    _false: int = 0
    _switches: int = 0

    def update(
        self, people: Sequence[int], truth: FloatArray, tracks: Sequence[str], positions: FloatArray
    ) -> dict[str, int]:
        """Count one scan and return its pairs, track → person.

        Args:
            people: identities of the people that count now.
            truth: (M, 2) m, where they are.
            tracks: identities of the tracks that count now.
            positions: (T, 2) m, where they are said to be.
        """
        apart = np.hypot(*(positions.reshape(-1, 1, 2) - truth.reshape(1, -1, 2)).transpose(2, 0, 1))
        matches = self._lasting(people, tracks, apart)
        free_tracks = [t for t in range(len(tracks)) if t not in matches]
        free_people = [p for p in range(len(people)) if p not in matches.values()]
        cost = np.where(apart < self.distance, apart, _FAR)[np.ix_(free_tracks, free_people)]
        for row, column in zip(*linear_sum_assignment(cost), strict=True):
            if cost[row, column] < _FAR:
                matches[free_tracks[row]] = free_people[column]
        pairs = {tracks[t]: people[p] for t, p in matches.items()}
        self._switches += sum(self._is_switch(track, person) for track, person in pairs.items())
        self._truths += len(people)
        self._false += len(tracks) - len(matches)
        self._errors += [float(apart[t, p]) for t, p in matches.items()]
        self._seen.update(tracks)
        found = set(pairs.values())
        self._pairs = {t: p for t, p in self._pairs.items() if t not in pairs and p not in found} | pairs
        return pairs

    def score(self) -> MotScore:
        """Return the counts so far."""
        errors = np.array(self._errors)
        return MotScore(
            truths=self._truths,
            matches=errors.size,
            misses=self._truths - errors.size,
            false_positives=self._false,
            id_switches=self._switches,
            error=float(errors.mean()) if errors.size else float("nan"),
            rmse=float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan"),
            hypotheses=len(self._seen),
        )

    def _lasting(self, people: Sequence[int], tracks: Sequence[str], apart: FloatArray) -> dict[int, int]:
        """Return the pairs of before that still hold, as indices track → person."""
        matches: dict[int, int] = {}
        for track, person in self._pairs.items():
            if track in tracks and person in people:
                t, p = tracks.index(track), people.index(person)
                if apart[t, p] < self.distance:
                    matches[t] = p
        return matches

    def _is_switch(self, track: str, person: int) -> bool:
        if track in self._pairs:
            return self._pairs[track] != person
        return person in self._pairs.values()
