"""Cells ↔ positions: the lattice of a person's actions, of spacing v·ΔT, anchored at the measured position."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from operator import mul

import numpy as np

from sidestep.checks import MOST, Checks, measured, measured_number
from sidestep.errors import InvalidInput
from sidestep.types import LARGEST, FloatArray, Vector, VectorLike, finite, frozen_array, sealed

_PLACE = "1, 2 or 3 finite numbers (m)"
_AXES = "(d, d) numbers, columns of length 1 at right angles"
_MEND = "sidestep.lattice.heading_rotation makes one from a direction"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lattice:
    """A box of cells around an origin.

    Cell index i = (i_1, …, i_d), 0 ≤ i_a ≤ 2·radius, has the position origin + rotation @ (spacing · (i − radius)).
    The anchor cell, (radius, …, radius), is the origin itself: nothing is ever rounded.

    Attributes:
        origin: (d,) m, the measured position.
        spacing: m, distance between neighbouring cells (> 0).
        radius: cells from the anchor to each face (≥ 0).
        rotation: (d, d) orthogonal; its columns are the lattice axes in the world frame. Without one: the world's axes.

    Raises:
        InvalidInput: a value is not allowed; one line that names the field.
    """

    origin: Vector
    spacing: float
    radius: int
    rotation: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def __post_init__(self) -> None:
        origin = measured("lattice.origin", self.origin, _PLACE)
        if origin.ndim != 1 or origin.size not in (1, 2, 3) or not finite(origin):
            raise InvalidInput("lattice.origin", self.origin, _PLACE)
        spacing = measured_number("lattice.spacing", self.spacing)
        if not 0.0 < spacing <= LARGEST:
            raise InvalidInput("lattice.spacing", self.spacing, f"a number > 0 and ≤ {LARGEST:g} (m)")
        self._check_radius()
        rotation = measured("lattice.rotation", self.rotation, _AXES)
        if rotation.size == 0:
            rotation = identity(origin.size)
        elif rotation.shape != (origin.size, origin.size) or not _orthogonal(rotation):
            raise InvalidInput("lattice.rotation", self.rotation, _AXES, _MEND)
        for name, value in (("origin", origin), ("spacing", spacing), ("rotation", rotation)):
            object.__setattr__(self, name, value)

    def _check_radius(self) -> None:
        if type(self.radius) is not int or self.radius < 0:  # another kind of number is rare, and takes longer
            Checks(self, "lattice").integers("radius", least=0, most=MOST)

    @property
    def dimension(self) -> int:
        """Number of axes d."""
        return int(self.origin.size)

    @property
    def width(self) -> int:
        """Cells per axis, 2·radius + 1."""
        return 2 * self.radius + 1

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of an array over the cells, (2·radius + 1,)·d."""
        return (self.width,) * self.dimension

    def with_radius(self, radius: int) -> Lattice:
        """Return the same lattice, cut or grown to another radius."""
        other = object.__new__(Lattice)  # the arrays are in order, and need not be looked at again
        kept = ("origin", self.origin), ("spacing", self.spacing), ("radius", radius), ("rotation", self.rotation)
        for name, value in kept:
            object.__setattr__(other, name, value)
        other._check_radius()
        return other

    def axis(self) -> FloatArray:
        """Return the (2·radius + 1,) m coordinates along one lattice axis, relative to the origin."""
        return self.spacing * np.arange(-self.radius, self.radius + 1, dtype=np.float64)

    def positions(self) -> FloatArray:
        """Return the positions of all cells, (cells…, d) m, in the world frame."""
        axis = self.axis()
        local = np.stack(np.meshgrid(*([axis] * self.dimension), indexing="ij"), axis=-1)
        return local @ self.rotation.T + self.origin

    def to_local(self, points: FloatArray | VectorLike) -> FloatArray:
        """World points (…, d) m → coordinates in the lattice's own frame (…, d) m, the origin at 0."""
        return (np.asarray(points, dtype=np.float64) - self.origin) @ self.rotation

    def to_world(self, local: FloatArray | VectorLike) -> FloatArray:
        """Coordinates in the lattice's own frame (…, d) m → world points (…, d) m."""
        return np.asarray(local, dtype=np.float64) @ self.rotation.T + self.origin


def _orthogonal(rotation: FloatArray) -> bool:
    """Whether the columns of (d, d) have length 1 and are at right angles."""
    axes: list[list[float]] = rotation.T.tolist()
    pairs = ((a, b) for a in range(len(axes)) for b in range(a + 1))
    return all(abs(sum(map(mul, axes[a], axes[b])) - (a == b)) < 1e-6 for a, b in pairs)


def heading_rotation(direction: VectorLike) -> FloatArray:
    """Return the (d, d) rotation whose first column points along `direction` ((d,), any length); read-only.

    A zero direction gives the identity. In 1-D the result is [[±1]]; in 3-D the second axis stays horizontal.
    """
    v = np.asarray(direction, dtype=np.float64)
    d = v.size
    parts: list[float] = v.tolist()
    norm = math.hypot(*parts)
    if norm < 1e-12:
        return identity(d)
    if d == 2:
        x, y = parts[0] / norm, parts[1] / norm
        return sealed(np.array([[x, -y], [y, x]]))
    first = v / norm
    if d == 1:
        return frozen_array(first.reshape(1, 1))
    side = np.cross([0.0, 0.0, 1.0], first)
    length = float(np.linalg.norm(side))
    second = side / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    return sealed(np.stack([first, second, np.cross(first, second)], axis=1))


@lru_cache(maxsize=8)
def identity(dimension: int) -> FloatArray:
    """Return the (d, d) rotation that turns nothing, read-only."""
    return frozen_array(np.eye(dimension))
