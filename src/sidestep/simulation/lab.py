"""The simulated lab: scanner → tracker → planner → base, closed over people who walk on two legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.perception.classifier import LegClassifier
from sidestep.perception.clear_mot import MotScore
from sidestep.planning.plan import Plan
from sidestep.robots import RobotState
from sidestep.simulation.lab_people import LabWalker
from sidestep.simulation.lab_room import LabRoom, LabSettings, lab_room
from sidestep.simulation.lab_senses import LabSenses, Rays, SceneRays
from sidestep.simulation.lidar import Scanner
from sidestep.simulation.loop import Run
from sidestep.simulation.record import Record
from sidestep.simulation.recorder import Recorder
from sidestep.types import Vector


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabRun:
    """What happened in one run of the lab.

    Attributes:
        settings: of the run.
        record: as of any run; beliefs are those about the track that stood for each person.
        tracking: CLEAR MOT of people as the planner was told of them.
        reactions: s, instants of decisions at which a concerned and an unconcerned person in this place would have done
            different things: without any, nobody can tell them apart.
        scans: measured; arrived: that reached the planner's computer.
        scan_age: s, mean age, at the planning instants, of the newest scan that the tracker had.
        drift: m, by which the robot's own idea of its place was off in the end.
        bumped: s during which the base touched furniture (MuJoCo only).
    """

    settings: LabSettings
    record: Record
    tracking: MotScore
    reactions: tuple[float, ...]
    scans: int
    arrived: int
    scan_age: float
    drift: float
    bumped: float


class Base(Protocol):
    """What moves the robot."""

    bumped: float
    """s of contact with furniture so far."""

    def drive(self, velocity: Vector, state: RobotState, duration: float) -> RobotState:
        """Make the reference follow a velocity (2,) m/s for `duration` s, from where the base is; return the state."""
        ...


def run_lab(settings: LabSettings, *, classifier: LegClassifier | None = None, snapshots: int = 6) -> LabRun:
    """Run the lab once.

    Args:
        settings: of the run.
        classifier: of the tracker; None: the one that comes with the package.
        snapshots: steps of which predicted occupancies are kept in the record.

    Raises:
        MissingExtra: `physics` is "mujoco" and MuJoCo is not installed.
    """
    room = lab_room(settings)
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence((settings.seed, 0x5EE)).spawn(2)]
    scanner = Scanner()
    base: Base | None = None
    rays: Rays = SceneRays(room.scene, scanner, streams[0])
    if settings.physics == "mujoco":
        from sidestep.simulation.lab_physics import Physics

        physics = Physics(room, scanner, streams[0])
        base, rays = physics, physics
    loop = _Lab(settings, room, rays, base, scanner, streams[1], classifier, snapshots)
    record = loop.finish()
    return LabRun(
        settings=settings,
        record=record,
        tracking=loop.senses.check.score(),
        reactions=tuple(t for person in loop.people if isinstance(person, LabWalker) for t in person.reactions),
        scans=loop.senses.scans,
        arrived=loop.senses.arrived,
        scan_age=float(np.mean(loop.ages)),
        drift=float(np.hypot(*(loop.senses.odometry.pose - loop.senses.true_pose)[:2])),
        bumped=0.0 if base is None else base.bumped,
    )


class _Lab(Run):
    """A run whose sensor is a tracker, whose robot knows itself by odometry, and whose base may be physical."""

    def __init__(
        self,
        settings: LabSettings,
        room: LabRoom,
        rays: Rays,
        base: Base | None,
        scanner: Scanner,
        generator: np.random.Generator,
        classifier: LegClassifier | None,
        snapshots: int,
    ) -> None:
        kinds = {"concerned": LabWalker, "unconcerned": LabWalker}
        super().__init__(room.scenario, kinds=kinds, snapshots=snapshots)
        self._base = base
        self.ages: list[float] = []
        self.senses = LabSenses(
            settings,
            room,
            rays=rays,
            people=self.people,
            start=self.state,
            generator=generator,
            scanner=scanner,
            classifier=classifier,
        )
        self.sensor = self.senses
        self.recorder = _LabRecorder(self, snapshots)
        self.senses.warm_up(self.people, self.scenario.step)
        self.recorder.instant(0.0, self.state.position, self.state.heading, self.places)

    @property
    def known(self) -> RobotState:
        """The robot's state by its odometry, in whose frame the goal is given, too."""
        return self.senses.believed(self.state)

    def _plan(self, now: float, observations: Sequence[PersonObservation]) -> float:
        """Ask the planner, and note how old the last scan is by then."""
        self.ages.append(now - self.senses.tracker.time)
        return super()._plan(now, observations)

    def _moved(self, step: float) -> RobotState:
        """The robot's true state one control step later."""
        base = self._base
        after = super()._moved(step) if base is None else base.drive(self._in_force.velocity, self.state, step)
        self.senses.move(after)
        return after


class _LabRecorder(Recorder):
    """Writes beliefs down under the names of the people for whom the tracks stood."""

    def __init__(self, lab: _Lab, snapshots: int) -> None:
        super().__init__(lab.scenario, lab.people, snapshots)
        self._lab = lab

    def step(self, motion: object, status: str, *, planning_time: float, age: float, planned: bool) -> None:
        """Write down the plan in force, tracks renamed."""
        if isinstance(motion, Plan):
            names = self._lab.senses.check.names
            people = {self.people[names[t]].id: person for t, person in motion.people.items() if t in names}
            motion = replace(motion, people=people)
        super().step(motion, status, planning_time=planning_time, age=age, planned=planned)
