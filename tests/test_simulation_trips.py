"""Trips through recorded crowds are long, start safely, and a blind robot could not make them."""

import numpy as np
import pytest

from sidestep.errors import InvalidInput
from sidestep.simulation.recordings import Recording, Track
from sidestep.simulation.trips import choose_trip

LIMITS = {"speed": 1.0, "contact": 0.6, "clearance": 0.7}


def crowd(people=12, size=14.0, seed=0, duration=60.0):
    """People who cross a square from side to side, again and again."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration, 0.4)
    tracks = []
    for i in range(people):
        phase, lane = rng.uniform(0, 2 * size), rng.uniform(0, size)
        x = np.abs((1.2 * time + phase) % (2 * size) - size)
        positions = np.stack([x, np.full_like(x, lane)], axis=1)
        tracks.append(Track(agent=str(i), kind="ped", time=time, positions=positions[:, :: 1 if i % 2 else -1]))
    return Recording(name="made", tracks=tuple(tracks))


@pytest.mark.parametrize("seed", range(8))
def test_trips_are_what_they_promise(seed):
    scene = crowd(seed=seed)
    trip = choose_trip(scene, np.random.default_rng(seed), **LIMITS)
    start, goal = np.array(trip.start), np.array(trip.goal)
    assert 7.0 <= np.linalg.norm(goal - start) <= 10.0
    fine = np.arange(0.0, trip.shortest, 0.02)
    blind = start + np.minimum(fine / np.linalg.norm(goal - start), 1.0)[:, None] * (goal - start)
    gaps = np.array([np.linalg.norm(t.at(trip.time + fine) - blind, axis=1) for t in scene.tracks])
    assert np.nanmin(gaps) < 0.6
    assert np.nanmin(gaps[:, 0]) >= 1.5 - 1e-3


def test_a_given_start_and_seed_are_kept():
    scene = crowd()
    a, b = (choose_trip(scene, np.random.default_rng(3), time=8.0, **LIMITS) for _ in range(2))
    assert a == b
    assert a.time == 8.0


def test_where_no_trip_fits_the_scene_is_named():
    time = np.arange(0.0, 3.0, 0.4)
    lone = Track(agent="a", kind="ped", time=time, positions=np.zeros((len(time), 2)))
    with pytest.raises(InvalidInput, match="scene: got 'tiny'"):
        choose_trip(Recording(name="tiny", tracks=(lone,)), np.random.default_rng(0), **LIMITS)
    with pytest.raises(InvalidInput, match="with people in it"):
        choose_trip(Recording(name="tiny", tracks=()), np.random.default_rng(0), **LIMITS)
