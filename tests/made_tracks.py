"""Recordings made by hand: people whose habits are known."""

from __future__ import annotations

import numpy as np

from sidestep.simulation.recordings import Recording, Track
from sidestep.types import FloatArray

STEP = 0.4  # s


def wavering(
    people: int, *, sigma: float, noise: float = 0.0, speed: float = 1.3, duration: float = 16.0, seed: int = 0
) -> Recording:
    """People whose velocity walks by `sigma`·√τ (m/s per axis in τ s), measured with `noise` m."""
    rng = np.random.default_rng(seed)
    tracks: list[Track] = []
    count = round(duration / STEP)
    for n in range(people):
        angle = rng.uniform(0, 2 * np.pi)
        start = speed * np.array([np.cos(angle), np.sin(angle)])
        velocity = start + np.cumsum(rng.normal(0, sigma * np.sqrt(STEP), (count, 2)), axis=0)
        path = np.cumsum(velocity * STEP, axis=0)
        tracks.append(track(f"p{n}", path + rng.normal(0, noise, path.shape)))
    return Recording(name=f"made{seed}", tracks=tuple(tracks))


def track(agent: str, positions: FloatArray, *, kind: str = "ped", step: float = STEP) -> Track:
    return Track(agent=agent, kind=kind, time=step * np.arange(len(positions)), positions=np.asarray(positions))


def straight(agent: str, start: tuple[float, float], velocity: tuple[float, float], duration: float = 12.0) -> Track:
    time = np.arange(0.0, duration, 0.1)
    return track(agent, np.array(start) + time[:, None] * np.array(velocity), step=0.1)
