"""Runs that share their planners are the runs that each would have been alone."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from sidestep.human.observation import PersonObservation
from sidestep.io.scenarios import load_scenario
from sidestep.planner import Planner
from sidestep.robots import Holonomic, RobotState
from sidestep.simulation.alike import planned_alike, simulate_alike
from sidestep.simulation.loop import simulate
from sidestep.simulation.record import Record
from sidestep.simulation.run import Step
from sidestep.simulation.scenario import Scenario


def ignore(step: Step) -> None:
    """Look away."""


def encounters(name: str, *changes: str) -> list[Scenario]:
    """Some seeds of a scenario with people of either kind."""
    return [
        load_scenario(name, [*changes, f"people.0.kind={kind}", f"seed={seed}"])
        for kind in ("concerned", "unconcerned")
        for seed in range(3)
    ]


def assert_equal(one: Record, other: Record) -> None:
    for field in fields(Record):
        if field.name != "planning_time":
            np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name), field.name)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("paper-authors", ("duration=8.0", "planner.horizon=4", "planner.risk_rule=cells")),
        ("paper-authors", ("duration=8.0", "planner.horizon=7", "planner.risk_rule=cells", "human.horizon=0")),
        ("crossing", ("measurement.position_noise=0.05",)),  # nobody is told the same twice, but at the start
        ("crossing", ("control_step=0.25",)),
        ("crossing", ("stop_at_goal=true",)),
        ("doorway", ("duration=6.0",)),
    ],
)
def test_each_record_is_the_one_of_a_run_alone(name: str, changes: tuple[str, ...]) -> None:
    scenarios = encounters(name, *changes)
    together = simulate_alike(scenarios, [ignore] * len(scenarios))
    for scenario, record in zip(scenarios, together, strict=True):
        assert_equal(record, simulate(scenario, snapshots=0))


def test_what_is_told_alike_is_planned_once(monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = encounters("paper-printed", "duration=10.0", "planner.horizon=2")
    planned: list[float] = []
    step = Planner.step

    def counted(self: Planner, *, time: float, robot: RobotState, people: list[PersonObservation]) -> object:
        planned.append(time)
        return step(self, time=time, robot=robot, people=people)

    monkeypatch.setattr(Planner, "step", counted)
    seen: list[list[float]] = [[] for _ in scenarios]
    watchers = [lambda step, times=times: times.append(step.time) for times in seen]
    simulate_alike(scenarios, watchers)
    assert all(times == seen[0] for times in seen)
    assert planned.count(0.0) == 1
    # with the printed values the two kinds of people do the same, so that there are no more plans than seeds
    assert len(planned) <= 3 * len(seen[0])
    assert len(planned) > len(seen[0])


def test_who_plans_otherwise_is_not_mixed_in() -> None:
    one, other = (load_scenario("crossing", [f"planner.horizon={n}"]) for n in (3, 4))
    assert planned_alike(one) != planned_alike(other)
    assert planned_alike(one) == planned_alike(load_scenario("crossing", ["planner.horizon=3", "seed=7"]))
    with pytest.raises(ValueError, match="not planned alike"):
        simulate_alike([one, other], [ignore, ignore])


def test_twins_know_the_same_and_go_their_own_ways() -> None:
    def seen(x: float) -> list[PersonObservation]:
        return [PersonObservation(id="a", position=(x, 2.0), velocity=(0.4, -0.8))]

    def told(planner: Planner, time: float, x: float) -> list[float]:
        plan = planner.step(time=time, robot=RobotState(position=(0.0, -2.0 + time)), people=seen(x))
        return [*plan.velocity.tolist(), plan.people["a"].belief, plan.cost]

    def new() -> Planner:
        return Planner(robot=Holonomic(max_speed=1.0, radius=0.3), goal=(0.0, 5.0), horizon=4)

    first, alone = new(), new()
    for k in range(3):
        assert told(first, 0.5 * k, -1.0 + 0.2 * k) == told(alone, 0.5 * k, -1.0 + 0.2 * k)
    twin = first.twin()
    elsewhere = told(twin, 1.5, -1.5)
    assert told(first, 1.5, -0.4) == told(alone, 1.5, -0.4) != elsewhere
    assert told(twin, 2.0, -1.6) != told(first, 2.0, -0.2) == told(alone, 2.0, -0.2)
