"""One robot's run: the one place that orders observe → believe → predict → plan → move, and owns the generators."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.planning.anticipate import carried_forward, straight
from sidestep.planning.plan import Plan
from sidestep.robots import RobotState
from sidestep.simulation.assembly import (
    check_places,
    obstacles_of,
    planner_of,
    recorded_people,
    robot_of,
    start_of,
)
from sidestep.simulation.navigators import Answer, Navigator
from sidestep.simulation.outlines import outlines
from sidestep.simulation.people import Builder, Person, Surroundings, build_people
from sidestep.simulation.record import Record
from sidestep.simulation.recorder import Recorder
from sidestep.simulation.recordings import Recording
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.sensing import Sensor
from sidestep.types import FloatArray, Path, Vector, frozen_array

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles


class Senses(Protocol):
    """What tells the planner about people: `Sensor`, or a scanner with a tracker behind it."""

    def warm_up(self, people: Sequence[Person], step: float) -> None:
        """Look at people during the last instants before the run, one control step (s) apart."""
        ...

    def observe(self, time: float, robot: Vector, people: Sequence[Person]) -> list[PersonObservation]:
        """Return who is seen at `time` (s) from the robot's position (d,) m."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """What a watcher sees of each control step.

    Attributes:
        index: of the step; time: s, at its beginning.
        robot: state then; observations: what the planner was told of people.
        motion: in force; planned: it was made at this step.
        distance: m from the robot to its goal.
    """

    index: int
    time: float
    robot: RobotState
    observations: Sequence[PersonObservation]
    motion: Answer
    planned: bool
    distance: float


class Run:
    """One run while it lasts: `finish` for the whole of it, or `advance` step by step. Arguments as for `simulate`.

    A robot that is not the only one has a `number` > 0, and `people` whom another run made and moves.
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
        people: list[Person] | None = None,
        number: int = 0,
    ) -> None:
        self.scenario = scenario
        self.obstacles = obstacles_of(scenario) if obstacles is None else obstacles
        streams = [
            np.random.Generator(np.random.PCG64(s))
            for s in np.random.SeedSequence([scenario.seed, number] if number else scenario.seed).spawn(
                len(scenario.people) + 1
            )
        ]
        if people is None:
            people = [*build_people(scenario, streams[1:], kinds=kinds), *recorded_people(scenario, recording)]
        self.people = people
        check_places(scenario, self.obstacles, self.people)
        self.sensor: Senses = Sensor(
            scenario.measurement,
            step=scenario.step,
            dimension=scenario.dimension,
            generator=streams[0],
            noisy=recording is not None,
            obstacles=self.obstacles,
        )
        self.robot = robot_of(scenario)
        self.state = start_of(scenario)
        self.goal = frozen_array(scenario.robot.goal)
        self.navigator = planner_of(scenario, self.obstacles) if navigator is None else navigator
        self.navigator.reset()
        self.recorder = Recorder(scenario, self.people, snapshots)
        self.on_step = on_step
        self.places = self._places(0.0)
        self.drift = np.zeros_like(self.places)
        self.motion: Answer | None = None
        self.observations: Sequence[PersonObservation] = ()
        self.planned_at = -1.0
        self.spent = 0.0
        self.index = 0
        self.reached = False  # its goal, at any time so far
        self.interval = scenario.step  # s, between two instants of the record
        self.every = round(scenario.period / scenario.step)
        self.sensor.warm_up(self.people, scenario.step)
        self.recorder.instant(0.0, self.state.position, self.state.heading, self.places)

    @property
    def time(self) -> float:
        """Seconds since the run began."""
        return self.index * self.interval

    def finish(self, *, keep_interrupted: bool = False) -> Record:
        """Run to the end; on KeyboardInterrupt return the whole steps done so far, if they are to be kept."""
        try:
            while not self.over:
                self.advance()
        except KeyboardInterrupt:
            if not keep_interrupted:
                raise
        return self.record()

    @property
    def over(self) -> bool:
        """Whether the time is up, or the robot has arrived and that ends the run."""
        s = self.scenario
        return self.index >= max(round(s.duration / s.step), 1) or (self.reached and s.stop_at_goal)

    def advance(self) -> bool:
        """Do one control step; return whether the robot is at its goal after it."""
        now, planned = self.time, self.index % self.every == 0
        self.think(now, planned=planned)
        self._people_decide(now)
        self.note(now, planned=planned)
        for person in self.people:
            person.move(now, now + self.interval)
        return self.settle(now + self.interval)

    def record(self) -> Record:
        """Return what has happened so far."""
        return self.recorder.record(self.reached, outlines(self.obstacles))

    def think(self, now: float, *, planned: bool) -> None:
        """Observe, and where a plan is due ask the navigator for one."""
        self.observations = self.sensor.observe(now, self.state.position, self.people)
        self.spent = self._plan(now, self.observations) if planned else 0.0

    def note(self, now: float, *, planned: bool) -> None:
        """Write down the motion in force, and show the step to who watches."""
        motion = self._in_force
        self.recorder.step(motion, motion.status, planning_time=self.spent, age=now - self.planned_at, planned=planned)
        if self.on_step is not None:
            distance = math.dist(self.state.position.tolist(), self.goal.tolist())
            self.on_step(
                Step(
                    index=self.index,
                    time=now,
                    robot=self.state,
                    observations=self.observations,
                    motion=motion,
                    planned=planned,
                    distance=distance,
                )
            )

    def settle(self, then: float) -> bool:
        """Move the robot until `then` (s) and look where the people are now; return whether it is at its goal."""
        self.state = self._moved(self.interval)
        before, self.places = self.places, self._places(then)
        self.drift = (self.places - before) / self.interval
        self.recorder.instant(then, self.state.position, self.state.heading, self.places)
        arrived = self._arrived()
        self.reached |= arrived
        self.index += 1
        return arrived

    @property
    def known(self) -> RobotState:
        """The robot's state as it knows it."""
        return self.state

    def _arrived(self) -> bool:
        """Whether the robot is at its goal as far as it knows: its middle, or the point that follows the plan."""
        state = self.known
        followed = self.robot.reference(state)
        goal = self.goal.tolist()
        away = math.dist(followed.tolist(), goal)
        if followed is not state.position:
            away = min(away, math.dist(state.position.tolist(), goal))
        return away <= self.scenario.robot.goal_tolerance

    @property
    def _in_force(self) -> Answer:
        assert self.motion is not None  # every run begins with a planning step
        return self.motion

    def _plan(self, now: float, observations: Sequence[PersonObservation]) -> float:
        """Ask the navigator; seconds of wall clock that it took."""
        began = clock.perf_counter()
        self.motion = self.navigator.step(time=now, robot=self.known, people=observations)
        spent = clock.perf_counter() - began
        self.planned_at = now
        return spent

    def _moved(self, step: float) -> RobotState:
        """The robot's state one control step later; a wall stops it."""
        after = self.robot.follow(self._in_force.velocity, self.state, step)
        walls = self.obstacles
        if walls is not None and not walls.segment_free(self.state.position[None], after.position[None], margin=0.0)[0]:
            still = np.zeros(self.scenario.dimension)
            return RobotState(position=self.state.position, heading=self.state.heading, velocity=still)
        return after

    def _people_decide(self, now: float) -> None:
        if not self.people:
            return
        path = self.anticipated(now)
        for i, person in enumerate(self.people):
            person.decide(self.surroundings(now, i, path))

    def surroundings(self, now: float, index: int, path: Path) -> Surroundings:
        """Return what person `index` knows of a robot that is expected to move along `path` (K+1, d) m."""
        motion = self._in_force
        return Surroundings(
            time=now,
            time_step=self.scenario.planner.time_step,
            robot_path=path,
            robot_velocity=motion.velocity,
            robot_radius=self.scenario.robot.radius,
            others=self.places,
            velocities=self.drift,
            index=index,
            obstacles=self.obstacles,
            signal=isinstance(motion, Plan) and motion.signal,
        )

    def anticipated(self, now: float) -> Path:
        """(K+1, d) m that people can know of the robot's motion: the plan in force, or straight to the goal."""
        s, motion = self.scenario, self._in_force
        steps = s.planner.horizon + max(s.human.horizon or 0, s.planner.horizon, 1)
        here = self.robot.reference(self.state)
        if isinstance(motion, Plan):
            return carried_forward(motion, time=now, start=here, goal=self.goal, steps=steps)
        speed = math.sqrt(motion.velocity.dot(motion.velocity))
        return straight(here, self.goal, speed=speed, time_step=s.planner.time_step, steps=steps)

    def _places(self, time: float) -> FloatArray:
        """(P, d) m, NaN where absent."""
        places = np.full((len(self.people), self.scenario.dimension), np.nan)
        for i, person in enumerate(self.people):
            place = person.position(time)
            if place is not None:
                places[i] = place
        return places
