"""The tracks as columns: constant-velocity Kalman filters, all at once."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from sidestep.types import BoolArray, FloatArray, IntArray


@dataclass(slots=True)
class TrackTable:
    """T tracks. Both axes share one covariance, since neither people's gait nor the scanner prefers a direction.

    Attributes:
        number: (T,) identity.
        position: (T, 2) m.
        velocity: (T, 2) m/s.
        covariance: (T, 3) variances per axis: of position (m²), position with velocity (m²/s), velocity (m²/s²).
        score: (T,) how much it looked like a person lately; a running mean of log likelihood ratios.
        age: (T,) s.
        unseen: (T,) s without a detection, time in the shade of other things counting less.
        born: (T, 2) m, where the track began.
        moved: (T,) has left that place.
        person: (T,) reported as a person.
    """

    number: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    position: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    velocity: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    score: FloatArray = field(default_factory=lambda: np.zeros(0))
    age: FloatArray = field(default_factory=lambda: np.zeros(0))
    unseen: FloatArray = field(default_factory=lambda: np.zeros(0))
    born: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    moved: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    person: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    def __len__(self) -> int:
        return int(self.number.size)

    def predict(self, duration: float, agility: FloatArray | float) -> None:
        """Move all tracks on.

        Args:
            duration: s.
            agility: m²/s³, density of the white acceleration noise, one for all or (T,).
        """
        pp, pv, vv = self.covariance.T
        self.position = self.position + duration * self.velocity
        self.covariance = np.stack(
            (
                pp + 2 * duration * pv + duration**2 * vv + agility * duration**3 / 3,
                pv + duration * vv + agility * duration**2 / 2,
                vv + agility * duration,
            ),
            axis=1,
        )

    def correct(self, rows: IntArray, measured: FloatArray, variance: FloatArray, delays: FloatArray) -> None:
        """Take in one measured position for each of `rows`.

        Args:
            rows: (K,) tracks.
            measured: (K, 2) m.
            variance: (K,) m² per axis.
            delays: (K,) s by which the measurement is later than the tracks.
        """
        pp, pv, vv = self.covariance[rows].T
        late_pp, late_pv = pp + 2 * delays * pv + delays**2 * vv, pv + delays * vv
        to_position, to_velocity = (pp + delays * pv) / (late_pp + variance), late_pv / (late_pp + variance)
        error = measured - self.position[rows] - delays[:, None] * self.velocity[rows]
        self.position[rows] += to_position[:, None] * error
        self.velocity[rows] += to_velocity[:, None] * error
        self.covariance[rows] = np.stack(
            (
                pp - to_position * (pp + delays * pv),
                pv - to_position * late_pv,
                vv - to_velocity * late_pv,
            ),
            axis=1,
        )

    def keep(self, rows: BoolArray) -> None:
        """Drop all tracks but `rows` (T,)."""
        if not rows.all():
            for column in fields(self):
                setattr(self, column.name, getattr(self, column.name)[rows])

    def add(self, number: IntArray, position: FloatArray, variance: FloatArray, speed: float) -> None:
        """Begin tracks at rest: `variance` (K,) m² per axis of the positions, `speed` m/s deviation of velocities."""
        count = number.size
        more = TrackTable(
            number=number,
            position=position,
            velocity=np.zeros((count, 2)),
            covariance=np.stack((variance, np.zeros(count), np.full(count, speed**2)), axis=1),
            score=np.zeros(count),
            age=np.zeros(count),
            unseen=np.zeros(count),
            born=position,
            moved=np.zeros(count, dtype=np.bool_),
            person=np.zeros(count, dtype=np.bool_),
        )
        for column in fields(self):
            setattr(self, column.name, np.concatenate((getattr(self, column.name), getattr(more, column.name))))
