"""Recorded people who would come too close to a vehicle if they kept their velocity, and what they did instead.

Whether somebody *noticed* the vehicle cannot be seen in a recording; whether they gained clearance over somebody who
keeps the velocity can. We say "reacted", never "aware". How often that happens by chance is measured on placebos: the
same geometry, transplanted to people with no vehicle near.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.lattice import heading_rotation
from sidestep.simulation.recordings import Recording, Track
from sidestep.studies.people_samples import without_gaps
from sidestep.types import FloatArray

STEP = 0.1  # s, of all arrays here
BEFORE, AFTER = 2.0, 4.0  # s around the onset
LEAD = 1.0  # s of past that a velocity needs
PACE_WINDOW = 0.5  # s over which a velocity is taken
SLOWEST = 0.5  # m/s, of people; those who stand have no course to keep
GAINED = 0.5  # m of clearance over the person who keeps the velocity: reacted
DRIVING = 0.5  # m/s, of vehicles; a parked one is furniture


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Encounter:
    """One person and one vehicle, from `BEFORE` s before the onset on.

    Attributes:
        scene, agent: whose; onset: s, when the collision course was first to be seen.
        track: the person's.
        vehicle: (K, 2) m, every 0.1 s from onset − `BEFORE`, carried forward at its last velocity where it ends.
        placebo: the vehicle was never there.
        kept: m, least distance over the next 4 s of a person who keeps the velocity; real: m, of this person.
    """

    scene: str
    agent: str
    onset: float
    track: Track
    vehicle: FloatArray
    placebo: bool
    kept: float
    real: float

    @property
    def reacted(self) -> bool:
        """Whether the person gained clearance."""
        return self.real - self.kept >= GAINED

    def gain_by(self, delay: float) -> float:
        """Return the clearance (m) gained `delay` s after the onset: if the person keeps the velocity of then."""
        time, ahead = self.onset + delay, np.arange(delay, AFTER + 1e-9, STEP)
        here = self.track.at(time)
        pace = (here - self.track.at(time - PACE_WINDOW)) / PACE_WINDOW
        course = self.vehicle[len(self.vehicle) - len(ahead) :]
        nearest = np.linalg.norm(here + pace * (ahead - delay)[:, None] - course, axis=1).min()
        return float(nearest) - self.kept

    def vehicle_from(self, time: float, count: int, step: float) -> FloatArray:
        """Return the (count, 2) m vehicle's places at `time` + k·step (s), at its last velocity beyond the end."""
        at = (time - self.onset + BEFORE) / STEP + np.arange(count) * step / STEP
        index = np.arange(len(self.vehicle))
        known = np.stack([np.interp(at, index, column) for column in self.vehicle.T], axis=1)
        beyond = np.maximum(at - index[-1], 0.0)[:, None]
        return known + beyond * (self.vehicle[-1] - self.vehicle[-2])


def encounters(recording: Recording, near: float, *, person_kinds: Sequence[str] = ("ped",)) -> list[Encounter]:
    """Return the encounters of a scene, at most one per person and vehicle.

    Args:
        recording: one scene.
        near: m between centres, "too close".
        person_kinds: kinds of agents that are people; all others are vehicles, and who was away is another.
    """
    whole = (t for t in recording.tracks if t.kind not in person_kinds)
    vehicles = [part for t in whole for part in without_gaps(t) if len(part.time) > 10]
    paths = [(float(v.time[0]), _sampled(v)) for v in vehicles]
    found: list[Encounter] = []
    for track in _walkers(recording, person_kinds):
        for start, path in paths:
            encounter = _first(recording.name, track, path, start, near)
            if encounter is not None:
                found.append(encounter)
    return found


def placebos(
    recordings: Mapping[str, Recording],
    real: Sequence[Encounter],
    near: float,
    generator: np.random.Generator,
    *,
    person_kinds: Sequence[str] = ("ped",),
    apart: float = 8.0,
) -> list[Encounter]:
    """Transplant the vehicles of `real` encounters to people with no vehicle within `apart` m.

    The vehicle keeps its place and motion relative to the person's place and heading at the onset; it counts where the
    person then too is on a collision course.

    Args:
        recordings: by scene.
        real: encounters whose vehicles are used.
        near: m, "too close".
        generator: of the choice.
        person_kinds: kinds of agents that are people.
        apart: m, to every true vehicle from 2 s before to 4 s after the onset.
    """
    found: list[Encounter] = []
    if not real:
        return found
    for recording in recordings.values():
        vehicles = [t for t in recording.tracks if t.kind not in person_kinds]
        for track in _walkers(recording, person_kinds):
            times = np.arange(track.time[0] + LEAD, track.time[-1] - AFTER, 0.5, dtype=np.float64)
            generator.shuffle(times)
            for onset in times[:12].tolist():
                if _vehicle_near(track, vehicles, onset, apart):
                    continue
                donor = real[int(generator.integers(len(real)))]
                path = _transplanted(donor, track, onset)
                encounter = None if path is None else _judged(recording.name, track, path, onset, near, placebo=True)
                if encounter is not None:
                    found.append(encounter)
                    break
    return found


