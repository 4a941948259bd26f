"""Risk by the definitions, slowly."""

from __future__ import annotations

import numpy as np
from scipy.stats import ncx2


def places(person, block):
    """World positions (cells, d) and masses of one block, from the lattice's definition."""
    lattice = person.lattice
    r = int(person.radii[block])
    spacing = lattice.spacing if block % 2 == 0 else 0.5 * lattice.spacing
    axis = spacing * np.arange(-r, r + 1)
    local = np.stack(np.meshgrid(*([axis] * lattice.dimension), indexing="ij"), axis=-1).reshape(-1, lattice.dimension)
    return local @ lattice.rotation.T + lattice.origin, person.flat[person.offsets[block] : person.offsets[block + 1]]


def share_within(apart, radius, sigma, dimension):
    """P(‖y + σ·n‖ < radius), ‖y‖ = apart."""
    if sigma == 0.0:
        return (apart < radius * (1 - 1e-9)).astype(float)
    return ncx2.cdf((radius / sigma) ** 2, dimension, (apart / sigma) ** 2)


def risk_at(people, distances, block, point):
    """1 − Π_h (1 − P_h) at one point, cell by cell."""
    clear = 1.0
    for person, distance in zip(people, distances, strict=True):
        cells, masses = places(person, block)
        if len(masses) == 0:
            continue
        apart = np.linalg.norm(cells - point, axis=1)
        near = np.zeros(len(apart))
        weights = [1.0] if person.weights is None else person.weights
        sigmas = [0.0] if person.sigmas is None else person.sigmas[block]
        for w, s in zip(weights, sigmas, strict=True):
            near += w * share_within(apart, distance, s, person.lattice.dimension)
        clear *= 1.0 - min(1.0, float(masses @ near))
    return 1.0 - clear


def sweep(start, velocity, position, actions, probabilities, distance, interval, samples=4001):
    """P(closer than `distance` at any of many instants), position known exactly."""
    t = np.linspace(0.0, interval, samples)[:, None]
    total = 0.0
    for action, p in zip(actions, probabilities, strict=True):
        gap = np.linalg.norm((position + t * action) - (start + t * velocity), axis=1).min()
        total += p * (gap < distance)
    return total
