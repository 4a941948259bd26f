"""Moments of recorded people: what was known of them from their past, and where they then went."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sidestep import minds
from sidestep.human.model import HumanModel
from sidestep.human.observation import PersonObservation
from sidestep.lattice import heading_rotation
from sidestep.mind import Mind
from sidestep.prediction.occupancy import Prediction, Workspace
from sidestep.simulation.recordings import LONGEST_GAP, Recording, Track
from sidestep.subjects import Circumstances, Subject
from sidestep.types import FloatArray, Vector

STEP = 0.4  # s, of the field's protocols
HORIZONS = tuple(round(STEP * k, 1) for k in range(1, 13))
"""Seconds ahead: the field's 12 steps of 0.4 s."""
PAST = 2.8  # s, that must have been seen before a moment counts: the field's 8 observed positions
STANDING = 0.3  # m/s, below which a person has no heading
FAR = 1e4  # m, where the robot is when there is none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """One person at one instant.

    Attributes:
        scene, agent: whose.
        time: s.
        position: (2,) m, measured.
        velocity: (2,) m/s, backward difference over 0.4 s.
        mind: what our planner would know of the person by now.
        frame: (2, 2) columns along and across the heading (world axes for those who stand).
        future: (H, 2) m, displacement from `position` at `HORIZONS`, in `frame`.
    """

    scene: str
    agent: str
    time: float
    position: Vector
    velocity: Vector
    mind: Mind
    frame: FloatArray
    future: FloatArray

    @property
    def speed(self) -> float:
        """Metres per second, of the backward difference."""
        return float(np.linalg.norm(self.velocity))


class Watcher:
    """Sees one person after another, sample by sample, as the planner would where no robot is near."""

    def __init__(self, model: HumanModel, *, expecting: bool = True) -> None:
        """Watch with a model; without `expecting`, nobody's goals are weighed against what was expected (faster)."""
        self.model = model
        self._expecting = expecting
        self._workspace = Workspace()

    def follow(self, track: Track) -> Iterator[tuple[float, Vector, Mind]]:
        """Yield time (s), measured position (2,) m and what is known by then, for every sample of a track."""
        mind: Mind | None = None
        for t, position in zip(track.time.tolist(), track.positions, strict=True):
            seen = PersonObservation(id=track.agent, position=position)
            known = minds.meet(seen, self.model, t) if mind is None else minds.observe(mind, seen, t, STEP)
            yield t, position, known
            mind = known
            if self._expecting and known.anchor is None:
                ahead = self.ahead(known, 1)
                mind = minds.expect(known, ahead.action_probabilities, ahead.velocities, t)

    def ahead(self, mind: Mind, steps: int) -> Prediction:
        """Return where the person will be at `steps` steps of 0.4 s, nobody being in the way."""
        around = Circumstances(time_step=STEP, horizon=steps, robot_radius=0.3, interval=STEP)
        nobody = np.full((2 * steps + 3, 2), FAR)
        return Subject(mind, around).predicted(nobody, self._workspace)


def moments(
    recording: Recording,
    model: HumanModel,
    *,
    kinds: Sequence[str] = ("ped",),
    every: float = 0.8,
    expecting: bool = True,
) -> list[Moment]:
    """Return the moments of one scene, every `every` s of each track that has past and future enough.

    Args:
        recording: one scene.
        model: of the people, for what is learned of them; its `measurement_noise` is that of the recording.
        kinds: of agents that are people.
        every: s between the moments of a track.
        expecting: see `Watcher`.
    """
    watcher = Watcher(model, expecting=expecting)
    found: list[Moment] = []
    for track in recording.of_kinds(kinds).tracks:
        for part in without_gaps(track):
            if part.time[-1] - part.time[0] >= PAST + HORIZONS[-1] - 1e-6:
                found.extend(_of_track(recording.name, part, watcher, every))
    return found


def _of_track(scene: str, track: Track, watcher: Watcher, every: float) -> Iterator[Moment]:
    due = track.time[0] + PAST - 1e-6
    for t, position, mind in watcher.follow(track):
        if t + HORIZONS[-1] > track.time[-1] + 1e-6:
            return
        if t < due:
            continue
        due = t + every - 1e-6
        velocity = (position - track.at(t - STEP)) / STEP
        frame = heading_rotation(velocity if np.linalg.norm(velocity) >= STANDING else np.zeros(2))
        yield Moment(
            scene=scene,
            agent=track.agent,
            time=t,
            position=position,
            velocity=velocity,
            mind=mind,
            frame=frame,
            future=(track.at(t + np.array(HORIZONS)) - position) @ frame,
        )


def without_gaps(track: Track) -> list[Track]:
    """Cut a track where it was not sampled for more than `LONGEST_GAP`, even if it never is more often.

    `Track.stays` asks whether somebody was there, and rare samples tell that. Here they are followed step by step:
    places between rare samples would be made of those to come, and tell what is to be predicted.
    """
    cuts = np.flatnonzero(np.diff(track.time) > LONGEST_GAP) + 1
    parts = zip(np.split(track.time, cuts), np.split(track.positions, cuts), strict=True)
    return [Track(agent=track.agent, kind=track.kind, time=t, positions=p) for t, p in parts]
