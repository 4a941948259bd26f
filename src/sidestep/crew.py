"""Threads that share out people among them, each with scratch arrays of its own."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, suppress
from threading import RLock
from typing import TypeVar

from sidestep.prediction.workspace import Workspace

Item = TypeVar("Item")
Result = TypeVar("Result")


class Crew:
    """Does the same for many, on one thread or several; what comes out is the same, whoever did it.

    Args:
        threads: ≥ 1, the caller's own included. More of them gain where there are as many cores: the compiled kernels
            run side by side, what is Python between them does not.
    """

    def __init__(self, threads: int = 1) -> None:
        self._busy = os.getpid(), RLock()
        self._spaces = [Workspace() for _ in range(threads)]
        self._helpers: tuple[int, ThreadPoolExecutor] | None = None

    def __getstate__(self) -> int:
        return len(self._spaces)  # a copy, or one in another process, has threads and scratch arrays of its own

    def __setstate__(self, threads: int) -> None:
        self.__init__(threads)

    @property
    def busy(self) -> AbstractContextManager[bool]:
        """Held by whoever works with the scratch arrays: two at a time would overwrite each other's memory.

        One of this process: after a fork, whoever held that of the parent is not there to let it go.
        """
        process = os.getpid()
        if self._busy[0] != process:
            self._busy = process, RLock()
        return self._busy[1]

    def each(self, work: Callable[[Item, Workspace], Result], items: Sequence[Item]) -> list[Result]:
        """Return `work` of every item, in their order; whoever is free takes the next.

        If one fails no further one is begun, and its error is raised once those under way have ended.
        """
        own, others = self._spaces[0], self._spaces[1 : len(items)]
        if not others:
            return [work(item, own) for item in items]
        waiting, found = deque(enumerate(items)), {}

        def help_with(space: Workspace) -> None:
            while True:
                try:
                    n, item = waiting.popleft()
                except IndexError:
                    return
                try:
                    found[n] = work(item, space)
                except BaseException:
                    waiting.clear()
                    raise

        helpers: list[Future[None]] = []
        with suppress(RuntimeError):  # no thread is to be had: whoever is there does it all
            for space in others:
                helpers.append(self._pool().submit(help_with, space))
        try:
            help_with(own)
        finally:
            ended = [None if helper.cancel() else helper.exception() for helper in helpers]  # none waits to begin
        for error in ended:
            if error is not None:
                raise error
        return [found[n] for n in range(len(items))]

    def _pool(self) -> ThreadPoolExecutor:
        """The helpers of this process: after a fork, those of the parent are not there."""
        process = os.getpid()
        if self._helpers is None or self._helpers[0] != process:
            self._helpers = process, ThreadPoolExecutor(len(self._spaces) - 1, "sidestep")
        return self._helpers[1]
