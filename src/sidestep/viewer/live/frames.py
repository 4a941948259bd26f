"""What the browser is told of one world: what moves, at every frame, and the plan, whenever there is a new one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sidestep.planning.plan import Plan
from sidestep.types import Vector
from sidestep.viewer.live import words
from sidestep.viewer.live.heat import Heat, heat
from sidestep.viewer.live.wire import numbers, with_images
from sidestep.viewer.live.world import World

HEATS = 6  # people whose predictions are drawn: the nearest
WALKING = 0.15  # m/s
BARE_LOOK = 1.0  # s, for which a bare velocity is drawn ahead


def frame(world: World) -> dict[str, Any]:
    """Return what the view needs at every frame."""
    gaps, nearest = world.gaps()
    beliefs = world.beliefs()
    run, tally = world.run, world.tally
    return {
        "robot": numbers(np.array([*run.state.position, _heading(world)])),
        "speed": round(world.speed(), 3),
        "goal": numbers(run.goal),
        "people": [[*numbers(place), heading] for place, heading in _people(world)],
        "walking": [bool(np.linalg.norm(v) > WALKING) for v in run.drift],
        "beliefs": [beliefs.get(person.id) for person in run.people],
        "nearest": nearest,
        "distance": None if nearest is None else round(float(gaps[nearest]), 3),
        "status": "arrived" if world.arrived else world.status(),
        "words": world.line,
        "score": tally.summary(),
        "trip": tally.trip,
        "times": [round(t, 2) for t in tally.times[-10:]],
        "closest": _finite(tally.closest),
        "closest_approaching": _finite(tally.closest_approaching),
        "contacts": [tally.contacts_moving, tally.contacts_standing],
    }


def plan_packet(world: World, time: float) -> bytes | None:
    """Return the plan in force, with predictions, as of `time` (s on the page's clock); None before the first."""
    if world.last is None:
        return None
    motion: Any = world.last.motion
    common = {"type": "plan", "panel": world.panel, "time": time, "limit": world.run.scenario.planner.risk_limit}
    if not isinstance(motion, Plan):
        way = np.linspace(0.0, BARE_LOOK, 3)[:, np.newaxis] * np.asarray(motion.velocity)
        ahead = numbers(world.run.state.position + way)
        return with_images([], **common, positions=ahead, risk=[], step=BARE_LOOK / 2, sample=_sample(world, time))
    return with_images(
        _heats(motion, world.run.state.position),
        **common,
        positions=numbers(motion.positions),
        risk=numbers(motion.risk, 5),
        collision=numbers(motion.collision_probability, 5),
        step=motion.time_step,
        sample=_sample(world, time),
    )


def _sample(world: World, time: float) -> dict[str, Any]:
    """One point of each chart."""
    gaps, nearest = world.gaps()
    motion: Any = world.last.motion if world.last is not None else None
    subject = world.subject(nearest)
    planned = isinstance(motion, Plan)
    return {
        "time": round(time, 3),
        "distance": None if nearest is None else round(float(gaps[nearest]), 3),
        "ms": round(1000 * world.run.recorder.steps[-1].planning_time, 2),
        "belief": None if subject is None else world.beliefs().get(world.run.people[subject].id),
        "risk": _finite(motion.limited_risk) if planned else None,
    }


def _heats(plan: Plan, here: Vector) -> list[Heat]:
    nearest = sorted(plan.people.values(), key=lambda p: float(np.linalg.norm(p.position - here)))
    return [heat(person) for person in nearest[:HEATS]]


def _people(world: World) -> list[tuple[Vector, float | None]]:
    drift = world.run.drift
    moving = np.linalg.norm(drift, axis=1) > WALKING
    headings = np.arctan2(drift[:, 1], drift[:, 0])
    return [(place, round(float(headings[i]), 3) if moving[i] else None) for i, place in enumerate(world.run.places)]


def _heading(world: World) -> float:
    if world.run.state.heading is not None:
        return float(world.run.state.heading)
    v = np.zeros(2) if world.last is None else np.asarray(world.last.motion.velocity)
    return math.atan2(v[1], v[0]) if float(np.linalg.norm(v)) > words.WAITING else math.nan


def _finite(value: float) -> float | None:
    return round(value, 5) if math.isfinite(value) else None
