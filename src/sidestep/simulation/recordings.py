"""Recorded people: where each agent of a scene was, and when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.types import FloatArray, Vector, frozen_array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """One agent of a recording.

    Attributes:
        agent: identity; kind: "ped", "veh", "robot", …
        time: (K,) s, strictly increasing.
        positions: (K, d) m.
    """

    agent: str
    kind: str
    time: FloatArray
    positions: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", frozen_array(self.time))
        object.__setattr__(self, "positions", frozen_array(self.positions))
        if len(self.time) == 0 or len(self.time) != len(self.positions):
            raise InvalidInput(f"track {self.agent!r}", len(self.time), "as many positions as times, at least one")
        if not (np.isfinite(self.time).all() and np.isfinite(self.positions).all()):
            raise InvalidInput(f"track {self.agent!r}", "a value that is not finite", "finite times and positions")
        if (np.diff(self.time) <= 0).any():
            raise InvalidInput(f"track {self.agent!r}", "times that stand still or run back", "increasing times")

    def at(self, time: float | FloatArray) -> FloatArray:
        """Positions at `time`, (d,) or (T, d) m, linear between the samples; NaN where the agent is absent.

        Instants up to a millisecond outside the track count as its ends.
        """
        t = np.asarray(time, dtype=np.float64)
        inside = (t >= self.time[0] - 1e-3) & (t <= self.time[-1] + 1e-3)
        columns = [np.interp(t, self.time, column) for column in self.positions.T]
        return np.where(inside[..., None], np.stack(columns, axis=-1), np.nan)

    def velocity_before(self, time: float, window: float) -> Vector | None:
        """Mean velocity (d,) m/s over the samples of the last `window` s up to `time`; None where there is no past.

        No sample after `time` enters: the coming step does not leak.
        """
        last = int(np.searchsorted(self.time, time + 1e-6, side="right")) - 1
        if last < 1:
            return None
        first = int(np.searchsorted(self.time, self.time[last] - window - 1e-6))
        first = min(first, last - 1)
        return (self.positions[last] - self.positions[first]) / (self.time[last] - self.time[first])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """One scene.

    Attributes:
        name: of the scene; tracks: its agents.
    """

    name: str
    tracks: tuple[Track, ...]

    @property
    def start(self) -> float:
        """Seconds, first sample of any agent."""
        return min(float(track.time[0]) for track in self.tracks)

    @property
    def end(self) -> float:
        """Seconds, last sample of any agent."""
        return max(float(track.time[-1]) for track in self.tracks)

    @property
    def interval(self) -> float:
        """Seconds, usual time between two samples of an agent."""
        gaps = [np.diff(track.time) for track in self.tracks if len(track.time) > 1]
        return round(float(np.median(np.concatenate(gaps))), 6) if gaps else 0.1

    def of_kinds(self, kinds: Iterable[str]) -> Recording:
        """Return the scene with agents of these kinds only."""
        wanted = set(kinds)
        return Recording(name=self.name, tracks=tuple(t for t in self.tracks if t.kind in wanted))

    def between(self, begin: float, end: float) -> Iterator[Track]:
        """Agents that are present at some time in [begin, end] s."""
        return (t for t in self.tracks if t.time[0] <= end and t.time[-1] >= begin)

    def snapped(self, time: float) -> float:
        """The sampling instant of the scene nearest to `time` (s): there, positions are measured, not interpolated."""
        return self.start + round((time - self.start) / self.interval) * self.interval
