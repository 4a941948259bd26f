"""Options that would be of no effect beside others: refused, so that nobody takes them to have had one."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any


def refuse(command: Callable[..., Any], when: str, **options: object) -> None:
    """Check that options are left at their defaults.

    Args:
        command: whose options they are.
        when: when they would be of effect, in words.
        options: their values by the names of the command's parameters.

    Raises:
        InvalidInput: one was given another value.
    """
    from sidestep.errors import InvalidInput

    known = inspect.signature(command).parameters
    for name, value in options.items():
        if value != known[name].default:
            told = str(value) if isinstance(value, Path) else value
            raise InvalidInput(f"--{name.replace('_', '-')}", told, when)
