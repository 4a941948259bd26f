"""What the machine can do, measured in the same run, and how near to it the human's sweeps come."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from sidestep._kernels.ceilings import copy_repeatedly, min_plus_repeatedly
from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.planning.anticipate import straight
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
    """Return what the sweeps of one concerned person must do: floating-point operations, and bytes if nothing is kept.

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


def _timed(function: object, *arguments: object) -> float:
    began = perf_counter()
    function(*arguments)  # type: ignore[operator]
    return perf_counter() - began
