"""Model-predictive control against people at constant velocity, as an engineer would write it with casadi and IPOPT."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sidestep.errors import MissingExtra
from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.simulation.navigators import Steering, Trip, positions_and_velocities, steering
from sidestep.simulation.walls import WallEdges
from sidestep.types import FloatArray

FAR = 1e3  # m, where those stand who are not there
SLACK_WEIGHT = 1e3  # per m², of squared distance missing


class ConstantVelocityMpc:
    """min Σ‖x_k − g'‖² + r‖u_k‖² + softened distances ≥ clearance to the nearest people at constant velocity.

    g' is the goal, drawn in to one and a half horizons' reach so that the pull is the same all the way.
    """

    def __init__(
        self, trip: Trip, *, stages: int = 15, interval: float = 0.2, effort: float = 0.05, nearest: int = 5
    ) -> None:
        """Prepare the program once; each call only sets its parameters.

        Args:
            trip: goal and limits.
            stages: of the horizon.
            interval: s per stage.
            effort: r.
            nearest: people that are looked at; the others are farther.

        Raises:
            MissingExtra: casadi is not installed.
        """
        self._trip = trip
        self._stages, self._interval, self._nearest = stages, interval, nearest
        self._walls = WallEdges(trip.walls)
        self._solver = _solver(trip, stages, interval, effort, nearest, bool(len(self._walls)))
        self._guess = np.zeros((2, stages))

    def reset(self) -> None:
        """Forget the last solution."""
        self._guess = np.zeros((2, self._stages))

    def step(self, *, time: float, robot: RobotState, people: Sequence[PersonObservation]) -> Steering:
        """Return the first velocity of the solution; a stop where the solver found none."""
        del time
        trip, x = self._trip, robot.position
        to_goal = trip.goal - x
        reach = 1.5 * trip.max_speed * self._stages * self._interval
        target = x + to_goal * min(1.0, reach / max(float(np.linalg.norm(to_goal)), 1e-9))
        if not self._guess.any():
            self._guess = np.tile(trip.preferred(x)[:, None], (1, self._stages))
        obstacles = self._obstacles(x, *positions_and_velocities(people, 2))
        parameters = np.concatenate([x, target, obstacles, self._wall_points(x)])
        start = np.concatenate([self._guess.ravel(order="F"), np.zeros(self._stages)])
        found = self._solver(x0=start, p=parameters, lbx=self._lower(), ubx=self._upper(), lbg=0.0, ubg=np.inf)
        u = np.array(found["x"]).ravel()[: 2 * self._stages].reshape((2, self._stages), order="F")
        if not np.isfinite(u).all():
            self.reset()
            return steering(np.zeros(2), trip.max_speed)
        shift = trip.time_step / self._interval
        ahead = np.minimum(np.arange(self._stages) + shift, self._stages - 1)
        self._guess = np.stack([np.interp(ahead, np.arange(self._stages), row) for row in u])
        return steering(u[:, 0], trip.max_speed)

    def _obstacles(self, x: FloatArray, where: FloatArray, pace: FloatArray) -> FloatArray:
        """(2·nearest·stages,) m, people at constant velocity at k = 1..stages."""
        order = np.argsort(np.linalg.norm(where - x, axis=1))[: self._nearest]
        times = np.arange(1, self._stages + 1) * self._interval
        paths = np.full((self._nearest, self._stages, 2), FAR)
        paths[: len(order)] = where[order, None] + times[:, None] * pace[order, None]
        return paths.ravel()

    def _wall_points(self, x: FloatArray) -> FloatArray:
        """(2·stages,) m, the nearest place on a wall to each stage of the last solution."""
        if not len(self._walls):
            return np.zeros(0)
        path = x + np.cumsum(self._guess.T, axis=0) * self._interval
        return self._walls.nearest(path).ravel()

    def _lower(self) -> FloatArray:
        return np.concatenate([np.full(2 * self._stages, -self._trip.max_speed), np.zeros(self._stages)])

    def _upper(self) -> FloatArray:
        return np.concatenate([np.full(2 * self._stages, self._trip.max_speed), np.full(self._stages, np.inf)])


def _solver(trip: Trip, stages: int, interval: float, effort: float, nearest: int, walls: bool) -> Any:
    try:
        import casadi as ca
    except ImportError:
        raise MissingExtra("the constant-velocity MPC", "peers") from None
    u, slack = ca.SX.sym("u", 2, stages), ca.SX.sym("s", stages)
    x0, target = ca.SX.sym("x0", 2), ca.SX.sym("target", 2)
    others = ca.SX.sym("others", 2, stages * nearest)
    wall = ca.SX.sym("wall", 2, stages if walls else 0)
    x, cost, constraints = x0, 0, []
    for k in range(stages):
        x = x + interval * u[:, k]
        cost += interval * (ca.sumsqr(x - target) + effort * ca.sumsqr(u[:, k])) + SLACK_WEIGHT * slack[k]
        constraints.append(trip.max_speed**2 - ca.sumsqr(u[:, k]))
        for j in range(nearest):
            constraints.append(ca.sumsqr(x - others[:, j * stages + k]) - trip.clearance**2 + slack[k])
        if walls:
            constraints.append(ca.sumsqr(x - wall[:, k]) - (trip.robot_radius + 0.05) ** 2 + slack[k])
    program = {
        "x": ca.vertcat(ca.vec(u), slack),
        "f": cost,
        "g": ca.vertcat(*constraints),
        "p": ca.vertcat(x0, target, ca.vec(others), ca.vec(wall)),
    }
    options = {
        "ipopt": {"print_level": 0, "sb": "yes", "max_iter": 60, "tol": 1e-4, "acceptable_tol": 1e-2},
        "print_time": False,
    }
    return ca.nlpsol("mpc", "ipopt", program, options)
