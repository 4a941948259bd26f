"""Several robots among the same people: in the order of priority each observes, hears the others' plans, and plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sidestep.fleet import Announced, FleetPlanner
from sidestep.planning.anticipate import carried_forward, straight
from sidestep.planning.plan import Plan
from sidestep.simulation.assembly import obstacles_of, robot_of
from sidestep.simulation.navigators import Navigator
from sidestep.simulation.people import Builder
from sidestep.simulation.record import Record
from sidestep.simulation.recordings import Recording
from sidestep.simulation.run import Run, Step
from sidestep.simulation.scenario import Scenario
from sidestep.types import frozen_array

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles


class TeamRun:
    """One run of a scenario with further `robots`; the scenario's own `robot` goes first.

    People react to the robot that is nearest to them.

    Args:
        scenario: the run.
        navigator: drives the first robot; None, like all others: a `FleetPlanner` that the scenario describes.
        recording, obstacles, kinds, on_step, snapshots: as for `simulate`; `on_step` sees the first robot.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        navigator: Navigator | None = None,
        recording: Recording | None = None,
        obstacles: Obstacles | None = None,
        kinds: Mapping[str, Builder] | None = None,
        on_step: Callable[[Step], object] | None = None,
        snapshots: int = 6,
    ) -> None:
        walls = obstacles_of(scenario) if obstacles is None else obstacles
        self.scenario = scenario
        self.runs: list[Run] = []
        for number, robot in enumerate((scenario.robot, *scenario.robots)):
            own = scenario.model_copy(update={"robot": robot})
            first = self.runs[0] if self.runs else None
            run = Run(
                own,
                navigator=fleet_planner_of(own, walls) if navigator is None or first else navigator,
                recording=recording,
                obstacles=walls,
                kinds=kinds,
                on_step=None if first else on_step,
                snapshots=snapshots if first is None else 0,
                people=None if first is None else first.people,
                number=number,
            )
            self.runs.append(run)

    def finish(self, *, keep_interrupted: bool = False) -> tuple[Record, ...]:
        """Run until every robot has been at its goal, or to the end; one record per robot. See `Run.finish`."""
        s = self.scenario
        try:
            for _ in range(max(round(s.duration / s.step), 1)):
                self.advance()
                if s.stop_at_goal and all(run.reached for run in self.runs):
                    break
        except KeyboardInterrupt:
            if not keep_interrupted:
                raise
        return self.records()

    def advance(self) -> None:
        """Do one control step of everybody."""
        first = self.runs[0]
        now, step = first.time, self.scenario.step
        planned = first.index % first.every == 0
        for run in self.runs:
            if planned and isinstance(run.navigator, FleetPlanner):
                run.navigator.announce([self._announced(other, now) for other in self.runs if other is not run])
            run.think(now, planned=planned)
        self._people_decide(now)
        for run in self.runs:
            run.note(now, planned=planned)
        for person in first.people:
            person.move(now, now + step)
        for run in self.runs:
            run.settle(now + step)

    def records(self) -> tuple[Record, ...]:
        """Return what has happened so far, as each robot lived it."""
        found = [run.record() for run in self.runs]
        radii = np.array([record.robot_radius for record in found])
        whole: list[Record] = []
        for i, record in enumerate(found):
            others = [j for j in range(len(found)) if j != i]
            ticks = np.arange(len(record.time))
            # an interruption may leave one robot a step behind
            paths = [found[j].robot_positions[np.minimum(ticks, len(found[j].time) - 1)] for j in others]
            goals = np.array([found[j].robot_goal for j in others])
            whole.append(
                replace(
                    record,
                    other_robots=frozen_array(np.stack(paths, axis=1)),
                    other_radii=frozen_array(radii[others]),
                    other_goals=frozen_array(goals),
                )
            )
        return tuple(whole)

    def _announced(self, run: Run, now: float) -> Announced:
        """What a robot has told the others by now: its plan, or nothing yet, which means that it stands."""
        settings, motion = run.scenario.planner, run.motion
        here, steps = run.robot.reference(run.state), settings.horizon
        told = partial(
            Announced,
            radius=run.robot.planning_radius,
            velocity=run.robot.reference_velocity(run.state),
            acceleration=run.robot.planning_acceleration,
        )
        if motion is None:
            return told(path=np.repeat(here[None], 2, axis=0), settled=False)
        if isinstance(motion, Plan):
            path = carried_forward(motion, time=now, start=here, goal=run.goal, steps=steps)
        else:
            speed = float(np.linalg.norm(motion.velocity))
            path = straight(here, here + 1e3 * motion.velocity, speed=speed, time_step=settings.time_step, steps=steps)
        return told(path=path, settled=run.planned_at == now)

    def _people_decide(self, now: float) -> None:
        if not self.runs[0].people:
            return
        paths = [run.anticipated(now) for run in self.runs]
        gaps = np.array([np.linalg.norm(run.places - run.state.position, axis=1) for run in self.runs])
        nearest = np.where(np.isnan(gaps), np.inf, gaps).argmin(axis=0)
        for i, person in enumerate(self.runs[0].people):
            which = int(nearest[i])
            person.decide(self.runs[which].surroundings(now, i, paths[which]))


def fleet_planner_of(scenario: Scenario, obstacles: Obstacles | None) -> FleetPlanner:
    """Return the planner that a scenario describes, for a robot among others."""
    return FleetPlanner(
        robot=robot_of(scenario),
        goal=scenario.robot.goal,
        human=scenario.human,
        obstacles=obstacles,
        settings=scenario.planner,
    )
