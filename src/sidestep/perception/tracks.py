"""Detections → people with position, velocity and identity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.obstacles import Obstacles
from sidestep.perception.association import STRIDE, assign_legs, pair_legs
from sidestep.perception.classifier import LegClassifier, load_classifier
from sidestep.perception.clutter import ClutterMap
from sidestep.perception.legs import LegCandidates, find_legs, in_fixed_frame
from sidestep.perception.scan import Scan
from sidestep.perception.shade import in_view, stands_still
from sidestep.perception.table import TrackTable
from sidestep.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerSettings:
    """How the tracker judges. Log likelihood ratios are natural logarithms, capped at ±3 per leg.

    Attributes:
        agility: m²/s³, density of the acceleration noise of a person, with odometry or a scanner that stands.
        agility_standing: m²/s³, the same of someone who hardly moves: their velocity is known better.
        agility_adrift: m²/s³, the same where the scanner moves in an unknown way.
        pair_deviation: m, of the middle of two legs about the middle of the person, per axis.
        single_deviation: m, of one leg; merged_deviation: m, of a cluster that holds both.
        memory: s, over which evidence for being a person is averaged.
        accept: mean log likelihood ratio from which a track is reported; reject: below which it no longer is.
        pair_bonus: evidence of having two legs.
        unseen_evidence: evidence of nothing being where a person should be seen.
        still_weight: how much it counts against a leg that something has stood there, and for it that nothing has.
        patience: s that a person is predicted without being seen, though nothing hides them.
        patience_hidden: s, where something nearer hides them or they left the field of view.
        own_body: m; what is nearer to the scanner is the robot itself.
        map_margin: m; what lies this near to a wall of the map, or inside it, is taken for the wall.
    """

    agility: float = 1.5
    agility_standing: float = 0.05
    agility_adrift: float = 1.5
    pair_deviation: float = 0.08
    single_deviation: float = 0.13
    merged_deviation: float = 0.07
    memory: float = 1.0
    accept: float = 1.4
    reject: float = 0.0
    pair_bonus: float = 1.0
    unseen_evidence: float = -2.0
    still_weight: float = 1.0
    patience: float = 0.9
    patience_hidden: float = 2.0
    own_body: float = 0.25
    map_margin: float = 0.1


_CAP = 3.0
_START = -0.5  # log likelihood ratio from which a leg begins a track
_MIN_AGE = 0.3  # s before a track is reported
_TENTATIVE_PATIENCE = 0.35  # s
_HOPELESS = -2.5  # score at which a track is given up
_LOST = 1.2  # m; standard deviation at which a track is given up: after about 1.2 s in the shade of something
_MOVED = 0.5  # m from where a track began: something that stands does not seem to get there
_SAME = 0.3  # m; two tracks this near are one person
_FASTEST = 3.5  # m/s; what seems to move faster is two things taken for one
_STANDS = 0.3  # m/s
_FIRST_SPEED = 1.0  # m/s; standard deviation of an unknown velocity
_LONGEST_GAP = 3.0  # s without scans after which all is forgotten
_BOTH = 0.5


class Tracker:
    """People in consecutive scans of one scanner.

    Positions are in the fixed frame of `Scan.pose`; in the scanner's own, where scans bring no pose.

    Args:
        classifier: of what is seen; None: the one that comes with the package.
        settings: how to judge; None: the defaults.
        walls: a map in the fixed frame: furniture that is on it is nobody's leg. None: there is no map. May be set
            between two scans.
    """

    def __init__(
        self,
        *,
        classifier: LegClassifier | None = None,
        settings: TrackerSettings | None = None,
        walls: Obstacles | None = None,
    ) -> None:
        self.settings = TrackerSettings() if settings is None else settings
        self._classifier = load_classifier() if classifier is None else classifier
        self.walls = walls
        self.reset()

    def reset(self) -> None:
        """Forget all people and the surroundings; identities go on counting from 1."""
        self.tracks = TrackTable()
        self.clutter = ClutterMap()
        self._past: list[Scan] = []
        self._count = 0

    @property
    def time(self) -> float:
        """Return the time of the last scan in s, −∞ before the first."""
        return self._past[-1].time if self._past else -np.inf

    def update(self, scan: Scan) -> list[PersonObservation]:
        """Take one scan and return the people at its time; a scan not later than the last one changes nothing."""
        if scan.time <= self.time:
            return self.people()
        if scan.time - self.time > _LONGEST_GAP and self._past:
            count = self._count
            self.reset()
            self._count = count
        duration = scan.time - self.time if self._past else 0.0
        fixed = scan.pose is not None or stands_still(scan, self._past)
        self.tracks.predict(duration, self._agility() if fixed else self.settings.agility_adrift)
        twist = self._twist(scan)
        legs = find_legs(scan, self._classifier, twist=twist, nearest=self.settings.own_body)
        evidence = np.clip(legs.leg, -_CAP, _CAP)
        if fixed:
            evidence -= self.settings.still_weight * self.clutter.standing(legs.positions)
        if self.walls is not None and scan.pose is not None and len(legs):
            evidence[~self.walls.free(legs.positions, self.settings.map_margin)] = -_CAP
        taken = assign_legs(self.tracks, legs, evidence)
        self._correct(legs, taken)
        self._judge(scan, evidence, taken, duration)
        self._begin(legs, evidence, taken)
        self._merge()
        self._look_around(scan, twist, duration, fixed=fixed)
        self._past = [*(s for s in self._past if s.time > scan.time - 1.05), scan]
        return self.people()

    def people(self, time: float | None = None) -> list[PersonObservation]:
        """Return the people at `time` (s), predicted from the last scan; None: at the last scan."""
        ahead = 0.0 if time is None or not self._past else max(time - self.time, 0.0)
        later = TrackTable(
            position=self.tracks.position, velocity=self.tracks.velocity, covariance=self.tracks.covariance
        )
        later.predict(ahead, self._agility())
        return [
            PersonObservation(
                id=str(self.tracks.number[row]),
                position=later.position[row],
                velocity=later.velocity[row],
                position_covariance=later.covariance[row, 0] * np.eye(2),
                velocity_covariance=later.covariance[row, 2] * np.eye(2),
            )
            for row in np.flatnonzero(self.tracks.person)
        ]

    def has_moved(self, name: str) -> bool:
        """Return whether the person with this identity was seen to leave the place where they were first seen."""
        rows = np.flatnonzero(self.tracks.number == int(name))
        return bool(self.tracks.moved[rows].any())

    def _agility(self) -> FloatArray:
        """(T,) m²/s³ of each track."""
        standing = np.hypot(*self.tracks.velocity.T) < _STANDS
        return np.where(standing, self.settings.agility_standing, self.settings.agility)

    def _twist(self, scan: Scan) -> FloatArray | None:
        """Return how the scanner has moved since the last scan, (3,) m/s, m/s, rad/s; None where unknown."""
        before = self._past[-1] if self._past else None
        if before is None or before.pose is None or scan.pose is None:
            return None
        change = scan.pose - before.pose
        change[2] = (change[2] + np.pi) % (2 * np.pi) - np.pi
        return change / (scan.time - before.time)

    def _correct(self, legs: LegCandidates, taken: IntArray) -> None:
        s = self.settings
        rows = np.flatnonzero(taken[:, 0] >= 0)
        first, second = taken[rows].T
        two = second >= 0
        other = np.where(two, second, first)
        merged = legs.both[first] > _BOTH
        deviation = np.where(two, s.pair_deviation, np.where(merged, s.merged_deviation, s.single_deviation))
        self.tracks.correct(
            rows,
            (legs.positions[first] + legs.positions[other]) / 2,
            deviation**2,
            (legs.delays[first] + legs.delays[other]) / 2,
        )

    def _judge(self, scan: Scan, evidence: FloatArray, taken: IntArray, duration: float) -> None:
        """Weigh what was seen of each track; report, go on watching, or give up."""
        s, tracks = self.settings, self.tracks
        seen, two = taken[:, 0] >= 0, taken[:, 1] >= 0
        found = np.zeros(len(tracks))
        found[seen] = evidence[taken[seen, 0]]
        better, worse = np.maximum(*evidence[taken[two]].T), np.minimum(*evidence[taken[two]].T)
        found[two] = better + np.minimum(worse, 0.0) / 2 + s.pair_bonus
        visible = in_view(scan, tracks.position)
        found[~seen] = s.unseen_evidence
        share = 1.0 - np.exp(-duration / s.memory)
        tracks.score = tracks.score + share * np.where(seen | visible, found - tracks.score, 0.0)
        tracks.age = tracks.age + duration
        tracks.unseen = np.where(
            seen, 0.0, tracks.unseen + duration * np.where(visible, 1.0, s.patience / s.patience_hidden)
        )
        tracks.moved |= np.hypot(*(tracks.position - tracks.born).T) > _MOVED
        accepted = (tracks.score > s.accept) & (tracks.age > _MIN_AGE) & seen
        tracks.person = np.where(tracks.person, tracks.score > s.reject, accepted)
        patience = np.where(tracks.person, s.patience, _TENTATIVE_PATIENCE)
        known = tracks.covariance[:, 0] < _LOST**2
        likely = np.hypot(*tracks.velocity.T) < _FASTEST
        if self.walls is not None and scan.pose is not None and len(tracks):
            likely &= self.walls.free(tracks.position)
        tracks.keep((tracks.unseen < patience) & (tracks.score > _HOPELESS) & known & likely)

    def _begin(self, legs: LegCandidates, evidence: FloatArray, taken: IntArray) -> None:
        """Begin a track with each pair of legs, and with each single one, that no track has taken."""
        free = evidence > _START
        free[taken[taken >= 0]] = False
        pairs = np.array(pair_legs(legs, evidence, free), dtype=np.int64).reshape(-1, 2)
        other = np.where(pairs[:, 1] >= 0, pairs[:, 1], pairs[:, 0])
        two = pairs[:, 1] >= 0
        variance = np.where(two, self.settings.pair_deviation, self.settings.single_deviation) ** 2
        numbers = self._count + 1 + np.arange(pairs.shape[0], dtype=np.int64)
        self._count += pairs.shape[0]
        self.tracks.add(numbers, (legs.positions[pairs[:, 0]] + legs.positions[other]) / 2, variance, _FIRST_SPEED)

    def _merge(self) -> None:
        """Of two tracks in one place keep the person, else the older."""
        tracks = self.tracks
        apart = np.hypot(*(tracks.position[:, None] - tracks.position[None]).transpose(2, 0, 1))
        keep = np.ones(len(tracks), dtype=np.bool_)
        for i, j in np.argwhere(np.triu(apart < _SAME, k=1)):
            if keep[i] and keep[j]:
                first = (tracks.person[i], tracks.age[i]) >= (tracks.person[j], tracks.age[j])
                keep[j if first else i] = False
        tracks.keep(keep)

    def _look_around(self, scan: Scan, twist: FloatArray | None, duration: float, *, fixed: bool) -> None:
        """Remember what stands where; people who were seen to walk leave no trace."""
        if not fixed:
            self.clutter.clear()
            return
        valid = np.flatnonzero(scan.valid())
        delays = scan.beams.time_increment * valid.astype(np.float64)
        hits = in_fixed_frame(scan.points()[valid], scan.pose, twist, delays)
        origin = np.zeros(2) if scan.pose is None else scan.pose[:2]
        self.clutter.update(origin, hits, self._on_people(hits), duration)

    def _on_people(self, hits: FloatArray) -> BoolArray:
        people = self.tracks.position[self.tracks.person & self.tracks.moved]
        apart = np.hypot(*(hits[:, None] - people[None]).transpose(2, 0, 1))
        return np.any(apart < STRIDE / 2 + 0.1, axis=1)
