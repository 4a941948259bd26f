"""What the fields of a frozen value may hold: checked when it is made, and kept as what they are declared to be."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from numbers import Integral, Real
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from sidestep.errors import InvalidInput, UnknownName
from sidestep.types import LARGEST, FloatArray, VectorLike, settled

MOST = 10_000_000
"""Episodes, trips, moments; a list of more pieces of work fits no memory."""
FARTHEST = 100
"""Steps; nobody looks farther ahead: time grows with the third power of it in the plane, memory too."""
MOST_REACH = 10
"""Actions per axis and direction."""
WIDEST = 100.0
"""m; no body, and no distance to be kept from one, is larger: what is drawn around a person would not fit memory."""


class Checks:
    """Checks fields of a frozen value that is being made (`__post_init__`), and settles what stands in them.

    Numbers of NumPy become plain ones, and sequences tuples, so that the value can be compared, hashed and written.
    A field that may be None says so with `optional`.

    Args:
        value: the frozen value.
        prefix: before the name of each field in a complaint.
    """

    def __init__(self, value: object, prefix: str) -> None:
        self._value = value
        self._prefix = prefix

    def numbers(
        self,
        *names: str,
        above: float = -math.inf,
        least: float = -math.inf,
        below: float = math.inf,
        most: float = math.inf,
        unit: str = "",
        optional: bool = False,
    ) -> None:
        """Finite numbers with above < x < below and least ≤ x ≤ most, none beyond ±`LARGEST`."""
        allowed = f"a finite number{_bounds(above, least, below, most)}{_remark(unit, optional)}"
        for name in names:
            value = getattr(self._value, name)
            if value is None and optional:
                continue
            number = _number(value)
            if abs(number) > LARGEST:
                raise self.wrong(name, f"a number of at most {LARGEST:g}{_remark(unit, optional)}")
            if not (above < number < below and least <= number <= most):
                raise self.wrong(name, allowed)
            self._keep(name, _plain(value, number))

    def integers(self, *names: str, least: int, most: int, optional: bool = False, mend: str = "") -> None:
        """Whole numbers from `least` to `most`: what is counted has to be done, or held in memory."""
        for name in names:
            value = getattr(self._value, name)
            if value is None and optional:
                continue
            if isinstance(value, bool) or not isinstance(value, Integral) or not least <= int(value) <= most:
                raise self.wrong(name, f"an integer ≥ {least} and ≤ {most}{_remark('', optional)}", mend)
            self._keep(name, int(value))

    def words(self, name: str, literal: Any) -> None:
        """One of the words of a `Literal` type."""
        known = get_args(literal)
        value = getattr(self._value, name)
        if not isinstance(value, str) or value not in known:
            raise self.wrong(name, ", ".join(known[:-1]) + f" or {known[-1]}")

    def flags(self, *names: str) -> None:
        """True or False."""
        for name in names:
            value = getattr(self._value, name)
            if not isinstance(value, bool | np.bool_):
                raise self.wrong(name, "true or false")
            self._keep(name, bool(value))

    def kind(self, name: str, kind: type) -> None:
        """An instance of a class."""
        of_kind(f"{self._prefix}.{name}", getattr(self._value, name), kind)

    def weights(self, *names: str) -> None:
        """One number ≥ 0, or one per axis."""
        for name in names:
            value = getattr(self._value, name)
            one, several = _number(value), numbers_in(value)
            if not all(0.0 <= x <= LARGEST for x in several or (one,)):
                raise self.wrong(name, f"a number from 0 to {LARGEST:g}, or one per axis")
            self._keep(name, several or _plain(value, one))

    def listed(
        self, name: str, *, count: int | None = None, above: float = -math.inf, least: float = -math.inf
    ) -> tuple[float, ...]:
        """Finite numbers with x > above and x ≥ least, `count` of them or any number ≥ 1; returned, too."""
        value = getattr(self._value, name)
        found = numbers_in(value)
        if not found or len(found) != (count or len(found)) or not all(x > above and x >= least for x in found):
            many = {None: "one or more", 2: "two", 3: "three"}.get(count, str(count))
            raise self.wrong(name, f"{many} finite numbers{_bounds(above, least, math.inf, math.inf)}")
        self._keep(name, found)
        return found

    def wrong(self, name: str, allowed: str, mend: str = "") -> InvalidInput:
        """Return the complaint about one field."""
        return InvalidInput(f"{self._prefix}.{name}", getattr(self._value, name), allowed, mend)

    def _keep(self, name: str, value: object) -> None:
        object.__setattr__(self._value, name, value)


def of_kind(field: str, value: object, *kinds: type, optional: bool = False, mend: str = "") -> None:
    """Raise `InvalidInput` unless `value` is an instance of one of `kinds`, or None where it is optional."""
    if not isinstance(value, kinds) and not (value is None and optional):
        raise InvalidInput(field, value, " or ".join(kind.__name__ for kind in kinds) + _remark("", optional), mend)


def one_of(field: str, names: Iterable[str], known: Collection[str]) -> None:
    """Check that each of the names is known.

    Raises:
        UnknownName: one is not.
    """
    for name in names:
        if name not in known:
            raise UnknownName(field, name, known)


def counted(field: str, value: int, *, most: int = MOST, mend: str = "") -> int:
    """Return how many of something there are to be.

    Raises:
        InvalidInput: less than one, or more than `most`.
    """
    if not 1 <= value <= most:
        raise InvalidInput(field, value, f"an integer ≥ 1 and ≤ {most}", mend)
    return value


def seeded(field: str, value: int) -> int:
    """Return a seed of random numbers.

    Raises:
        InvalidInput: it is negative, or takes more than 32 bits.
    """
    if not 0 <= value < 2**32:
        raise InvalidInput(field, value, f"an integer ≥ 0 and < {2**32}")
    return value


def measured(field: str, value: VectorLike | FloatArray, allowed: str = "numbers") -> FloatArray:
    """Return what a sensor or a caller tells as a read-only array; what numbers are in it is not looked at.

    Raises:
        InvalidInput: it is not numbers at all.
    """
    try:
        return settled(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput(field, value, allowed) from None


def measured_number(field: str, value: float) -> float:
    """Return one number that a sensor or a caller tells, whatever it is; NaN where it is masked.

    Raises:
        InvalidInput: it is no number at all.
    """
    if type(value) is float:
        return value
    told = plainly(value)
    if isinstance(value, bool | np.bool_) or not isinstance(told, Real):
        raise InvalidInput(field, value, "a number")
    return _number(told)


def plainly(value: Any) -> Any:
    """Return a number of any kind, a Decimal or an array without axes among them, as float; what is none as it is."""
    if type(value) is float or isinstance(value, str | bytes | bytearray):
        return value
    try:
        return math.nan if value is np.ma.masked else float(value)
    except (TypeError, ValueError, OverflowError):
        return value


def numbers_in(value: object) -> tuple[float, ...]:
    """Return a sequence, (n,) array or series of numbers within ±`LARGEST` as a tuple, () where it is anything else."""
    listed = value if isinstance(value, Sequence | np.ndarray) else _array_of(value)
    if isinstance(listed, np.ndarray) and listed.ndim != 1:
        return ()
    found = tuple(map(_number, listed))
    return found if all(-LARGEST <= x <= LARGEST for x in found) else ()


def _array_of(value: Any) -> Sequence[object] | NDArray[Any]:
    """Return what a value of another library, such as a series of pandas, holds; () where it holds no array."""
    try:
        return np.asarray(value) if hasattr(value, "__array__") else ()
    except Exception:  # of whoever made it
        return ()


def _number(value: object) -> float:
    """Return a number as float, NaN where it is none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf
    except TypeError:  # NumPy counts a span of time among the integers
        return math.nan


def _plain(value: object, number: float) -> object:
    """Return a plain number as it is (1 stays 1), any other as the `number` that was found in it."""
    return value if type(value) in (int, float) else number


def _bounds(above: float, least: float, below: float, most: float) -> str:
    if math.isfinite(least) and math.isfinite(most):
        return f" from {least:g} to {most:g}"
    told = ((" >", above), (" ≥", least), (" <", below), (" ≤", most))
    return " and".join(f"{sign} {bound:g}" for sign, bound in told if math.isfinite(bound))


def _remark(unit: str, optional: bool) -> str:
    return (f" ({unit})" if unit else "") + (", or none" if optional else "")
