"""How far ahead there is time to plan: the horizon that fits a deadline, learned from the calls so far."""

from __future__ import annotations

import math

from sidestep.planning.settings import PlannerSettings

_SHARE = 0.5  # of the deadline that a call is planned to take; the rest is for the machine's own hiccups
_FIRST = 4  # steps of the first call
_FORGOTTEN = 0.95  # per call: what a longer horizon took counts less and less, so that it is tried again
_HICCUP = 2.0  # times what it took before is believed at most, until the next call says so, too


class Pace:
    """Wall-clock time of a call by its horizon, as the calls so far tell; they grow longer by one step at a time."""

    def __init__(self) -> None:
        self._seconds: dict[int, float] = {}  # by horizon, the largest seen lately; never changed in place
        self._last = 0  # steps, of the last call; half of them if it was late

    def horizon(self, settings: PlannerSettings, standing: float = 0.0) -> int:
        """Return the largest horizon ≤ N whose expected time fits the deadline; starts small and grows.

        Args:
            settings: of the planner; without a deadline it is N.
            standing: s that the base needs to stand. A stop that the plan does not see is not safe: where there is no
                time to look so far ahead, to be late is to stop.
        """
        if settings.deadline is None:
            return settings.horizon
        least = math.ceil(standing / settings.time_step)
        return min(max(self._fitting(settings, settings.deadline), least), settings.horizon)

    def _fitting(self, settings: PlannerSettings, deadline: float) -> int:
        if not self._seconds:
            return _FIRST
        longest, most = min(settings.horizon, self._last + 1), _SHARE * deadline
        return next((n - 1 for n in range(2, longest + 1) if self._expected(n) > most), max(longest, 1))

    def took(self, horizon: int, seconds: float) -> None:
        """Remember how long a call took: where the one before had the same horizon, others have changed as it has."""
        before, now, change = self._seconds.get(horizon), seconds, 1.0
        if before is not None and horizon == self._last:
            now = min(seconds, _HICCUP * before) if seconds > before else 0.9 * before + 0.1 * seconds
            change = now / before
        others = {n: t * change * (_FORGOTTEN if n > horizon else 1.0) for n, t in self._seconds.items()}
        self._seconds, self._last = others | {horizon: now}, horizon

    def late(self, horizon: int, seconds: float) -> None:
        """Remember that a call of this horizon did not finish within so many seconds."""
        self.took(horizon, seconds)
        self._last = horizon // 2

    def _expected(self, horizon: int) -> float:
        """Return s, as known, else from the nearest horizon that is: ∝ N if that is longer, ∝ N² if it is shorter."""
        known = min(self._seconds, key=lambda n: (abs(n - horizon), n))
        share = horizon / known
        return self._seconds[known] * (share if share < 1.0 else share**2)
