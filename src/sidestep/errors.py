"""One tree of exceptions; each message is one line: which field, which value, what is allowed, how to mend it.

SidestepError
├── InvalidInput(ValueError)     a value that a caller passed          (exit status 2 on the command line)
│   ├── InvalidFile              a file that cannot be read as what it should be
│   └── UnknownName              a scenario, field or option that does not exist; suggests the nearest
├── MissingExtra(ImportError)    an optional part is not installed; names the extra
└── OutputError(OSError)         a result that cannot be written
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class SidestepError(Exception):
    """Root of all exceptions that this library raises on purpose; they cross between processes as they are."""

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), self.args, self.__dict__)


def _again(kind: type[SidestepError], args: tuple[Any, ...], attributes: dict[str, Any]) -> SidestepError:
    """Return an exception as it was; its message, and not what that is made of, is in `args`."""
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(attributes)
    return error


class InvalidInput(SidestepError, ValueError):  # noqa: N818 (reads as a sentence where it is caught)
    """A value is not allowed.

    Args:
        field: dotted name of the field, as the caller wrote it.
        value: the offending value.
        allowed: what is allowed, in words.
        mend: what to do; optional.
    """

    def __init__(self, field: str, value: object, allowed: str, mend: str = "") -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        self.mend = mend
        text = f"{field}: got {_short(value)}; allowed: {allowed}"
        super().__init__(f"{text}; {mend}" if mend else text)


class InvalidFile(InvalidInput):
    """A file cannot be read as what it should be; `field` is its path (and line or key)."""


_LISTED = 40  # names that a message may hold


class UnknownName(InvalidInput):
    """A name does not exist among `known`; the nearest ones are suggested."""

    def __init__(self, field: str, value: str, known: Iterable[str]) -> None:
        names = sorted(known)
        near = difflib.get_close_matches(value, names, n=2)
        mend = f"did you mean {' or '.join(repr(n) for n in near)}?" if near else ""
        some = names if len(names) <= _LISTED else [*names[: _LISTED // 2], f"… ({len(names)} in all)"]
        super().__init__(field, value, "one of " + ", ".join(some), mend)


class MissingExtra(SidestepError, ImportError):  # noqa: N818
    """An optional part is missing; the message names the extra that brings it."""

    def __init__(self, feature: str, extra: str) -> None:
        self.feature = feature
        self.extra = extra
        super().__init__(f"{feature} needs the optional part '{extra}': pip install 'sidestep[{extra}]'")


class OutputError(SidestepError, OSError):
    """A result cannot be written; says where and why."""

    def __init__(self, path: object, why: str) -> None:
        self.path = path
        super().__init__(f"{path}: cannot be written ({why}); choose a folder that can be written to")


def _short(value: object) -> str:
    text = " ".join(map(str.strip, repr(value).splitlines()))
    return text if len(text) <= 80 else text[:77] + "..."
