"""Masses of people, made by hand: small lattices pushed with a fixed action distribution."""

from __future__ import annotations

from itertools import product

import numpy as np

from sidestep.lattice import Lattice, heading_rotation
from sidestep.prediction.collision import PersonMass


def still_person(horizon, position):
    """Somebody who certainly stays where they are; steps and midway."""
    position = np.asarray(position, dtype=float)
    d = position.size
    steps = np.zeros((horizon + 1, *(2 * horizon + 1,) * d))
    steps[(slice(None), *(horizon,) * d)] = 1.0
    midway = []
    for k in range(horizon):
        block = np.zeros((2 * (2 * k + 1) + 1,) * d)
        block[(2 * k + 1,) * d] = 1.0
        midway.append(block)
    lattice = Lattice(origin=position, spacing=0.25, radius=horizon)
    return PersonMass.of(lattice=lattice, steps=steps, midway=midway, reach=1)


def person(
    *, horizon=4, position=(1.5, 0.0), heading=np.pi, speed=0.25, straight=0.8, reach=1, turn=None, spread=False,
    midway=True, weights=(0.5, 0.3, 0.2), rates=(0.05, 0.15, 0.5),
):  # fmt: skip
    """Somebody who goes straight on with probability `straight`, else anywhere; `speed` in m per step and cell."""
    d = len(position)
    turn = np.eye(d) if turn is None else turn
    direction = np.zeros(d)
    direction[0] = np.cos(heading)
    if d > 1:
        direction[1] = np.sin(heading)
    rotation = turn @ heading_rotation(direction)
    actions = np.array(list(product(range(-reach, reach + 1), repeat=d)))
    chances = np.full(len(actions), (1 - straight) / len(actions))
    ahead = np.zeros(d)
    ahead[0] = reach
    chances[np.all(actions == ahead, axis=1)] += straight
    radius = reach * horizon
    steps = np.zeros((horizon + 1, *(2 * radius + 1,) * d))
    steps[(0, *(radius,) * d)] = 1.0
    halves = []
    for k in range(horizon):
        half = np.zeros((2 * reach * (2 * k + 1) + 1,) * d)
        for cell in np.argwhere(steps[k] > 0):
            for action, p in zip(actions, chances, strict=True):
                steps[k + 1][tuple(cell + action)] += p * steps[k][tuple(cell)]
                half[tuple(2 * (cell - radius) + action + reach * (2 * k + 1))] += p * steps[k][tuple(cell)]
        halves.append(half)
    more = {}
    if spread:
        t = 0.25 * np.arange(2 * horizon + 1)[:, None]
        more = {"weights": np.array(weights), "sigmas": np.sqrt(0.03**2 + (np.array(rates) * t**1.5) ** 2)}
    lattice = Lattice(origin=turn @ np.asarray(position, dtype=float), spacing=speed, radius=radius, rotation=rotation)
    return PersonMass.of(lattice=lattice, steps=steps, midway=halves if midway else (), reach=reach, **more)
