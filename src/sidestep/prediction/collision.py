"""The probability that somebody is close to the robot, and the risk rules that limit it (Eq. 9f).

Half instants count twice as fast as steps: half instant 2k is step k, 2k+1 lies midway between the steps k and k+1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.risk import mass_near, mass_within
from sidestep._kernels.risk_along import mass_near_along, mass_within_along
from sidestep._kernels.risk_profile import blob_table
from sidestep._kernels.risk_raster import rasterise_all
from sidestep.lazily import lazy
from sidestep.prediction.person_mass import PersonMass, active_axes, embedded, embedded_point
from sidestep.prediction.profiles import profile_of
from sidestep.types import FloatArray, IntArray, Path

Clouds = tuple[FloatArray, FloatArray, IntArray, FloatArray, FloatArray, FloatArray]
Boxes = tuple[IntArray, IntArray]
"""Lowest cells and numbers of cells of boxes among three axes."""


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

    @lazy
    def blocks(self) -> int:
        """Half instants B = 2N+1 that are known; 0 when there is nobody."""
        return len(self.people[0].radii) if self.people else 0

    @lazy
    def has_midway(self) -> bool:
        """True if the risk between the steps is to be looked at, and known."""
        return self.midway and any(p.offsets[2] > p.offsets[1] for p in self.people if len(p.radii) > 1)

    @lazy
    def _evaluators(self) -> list[_Sharp | _Blurred]:
        pairs = zip(self.people, self.distances, strict=True)
        return [_Blurred(p, float(r)) if p.spread else _Sharp(p, float(r)) for p, r in pairs]

    def per_person(self, instants: IntArray, points: FloatArray) -> FloatArray:
        """Return (P, M) the probability that each person is close to a point at a half instant.

        Args:
            instants: (M,) half instants, 0 ≤ · < B.
            points: (M, d) m.
        """
        places = embedded(points)
        index = np.ascontiguousarray(instants, dtype=np.int64)
        out = np.empty((len(self.people), len(points)))
        for row, evaluator in zip(out, self._evaluators, strict=True):
            row[:] = evaluator.at(index, places)
        return out

    def at(self, instant: int, points: FloatArray) -> FloatArray:
        """Return (M,) the probability that somebody is close to each of the `points` (M, d) m at a half instant."""
        return self.at_instants(np.full(len(points), instant, dtype=np.int64), points)

    def at_instants(self, instants: IntArray, points: FloatArray) -> FloatArray:
        """Return (M,) the probability that somebody is close to each point (M, d) m at its half instant (M,)."""
        return 1.0 - np.prod(1.0 - self.per_person(instants, points), axis=0)

    def along(self, path: Path) -> FloatArray:
        """Return (2N,) the probability at half instants 1..2N for a robot on `path` (N+1, d) m, straight between steps.

        Half instants between the steps are 0 where they are not looked at.
        """
        if not self.people or len(path) < 2:
            return np.zeros(2 * (len(path) - 1))
        midway, first = self.has_midway, self._evaluators[0]
        if len(self.people) == 1:
            return first.along(path, midway)
        none = 1.0 - first.along(path, midway)
        for evaluator in self._evaluators[1:]:
            none *= 1.0 - evaluator.along(path, midway)
        return 1.0 - none

    def raster(
        self, instant: int, origin: FloatArray, spacing: float, radius: int, *, limit: float = 0.02
    ) -> NDArray[np.float32]:
        """Return the probability over the (2·radius+1)^d places origin + spacing·i at a half instant.

        Equal to `at` without spread; with spread an approximation that serves `limit` (see `_kernels.risk_raster`).
        """
        d = len(origin)
        active = active_axes(d)
        if not self.people:
            return np.zeros((2 * radius + 1,) * d, dtype=np.float32)
        cells, masses, begin, distances, weights, sigmas = self._clouds(0.0)
        alone = np.ascontiguousarray(begin[:, [instant, instant, instant + 1]])  # as if it were the only one after 0
        corner, size = np.zeros((2, 3), dtype=np.int64), np.ones((2, 3), dtype=np.int64)
        corner[1], size[1] = -radius * active, 2 * radius * active + 1
        values, _, _ = rasterise_all(
            cells, masses, alone, distances, weights, np.ascontiguousarray(sigmas[:, [instant, instant]]),
            embedded_point(np.asarray(origin, dtype=np.float64)), spacing, active, blob_table(d), limit, True,
            corner, size,
        )  # fmt: skip
        return values.reshape((2 * radius + 1,) * d)

    def rasters(self, origin: FloatArray, spacing: float, boxes: Boxes, limit: float = 0.02) -> RiskRasters:
        """Return the probability at all places of a lattice that lie in the `boxes` of the half instants, or in more.

        Args:
            origin: (d,) m, cell 0.
            spacing: m.
            boxes: lowest cells (B, 3) and numbers of cells (B, 3); see `all_in_reach`.
            limit: the risk limit that the rasters shall serve; tails of 2 % of it are left out per person.
        """
        key = origin.tobytes(), spacing, limit
        known = self._drawn.get(key)
        if known is None or not known.cover(boxes):
            known = self._drawn[key] = self.draw(origin, spacing, boxes, limit)
        return known

    def draw(self, origin: FloatArray, spacing: float, boxes: Boxes, limit: float = 0.02) -> RiskRasters:
        """Return the `rasters` of just these boxes, made anew."""
        d = len(origin)
        values, starts, some = rasterise_all(
            *self._clouds(0.02 * limit), embedded_point(origin), spacing, active_axes(d), blob_table(d), limit,
            self.has_midway, *boxes,
        )  # fmt: skip
        return RiskRasters(values=values, starts=starts, some=some, boxes=boxes)

    @lazy
    def _drawn(self) -> dict[tuple[bytes, float, float], RiskRasters]:
        """What `rasters` has drawn last, by where and for which limit: a graded search looks where another has."""
        return {}

    @lazy
    def _listed(self) -> dict[float, Clouds]:
        """What `_clouds` has made, by tolerance: a search that looks again draws the same people."""
        return {}

    def _clouds(self, tolerance: float) -> Clouds:
        """Everybody's cells (·, 3) m, masses, starts (P, B+1), distances (P,), weights (P, C), sigmas (P, B, C)."""
        if tolerance not in self._listed:
            self._listed[tolerance] = self._clouds_anew(tolerance)
        return self._listed[tolerance]

    def _clouds_anew(self, tolerance: float) -> Clouds:
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
        if threshold not in self._above:
            marked = [
                PersonMass(
                    lattice=p.lattice, flat=(p.flat >= threshold).astype(np.float64), offsets=p.offsets, radii=p.radii
                )
                for p in self.people
            ]
            self._above[threshold] = RiskField(people=marked, distances=self.distances, midway=False)
        return self._above[threshold]

    @lazy
    def _above(self) -> dict[float, RiskField]:
        """What `cells_above` has made, by threshold: a path is searched and judged under the same people."""
        return {}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RiskRasters:
    """The risk over the robot's lattice at all half instants; laid out as `_kernels.risk_raster.rasterise_all` says.

    Attributes:
        values: flat; starts: (B+1,) where the half instants start; some: (B,) whether anything is above zero.
        boxes: that they cover: lowest cells (B, 3), counted from the robot, and numbers of cells (B, 3).
    """

    values: NDArray[np.float32]
    starts: IntArray
    some: NDArray[np.bool_]
    boxes: Boxes

    def cover(self, boxes: Boxes) -> bool:
        """Whether everything in these boxes is here."""
        (low, size), (first, count) = self.boxes, boxes
        return bool((low <= first).all() and (first + count <= low + size).all())

    @classmethod
    def nobody(cls, boxes: Boxes) -> RiskRasters:
        """Return the rasters of an empty world."""
        blocks = len(boxes[0])
        return cls(
            values=np.zeros(0, dtype=np.float32),
            starts=np.zeros(blocks + 1, dtype=np.int64),
            some=np.zeros(blocks, dtype=np.bool_),
            boxes=boxes,
        )


