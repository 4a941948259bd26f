"""One visitor's world: the person they steer, one or two robots around it, and the clock. Knows no browser."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.errors import SidestepError
from sidestep.simulation.assembly import obstacles_of
from sidestep.simulation.navigators import Navigator
from sidestep.simulation.outlines import outlines
from sidestep.simulation.record import Record
from sidestep.simulation.scenario import Scenario
from sidestep.viewer.live import messages, stage
from sidestep.viewer.live.frames import frame, plan_packet
from sidestep.viewer.live.navigators import TITLES, navigator_of
from sidestep.viewer.live.settings import LiveSettings
from sidestep.viewer.live.visitor import Visitor
from sidestep.viewer.live.wire import Packet, numbers, text
from sidestep.viewer.live.world import World

if TYPE_CHECKING:
    from sidestep.obstacles import Obstacles

PAUSE_AT_GOAL = 1.5  # s between the last robot's arrival and the way back
MOST_WAITING = 256  # messages kept between two steps; a flood beyond that is dropped
YOUNG = 2.0  # s; a trip younger than this is not worth a record while there is an older one

Load = Callable[[str], Scenario]
Walls = Callable[[Scenario], "Obstacles | None"]
Choose = Callable[[str, Scenario, Any], Navigator]
"""(name of a planner, scenario of one trip, walls) → navigator."""


class Session:
    """Advanced by `tick`, which returns what the browser has to be told; steered by `post`.

    `post` may be called from another thread than `tick`; everything it brings takes effect at the next tick.

    Args:
        load: name → scenario.
        settings: to begin with.
        seed: of simulated people and their places.
        choose: makes the planners.
        walls: scenario → its walls; the default knows polygons only, no map files.
    """

    def __init__(
        self,
        *,
        load: Load,
        settings: LiveSettings | None = None,
        seed: int = 0,
        choose: Choose = navigator_of,
        walls: Walls = obstacles_of,
    ) -> None:
        self.settings = settings or LiveSettings()
        self.running = True
        self.trouble = ""
        self.pace = 1.0
        self._load = load
        self._choose = choose
        self._walls = walls
        self._seed = seed
        self._inbox: deque[messages.Message | LiveSettings] = deque(maxlen=MOST_WAITING)
        self._steps = 0
        self._clock = 0.0
        self._greet = True
        self._finished: Record | None = None
        self._rest = 0.0
        self.worlds: list[World] = []
        self._open(self.settings)

    @property
    def interval(self) -> float:
        """Seconds between two ticks."""
        return stage.CONTROL_STEP

    def post(self, message: messages.Message) -> None:
        """Take a message from the browser; it acts at the next tick."""
        self._inbox.append(message)

    def configure(self, settings: LiveSettings) -> None:
        """Go on with other settings from the next tick on."""
        self._inbox.append(settings)

    def greet(self) -> None:
        """Tell the browser everything again at the next tick (it has just connected)."""
        self._greet = True

    def tick(self) -> list[Packet]:
        """Take in what was posted, advance one control step if running, and return what to send."""
        while self._inbox:
            item = self._inbox.popleft()
            if isinstance(item, LiveSettings):
                self._change(item)
            else:
                self._act(item)
        fresh: list[Packet] = []
        if self.running or self._steps > 0:
            self._steps = max(self._steps - 1, 0)
            fresh = self._advance()
        if self._greet:
            self._greet = False
            fresh = [self.scene(), *self._plans()]
        return [*fresh, self.frame()]

    def scene(self) -> str:
        """Return what does not change from frame to frame."""
        s = self._scenario
        radii = [(person.id, person.radius) for person in self.worlds[0].run.people]
        return text(
            type="scene",
            mode="live",
            name=s.name,
            bounds=list(self._bounds),
            walls=[numbers(wall) for wall in outlines(self._obstacles)],
            panels=[{"title": world.title, "radius": s.robot.radius, "kind": s.robot.kind} for world in self.worlds],
            people=[{"id": name, "radius": radius, "you": name == Visitor.id} for name, radius in radii],
            limit=s.planner.risk_limit,
            summed=s.planner.risk_rule == "trajectory",
            clearance=s.clearance,
            contact=s.robot.radius + s.human.radius,
            horizon=s.planner.horizon,
            step=s.planner.time_step,
        )

    def frame(self) -> str:
        """Return everything that moves."""
        hand = self.visitor.hand
        return text(
            type="frame",
            time=round(self._clock, 3),
            running=self.running,
            pace=round(self.pace, 3),
            hand=None if hand is None else numbers(hand),
            trouble=self.trouble,
            panels=[frame(world) for world in self.worlds],
        )

    def record(self, panel: int = 0) -> Record:
        """Return the present trip, or the last whole one where the present trip has only begun."""
        world = self.worlds[min(panel, len(self.worlds) - 1)]
        if world.time < YOUNG and self._finished is not None:
            return self._finished
        return world.record()

    def _act(self, message: messages.Message) -> None:
        if isinstance(message, messages.Drag):
            self.visitor.drag(message.point)
        elif isinstance(message, messages.Walk):
            self.visitor.walk(message.direction, hurry=message.hurry)
        elif isinstance(message, messages.Transport):
            self._transport(message.type)

    def _transport(self, name: str) -> None:
        if name == "reset":
            self._open(self.settings)
        elif name == "step":
            self.running = False
            self._steps = round(self._scenario.period / self.interval)
        else:
            self.running = name == "play"

    def _change(self, settings: LiveSettings) -> None:
        """Where the floor stays the same, go on from where everybody is; otherwise begin anew."""
        before = self.settings
        same = (before.scenario, before.people, before.kind, before.beside) == (
            settings.scenario,
            settings.people,
            settings.kind,
            settings.beside,
        )
        try:
            if not same:
                self._reopen(settings)
                return
            self._scenario = stage.with_settings(self._load(settings.scenario), settings)
            self.settings = settings
            for world in self.worlds:
                self._begin(world, from_here=True)
            self._greet = True
            self.trouble = ""
        except SidestepError as error:
            self.trouble = str(error)

    def _reopen(self, settings: LiveSettings) -> None:
        """Everybody at the start; on trouble, which may come with the planners, the old world stays."""
        before = vars(self).copy()
        try:
            self._open(settings)
        except SidestepError:
            vars(self).update(before)
            raise

    def _open(self, settings: LiveSettings) -> None:
        """Everybody at the start."""
        source = self._load(settings.scenario)
        scenario = stage.with_settings(source, settings)
        obstacles = self._walls(source)
        bounds = stage.bounds_of(source, obstacles)
        generator = np.random.Generator(np.random.PCG64(self._seed))

        def free(point: Any) -> bool:
            return obstacles is None or bool(obstacles.free(np.asarray(point), margin=scenario.human.radius))

        people = stage.crowd(source, settings, bounds, generator, free)
        visitor = Visitor(
            start=stage.visitor_start(source), radius=scenario.human.radius, bounds=bounds, obstacles=obstacles
        )
        names = [settings.ignores] + ([settings.beside] if settings.beside != "nothing" else [])
        worlds = [World(name=name, title=TITLES[name], panel=i) for i, name in enumerate(names)]
        self._scenario, self._obstacles, self._bounds, self._people = scenario, obstacles, bounds, people
        self.settings, self.visitor, self.worlds = settings, visitor, worlds
        self._clock, self._rest, self._steps, self._finished = 0.0, 0.0, 0, None
        for world in worlds:
            self._begin(world, from_here=False)
        self._greet = True
        self.trouble = ""

    def _begin(self, world: World, *, from_here: bool, turn: bool = False) -> None:
        """Begin a trip in `world`: at the start, or from where everybody is (`turn`: the other way)."""
        robot = self._scenario.robot
        start, goal, people = robot.start, robot.goal, self._people
        if from_here:
            run = world.run
            start, goal = run.state.position, run.goal
            people = [
                person if np.isnan(place).any() else person.model_copy(update={"start": tuple(map(float, place))})
                for person, place in zip(run.scenario.people[1:], run.places[1:], strict=True)
            ]
        if turn:
            goal = robot.start if world.tally.trip % 2 else robot.goal
            people = [_turned(person, first) for person, first in zip(people, self._people, strict=True)]
            world.tally.next_trip()
        self.visitor.new_trip()
        place = self.visitor.place
        trip = stage.trip(self._scenario, start=start, goal=goal, visitor=place, people=people)
        name = self.settings.ignores if world.panel == 0 else self.settings.beside
        world.name, world.title = name, TITLES[name]
        world.begin(trip, self._choose(name, trip, self._obstacles), self.visitor, self._obstacles)

    def _advance(self) -> list[Packet]:
        for world in self.worlds:
            world.advance()
        self._clock += self.interval
        if self.worlds[0].time > stage.LONGEST_TRIP:
            for world in self.worlds:
                self._begin(world, from_here=True)
        packets = self._plans() if self.worlds[0].planned else []
        if all(world.arrived for world in self.worlds):
            self._rest += self.interval
        if self._rest > PAUSE_AT_GOAL:
            self._rest = 0.0
            self._finished = self.worlds[0].record()
            for world in self.worlds:
                self._begin(world, from_here=True, turn=True)
        return packets

    def _plans(self) -> list[Packet]:
        found = [plan_packet(world, self._clock) for world in self.worlds]
        return [packet for packet in found if packet is not None]


def _turned(person: Any, first: Any) -> Any:
    """`person` on the way to the other one of the two places that `first` went between."""
    if first.goal is None:
        return person
    back = person.goal == first.goal
    return person.model_copy(update={"goal": first.start if back else first.goal, "waypoints": ()})
