"""Bars on stderr, where it is a terminal: for long work, and for the first time, when everything is compiled."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

from sidestep.commands.console import say


@contextmanager
def progress_bar(title: str) -> Generator[Callable[[int, int], object] | None]:
    """A bar on stderr where it is a terminal; what is needed for the work is compiled before, the first time."""
    first_time()
    if not sys.stderr.isatty():
        yield None
        return
    with _bar(title) as tell:
        yield tell


def first_time(*, walls: bool = False) -> None:
    """Compile what planning needs where that is still to be done, and say so; see `sidestep.compiling`."""
    from sidestep.compiling import compile_together, helpers_at_most, worth_sharing

    if not worth_sharing(walls=walls):
        return  # on one processor there is nothing to share; the planner says what it does
    if not sys.stderr.isatty():
        say(f"compiling the inner loops, once, on {helpers_at_most()} processors: about a minute")
        compile_together(walls=walls)
        return
    with _bar("compiling the inner loops, once") as tell:
        compile_together(walls=walls, tell=lambda share: tell(round(100 * share), 100))


@contextmanager
def _bar(title: str) -> Generator[Callable[[int, int], object]]:
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)

        def tell(done: int, everything: int) -> None:
            bar.update(task, completed=done, total=everything)

        yield tell
