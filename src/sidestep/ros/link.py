"""Who drives from afar, and whether their link lives. No sockets here, and no clock of its own."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable


class Link:
    """At most one station drives; the robot stands unless that station has started it and still answers.

    Every state that is sent has a number, and every answer names the newest number seen. The link is as old as the
    state that was last answered: a dead line, a dead station and a line that merely delays everything all look the
    same, and stop the robot alike. After a loss, someone has to start again.

    Args:
        hold: (reason) keeps the robot standing, as it must be before the first start; "" lets go.
        timeout: s.
    """

    def __init__(self, hold: Callable[[str], None], timeout: float) -> None:
        self._hold = hold
        self._timeout = timeout
        self._lock = threading.Lock()
        self._sent: deque[tuple[int, float]] = deque(maxlen=1000)
        self._driver: str | None = None
        self._alive = 0.0

    @property
    def driver(self) -> str | None:
        """Name of the station that drives."""
        with self._lock:
            return self._driver

    def sent(self, number: int, now: float) -> None:
        """State `number` left at `now` (s)."""
        with self._lock:
            self._sent.append((number, now))

    def start(self, who: str, seen: int, now: float) -> str:
        """`who` wants to drive and has seen state `seen`; return why not, or ""."""
        with self._lock:
            if self._driver not in (None, who):
                return f"{self._driver} is driving"
            left = self._left(seen)
            if left is None or now - left > self._timeout:
                return f"the link is slower than {self._timeout:g} s"
            self._driver, self._alive = who, left
            self._hold("")
            return ""

    def beat(self, who: str, seen: int) -> None:
        """`who` has seen state `seen`."""
        with self._lock:
            left = self._left(seen)
            if who == self._driver and left is not None:
                self._alive = max(self._alive, left)

    def stop(self, who: str) -> None:
        """Anyone may stop the robot."""
        with self._lock:
            self._driver = None
            self._hold(f"stopped by {who}")

    def gone(self, who: str) -> None:
        """The connection of `who` has ended."""
        with self._lock:
            if who == self._driver:
                self._driver = None
                self._hold(f"{who} has gone")

    def check(self, now: float) -> None:
        """Call at the control rate: stops the robot when the driver has not answered for the timeout."""
        with self._lock:
            if self._driver is not None and now - self._alive > self._timeout:
                self._hold(f"no answer from {self._driver} for {now - self._alive:.1f} s: link lost")
                self._driver = None

    def _left(self, seen: int) -> float | None:
        return next((time for number, time in reversed(self._sent) if number == seen), None)
