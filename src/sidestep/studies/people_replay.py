"""Through recorded crowds. Recorded people never react: everybody is unconcerned by construction.

A trip counts where a blind robot, straight at full speed, would have touched somebody, and where nobody's track begins
in the middle of the way: no planner avoids people who come out of nothing.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.checks import one_of
from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.io.scene_maps import scene_walls
from sidestep.io.tracks import read_recordings
from sidestep.obstacles import Obstacles
from sidestep.simulation.recordings import Recording, Track
from sidestep.simulation.scenario import Scenario
from sidestep.studies.engines import Store, each, run_kept
from sidestep.studies.episode import columns, histogram, quantile, run_episode
from sidestep.studies.opponents import contestants
from sidestep.studies.statistics import clopper_pearson, upper_bound
from sidestep.types import FloatArray

SHORTEST, LONGEST = 7.0, 10.0  # m, of a trip
SPEED = 1.0  # m/s, of the robot
CONTACT = 0.6  # m between centres
ROOM = 1.0  # m to everybody at the start
PATIENCE = 4.0  # times the shortest time
TRODDEN = 1.0  # m: start and goal lie within this of where somebody walked
PERIOD = 0.1  # s between two calls
SUDDEN = 1.5  # m from the straight way: nobody's track begins there during a trip
ATTEMPTS = 400  # per wanted trip


@dataclass(frozen=True, slots=True, kw_only=True)
class Journey:
    """One trip of one navigator.

    Attributes:
        file: of the recording; content: a digest of what it holds.
        scenario: as `Scenario.settings()`; navigator: name; number: of the trip.
    """

    file: str
    content: str
    scenario: Mapping[str, Any]
    navigator: str
    number: int

    @property
    def name(self) -> str:
        """Under which a finished trip is kept."""
        told = json.dumps([self.scenario, self.content], sort_keys=True).encode()
        return f"replay-{self.number}-{self.navigator}-{hashlib.sha256(told).hexdigest()[:16]}"


def replay_study(
    file: Path,
    navigators: Sequence[str],
    *,
    trips: int,
    kinds: Sequence[str] = ("ped",),
    without: Sequence[str] = (),
    crowd: int | None = None,
    human: HumanModel | None = None,
    seed: int = 0,
    workers: int = 1,
    engine: str = "joblib",
    address: str | None = None,
    store: Store | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[dict[str, Any]]:
    """Send every navigator on the same trips.

    Args:
        file: of tracks.
        navigators: names of `contestants()`.
        trips: per file, spread evenly over its scenes.
        kinds: of agents that are people.
        without: scenes that are left out.
        crowd: most people who may be there at once during a trip, or None.
        human: the model by which ours predicts; None: the defaults.
        seed: of the choice of trips.
        workers, engine, address: see `run_pieces`.
        store: where finished trips are kept and looked for.
        progress: called with (trips done, all trips).

    Returns:
        One row per navigator, JSON-able.

    Raises:
        UnknownName: there is no such navigator.
    """
    one_of("navigators", navigators, contestants())
    recordings = {name: r for name, r in read_recordings(file).items() if name not in without}
    chosen = choose_trips(file, recordings, trips=trips, kinds=kinds, seed=seed, crowd=crowd)
    if human is not None:
        chosen = [scenario.model_copy(update={"human": human}) for scenario in chosen]
    content = hashlib.sha256(file.read_bytes()).hexdigest()[:16]
    pieces = [
        Journey(file=str(file), content=content, scenario=scenario.settings(), navigator=name, number=i)
        for i, scenario in enumerate(chosen)
        for name in navigators
    ]
    found = run_kept(
        each(travel),
        pieces,
        store=store,
        size=lambda _: 1,
        workers=workers,
        engine=engine,
        address=address,
        progress=progress,
    )
    ended: dict[str, list[tuple[list[float], FloatArray]]] = {name: [] for name in navigators}
    for piece in pieces:
        ended[piece.navigator].append((found[piece.name]["row"], np.array(found[piece.name]["times"])))
    return [_row(name, trips_of) for name, trips_of in ended.items() if trips_of]


def travel(journey: Journey) -> tuple[Journey, dict[str, Any]]:
    """Make one trip; what comes back can be written as JSON."""
    scenario = Scenario.parse(journey.scenario)
    if scenario.recording is None:
        raise InvalidInput("journey.scenario.recording", None, "a recording")
    recording = _recordings(journey.file)[scenario.recording.scene]
    outcome, times = run_episode(scenario, contestants()[journey.navigator], recording)
    return journey, {"row": outcome.row(), "times": times.tolist()}


def choose_trips(
    file: Path,
    recordings: Mapping[str, Recording],
    *,
    trips: int,
    kinds: Sequence[str],
    seed: int,
    crowd: int | None = None,
) -> list[Scenario]:
    """Return up to `trips` scenarios, spread evenly over the scenes that are large, long and busy enough.

    With a `crowd`, never more than so many people are there at once while a blind robot would be on its way.
    """
    generator = np.random.Generator(np.random.PCG64(seed))
    usable = {name: r.of_kinds(kinds) for name, r in sorted(recordings.items())}
    usable = {name: r for name, r in usable.items() if r.tracks and r.end - r.start > LONGEST / SPEED}
    chosen: list[Scenario] = []
    left = len(usable)
    for name, recording in usable.items():
        wanted = (trips - len(chosen) + left - 1) // left
        left -= 1
        chosen += _trips_of_scene(file, name, recording, kinds, wanted, crowd or math.inf, generator)
    return chosen[:trips]


def _trips_of_scene(
    file: Path,
    name: str,
    recording: Recording,
    kinds: Sequence[str],
    wanted: int,
    crowd: float,
    generator: np.random.Generator,
) -> list[Scenario]:
    walls = scene_walls(file, name)
    obstacles = Obstacles(polygons=walls) if walls else None
    trodden = np.concatenate([t.positions for t in recording.tracks])
    begin, interval = recording.start, recording.interval
    last = int((recording.end - LONGEST / SPEED - begin) / interval)
    chosen: list[Scenario] = []
    for _ in range(ATTEMPTS * wanted):
        if len(chosen) == wanted:
            break
        start, goal = (trodden[generator.integers(len(trodden))] + generator.normal(0, TRODDEN / 3, 2) for _ in "sg")
        time = begin + interval * int(generator.integers(last + 1))
        length = float(np.linalg.norm(goal - start))
        if not SHORTEST <= length <= LONGEST or _most_at_once(recording, time, time + length / SPEED) > crowd:
            continue
        if _worthwhile(recording, start, goal, time, obstacles):
            chosen.append(_scenario(file, name, kinds, start, goal, time, walls, int(generator.integers(2**31))))
    return chosen


def _worthwhile(
    recording: Recording, start: FloatArray, goal: FloatArray, time: float, obstacles: Obstacles | None
) -> bool:
    """Whether a blind robot would touch somebody, but not at once, and nobody camps at the goal."""
    length = float(np.linalg.norm(goal - start))
    t = np.arange(0.0, length / SPEED, 0.1)
    robot = start + (goal - start) * (t * SPEED / length)[:, None]
    present = list(recording.between(time, time + PATIENCE * length / SPEED))
    if not _ways(present, time, t, robot) or _sudden(present, time, robot):
        return False
    first = [track.at(time) for track in present]
    if any(np.linalg.norm(place - start) < ROOM for place in first):  # NaN, while absent, compares false
        return False
    later = time + np.arange(0.5 * length / SPEED, PATIENCE * length / SPEED, 0.5)
    at_goal = [np.linalg.norm(track.at(later) - goal, axis=1) < CONTACT + 0.4 for track in present]
    if np.any(at_goal, axis=0).mean() > 0.3:
        return False
    if obstacles is None:
        return True
    ends = np.array([start, goal])
    return bool(obstacles.free(ends, 0.4).all() and obstacles.segment_free(start[None], goal[None], 0.35)[0])


def _most_at_once(recording: Recording, start: float, end: float) -> int:
    present = list(recording.between(start, end))
    times = np.arange(start, end, 0.5, dtype=np.float64)
    there = np.array([np.isfinite(track.at(times)[:, 0]) for track in present]).reshape(len(present), len(times))
    return int(there.sum(axis=0).max(initial=0))


def _sudden(present: Sequence[Track], time: float, way: FloatArray) -> bool:
    """Whether somebody is first seen, after `time`, within `SUDDEN` of the way (K, 2) m."""
    begins = np.array([place for t in present for place in t.at(t.stays[t.stays[:, 0] > time, 0])]).reshape(-1, 1, 2)
    return bool((np.linalg.norm(begins - way, axis=2) < SUDDEN).any())


def _ways(present: Sequence[Track], time: float, t: FloatArray, robot: FloatArray) -> bool:
    """Whether a robot on this way, (K, 2) m at `time` + t (K,) s, touches somebody."""
    return any(bool((np.linalg.norm(track.at(time + t) - robot, axis=1) < CONTACT).any()) for track in present)


def _scenario(
    file: Path,
    scene: str,
    kinds: Sequence[str],
    start: FloatArray,
    goal: FloatArray,
    time: float,
    walls: Sequence[FloatArray],
    seed: int,
) -> Scenario:
    length = float(np.linalg.norm(goal - start))
    return Scenario.parse(
        {
            "name": f"{scene}-{time:.1f}",
            "seed": seed,
            "duration": PATIENCE * length / SPEED,
            "planning_period": PERIOD,
            "control_step": PERIOD,
            "robot": {"start": start.tolist(), "goal": goal.tolist(), "max_speed": SPEED},
            "recording": {"file": str(file), "scene": scene, "start": time, "kinds": tuple(kinds)},
            "walls": [w.tolist() for w in walls],
        }
    )


def _row(navigator: str, results: Sequence[tuple[list[float], FloatArray]]) -> dict[str, Any]:
    values = np.array([row for row, _ in results])
    numbers = dict(zip(columns(), values.T, strict=True))
    n = len(values)
    moving, success = int(numbers["collision_moving"].sum()), int(numbers["success"].sum())
    times = histogram(np.concatenate([t for _, t in results]))
    ratio = numbers["time_to_goal"] / numbers["shortest_time"]
    nearest = numbers["min_distance"][np.isfinite(numbers["min_distance"])]
    return {
        "navigator": navigator,
        "trips": n,
        "collision_moving": moving / n,
        "collision_moving_upper99": upper_bound(moving, n),
        "collision_standing": float(numbers["collision_standing"].mean()),
        "success": success / n,
        "success_ci99": list(clopper_pearson(success, n)),
        "timeout": float(numbers["timeout"].mean()),
        "time_ratio": float(np.nanmean(ratio)) if np.isfinite(ratio).any() else None,
        "clearance_quantiles": np.quantile(nearest, [0.01, 0.05, 0.25, 0.5]).tolist() if len(nearest) else None,
        "plan_ms_p95": quantile(times, 0.95),
    }


@lru_cache(maxsize=2)
def _recordings(file: str) -> dict[str, Recording]:
    return read_recordings(file)