def _walkers(recording: Recording, kinds: Sequence[str]) -> Iterator[Track]:
    for track in recording.of_kinds(kinds).tracks:
        for part in without_gaps(track):
            if part.time[-1] - part.time[0] >= LEAD + 2.0:
                yield part


def _first(scene: str, track: Track, path: FloatArray, start: float, near: float) -> Encounter | None:
    """The first instant at which a kept velocity leads too close within 4 s, while there is still something to do."""
    end = start + (len(path) - 1) * STEP
    begin = max(track.time[0] + LEAD, start)
    for onset in np.arange(begin, min(track.time[-1] - AFTER, end - 1.0), 2 * STEP).tolist():
        whole = _window(path, start, onset)
        if np.linalg.norm(whole[-1] - whole[0]) < DRIVING * (BEFORE + AFTER):
            continue
        found = _judged(scene, track, whole, onset, near, placebo=False)
        if found is not None:
            return found
    return None


def _judged(
    scene: str, track: Track, vehicle: FloatArray, onset: float, near: float, *, placebo: bool
) -> Encounter | None:
    here, before = track.at(onset), track.at(onset - PACE_WINDOW)
    velocity = (here - before) / PACE_WINDOW
    if not np.isfinite(velocity).all() or np.linalg.norm(velocity) < SLOWEST:
        return None
    skip = round(BEFORE / STEP)
    ahead = np.arange(round(AFTER / STEP) + 1, dtype=np.float64) * STEP
    course = vehicle[skip : skip + len(ahead)]
    kept = np.linalg.norm(here + velocity * ahead[:, None] - course, axis=1)
    closest = int(kept.argmin())
    if kept[closest] >= near or ahead[closest] < 1.0 or kept[0] < near + 0.5:
        return None  # no collision course, or too late to do anything
    real = np.linalg.norm(track.at(onset + ahead) - course, axis=1)
    return Encounter(
        scene=scene,
        agent=track.agent,
        onset=onset,
        track=track,
        vehicle=vehicle,
        placebo=placebo,
        kept=float(kept[closest]),
        real=float(np.nanmin(real)),
    )


def _window(path: FloatArray, start: float, onset: float) -> FloatArray:
    """The vehicle's places every 0.1 s from onset − 2 s to onset + 4 s, at its end velocities beyond the track."""
    at = (onset - BEFORE - start) / STEP + np.arange(round((BEFORE + AFTER) / STEP) + 1, dtype=np.float64)
    index = np.arange(len(path))
    known = np.stack([np.interp(at, index, column) for column in path.T], axis=1)
    early, late = np.minimum(at, 0.0)[:, None], np.maximum(at - index[-1], 0.0)[:, None]
    return known + early * (path[1] - path[0]) + late * (path[-1] - path[-2])


def _sampled(track: Track) -> FloatArray:
    return track.at(np.arange(track.time[0], track.time[-1] + 1e-6, STEP))


def _transplanted(donor: Encounter, track: Track, onset: float) -> FloatArray | None:
    """The donor's vehicle as it would look from this person's place and heading at `onset`."""
    there = _place_and_heading(donor.track, donor.onset)
    here = _place_and_heading(track, onset)
    if there is None or here is None:
        return None
    return (donor.vehicle - there[0]) @ there[1] @ here[1].T + here[0]


def _place_and_heading(track: Track, time: float) -> tuple[FloatArray, FloatArray] | None:
    place, before = track.at(time), track.at(time - PACE_WINDOW)
    velocity = (place - before) / PACE_WINDOW
    if not np.isfinite(velocity).all() or np.linalg.norm(velocity) < SLOWEST:
        return None
    return place, heading_rotation(velocity)


def _vehicle_near(track: Track, vehicles: Sequence[Track], onset: float, apart: float) -> bool:
    times = np.arange(onset - BEFORE, onset + AFTER, 2 * STEP)
    own = track.at(times)
    gaps = [np.linalg.norm(v.at(times) - own, axis=1) for v in vehicles]
    return any(bool((gap < apart).any()) for gap in gaps)  # NaN, where either is absent, compares false
