"""One person's mass at the steps and midway, in the form that the risk is computed from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sidestep._kernels.risk import EXACT, compact, row_spans
from sidestep.lattice import Lattice
from sidestep.lazily import lazy
from sidestep.prediction.profiles import Profile
from sidestep.types import FloatArray, IntArray, sealed

if TYPE_CHECKING:
    from sidestep.prediction.occupancy import Prediction


@dataclass(frozen=True, kw_only=True, eq=False)
class PersonMass:
    """Where one person may be, at steps and midway, as one flat array.

    Attributes:
        lattice: cells at the steps (spacing s); midway the same axes with spacing s/2.
        flat: all blocks one after another; block b is the mass at half instant b, last axis fastest.
        offsets: (B+1,) where the blocks start; radii: (B,) cells from the anchor to each face; B = 2N+1.
            An empty block (midway not predicted) has offsets[b] == offsets[b+1].
        weights: (C,) probabilities of the spread classes; sigmas: (B, C) m. None: no spread.
        profile: of `profile_of` for the distance that the risk asks for; None: made when asked.
    """

    lattice: Lattice
    flat: FloatArray
    offsets: IntArray
    radii: IntArray
    weights: FloatArray | None = None
    sigmas: FloatArray | None = None
    profile: Profile | None = None

    @classmethod
    def of(
        cls,
        *,
        lattice: Lattice,
        steps: FloatArray,
        midway: Sequence[FloatArray] = (),
        reach: int = 2,
        weights: FloatArray | None = None,
        sigmas: FloatArray | None = None,
        profile: Profile | None = None,
    ) -> PersonMass:
        """Collect the mass at steps (N+1, cells…; radius reach·N) and midway (N arrays, radius reach·(2k+1)).

        Cells farther than reach·k from the anchor hold no mass at step k and are dropped.
        """
        horizon = len(steps) - 1
        blocks: list[FloatArray] = []
        radii = np.zeros(2 * horizon + 1, dtype=np.int64)
        for b in range(2 * horizon + 1):
            k = b // 2
            if b % 2 == 0:
                radii[b] = min(reach * k, lattice.radius)
                cut = slice(lattice.radius - radii[b], lattice.radius + radii[b] + 1)
                blocks.append(steps[k][(cut,) * lattice.dimension].ravel())
            elif midway:
                radii[b] = midway[k].shape[0] // 2
                blocks.append(midway[k].ravel())
            else:
                blocks.append(np.zeros(0))
        offsets = np.concatenate([[0], np.cumsum([x.size for x in blocks])]).astype(np.int64)
        flat = np.concatenate(blocks).astype(np.float64, copy=False)
        return cls(
            lattice=lattice, flat=flat, offsets=offsets, radii=radii, weights=weights, sigmas=sigmas, profile=profile
        )

    @classmethod
    def of_prediction(
        cls,
        prediction: Prediction,
        *,
        weights: FloatArray | None = None,
        sigmas: FloatArray | None = None,
        profile: Profile | None = None,
    ) -> PersonMass:
        """Collect the mass of a `Prediction`; `weights` (C,), `sigmas` (2N+1, C) m and `profile` as for the class."""
        return cls(
            lattice=prediction.occupancy.lattice,
            flat=prediction.blocks, offsets=prediction.offsets, radii=prediction.radii,
            weights=weights, sigmas=sigmas, profile=profile,
        )  # fmt: skip

    @lazy
    def frame(self) -> tuple[FloatArray, FloatArray, IntArray]:
        """Origin (3,), rotation (3, 3) and active axes (3,) of the lattice among three axes."""
        return frame_of_lattice(self.lattice)

    @lazy
    def spacings(self) -> FloatArray:
        """(B,) m between the cells of each block."""
        return self.lattice.spacing * _halved_midway(self.radii.size)

    @lazy
    def spans(self) -> tuple[IntArray, IntArray, FloatArray]:
        """Where the mass lies in the rows of every block, all but `EXACT` of it; see `_kernels.risk.row_spans`."""
        return row_spans(self.flat, self.offsets, self.radii, self.frame[2], EXACT)

    @lazy
    def spread(self) -> bool:
        """True if positions are blurred."""
        return self.sigmas is not None and self.weights is not None and bool(self.sigmas.max() > 0)

    def cells(self, tolerance: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return the cells (·, 3) m that matter, their masses, and (B+1,) where the blocks start in them.

        Args:
            tolerance: mass that may be left out of each block.
        """
        where = self.flat, self.offsets, self.radii
        spans = self.spans if tolerance >= EXACT else row_spans(*where, self.frame[2], 0.0)
        return compact(*where, self.spacings, *self.frame, *spans, tolerance)


@lru_cache(maxsize=64)
def _halved_midway(blocks: int) -> FloatArray:
    """(B,) 1 at the steps, ½ midway."""
    return sealed(np.where(np.arange(blocks) % 2 == 0, 1.0, 0.5))


@lru_cache(maxsize=3)
def active_axes(dimension: int) -> IntArray:
    """(3,) 1 for the axes that exist; they are the last ones."""
    return (np.arange(3) >= 3 - dimension).astype(np.int64)


def embedded(points: FloatArray) -> FloatArray:
    """(M, d) → (M, 3), the missing leading axes at 0."""
    out = np.zeros((len(points), 3))
    out[:, 3 - points.shape[1] :] = points
    return out


def embedded_point(point: FloatArray) -> FloatArray:
    """(d,) → (3,), the missing leading axes at 0."""
    out = np.zeros(3)
    out[3 - len(point) :] = point
    return out


def frame_of_lattice(lattice: Lattice) -> tuple[FloatArray, FloatArray, IntArray]:
    """Origin (3,), rotation (3, 3) and active axes (3,) of a lattice among three axes."""
    d = lattice.dimension
    rotation = np.eye(3)
    rotation[3 - d :, 3 - d :] = lattice.rotation
    return embedded_point(lattice.origin), rotation, active_axes(d)
