"""Recorded people: where each agent of a scene was, and when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.types import FloatArray, Vector, frozen_array

LONGEST_GAP = 0.85
"""s between two samples, over which an agent is taken to have been there: one missing at 2.5 Hz."""
EDGE = 1e-3
"""s, up to which an instant before the first sample or after the last counts as these."""
_RARE = 2.1  # usual intervals, over which it is where samples are rarer than that
_WALKING, _FASTEST = 0.3, 15.0  # m/s, of those who do not stand; most people cannot go so fast on a bicycle
_SLOWEST = 10.0  # s between two samples, with which nobody can be followed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """One agent of a recording.

    Attributes:
        agent: identity; kind: "ped", "veh", "robot", …
        time: (K,) s, strictly increasing.
        positions: (K, d) m.
        stays: (S, 2) s, first and last sample of every time that the agent was there. Who is seen again after a gap was
            away in between, or somebody else bears the name now: where they turn up says nothing of where they were.
    """

    agent: str
    kind: str
    time: FloatArray
    positions: FloatArray
    stays: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", frozen_array(self.time))
        object.__setattr__(self, "positions", frozen_array(self.positions))
        if len(self.time) == 0 or len(self.time) != len(self.positions):
            raise InvalidInput(f"track {self.agent!r}", len(self.time), "as many positions as times, at least one")
        if not (np.isfinite(self.time).all() and np.isfinite(self.positions).all()):
            raise InvalidInput(f"track {self.agent!r}", "a value that is not finite", "finite times and positions")
        if (np.diff(self.time) <= 0).any():
            raise InvalidInput(f"track {self.agent!r}", "times that stand still or run back", "increasing times")
        object.__setattr__(self, "stays", frozen_array(_stays(self.time)))

    def at(self, time: float | FloatArray) -> FloatArray:
        """Positions at `time`, (d,) or (T, d) m, linear between the samples; NaN where the agent is absent.

        Instants up to `EDGE` outside of `stays` count as their ends.
        """
        t = np.asarray(time, dtype=np.float64)
        begins, ends = self.stays.T
        inside = ((t[..., None] >= begins - EDGE) & (t[..., None] <= ends + EDGE)).any(axis=-1)
        columns = [np.interp(t, self.time, column) for column in self.positions.T]
        return np.where(inside[..., None], np.stack(columns, axis=-1), np.nan)

    def velocity_before(self, time: float, window: float) -> Vector | None:
        """Mean velocity (d,) m/s over the samples of the last `window` s up to `time`; None where there is no past.

        No sample after `time` enters: the coming step does not leak.
        """
        last = int(np.searchsorted(self.time, time + 1e-6, side="right")) - 1
        if last < 1:
            return None
        begins = self.stays[:, 0]
        come = int(np.searchsorted(self.time, begins[begins <= self.time[last]][-1]))
        if last == come:
            return None
        first = int(np.searchsorted(self.time, self.time[last] - window - 1e-6))
        first = max(min(first, last - 1), come)
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


def _stays(time: FloatArray) -> FloatArray:
    steps = np.diff(time)
    usual = float(np.median(steps)) if len(steps) else 0.0
    cuts = np.flatnonzero(steps > max(LONGEST_GAP, _RARE * usual))
    return np.stack([time[np.append(0, cuts + 1)], time[np.append(cuts, len(steps))]], axis=1)


def check_people(recordings: Iterable[Recording], kinds: Iterable[str], where: str) -> None:
    """Check that there are people in recordings, and that they can be told in metres and seconds.

    Args:
        recordings: scenes.
        kinds: of agents that are people.
        where: how a complaint begins: the file, say.

    Raises:
        InvalidInput: nobody is of these kinds, or most people are faster than people can be, or seen too seldom.
    """
    wanted, scenes = set(kinds), list(recordings)
    held = {track.kind for recording in scenes for track in recording.tracks}
    if not held & wanted:
        told, mend = (", ".join(sorted(held)), "rename them") if held else ("nobody", "leave out fewer scenes")
        raise InvalidInput(f"{where}: kind", told, f"{' or '.join(sorted(wanted))} for people", mend)
    tracks = [t for recording in scenes for t in recording.of_kinds(wanted).tracks if len(t.time) > 1]
    if not tracks:
        return
    elapsed = np.concatenate([np.diff(t.time) for t in tracks])
    if (usual := float(np.median(elapsed))) > _SLOWEST:
        raise InvalidInput(
            f"{where}: t", f"{usual:g} s between samples", f"at most {_SLOWEST:g} s", "convert to seconds"
        )
    speed = np.concatenate([np.linalg.norm(np.diff(t.positions, axis=0), axis=1) for t in tracks]) / elapsed
    usual = float(np.median(speed[speed > _WALKING])) if (speed > _WALKING).any() else 0.0
    if usual > _FASTEST:
        told = f"people at {usual:.0f} m/s"
        raise InvalidInput(f"{where}: x, y, t", told, f"at most {_FASTEST:g} m/s", "convert to metres and seconds")
