"""Recorded people in place of simulated ones: which file, which scene, when, and what trip for the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.errors import InvalidInput
from sidestep.io.scenarios import load_scenario
from sidestep.io.tracks import read_recording
from sidestep.simulation.recordings import Recording, check_people
from sidestep.simulation.scenario import Scenario
from sidestep.simulation.trips import Trip, choose_trip


@dataclass(frozen=True, slots=True)
class Source:
    """What the command line says about recorded people.

    Attributes:
        file: CSV of tracks, or None: no recorded people.
        scene: of the file, or None where it holds only one.
        start: s, or None: chosen by the seed.
    """

    file: Path | None
    scene: str | None
    start: float | None

    def named(self, scenario: Scenario) -> Recording | None:
        """Return the recording that a scenario itself names, or None."""
        wanted = scenario.recording
        return None if wanted is None else read_recording(wanted.file, wanted.scene)

    def scenario(self, name: str, changes: Sequence[str]) -> tuple[Scenario, Recording]:
        """Return a scenario with the recorded people in it, and the recording.

        The robot's trip is chosen by the seed unless `changes` set robot.start and robot.goal.

        Raises:
            InvalidInput: something does not fit; says what.
        """
        assert self.file is not None
        recording = read_recording(self.file, self.scene)
        kinds = ("ped",)
        check_people([recording], kinds, str(self.file))
        own_trip = _own_trip(changes)
        plain = load_scenario(name, changes, people=[], recording=None)
        trip = None if own_trip else _trip(plain, recording.of_kinds(kinds), self._begin(recording))
        begin = trip.time if trip else self._begin(recording)
        values: dict[str, Any] = plain.settings() | {
            "recording": {
                "file": str(self.file.resolve()),
                "scene": recording.name,
                "start": recording.start if begin is None else begin,
                "kinds": kinds,
            },
            **_clock(plain, recording),
        }
        if trip is not None:
            values["robot"] |= {"start": trip.start, "goal": trip.goal, "heading": None}
        return Scenario.parse(values), recording

    def _begin(self, recording: Recording) -> float | None:
        if self.start is None:
            return None
        if not recording.start <= self.start < recording.end:
            raise InvalidInput(
                "--start", self.start, f"{recording.start:g} to {recording.end:g} s, where the scene lasts"
            )
        return round(recording.snapped(self.start), 6)


def _own_trip(changes: Sequence[str]) -> bool:
    """Whether `changes` say from where to where the robot goes.

    Raises:
        InvalidInput: they say it by half, or change what the recording takes the place of.
    """
    given = {".".join(change.partition("=")[0].strip().split(".")[:2]): change for change in changes}
    for name, change in given.items():
        if name.partition(".")[0] in ("people", "recording"):
            raise InvalidInput("--set", change, "only without --people", "recorded people stay as they are")
    ends = [change for name, change in given.items() if name in ("robot.start", "robot.goal")]
    if len(ends) == 1:
        raise InvalidInput("--set", ends[0], "robot.start and robot.goal together", "else the trip is chosen by --seed")
    return bool(ends)


def _trip(scenario: Scenario, recording: Recording, begin: float | None) -> Trip:
    return choose_trip(
        recording,
        np.random.default_rng(scenario.seed),
        speed=scenario.robot.max_speed,
        contact=scenario.robot.radius + scenario.human.radius,
        clearance=scenario.clearance,
        time=begin,
    )


def _clock(scenario: Scenario, recording: Recording) -> dict[str, float]:
    """Control at the recording's own instants where they are dense enough: there, positions are measured."""
    interval, period = recording.interval, scenario.period
    step = interval / math.ceil(interval / period - 1e-9)
    return {"control_step": step, "planning_period": max(math.floor(period / step + 1e-9), 1) * step}
