"""Attributes that are computed when first read, and kept."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or sys.version_info >= (3, 12):
    lazy = cached_property
else:

    class lazy:  # noqa: N801 (used like `cached_property`)
        """`functools.cached_property` as it is from Python 3.12 on: without a lock that every first read takes.

        Two threads that read at once may both compute; they find the same, since what is computed here depends on
        frozen values alone.
        """

        def __init__(self, compute: Callable[[Any], Any]) -> None:
            self._compute = compute
            self._name = compute.__name__
            self.__doc__ = compute.__doc__

        def __get__(self, instance: Any, owner: type | None = None) -> Any:
            if instance is None:
                return self
            value = instance.__dict__[self._name] = self._compute(instance)
            return value
