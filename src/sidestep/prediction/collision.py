"""The probability that somebody is close to the robot, and the risk rules that limit it (Eq. 9f).

Half instants count twice as fast as steps: half instant 2k is step k, 2k+1 lies midway between the steps k and k+1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.risk import compact, mass_near, mass_within
from sidestep._kernels.risk_profile import blob_table, profiles
from sidestep._kernels.risk_raster import rasterise, rasterise_all
from sidestep.lattice import Lattice
from sidestep.types import FloatArray, IntArray, Path

if TYPE_CHECKING:
    from sidestep.prediction.occupancy import Prediction

EXACT = 1e-5
"""Probability that evaluations of a spread-out person may leave out, and then add as if it were near."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PersonMass:
    """Where one person may be, at steps and midway, as one flat array.

    Attributes:
        lattice: cells at the steps (spacing s); midway the same axes with spacing s/2.
        flat: all blocks one after another; block b is the mass at half instant b, last axis fastest.
        offsets: (B+1,) where the blocks start; radii: (B,) cells from the anchor to each face; B = 2N+1.
            An empty block (midway not predicted) has offsets[b] == offsets[b+1].
        weights: (C,) probabilities of the spread classes; sigmas: (B, C) m. None: no spread.
    """

    lattice: Lattice
    flat: FloatArray
    offsets: IntArray
    radii: IntArray
    weights: FloatArray | None = None
    sigmas: FloatArray | None = None

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
        return cls(lattice=lattice, flat=flat, offsets=offsets, radii=radii, weights=weights, sigmas=sigmas)

    @classmethod
    def of_prediction(
        cls, prediction: Prediction, *, weights: FloatArray | None = None, sigmas: FloatArray | None = None
    ) -> PersonMass:
        """Collect the mass of a `Prediction`; `weights` (C,) and `sigmas` (2N+1, C) m as for the class."""
        occupancy = prediction.occupancy
        return cls.of(
            lattice=occupancy.lattice,
            steps=occupancy.probability,
            midway=prediction.midway,
            reach=occupancy.lattice.radius // max(1, len(occupancy) - 1),
            weights=weights,
            sigmas=sigmas,
        )

    @property
    def spacings(self) -> FloatArray:
        """(B,) m between the cells of each block."""
        s = np.full(self.radii.size, self.lattice.spacing)
        s[1::2] *= 0.5
        return s

    @property
    def spread(self) -> bool:
        """True if positions are blurred."""
        return self.sigmas is not None and self.weights is not None and bool(np.any(self.sigmas > 0))

    def cells(self, tolerance: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return the cells (·, 3) m that matter, their masses, and (B+1,) where the blocks start in them.

        Args:
            tolerance: mass that may be left out of each block.
        """
        return compact(self.flat, self.offsets, self.radii, self.spacings, *_frame(self.lattice), tolerance)


@dataclass(frozen=True, kw_only=True, eq=False)
class RiskField:
    """P(somebody is closer than a distance), as a function of place and half instant: 1 − Π_h (1 − P_h).

    Attributes:
        people: one `PersonMass` each; all with the same number of blocks.
        distances: (P,) m, closer than which counts, per person.
        midway: evaluate the half instants between the steps too.
    """

    people: Sequence[PersonMass]
    distances: FloatArray
    midway: bool = True

    @cached_property
    def blocks(self) -> int:
        """Half instants B = 2N+1 that are known; 0 when there is nobody."""
        return len(self.people[0].radii) if self.people else 0

    @cached_property
    def has_midway(self) -> bool:
        """True if the risk between the steps is to be looked at, and known."""
        return self.midway and any(p.offsets[2] > p.offsets[1] for p in self.people if len(p.radii) > 1)

    @cached_property
    def _evaluators(self) -> list[_Sharp | _Blurred]:
        pairs = zip(self.people, self.distances, strict=True)
        return [_Blurred.of(p, float(r)) if p.spread else _Sharp.of(p, float(r)) for p, r in pairs]

    def per_person(self, instants: IntArray, points: FloatArray) -> FloatArray:
        """Return (P, M) the probability that each person is close to a point at a half instant.

        Args:
            instants: (M,) half instants, 0 ≤ · < B.
            points: (M, d) m.
        """
        embedded = _embed(points)
        index = np.ascontiguousarray(instants, dtype=np.int64)
        out = np.empty((len(self.people), len(points)))
        for row, evaluator in zip(out, self._evaluators, strict=True):
            row[:] = evaluator.at(index, embedded)
        return out

    def at(self, instant: int, points: FloatArray) -> FloatArray:
        """Return (M,) the probability that somebody is close to each of the `points` (M, d) m at a half instant."""
        index = np.full(len(points), instant, dtype=np.int64)
        return 1.0 - np.prod(1.0 - self.per_person(index, points), axis=0)

    def along(self, path: Path) -> FloatArray:
        """Return (2N,) the probability at half instants 1..2N for a robot on `path` (N+1, d) m, straight between steps.

        Half instants between the steps are 0 where they are not looked at.
        """
        steps = len(path) - 1
        if not self.people or steps == 0:
            return np.zeros(2 * steps)
        doubled = np.empty((2 * steps, path.shape[1]))
        doubled[0::2] = 0.5 * (path[:-1] + path[1:])
        doubled[1::2] = path[1:]
        out = 1.0 - np.prod(1.0 - self.per_person(np.arange(1, 2 * steps + 1), doubled), axis=0)
        if not self.has_midway:
            out[0::2] = 0.0
        return out

    def raster(
        self, instant: int, origin: FloatArray, spacing: float, radius: int, *, limit: float = 0.02
    ) -> NDArray[np.float32]:
        """Return the probability over the (2·radius+1)^d places origin + spacing·i at a half instant.

        Equal to `at` without spread; with spread an approximation that serves `limit` (see `_kernels.risk_raster`).
        """
        d = len(origin)
        active = _active(d)
        half = radius * active
        w0, w1, w2 = (int(w) for w in 2 * half + 1)
        out = np.zeros((w0, w1, w2), dtype=np.float32)
        if self.people:
            clouds = self._clouds(0.0)
            ends = np.zeros((w0, w1 + 1, w2))
            place = _embed_point(np.asarray(origin, dtype=np.float64))
            rasterise(*clouds, place, spacing, instant, half, active, blob_table(d), limit, ends, out)
        return out.reshape((2 * radius + 1,) * d)

    def rasters(self, origin: FloatArray, spacing: float, radius: int, limit: float = 0.02) -> RiskRasters:
        """Return the probability at all places that a robot may reach which moves ≤ `radius` cells per axis and step.

        Args:
            origin: (d,) m.
            spacing: m.
            radius: cells per step.
            limit: the risk limit that the rasters shall serve; tails of 2 % of it are left out per person.
        """
        d = len(origin)
        values, starts, some = rasterise_all(
            *self._clouds(0.02 * limit), _embed_point(origin), spacing, radius, _active(d), blob_table(d), limit,
            self.has_midway,
        )  # fmt: skip
        return RiskRasters(values=values, starts=starts, some=some)

    def _clouds(self, tolerance: float) -> tuple[FloatArray, FloatArray, IntArray, FloatArray, FloatArray, FloatArray]:
        """Everybody's cells (·, 3) m, masses, starts (P, B+1), distances (P,), class weights (P, C), sigmas (P, B, C)."""
        listed = [p.cells(tolerance) for p in self.people]
        classes = max(1, max(0 if p.weights is None else len(p.weights) for p in self.people))
        weights = np.zeros((len(self.people), classes))
        sigmas = np.zeros((len(self.people), self.blocks, classes))
        starts = np.empty((len(self.people), self.blocks + 1), dtype=np.int64)
        at = 0
        for h, (person, (_, masses, begin)) in enumerate(zip(self.people, listed, strict=True)):
            starts[h] = begin + at
            at += len(masses)
            if person.spread and person.weights is not None and person.sigmas is not None:
                weights[h, : len(person.weights)] = person.weights
                sigmas[h, :, : len(person.weights)] = person.sigmas
            else:
                weights[h, 0] = 1.0
        if len(listed) == 1:
            return listed[0][0], listed[0][1], starts, self.distances, weights, sigmas
        cells = np.concatenate([x for x, _, _ in listed])
        masses = np.concatenate([m for _, m, _ in listed])
        return cells, masses, starts, self.distances, weights, sigmas

    def cells_above(self, threshold: float) -> RiskField:
        """Rule `cells` of the paper: a field that is 1 within the distance of any cell with P ≥ `threshold`, else 0.

        Only the steps count, as in the paper's Section IV; the spread is ignored.
        """
        marked = [
            PersonMass(
                lattice=p.lattice, flat=(p.flat >= threshold).astype(np.float64), offsets=p.offsets, radii=p.radii
            )
            for p in self.people
        ]
        return RiskField(people=marked, distances=self.distances, midway=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RiskRasters:
    """The risk over the robot's lattice at all half instants; laid out as `_kernels.risk.rasterise_all` says.

    Attributes:
        values: flat; starts: (B+1,) where the half instants start; some: (B,) whether anything is above zero.
    """

    values: NDArray[np.float32]
    starts: IntArray
    some: NDArray[np.bool_]

    @classmethod
    def nobody(cls, horizon: int) -> RiskRasters:
        """Return the rasters of an empty world."""
        blocks = 2 * horizon + 1
        return cls(
            values=np.zeros(0, dtype=np.float32),
            starts=np.zeros(blocks + 1, dtype=np.int64),
            some=np.zeros(blocks, dtype=np.bool_),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Sharp:
    """Evaluates one person without spread: sums the cells within the distance."""

    person: PersonMass
    spacings: FloatArray
    frame: tuple[FloatArray, FloatArray, IntArray]
    distance: float

    @classmethod
    def of(cls, person: PersonMass, distance: float) -> _Sharp:
        return cls(person, person.spacings, _frame(person.lattice), distance)

    def at(self, instants: IntArray, points: FloatArray) -> FloatArray:
        person = self.person
        return mass_within(
            points, instants, person.flat, person.offsets, person.radii, self.spacings, *self.frame, self.distance
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Blurred:
    """Evaluates one person with spread: sums all cells that matter, each with its share within the distance."""

    listed: tuple[FloatArray, FloatArray, IntArray]
    samples: FloatArray
    grids: FloatArray

    @classmethod
    def of(cls, person: PersonMass, distance: float) -> _Blurred:
        assert person.weights is not None and person.sigmas is not None
        table = blob_table(person.lattice.dimension)
        sigmas = np.ascontiguousarray(person.sigmas, dtype=np.float64)
        samples, grids = profiles(distance, np.ascontiguousarray(person.weights, dtype=np.float64), sigmas, table)
        return cls(person.cells(EXACT), samples, grids)

    def at(self, instants: IntArray, points: FloatArray) -> FloatArray:
        return np.minimum(mass_near(points, instants, *self.listed, self.samples, self.grids) + EXACT, 1.0)


def _active(dimension: int) -> IntArray:
    """(3,) 1 for the axes that exist; they are the last ones."""
    return (np.arange(3) >= 3 - dimension).astype(np.int64)


def _embed(points: FloatArray) -> FloatArray:
    """(M, d) → (M, 3), the missing leading axes at 0."""
    out = np.zeros((len(points), 3))
    out[:, 3 - points.shape[1] :] = points
    return out


def _embed_point(point: FloatArray) -> FloatArray:
    out = np.zeros(3)
    out[3 - len(point) :] = point
    return out


def _frame(lattice: Lattice) -> tuple[FloatArray, FloatArray, IntArray]:
    """Origin (3,), rotation (3, 3) and active axes (3,) of a lattice among three axes."""
    d = lattice.dimension
    rotation = np.eye(3)
    rotation[3 - d :, 3 - d :] = lattice.rotation
    return _embed_point(lattice.origin), rotation, _active(d)
