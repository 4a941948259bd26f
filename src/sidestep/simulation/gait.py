"""How two legs move under a walking body, at the height of a scanner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.types import FloatArray, Vector

_STANCE = 0.6  # share of the cycle in which a foot stands (level walking)
_STRIDE_AT_UNIT = 1.15  # m; stride length at 1 m/s, growing with the root of the speed (Grieve 1968)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gait:
    """How one person walks.

    Attributes:
        leg_radius: m, trousers included.
        half_width: m, from the middle of the body to each leg, sideways.
        swing: share of the foot's forward and backward travel that is left at the height of the scanner.
        standing_offset: m, how far the left leg stands before the right one at rest.
    """

    leg_radius: float = 0.065
    half_width: float = 0.09
    swing: float = 0.8
    standing_offset: float = 0.0

    @staticmethod
    def random(generator: np.random.Generator) -> Gait:
        """Draw an adult's gait, in shoes and anything from tights to wide trousers."""
        return Gait(
            leg_radius=generator.uniform(0.045, 0.095),
            half_width=generator.uniform(0.06, 0.14),
            swing=generator.uniform(0.55, 0.95),
            standing_offset=generator.normal(0.0, 0.06),
        )

    def advance(self, phase: float, speed: float, duration: float) -> float:
        """Return the phase (rad) after walking at `speed` (m/s) for `duration` (s)."""
        return float((phase + 2 * np.pi * duration * speed / _stride(speed)) % (2 * np.pi))

    def legs(self, position: Vector, velocity: Vector, heading: float, phase: float) -> FloatArray:
        """Return (2, 5): x, y, radius (m) and velocity (m/s) of the left and the right leg.

        Args:
            position: (2,) m, middle of the body.
            velocity: (2,) m/s of the body.
            heading: rad; the legs swing along the velocity, and stand side by side across the heading.
            phase: rad; the left leg begins its stance at 0, the right one at π.
        """
        speed = float(np.hypot(*velocity))
        ahead = np.array([np.cos(heading), np.sin(heading)])
        forward = velocity / speed if speed > 0.05 else ahead
        left = np.array([-ahead[1], ahead[0]])
        discs = np.empty((2, 5))
        for leg, (side, shift) in enumerate(((1.0, 0.0), (-1.0, np.pi))):
            offset, rate = _travel((phase + shift) % (2 * np.pi), speed)
            at_rest = side * self.standing_offset / 2 * np.exp(-4.0 * speed)
            discs[leg, :2] = position + side * self.half_width * left + self.swing * offset * forward + at_rest * ahead
            discs[leg, 2] = self.leg_radius
            discs[leg, 3:] = velocity + self.swing * rate * forward
        return discs


def _stride(speed: float) -> float:
    """Return the length of a stride (two steps) in m."""
    return _STRIDE_AT_UNIT * float(np.sqrt(max(speed, 1e-6)))


def _travel(phase: float, speed: float) -> tuple[float, float]:
    """Return where a foot is along the walking direction, relative to the body (m), and how fast it moves there (m/s).

    A standing foot slides back at walking speed, that is, rests on the ground; a swinging one comes forward smoothly.
    """
    if speed < 1e-3:
        return 0.0, 0.0
    reach = _STANCE * _stride(speed) / 2
    share = phase / (2 * np.pi)
    if share < _STANCE:
        return reach * (1 - 2 * share / _STANCE), -speed
    swing = (share - _STANCE) / (1 - _STANCE)
    cycle = _stride(speed) / speed
    rate = reach * np.pi * float(np.sin(np.pi * swing)) / ((1 - _STANCE) * cycle)
    return -reach * float(np.cos(np.pi * swing)), rate
