"""Robots (Eqs. 3, 10): which velocities a base can follow, what it is commanded, and where it then goes.

Planning moves one point of the robot, the *reference*, which obeys x' = x + ΔT·u (Eq. 3). For `Holonomic` it is the
centre; for `DifferentialDrive` it lies a little ahead of the axle, because a point on the axle cannot move sideways.
"""

from __future__ import annotations

from sidestep.robots.differential import DifferentialDrive
from sidestep.robots.holonomic import Holonomic
from sidestep.robots.state import RobotState

__all__ = ["DifferentialDrive", "Holonomic", "Robot", "RobotState"]

Robot = Holonomic | DifferentialDrive
"""What can be planned for."""
