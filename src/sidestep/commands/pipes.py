"""A console on stdout whose reader may go away, as in `sidestep run --help | head -1`."""

from __future__ import annotations

import errno
import os
from typing import Any

from rich.console import Console

LEAST = 20
"""Columns; rich comes to no end where there are one or two."""


class Output(Console):
    """Prints on stdout; that nobody reads any more is left to `sidestep.cli.execute`: it is no failure."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.width = max(self.width, LEAST)

    def on_broken_pipe(self) -> None:
        """Say what has happened, where rich would end the program with status 1."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
