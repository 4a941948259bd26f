"""Who is visiting: one world per open page, freed when the page is gone."""

from __future__ import annotations

import secrets
import threading

from sidestep.errors import InvalidInput
from sidestep.simulation.assembly import obstacles_of
from sidestep.simulation.record import Record
from sidestep.viewer.live import stage
from sidestep.viewer.live.navigators import require
from sidestep.viewer.live.replay import Replay
from sidestep.viewer.live.session import Load, Session, Walls
from sidestep.viewer.live.settings import LiveSettings

MOST_VISITORS = 32  # worlds at the same time


class Visit:
    """One open page: its settings, and its world while the page is connected.

    Args:
        load: name → scenario.
        settings: to begin with.
        record: shown instead of a live world; None: a live world.
        walls: scenario → its walls.
    """

    def __init__(
        self, *, load: Load, settings: LiveSettings, record: Record | None, walls: Walls = obstacles_of
    ) -> None:
        self.settings = settings
        self.trouble = ""
        self.malformed = 0
        self.connections = 0
        self.driver: object = None  # the connection that advances the world
        self.turn = threading.Lock()  # one step at a time
        self._load = load
        self._walls = walls
        self._record = record
        self.world: Session | Replay | None = None

    def enter(self) -> Session | Replay:
        """Return the visit's world; made now where there is none yet."""
        if self.world is None:
            self.world = self._make()
        self.world.greet()
        return self.world

    @property
    def present(self) -> bool:
        """The page has a world, or is connected and about to get one."""
        return self.world is not None or self.connections > 0

    def free(self) -> None:
        """Let go of the world and its planners; `enter` makes a new one."""
        self.world = None

    def change(self, name: str, value: object) -> None:
        """Change one setting.

        Raises:
            InvalidInput: it is not allowed; nothing has changed.
            MissingExtra: the planner beside ours is not installed; nothing has changed.
        """
        settings = self.settings.changed(name, value)
        require(settings.beside)
        self._load(settings.scenario)
        self.settings = settings
        if isinstance(self.world, Session):
            self.world.configure(settings)

    def numbers(self) -> dict[str, float]:
        """Return the numbers in force where a setting may leave them to the scenario."""
        source = self._load(self.settings.scenario)
        scenario = stage.with_settings(source, self.settings)
        return {
            "people": stage.people_count(source, self.settings),
            "horizon": scenario.planner.horizon,
            "risk_limit": scenario.planner.risk_limit,
            "clearance": scenario.clearance,
            "randomness": scenario.human.randomness,
            "robot_speed": scenario.robot.max_speed,
        }

    def show(self, record: Record | None) -> None:
        """Show a record, or with None a live world again."""
        self._record = record
        if self.world is not None:
            self.world = self._make()

    @property
    def live(self) -> bool:
        """A live world is shown, not a record."""
        return self._record is None

    def record(self) -> Record:
        """Return the present trip, or the record that is shown.

        Raises:
            InvalidInput: nothing has happened yet.
        """
        if self.world is None:
            raise InvalidInput("record", None, "a trip that has begun", "press play")
        return self.world.record()

    def _make(self) -> Session | Replay:
        if self._record is not None:
            return Replay(self._record)
        return Session(load=self._load, settings=self.settings, seed=secrets.randbelow(2**31), walls=self._walls)


class Visits:
    """All open pages, by a token that only the page itself knows."""

    def __init__(
        self, *, load: Load, settings: LiveSettings, record: Record | None, walls: Walls = obstacles_of
    ) -> None:
        self._load, self._walls, self._settings, self._record = load, walls, settings, record
        self._visits: dict[str, Visit] = {}

    def __len__(self) -> int:
        return len(self._visits)

    @property
    def worlds(self) -> int:
        """Worlds, with their planners, that are held in memory."""
        return sum(visit.world is not None for visit in self._visits.values())

    @property
    def full(self) -> bool:
        """No place is free."""
        return sum(visit.present for visit in self._visits.values()) >= MOST_VISITORS

    def admit(self) -> str | None:
        """Return the token of a new visit, or None when there are too many worlds already."""
        if self.full:
            return None
        token = secrets.token_urlsafe(16)
        self._visits[token] = Visit(load=self._load, settings=self._settings, record=self._record, walls=self._walls)
        return token

    def get(self, token: str) -> Visit | None:
        """Return the visit of `token`, or None."""
        return self._visits.get(token)

    def leave(self, token: str) -> None:
        """Forget a visit and free its world."""
        visit = self._visits.pop(token, None)
        if visit is not None:
            visit.free()
