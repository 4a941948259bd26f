"""What is executed is what was certified: real bases, in closed loop among people, over seeds."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.io.scenarios import load_scenario
from sidestep.planning.plan import Plan
from sidestep.planning.stopping import LAG
from sidestep.simulation.loop import Run

BASES = {
    "differential": ["robot.kind=differential", "robot.max_speed=0.7", "robot.radius=0.2"],
    "differential, slow to turn": ["robot.kind=differential", "robot.max_speed=0.5", "robot.max_turn_rate=1.0"],
    "differential, limited acceleration": [
        "robot.kind=differential", "robot.max_speed=0.7", "robot.max_acceleration=1.0",
        "robot.max_turn_acceleration=4.0",
    ],
    "holonomic, limited acceleration": ["robot.max_acceleration=1.5"],
}  # fmt: skip


def _largest_gap(changes: list[str], seed: int) -> tuple[float, int]:
    """How far (m) the reference left the plan in force until the next plan, and the steps that this was looked at."""
    scenario = load_scenario("crossing", [*changes, f"seed={seed}", "control_step=0.05", "people.0.kind=unconcerned"])
    run = Run(scenario, snapshots=0)
    largest, looked = 0.0, 0
    while run.time < 16.0 and not run.advance():
        plan = run.motion
        assert isinstance(plan, Plan)
        since = run.time - run.planned_at
        certified = [np.interp(since, plan.time_step * np.arange(len(plan.positions)), x) for x in plan.positions.T]
        largest = max(largest, float(np.linalg.norm(run.robot.reference(run.state) - certified)))
        looked += plan.velocity.any()
    return largest, looked


@pytest.mark.slow
@pytest.mark.parametrize("name", BASES)
def test_the_executed_path_stays_with_the_certified_one(name):
    for seed in range(3):
        gap, looked = _largest_gap(BASES[name], seed)
        assert looked > 100
        assert gap <= LAG
