"""sidestep plans a robot's motion among people who may not be watching.

    planner = sidestep.Planner(robot=sidestep.Holonomic(max_speed=1.0, radius=0.3), goal=(0.0, 5.0))
    plan = planner.step(time=0.0, robot=sidestep.RobotState(position=(0.0, -5.0)), people=[...])

Names are loaded when they are first used, so that `import sidestep` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sidestep.errors import InvalidFile, InvalidInput, MissingExtra, OutputError, SidestepError, UnknownName
    from sidestep.fleet import Announced, FleetPlanner
    from sidestep.human.model import HumanModel
    from sidestep.human.observation import PersonObservation
    from sidestep.lattice import Lattice
    from sidestep.obstacles import Obstacles
    from sidestep.planner import Planner
    from sidestep.planning.plan import PersonPlan, Plan
    from sidestep.planning.settings import PlannerSettings
    from sidestep.prediction.occupancy import Occupancy
    from sidestep.robots import DifferentialDrive, Holonomic, RobotState
    from sidestep.safety_filter import SafetyFilter
    from sidestep.simulation.loop import simulate
    from sidestep.simulation.record import Record
    from sidestep.simulation.scenario import Scenario

__version__ = "0.1.0"

_HOME = {
    "Announced": "fleet",
    "DifferentialDrive": "robots",
    "FleetPlanner": "fleet",
    "Holonomic": "robots",
    "HumanModel": "human.model",
    "InvalidFile": "errors",
    "InvalidInput": "errors",
    "Lattice": "lattice",
    "MissingExtra": "errors",
    "Obstacles": "obstacles",
    "Occupancy": "prediction.occupancy",
    "OutputError": "errors",
    "PersonObservation": "human.observation",
    "PersonPlan": "planning.plan",
    "Plan": "planning.plan",
    "Planner": "planner",
    "PlannerSettings": "planning.settings",
    "Record": "simulation.record",
    "RobotState": "robots",
    "SafetyFilter": "safety_filter",
    "Scenario": "simulation.scenario",
    "SidestepError": "errors",
    "UnknownName": "errors",
    "simulate": "simulation.loop",
}

__all__ = [
    "Announced",
    "DifferentialDrive",
    "FleetPlanner",
    "Holonomic",
    "HumanModel",
    "InvalidFile",
    "InvalidInput",
    "Lattice",
    "MissingExtra",
    "Obstacles",
    "Occupancy",
    "OutputError",
    "PersonObservation",
    "PersonPlan",
    "Plan",
    "Planner",
    "PlannerSettings",
    "Record",
    "RobotState",
    "SafetyFilter",
    "Scenario",
    "SidestepError",
    "UnknownName",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sidestep' has no attribute {name!r}")
    value = getattr(import_module(f"sidestep.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