@lru_cache(maxsize=64)
def all_in_reach(horizon: int, radius: int, dimension: int) -> Boxes:
    """Return the boxes (2N+1, 3) of a robot that moves ≤ `radius` cells per axis and step, for `RiskField.rasters`."""
    half = ((radius * np.arange(2 * horizon + 1) + 1) // 2)[:, None] * active_axes(dimension)
    low, size = -half, 2 * half + 1
    low.setflags(write=False)
    size.setflags(write=False)
    return low, size


class _Sharp:
    """Evaluates one person without spread: sums the cells within the distance."""

    def __init__(self, person: PersonMass, distance: float) -> None:
        mass = person.flat, person.offsets, person.radii, person.spacings
        self._arguments = *mass, *person.frame, distance

    def at(self, instants: IntArray, points: FloatArray) -> FloatArray:
        """(M,) at `points` (M, 3) m and half instants (M,)."""
        return mass_within(points, instants, *self._arguments)

    def along(self, path: Path, midway: bool) -> FloatArray:
        """(2N,) along `path` (N+1, d) m; 0 between the steps if not `midway`."""
        return mass_within_along(path, midway, *self._arguments)


class _Blurred:
    """Evaluates one person with spread: sums the cells in reach, each with its share within the distance."""

    def __init__(self, person: PersonMass, distance: float) -> None:
        profile = person.profile
        if profile is None:
            assert person.weights is not None
            assert person.sigmas is not None
            sigmas = np.ascontiguousarray(person.sigmas, dtype=np.float64)
            weights = np.ascontiguousarray(person.weights, dtype=np.float64)
            profile = profile_of(distance, weights, sigmas, person.lattice.dimension)
        mass = person.flat, person.offsets, person.radii, person.spacings
        self._arguments = *mass, *person.frame, *person.spans, *profile

    def at(self, instants: IntArray, points: FloatArray) -> FloatArray:
        """(M,) at `points` (M, 3) m and half instants (M,)."""
        return mass_near(points, instants, *self._arguments)

    def along(self, path: Path, midway: bool) -> FloatArray:
        """(2N,) along `path` (N+1, d) m; 0 between the steps if not `midway`."""
        return mass_near_along(path, midway, *self._arguments)
