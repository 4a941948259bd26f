"""The planners that a visitor can choose from."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np

from sidestep.errors import MissingExtra
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.navigators import Navigator, Trip
from sidestep.simulation.outlines import outlines
from sidestep.simulation.scenario import Scenario
from sidestep.viewer.live.stage import ignoring

TITLES = {
    "nothing": "sidestep",
    "assume_concerned": "trusts everybody",
    "assume_unconcerned": "trusts nobody",
    "no_prediction": "without prediction",
    "cv_mpc": "constant-velocity MPC",
    "orca": "ORCA",
}
NEEDS = {"cv_mpc": "casadi", "orca": "pyrvo"}  # packages of the extra "peers"


def require(name: str) -> None:
    """Raise `MissingExtra` where the planner `name` (a key of `TITLES`) needs a part that is not installed."""
    if name in NEEDS and find_spec(NEEDS[name]) is None:
        raise MissingExtra(TITLES[name], "peers")


def navigator_of(name: str, scenario: Scenario, obstacles: Any) -> Navigator:
    """Return the planner `name` (a key of `TITLES`) for one trip.

    Raises:
        MissingExtra: it needs a part that is not installed.
    """
    if name == "cv_mpc":
        from sidestep.simulation.peers_mpc import ConstantVelocityMpc

        return ConstantVelocityMpc(_trip(scenario, obstacles))
    if name == "orca":
        from sidestep.simulation.peers_orca import Orca

        return Orca(_trip(scenario, obstacles))
    return planner_of(ignoring(scenario, name), obstacles)  # pyright: ignore[reportArgumentType]


def _trip(scenario: Scenario, obstacles: Any) -> Trip:
    return Trip(
        goal=np.array(scenario.robot.goal),
        max_speed=scenario.robot.max_speed,
        robot_radius=scenario.robot.radius,
        person_radius=scenario.human.radius,
        clearance=scenario.clearance,
        risk_limit=scenario.planner.risk_limit,
        time_step=scenario.period,
        walls=outlines(obstacles),
    )
