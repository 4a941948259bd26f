"""A console on stdout whose reader may go away, as in `sidestep run --help | head -1`."""

from __future__ import annotations

import errno
import os

from rich.console import Console


class Output(Console):
    """Prints on stdout; that nobody reads any more is left to `sidestep.cli.execute`: it is no failure."""

    def on_broken_pipe(self) -> None:
        """Say what has happened, where rich would end the program with status 1."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
