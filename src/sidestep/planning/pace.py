"""How far ahead there is time to plan: the horizon that fits a deadline, learned from the calls so far."""

from __future__ import annotations

from sidestep.planning.settings import PlannerSettings

_SHARE = 0.5  # of the deadline that a call is planned to take; the rest is for the machine's own hiccups


class Pace:
    """Wall-clock time of a call as overhead + growth, both learned; grows with the fourth power of the horizon."""

    def __init__(self) -> None:
        self._per_work = 0.0  # s, the largest seen lately
        self._limit = 1 << 30  # steps, lowered when a call was late

    def horizon(self, settings: PlannerSettings) -> int:
        """Return the largest horizon ≤ N whose expected time fits the deadline; starts small and grows."""
        assert settings.deadline is not None
        if self._per_work == 0.0:
            return min(4, settings.horizon, self._limit)
        chosen = 1
        for n in range(1, min(settings.horizon, self._limit) + 1):
            if self._per_work * _work(n) <= _SHARE * settings.deadline:
                chosen = n
        return chosen

    def took(self, horizon: int, seconds: float) -> None:
        """Remember how long a call took."""
        rate = seconds / _work(horizon)
        self._per_work = rate if rate > self._per_work else 0.9 * self._per_work + 0.1 * rate
        self._limit += 1

    def late(self, horizon: int) -> None:
        """Remember that a call of this horizon did not finish."""
        self._limit = max(1, horizon // 2)


def _work(horizon: int) -> float:
    """Relative work of a call: overhead until about 12 steps, then the sweeps (∝ N_R·N_H·N²)."""
    return 1.0 + (horizon / 12.0) ** 4
