"""What a trip came to: how long it took, how near it got, who touched whom."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

MOVING = 0.05  # m/s; slower than this the robot stands


@dataclass(slots=True, kw_only=True)
class Tally:
    """Counts over one robot's trips.

    Attributes:
        trip: number of the present trip, from 1.
        elapsed: s since it began (until it ended).
        closest: m between centres, smallest distance to anyone in this trip.
        closest_approaching: m, the same while the robot itself moved nearer.
        contacts_moving, contacts_standing: contacts that began while the robot moved, or stood; over all trips.
        times: s that the finished trips took.
    """

    trip: int = 1
    elapsed: float = 0.0
    closest: float = math.inf
    closest_approaching: float = math.inf
    contacts_moving: int = 0
    contacts_standing: int = 0
    times: list[float] = field(default_factory=list[float])
    _touching: bool = False

    def instant(self, *, distance: float, contact: float, speed: float, approaching: bool) -> None:
        """Count one instant.

        Args:
            distance: m between centres, to the nearest person.
            contact: m between centres at which bodies touch.
            speed: m/s, of the robot.
            approaching: the robot's own motion shortens the distance.
        """
        self.closest = min(self.closest, distance)
        if speed > MOVING and approaching:
            self.closest_approaching = min(self.closest_approaching, distance)
        touching = distance < contact
        if touching and not self._touching:
            if speed > MOVING:
                self.contacts_moving += 1
            else:
                self.contacts_standing += 1
        self._touching = touching

    def finish(self) -> None:
        """The robot has arrived."""
        self.times.append(self.elapsed)

    def next_trip(self) -> None:
        """Begin the next trip."""
        self.trip += 1
        self.elapsed = 0.0
        self.closest = self.closest_approaching = math.inf

    def summary(self) -> str:
        """Return one short line, for under a planner's name."""
        parts = [f"trip {self.trip}: {self.elapsed:.1f} s"]
        if math.isfinite(self.closest):
            parts.append(f"closest {self.closest:.2f} m")
        if self.times:
            parts.append("earlier " + ", ".join(f"{t:.1f} s" for t in self.times[-3:]))
        contacts = self.contacts_moving + self.contacts_standing
        if contacts:
            parts.append(f"{contacts} contact{'s' if contacts > 1 else ''}, {self.contacts_moving} while moving")
        return " · ".join(parts)
