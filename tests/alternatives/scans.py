"""Beams, grids and trees by the definitions, slowly."""

from __future__ import annotations

import math

import numpy as np


def first_hit(origin, bearing, time, segments, discs, range_max):
    """(distance, index, squareness) of one beam; (inf, −1, 0) where nothing is nearer than `range_max`."""
    direction = np.array([math.cos(bearing), math.sin(bearing)])
    found = (math.inf, -1, 0.0)
    for index, (ax, ay, bx, by) in enumerate(segments):
        along = np.array([bx - ax, by - ay])
        system = np.stack([direction, -along], axis=1)
        if abs(np.linalg.det(system)) < 1e-12:
            continue
        distance, share = np.linalg.solve(system, np.array([ax, ay]) - origin)
        if distance > 0 and 0 <= share <= 1 and distance < min(found[0], range_max):
            normal = np.array([-along[1], along[0]]) / np.hypot(*along)
            found = (float(distance), index, abs(float(normal @ direction)))
    for index, (x, y, radius, vx, vy) in enumerate(discs):
        centre = np.array([x + time * vx, y + time * vy])
        from_centre = origin - centre
        middle = from_centre @ direction
        inside = middle**2 - (from_centre @ from_centre - radius**2)  # |origin + s·direction − centre|² = radius²
        if inside <= 0:
            continue
        distance = -middle - math.sqrt(inside)
        if 0 < distance < min(found[0], range_max):
            normal = (from_centre + distance * direction) / radius
            found = (float(distance), len(segments) + index, abs(float(normal @ direction)))
    return found


def cells_on_line(origin, end, corner, spacing, shape):
    """Cells met by points set densely along the line."""
    shares = np.linspace(0.0, 1.0, 4001)[:, None]
    cells = np.floor((origin + shares * (end - origin) - corner) / spacing).astype(int)
    cells = cells[np.all((cells >= 0) & (cells < shape), axis=1)]
    grid = np.zeros(shape, dtype=bool)
    grid[cells[:, 0], cells[:, 1]] = True
    return grid


def tree_values(samples, roots, features, thresholds, children, values, outputs):
    """Sum of leaves, one recursive walk at a time."""

    def walk(sample, node):
        if features[node] < 0:
            return float(values[node])
        left, right = children[node]
        return walk(sample, left if np.float32(sample[features[node]]) <= thresholds[node] else right)

    out = np.zeros((len(samples), outputs))
    for i, sample in enumerate(samples):
        for t, root in enumerate(roots):
            out[i, t % outputs] += walk(sample, root)
    return out


class DenseKalman:
    """The constant-velocity filter of one person with whole matrices: x, y, vx, vy."""

    def __init__(self, position, variance, speed):
        self.mean = np.array([*position, 0.0, 0.0])
        self.covariance = np.diag([variance, variance, speed**2, speed**2])

    def predict(self, duration, agility):
        step = np.eye(4) + duration * np.eye(4, k=2)
        block = agility * np.array([[duration**3 / 3, duration**2 / 2], [duration**2 / 2, duration]])
        self.mean = step @ self.mean
        self.covariance = step @ self.covariance @ step.T + np.kron(block, np.eye(2))

    def correct(self, measured, variance, delay):
        look = np.hstack([np.eye(2), delay * np.eye(2)])
        gain = self.covariance @ look.T @ np.linalg.inv(look @ self.covariance @ look.T + variance * np.eye(2))
        self.mean = self.mean + gain @ (measured - look @ self.mean)
        self.covariance = (np.eye(4) - gain @ look) @ self.covariance
