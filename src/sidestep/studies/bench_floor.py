"""What the machine can do, measured in the same run, and how near to it the human's sweeps come."""

from __future__ import annotations

from functools import partial
from time import perf_counter

import numpy as np

from sidestep._kernels.ceilings import copy_repeatedly, min_plus_repeatedly
from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.planning.anticipate import straight
from sidestep.planning.problem import PlanningProblem
from sidestep.planning.search import search
from sidestep.planning.search_maps import prepare
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.prediction.occupancy import Workspace, frame_of, predict


def ceilings(repeats: int = 5) -> dict[str, float]:
    """Return the best rates seen: Gflop/s of additions and minima in float32 within the first cache, GB/s of a copy."""
    line = np.random.default_rng(0).random(2048).astype(np.float32)
    out = np.empty_like(line)
    rounds = 4000
    min_plus_repeatedly(line, out, 1)
    compute = min(_timed(min_plus_repeatedly, line, out, rounds) for _ in range(repeats))
    block = np.zeros(1 << 24, dtype=np.float32)
    target = np.empty_like(block)
    copy_repeatedly(block, target, 1)
    move = min(_timed(copy_repeatedly, block, target, 2) for _ in range(repeats))
    return {
        "gflops": 2.0 * 4 * rounds * line.size / compute * 1e-9,
        "gbytes_per_s": 2.0 * 2 * block.nbytes / move * 1e-9,
    }


def sweep_work(horizon: int, reach: int = 2, dimension: int = 2, item: int = 4) -> dict[str, float]:
    """Return what sweeping every cell for one concerned person takes: operations, and bytes if nothing is kept.

    Policy k charges N_H = N stages; stage j is needed on the box of radius reach·(k + j). Per cell and stage: one
    minimum over 2·reach + 1 sums along each axis, and the stage cost (one product and two sums).
    """
    taps = 2 * reach + 1
    cells = sum((2 * reach * (k + j) + 1) ** dimension for k in range(horizon) for j in range(1, horizon + 1))
    return {"flop": float(cells * (dimension * 2 * taps + 3)), "bytes": float(cells * item * 2), "cells": float(cells)}


def floor_fraction(horizon: int, limits: dict[str, float], repeats: int = 7) -> dict[str, float]:
    """Return the time of one concerned person's whole prediction, its floor, and the fraction reached."""
    model = HumanModel(
        frame="world", goal_cost="squared", danger_weight=100.0, danger_rate=0.06, motion_filter=False, horizon=horizon
    )
    lattice = frame_of(model, np.array([-3.0, 0.0]), None, 0.5)
    path = straight(np.array([0.0, -3.0]), np.array([0.0, 30.0]), speed=1.0, time_step=0.5, steps=2 * horizon + 1)
    workspace = Workspace()

    def once() -> None:
        predict(
            model=model,
            lattice=lattice,
            goals=[PointGoal((3.0, 0.0))],
            weights=[[0.0, 1.0]],
            robot_path=path,
            horizon=horizon,
            time_step=0.5,
            workspace=workspace,
            dtype=np.float32,
        )

    once()
    seconds = min(_timed(once) for _ in range(repeats))
    work = sweep_work(horizon)
    floor = max(work["flop"] / (1e9 * limits["gflops"]), 0.0)
    return work | {"ms": 1e3 * seconds, "floor_ms": 1e3 * floor, "fraction": floor / seconds}


