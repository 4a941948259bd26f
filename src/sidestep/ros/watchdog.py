"""Is what we know still true? Ages and rates of the inputs, and of the clock itself."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence


class Beat:
    """When something happened last, and how often it happens."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=20)

    def beat(self, time: float) -> None:
        """It happens at `time` (s)."""
        self._times.append(time)

    def since(self, now: float) -> float:
        """Seconds since the last time; inf if it never happened."""
        return now - self._times[-1] if self._times else math.inf

    def rate(self, now: float) -> float:
        """Times per second over the last few; 0 when it has stopped."""
        if len(self._times) < 2:
            return 0.0
        usual = (self._times[-1] - self._times[0]) / (len(self._times) - 1)
        silent = now - self._times[-1]
        return 0.0 if usual <= 0 or silent > max(2.0, 4 * usual) else 1.0 / max(usual, silent)

    @property
    def pace(self) -> float:
        """As `rate`, at the last time it happened."""
        return self.rate(self._times[-1]) if self._times else 0.0


class Watchdog:
    """Says which input is missing or late.

    An input is as old as the later of two doubts: the time since it arrived, and the time since its stamp. So a network
    that delivers old messages at full rate does not pass for a sensor that works. Stamps of 0 are not looked at.

    Args:
        required: names of the inputs without which the robot must not move.
        timeout: s, age from which on an input counts as missing.
    """

    def __init__(self, required: Sequence[str], timeout: float) -> None:
        self._required = tuple(required)
        self._timeout = timeout
        self._arrivals: dict[str, Beat] = {}
        self._stamps: dict[str, float] = {}
        self._useless: Counter[str] = Counter()  # since the last one that could be used
        self._clock = -math.inf
        self._moved = -math.inf

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the inputs that are watched."""
        return self._required

    def fed(self, name: str, *, now: float, stamp: float = 0.0) -> None:
        """Input `name` arrived at `now`, stamped `stamp` (s; 0: no stamp)."""
        self._arrivals.setdefault(name, Beat()).beat(now)
        self._stamps[name] = stamp
        self._useless[name] = 0

    def refused(self, name: str) -> None:
        """Input `name` arrived and could not be used: it is as missing as before, and that is why."""
        self._useless[name] += 1

    def age(self, name: str, now: float) -> float:
        """Age of the latest `name` in s; inf when there was none."""
        if name not in self._arrivals:
            return math.inf
        since, stamp = self._arrivals[name].since(now), self._stamps[name]
        return max(since, now - stamp) if stamp > 0 else since

    def rate(self, name: str, now: float) -> float:
        """Arrivals of `name` per second; 0 when there is nothing recent."""
        return self._arrivals[name].rate(now) if name in self._arrivals else 0.0

    def complaint(self, now: float, wall: float) -> str:
        """Return why the robot must not move, in plain words, or "".

        Args:
            now: s, of the clock that stamps messages.
            wall: s, of a clock that always runs: a simulated one may stand still while its last command is repeated.
        """
        if now != self._clock:
            self._clock, self._moved = now, wall
        elif wall - self._moved > self._timeout:
            return f"the clock has stood still for {wall - self._moved:.1f} s"
        return next((trouble for name in self._required if (trouble := self._late(name, now))), "")

    def wrong_clock(self, stamp: float, now: float) -> float:
        """Seconds by which a stamp lies ahead of now (negative: behind), if that is too many; 0 if not, or no stamp."""
        ahead = stamp - now
        return ahead if stamp > 0 and abs(ahead) > self._timeout else 0.0

    def waits(self) -> bool:
        """Return whether some required input has never come."""
        return any(name not in self._arrivals for name in self._required)

    def clear(self) -> None:
        """Forget all arrivals, as when the clock jumps back."""
        self._arrivals.clear()
        self._stamps.clear()
        self._useless.clear()

    def _late(self, name: str, now: float) -> str:
        came = self._useless[name]
        useless = f"; {came} came that could not be used: not finite, or in an unknown frame" if came else ""
        if name not in self._arrivals:
            return f"no {name} yet{useless}"
        since = self._arrivals[name].since(now)
        if since > self._timeout:
            return f"no {name} for {since:.1f} s{useless}"
        if ahead := self.wrong_clock(self._stamps[name], now):
            side = "ahead of" if ahead > 0 else "behind"
            return f"{name} is stamped {abs(ahead):.1f} s {side} now: a slow network, or clocks that differ"
        return ""
