"""Scans of people whose legs are known, for the tests of scanner and tracker."""

from __future__ import annotations

import numpy as np

from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import RPLIDAR_A2M8, Scanner
from sidestep.simulation.scene import Scene, rectangle

PERIOD = 0.1
EXACT = Scanner(noise=0.0, noise_share=0.0, missing=0.0, failed=0.0, mixed=0.0, spurious=0.0)


def room(*pieces, half=5.0, cylinders=()):
    walls = [
        rectangle((0, half + 0.1), (2 * half + 0.4, 0.2)),
        rectangle((0, -half - 0.1), (2 * half + 0.4, 0.2)),
        rectangle((half + 0.1, 0), (0.2, 2 * half)),
        rectangle((-half - 0.1, 0), (0.2, 2 * half)),
    ]
    return Scene(polygons=(*walls, *pieces), cylinders=np.array(cylinders, dtype=float).reshape(-1, 3))


class Film:
    """Consecutive scans of a scene: `people` are functions of time (s) → position (2,) m, or None while absent."""

    def __init__(self, scene, people, *, pose=None, scanner=None, seed=0):
        self.scene, self.people = scene, people
        self.scanner = Scanner() if scanner is None else scanner
        self.generator = np.random.default_rng(seed)
        self.pose = pose if pose is not None else lambda t: np.zeros(3)
        self.gaits = [Gait.random(self.generator) for _ in people]
        self.phases = self.generator.uniform(0, 2 * np.pi, len(people))
        self.time = 0.0

    def truth(self, time):
        """{index: position (2,) m, world}."""
        return {k: p for k, walk in enumerate(self.people) if (p := walk(time)) is not None}

    def next(self, *, known=True):
        """The next scan; its pose is None where odometry is not `known`."""
        time, legs = self.time, []
        for k, place in self.truth(time).items():
            later = self.people[k](time + PERIOD)
            velocity = np.zeros(2) if later is None else (later - place) / PERIOD
            speed = float(np.hypot(*velocity))
            heading = float(np.arctan2(velocity[1], velocity[0])) if speed > 0.05 else 0.0
            legs.append(self.gaits[k].legs(place, velocity, heading, self.phases[k]))
            self.phases[k] = self.gaits[k].advance(self.phases[k], speed, PERIOD)
        discs = np.concatenate(legs) if legs else np.zeros((0, 5))
        pose = np.asarray(self.pose(time), dtype=float)
        twist = (np.asarray(self.pose(time + PERIOD)) - pose) / PERIOD
        scan, _ = self.scanner.sense(self.scene, discs, pose, twist, time, self.generator)
        self.time = round(time + PERIOD, 6)
        if not known:
            return type(scan)(time=scan.time, ranges=scan.ranges, beams=RPLIDAR_A2M8)
        return scan


def line(start, end, speed, *, begins=0.0):
    """Someone who stands at `start` until `begins` (s), walks to `end` and stands there."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.hypot(*(end - start)))

    def place(time):
        share = np.clip((time - begins) * speed / max(length, 1e-9), 0.0, 1.0)
        return start + share * (end - start)

    return place
