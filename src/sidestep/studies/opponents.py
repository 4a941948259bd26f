"""Who is compared: ours, ours with one part taken away, and the opponents; all with the same limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sidestep.human.model import HumanModel
from sidestep.obstacles import Obstacles
from sidestep.simulation.assembly import planner_of, walls_of
from sidestep.simulation.navigators import Navigator, Trip
from sidestep.simulation.peers_mpc import ConstantVelocityMpc
from sidestep.simulation.peers_navground import Navground
from sidestep.simulation.peers_orca import Orca
from sidestep.simulation.peers_simple import ConstantVelocityChance, StopAndGo
from sidestep.simulation.scenario import Scenario

OPPONENT_RISK = 0.05
"""P_th of the chance-constrained opponent: the limit that is aimed at per encounter."""
FAR_PLACES = tuple((5.0 + 20.0 * math.cos(a), 20.0 * math.sin(a)) for a in np.arange(8) * math.pi / 4)
"""m, all round the middle of the trip: where people may want to go, for whom does without directions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contestant:
    """One navigator of the comparison.

    Attributes:
        name: for tables.
        description: one line.
        build: (scenario, walls or None) → navigator.
        kind: "ours", "ablation" or "opponent".
        quick: part of `--quick`.
        needs_peers: comes with the extra [peers].
    """

    name: str
    description: str
    build: Callable[[Scenario, Obstacles | None], Navigator]
    kind: str = "opponent"
    quick: bool = False
    needs_peers: bool = False


def trip_of(scenario: Scenario) -> Trip:
    """Return what the opponents are told of a scenario: the goal, and the limits that our planner has too."""
    radii = [p.radius or scenario.human.radius for p in scenario.people] or [scenario.human.radius]
    return Trip(
        goal=np.array(scenario.robot.goal),
        max_speed=scenario.robot.max_speed,
        robot_radius=scenario.robot.radius,
        person_radius=max(radii),
        clearance=scenario.clearance,
        risk_limit=OPPONENT_RISK,
        time_step=scenario.period,
        walls=walls_of(scenario),
    )


def contestants() -> Mapping[str, Contestant]:
    """Return everybody by name, in the order of the table."""
    every = [
        Contestant(name="sidestep", description="ours", build=_ours(), kind="ours", quick=True),
        _peer("orca", "optimal reciprocal collision avoidance (RVO2)", Orca, quick=True),
        _peer("hl", "human-like (navground)", lambda trip: Navground(trip, "HL")),
        _peer("hrvo", "hybrid reciprocal velocity obstacles (navground)", lambda trip: Navground(trip, "HRVO")),
        _peer("social-force", "social force (navground)", lambda trip: Navground(trip, "SocialForce")),
        _peer("mpc", "constant-velocity MPC (casadi, IPOPT)", ConstantVelocityMpc),
        _peer("chance", "constant velocity, chance constraint", ConstantVelocityChance, quick=True, needs_peers=False),
        _peer("stop-and-go", "straight, or not at all", StopAndGo, quick=True, needs_peers=False),
        _ablation("unconcerned", "β = 0 for everybody: nobody ever gives way", human={"danger_weight": 0.0}),
        _ablation(
            "concerned",
            "β = 1 for everybody: everybody gives way",
            human={"prior_concerned": 1.0 - 1e-15, "switch_rate": 0.0},
        ),
        _ablation("no-anticipation", "N_H = 0: people take the robot to stand", human={"horizon": 0}),
        _ablation("cells", "the paper's rule: away from every likely cell", planner={"risk_rule": "cells"}),
        _ablation("no-directions", "goals are eight far places, not directions", human={"goals": FAR_PLACES}),
        _ablation("no-steadiness", "one steadiness for all", human={"steadiness": False}),
        _ablation("fixed-randomness", "ω is not learned", human={"online_randomness": False}),
        _ablation("no-filter", "measured positions as they are", human={"motion_filter": False}),
        _ablation("no-soft-risk", "risk below the limit is free", planner={"soft_risk_weight": 0.0}),
        _ablation("no-terminal-weight", "the way beyond the horizon is free", planner={"terminal_weight": 0.0}),
        _ablation("no-acceleration-weight", "changes of velocity are free", planner={"acceleration_weight": 0.0}),
        _ablation("no-first-step", "the first step is not swept", planner={"first_step_limit": None}),
        _ablation(
            "no-recourse",
            "limits hold to the end, even where the only such motion gives way",
            planner={"recourse": None},
        ),
        _ablation("no-detour", "no way is laid around people who stand", planner={"detour_after": None}),
        _ablation("no-midway", "only the samples are looked at", planner={"midway": False}),
    ]
    return {c.name: c for c in every}


def _peer(
    name: str, description: str, build: Callable[[Trip], Navigator], *, quick: bool = False, needs_peers: bool = True
) -> Contestant:
    return Contestant(
        name=name,
        description=description,
        build=lambda scenario, _: build(trip_of(scenario)),
        quick=quick,
        needs_peers=needs_peers,
    )


def _ablation(
    name: str, description: str, human: Mapping[str, Any] | None = None, planner: Mapping[str, Any] | None = None
) -> Contestant:
    return Contestant(name=f"sidestep-{name}", description=description, build=_ours(human, planner), kind="ablation")


def _ours(
    human: Mapping[str, Any] | None = None, planner: Mapping[str, Any] | None = None
) -> Callable[[Scenario, Obstacles | None], Navigator]:
    """Return a builder of our planner with some fields of its models changed."""

    def build(scenario: Scenario, obstacles: Obstacles | None) -> Navigator:
        model: HumanModel = replace(scenario.human, **human) if human else scenario.human
        settings = replace(scenario.planner, **planner) if planner else scenario.planner
        return planner_of(scenario.model_copy(update={"human": model, "planner": settings}), obstacles)

    return build