def kernel_work(horizon: int, limits: dict[str, float], repeats: int = 7) -> dict[str, dict[str, float]]:
    """Return for each kernel of one planning step what it must do, its floor, its time and the fraction reached.

    The floor is the larger of arithmetic over the ceiling of arithmetic and bytes over the ceiling of moving them, each
    value read and written once. The scene is a person crossing the robot's way (2-D, 25 actions).
    """
    scene = _Scene(horizon)
    table = {"sweeps of a concerned person": floor_fraction(horizon, limits, repeats)}
    for name, once, flop, moved in (
        ("push of an undisturbed person", scene.push, *scene.push_work()),
        ("risk map", scene.raster, *scene.raster_work()),
        ("search", scene.search, *scene.search_work()),
        ("risk along a path", scene.along, *scene.along_work()),
    ):
        once()
        seconds = min(_timed(once) for _ in range(repeats))
        floor = max(flop / (1e9 * limits["gflops"]), moved / (1e9 * limits["gbytes_per_s"]))
        table[name] = {
            "flop": flop,
            "bytes": moved,
            "ms": 1e3 * seconds,
            "floor_ms": 1e3 * floor,
            "fraction": floor / seconds,
        }
    return table


class _Scene:
    """One person, predicted, and the robot's problem; each part of a planning step by itself."""

    def __init__(self, horizon: int) -> None:
        self.horizon = horizon
        model = HumanModel(frame="world", goal_cost="squared", motion_filter=False, horizon=horizon)
        lattice = frame_of(model, np.array([-3.0, 0.0]), None, 0.5)
        self._path = straight(np.array([0.0, -3.0]), np.array([0.0, 30.0]), speed=1.0, time_step=0.5, steps=2 * horizon)
        self._predict = partial(
            predict, model=model, lattice=lattice, goals=[PointGoal((3.0, 0.0))], weights=[[1.0, 0.0]],
            robot_path=self._path, horizon=horizon, time_step=0.5, midway=True, workspace=Workspace(),
        )  # fmt: skip
        grown = 0.1 * (0.5 * np.arange(2 * horizon + 1.0)[:, None]) * np.array([1.0, 3.0])
        person = PersonMass.of_prediction(self._predict(), weights=np.array([0.7, 0.3]), sigmas=grown)
        self._people = RiskField(people=[person], distances=np.array([0.7]))
        start, goal = np.array([0.0, -3.0]), np.array([0.0, 30.0])
        self._problem = PlanningProblem(
            start=start, goal=goal, time_step=0.5, horizon=horizon, max_speed=1.0, people=self._people
        )
        self._maps = prepare(self._problem)
        self._cells = [(4 * k + 1) ** 2 for k in range(horizon + 1)]
        self._halves = [(8 * k + 5) ** 2 for k in range(horizon)]

    def push(self) -> None:
        """All masses and mid-steps of the person."""
        self._predict()

    def push_work(self) -> tuple[float, float]:
        """Per cell with mass and axis, five products and sums for the random and five for the deliberate part."""
        flop = 2.0 * 2 * 2 * 5 * (sum(self._cells) + sum(self._halves))
        return flop, 8.0 * 2 * (sum(self._cells) + sum(self._halves))

    def raster(self) -> None:
        """The risk over the robot's lattice."""
        self._people.draw(self._problem.start, self._maps.spacing, self._maps.rasters.boxes)

    def raster_work(self) -> tuple[float, float]:
        """Every mass is read and every place of the map written once; a difference and a sum per place."""
        places = float(self._maps.rasters.values.size)
        return 2.0 * places, 8.0 * (sum(self._cells) + sum(self._halves)) + 4.0 * places

    def search(self) -> None:
        """The robot's best motion on its lattice."""
        search(self._problem, self._maps)

    def search_work(self) -> tuple[float, float]:
        """Per cell that is looked at and tap: two sums and a minimum."""
        cells = int(self._maps.boxes[1][:-1].prod(axis=1).sum())
        return 3.0 * len(self._maps.lattice.taps) * cells, 4.0 * 2 * cells

    def along(self) -> None:
        """The risk along one path."""
        self._people.along(self._path[: self.horizon + 1])

    def along_work(self) -> tuple[float, float]:
        """Per cell with mass: a distance (six operations) and its share (four)."""
        cells = sum(self._cells) + sum(self._halves)
        return 10.0 * cells, 8.0 * cells


def _timed(function: object, *arguments: object) -> float:
    began = perf_counter()
    function(*arguments)  # type: ignore[operator]
    return perf_counter() - began
