"""Predicted occupancy → small grey images that a browser can draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.special import ndtr

from sidestep.lattice import Lattice
from sidestep.planning.plan import PersonPlan
from sidestep.types import FloatArray

FAINTEST = 2e-3  # 1/m², the density that is drawn as nothing
STRONGEST = 2.0  # 1/m², and the one that is drawn fully
MOST_INSTANTS = 13
WIDEST_MARGIN = 12  # cells by which a picture grows beyond the lattice
LEAST_WEIGHT = 0.01  # of a steadiness class that is worth drawing


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heat:
    """K images of one person's predicted density, on a logarithmic scale from `FAINTEST` to `STRONGEST`.

    Attributes:
        pixels: (K, rows, columns) 0..255; row i, column j lies at origin + rotation @ (x[i], y[j]).
        instants: steps ahead, K of them.
        origin: (2,) m; rotation: (2, 2); spacing: m.
        first: (2,) m, local coordinates of pixel (0, 0).
    """

    pixels: NDArray[np.uint8]
    instants: tuple[int, ...]
    origin: FloatArray
    rotation: FloatArray
    spacing: float
    first: FloatArray

    def header(self) -> dict[str, Any]:
        """Return what a browser needs beside the pixels."""
        return {
            "shape": list(self.pixels.shape),
            "instants": list(self.instants),
            "origin": np.round(self.origin, 4).tolist(),
            "rotation": np.round(self.rotation, 6).tolist(),
            "spacing": self.spacing,
            "first": np.round(self.first, 4).tolist(),
        }


def heat(person: PersonPlan) -> Heat:
    """Return the images of one person's prediction; 1-D is drawn as a line along x, 3-D from above."""
    instants = _chosen(len(person.occupancy))
    mass = person.occupancy.probability[list(instants)]
    spread = None if person.spread is None else (person.spread[0], person.spread[1][list(instants)])
    return paint(mass, person.occupancy.lattice, instants, spread)


def paint(
    probability: FloatArray,
    lattice: Lattice,
    instants: tuple[int, ...],
    spread: tuple[FloatArray, FloatArray] | None = None,
) -> Heat:
    """Return the images of a prediction.

    Args:
        probability: (K, cells…), mass per cell.
        lattice: the cells.
        instants: K steps ahead.
        spread: (C,) weights and (K, C) m standard deviations of the Gaussians around every cell, or None.
    """
    mass = _flat(probability)
    if spread is not None:
        mass = _spread(mass, *spread, lattice.spacing)
    density = mass / lattice.spacing**2
    scale = np.log(np.maximum(density, 1e-12) / FAINTEST) / np.log(STRONGEST / FAINTEST)
    pixels = np.clip(np.rint(255 * scale), 0, 255).astype(np.uint8)
    rows, columns = _support(pixels)
    half = [(size - 1) // 2 for size in mass.shape[1:]]
    first = lattice.spacing * np.array([rows.start - half[0], columns.start - half[1]], dtype=np.float64)
    origin, rotation = _plane(lattice)
    return Heat(
        pixels=np.ascontiguousarray(pixels[:, rows, columns]),
        instants=instants,
        origin=origin,
        rotation=rotation,
        spacing=lattice.spacing,
        first=first,
    )


def _spread(mass: FloatArray, weights: FloatArray, sigmas: FloatArray, spacing: float) -> FloatArray:
    """Return Σ_c w_c·(mass ∗ Gaussian of σ_c) at every instant, on a grid grown by what spreads over its edge."""
    margin = int(min(np.ceil(2.0 * float((weights * sigmas).sum(axis=1).max()) / spacing), WIDEST_MARGIN))
    worth = weights >= LEAST_WEIGHT
    rows, columns = mass.shape[1:]
    along = _blurs(rows, margin, sigmas[:, worth] / spacing)
    across = along if rows == columns else _blurs(columns, 0, sigmas[:, worth] / spacing)
    spread = along @ mass[:, np.newaxis] @ across.swapaxes(2, 3)  # (K, C, rows, columns)
    return np.einsum("c,kcij->kij", weights[worth], spread)


def _blurs(cells: int, margin: int, sigmas: FloatArray) -> FloatArray:
    """Return (K, C, cells + 2·margin, cells): the share of a cell's mass that each Gaussian (σ in cells) puts where."""
    if cells == 1:
        return np.broadcast_to(np.eye(2 * margin + 1, 1, -margin), (*sigmas.shape, 2 * margin + 1, 1))
    farthest = cells - 1 + margin
    edges = np.arange(-farthest, farthest + 2) - 0.5
    shares = np.diff(ndtr(edges / np.maximum(sigmas, 1e-3)[:, :, np.newaxis]), axis=2)
    windows = sliding_window_view(shares, cells, axis=2)[..., ::-1]  # row i: gaps i − margin − j, j = 0..cells−1
    return np.ascontiguousarray(windows)


def _chosen(count: int) -> tuple[int, ...]:
    """All instants, or evenly chosen ones where there are many; the last one always."""
    if count <= MOST_INSTANTS:
        return tuple(range(count))
    return tuple(int(k) for k in np.unique(np.rint(np.linspace(0, count - 1, MOST_INSTANTS))))


def _flat(probability: FloatArray) -> FloatArray:
    """(K, cells…) → (K, rows, columns): a line becomes one column, a volume is summed along the vertical."""
    if probability.ndim == 2:
        return probability[:, :, np.newaxis]
    return probability.sum(axis=3) if probability.ndim == 4 else probability


def _plane(lattice: Lattice) -> tuple[FloatArray, FloatArray]:
    """Origin and rotation of the lattice, seen from above."""
    origin, rotation = np.zeros(2), np.eye(2)
    d = min(lattice.dimension, 2)
    origin[:d] = lattice.origin[:d]
    if lattice.dimension == 2:
        rotation = np.array(lattice.rotation)
    elif lattice.dimension == 1:
        rotation[0, 0] = lattice.rotation[0, 0]
    return origin, rotation


def _support(pixels: NDArray[np.uint8]) -> tuple[slice, slice]:
    """Rows and columns in which anything is drawn at any instant, with one empty cell around where there is one."""
    seen: NDArray[np.bool_] = np.max(pixels, axis=0) > 0
    slices: list[slice] = []
    for lines in (seen, seen.T):
        used = np.flatnonzero(np.count_nonzero(lines, axis=1))
        size = len(lines)
        slices.append(slice(0, size) if used.size == 0 else slice(max(used[0] - 1, 0), min(used[-1] + 2, size)))
    return slices[0], slices[1]
