"""Ways around people who stand. A robot that sees a few steps ahead would wait before them for as long as they stand.

Somebody who stands is passed like a wall is. So once people have stood for a while, the way to the goal is laid around
them, too. It is taken where it costs no more time than the robot has waited already, and a little: who waits for as
long as the detour takes, and goes then, loses at most twice what was needed, however long people go on standing (the
ski-rental rule; Karp 1992, "On-line algorithms versus off-line algorithms"). Who is seen to have stood for longer than
that need not be waited for: the longer somebody has stood, the longer they will.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from threading import Thread
from typing import Any, NamedTuple

import numpy as np

from sidestep.planning.geodesic import DistanceField, Ways, open_ways, way_to
from sidestep.planning.settings import PlannerSettings
from sidestep.robots import Robot
from sidestep.robots.holonomic import diagonal
from sidestep.site import Site
from sidestep.types import Vector

STILL = 0.3
"""m from where they came to stand, within which people stand."""
SIGHT = 10.0
"""m from the robot, within which people who stand are gone around."""
IN_VIEW = 4.0
"""m from the robot, within which somebody who is not seen is not there any more."""
FORGOTTEN = 60.0
"""s after which nobody is taken to stand where they were seen last."""
ROOM, BRAKED_ROOM, MOST_ROOM = 0.4, 0.5, 1.0
"""m beyond contact that a robot needs beside somebody who stands: any base, one of limited acceleration, at most."""
PATIENCE, WIDER = 6.0, 0.2
"""s without getting on, on a way around people, after which the robot is taken to need so many m more beside them."""
NUDGE = 0.5
"""m that a goal may be moved by and still be the same: what was waited before counts on."""
PROGRESS = 0.2
"""m nearer to the goal, by which the robot has not waited."""
SHIFT = 0.15
"""m that somebody may shift before the way is laid anew."""
COARSEST = 0.3
"""m between cells, above which somebody may stand between them: no way is laid around people then."""
AROUND = 4.0
"""m beyond what the robot reaches within the horizon, that the way is laid for where there is no map."""


class Disc(NamedTuple):
    """What takes room: centre (d,) m, radius m, and what it is one of, in a word."""

    centre: Vector
    radius: float
    kind: str = "people"


class Course(NamedTuple):
    """The walking distance to the goal (None: straight), what is to be said of it, and for how long nothing is gained.

    What is said begins with "; ", or is "". How long is in s.
    """

    field: DistanceField | None
    remark: str = ""
    waited: float = 0.0


@dataclass(frozen=True, slots=True)
class Stand:
    """Somebody who has not gone away.

    Attributes:
        place: (2,) m, where they came to stand; here: (2,) m, where they are.
        since: s, when; seen: s, last.
        contact: m between centres at which bodies touch.
        kind: what they are one of.
    """

    place: Vector
    here: Vector
    since: float
    seen: float
    contact: float
    kind: str


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """A way around people.

    Attributes:
        centres: id → (2,) m, where they stand; room: m beyond contact, at most; field: the way.
    """

    centres: Mapping[str, Vector]
    room: float
    field: DistanceField

    def fits(self, standing: Mapping[str, Stand], room: float) -> bool:
        """Whether it leads around just these."""
        if room != self.room or self.centres.keys() != standing.keys():
            return False
        return all(math.dist(self.centres[name], stand.here) < SHIFT for name, stand in standing.items())


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """How it goes on ways around people.

    Attributes:
        failed: how many led nowhere, since the room beside people was not enough.
        way: the present one; left: m to the goal along it, the least so far.
        stuck: s on it since then.
    """

    failed: int = 0
    way: DistanceField | None = None
    left: float = math.inf
    stuck: float = 0.0

    def along(self, way: DistanceField, left: float, here: Vector, passed: float) -> Trial:
        """What is known after so many s more, with so many m left from `here` (2,) m on a way that is followed."""
        before = self.left
        if self.way is not None and self.way is not way:
            before += left - way_to(self.way.goal, here, self.way)  # another way is no progress
        if left < before - PROGRESS:
            return replace(self, way=way, left=left, stuck=0.0)
        if self.stuck + passed >= PATIENCE:
            return Trial(self.failed + 1)
        return replace(self, way=way, left=before, stuck=self.stuck + passed)


class Laying:
    """A way that is being laid by a thread of its own, so that nobody has to wait for it."""

    def __init__(self, lay: Callable[[], Laid]) -> None:
        self.laid: Laid | None = None
        self._thread = Thread(target=self._run, args=(lay,), name="sidestep-detour", daemon=True)
        with suppress(RuntimeError):  # no thread is to be had: another time
            self._thread.start()

    @property
    def over(self) -> bool:
        """Whether it has ended, with `laid` or without."""
        return not self._thread.is_alive()

    def _run(self, lay: Callable[[], Laid]) -> None:
        self.laid = lay()


class Detours:
    """Who stands where, for how long the robot has waited, and the way around.

    With a deadline, ways are laid while planning goes on without them: on a map of 100 m by 100 m that takes a third of
    a second, on one of 12 m by 12 m 4 ms. Where goal or map are set anew, that lays them, too (`renew`).
    """

    def __init__(self, robot: Robot, settings: PlannerSettings) -> None:
        self._robot = robot
        within = settings.horizon * settings.time_step  # s
        self._reach = within * robot.planning_speed * diagonal(robot.shape, 2)  # m
        self._after = None if isinstance(settings.goal_weight, tuple) else settings.detour_after
        self._aside = settings.deadline is not None
        self._timeout = settings.timeout
        self._stands: Mapping[str, Stand] = {}
        self._site: Site | None = None
        self._least = math.inf  # m to the goal, the least so far
        self._progress = 0.0  # s, when that was
        self._latest = math.inf  # s, of the last call
        self._trial = Trial()
        self._ways: Ways | None = None  # where there is no map
        self._laid: Laid | None = None
        self._laying: Laying | None = None
        self._told: tuple[Mapping[str, Stand], float] | None = None  # around whom, m beyond contact

    def renew(self, site: Site) -> None:
        """Take another goal or map. With a deadline the way around those who stand is laid at once, unlike in `course`.

        A thread would be done after the next call only: never where goal or map are set before every call.
        """
        before, self._ways = self._ways, None
        self._laid = self._laying = None
        if self._told is None or not self._aside or site.goal.size != 2:
            return
        if site.ways is None and before is not None:
            self._ways = open_ways(site.goal, before.corner, before.far)
        ways = self._ways if site.ways is None else site.ways
        if ways is not None and ways.spacing <= COARSEST:
            self._laid = _laid(ways, *self._told)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_laying": None}  # a thread cannot be copied: what it lays is laid anew

    def course(self, site: Site, discs: Mapping[str, Disc], *, here: Vector, time: float) -> Course:
        """Return the way around walls, and around people who stand where that is worth it.

        Args:
            site: the goal and the walls.
            discs: everybody who counts, by name, and what else may stand in the way.
            here: (d,) m, the point that planning moves; what is not in the plane has no detours.
            time: s, now.
        """
        after = self._after
        if after is None or here.size != 2:
            return Course(site.field)
        self._stands = self._noted(discs, here, time)
        gap, self._latest = max(time - self._latest, 0.0), time
        passed = min(gap, self._timeout)
        self._progress += gap - passed  # nobody drove during a pause: that is no waiting
        direct = way_to(site.goal, here, site.field)
        if site is not self._site:
            before, self._site = self._site, site
            if before is not None and math.dist(before.goal, site.goal) < NUDGE:
                self._least += direct - way_to(before.goal, here, before.field)  # a new map is no progress
            else:
                self._least = math.inf
        if direct < self._least - PROGRESS:
            self._least, self._progress, self._trial = direct, time, Trial()
        waited = time - self._progress
        standing = self._standing(site.goal, here, time - after)
        self._told = (standing, self._room) if standing else None
        laid = self._around(site, *self._told, here) if self._told else None
        if laid is None:
            return Course(site.field, waited=waited)
        who = " and ".join(sorted({stand.kind for stand in standing.values()}))
        if not laid.reaches(here):
            return Course(site.field, f"; {who} stand in every way to the goal" if waited > after else "", waited)
        left = way_to(site.goal, here, laid)
        longer = left - direct
        stood = time - max(stand.since for stand in standing.values())
        if longer > self._robot.planning_speed * max(after + waited, stood):
            waiting = f"; waiting for {who} who stand in the way: around them it is {longer:.1f} m more"
            return Course(site.field, waiting, waited)
        self._trial = self._trial.along(laid, left, here, passed)
        return Course(laid, f"; going around {who} who stand in the way" if longer > PROGRESS else "", waited)

    def _noted(self, discs: Mapping[str, Disc], here: Vector, time: float) -> Mapping[str, Stand]:
        """Everybody, and since when they are where they are; who is out of view is taken to stay for a while."""
        now = {
            name: stand
            for name, stand in self._stands.items()
            if math.dist(stand.here, here) > IN_VIEW and time - stand.seen < FORGOTTEN
        }
        for name, (centre, radius, kind) in discs.items():
            before = self._stands.get(name)
            if before is not None and math.dist(before.place, centre) <= STILL:
                now[name] = Stand(before.place, centre, before.since, time, before.contact, kind)
            else:
                now[name] = Stand(centre, centre, time, time, self._robot.planning_radius + radius, kind)
        return now

    def _standing(self, goal: Vector, here: Vector, since: float) -> dict[str, Stand]:
        """Those who have stood since a time (s), near enough to matter, and not at the goal itself."""
        return {
            name: stand
            for name, stand in self._stands.items()
            if stand.since <= since
            and math.dist(stand.here, here) <= SIGHT
            and math.dist(stand.here, goal) > stand.contact + SHIFT
        }

    @property
    def _room(self) -> float:
        """Metres beyond contact that the robot is taken to need: more, where ways with less led nowhere."""
        least = ROOM if self._robot.planning_acceleration is None else BRAKED_ROOM
        return min(least + WIDER * self._trial.failed, MOST_ROOM)

    def _around(self, site: Site, standing: Mapping[str, Stand], room: float, here: Vector) -> DistanceField | None:
        """The way around them all, laid anew where somebody is new, gone or has shifted; None: not laid yet."""
        ways = self._open(site, standing, here) if site.ways is None else site.ways
        if ways.spacing > COARSEST:
            return None
        if self._laying is not None and self._laying.over:
            self._laid, self._laying = self._laying.laid or self._laid, None
        if self._laid is None or not self._laid.fits(standing, room):
            if not self._aside:
                self._laid = _laid(ways, standing, room)
            elif self._laying is None:
                self._laying = Laying(lambda: _laid(ways, standing, room))
        return None if self._laid is None else self._laid.field

    def _open(self, site: Site, standing: Mapping[str, Stand], here: Vector) -> Ways:
        """Where ways may lead without a map: around the robot and those who stand, as far as the horizon matters."""
        places = np.array([here, *(s.here for s in standing.values())])
        rooms = np.array([self._reach, *(s.contact for s in standing.values())])[:, None]
        ways = self._ways
        if ways is None or not (ways.covers(places - rooms) and ways.covers(places + rooms)):
            low, high = (places - rooms).min(axis=0), (places + rooms).max(axis=0)
            self._ways = ways = open_ways(site.goal, low - AROUND, high + AROUND)
            self._laid = self._laying = None
        return ways


def _laid(ways: Ways, standing: Mapping[str, Stand], room: float) -> Laid:
    """The way around all who stand, `room` m beyond contact, or less where the goal is nearer to them."""
    centres = {name: stand.here for name, stand in standing.items()}
    radii = [max(min(s.contact + room, math.dist(s.here, ways.goal) - SHIFT), 0.0) for s in standing.values()]
    return Laid(centres, room, ways.field(np.array(list(centres.values())), np.array(radii)))
