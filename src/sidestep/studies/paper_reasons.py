"""Why some claims do not hold: how often awareness changes the best action, and how many cells reach P_th."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.human.policy import best_actions
from sidestep.planning.anticipate import straight
from sidestep.prediction.occupancy import frame_of, predict
from sidestep.types import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reasons:
    """Two curves for each parameter set.

    Attributes:
        danger_weights: (W,); differing: label → (W,) share of random states in which the best first action of a
            concerned and an unconcerned person differ; own_weight: label → the set's own danger weight.
        steps: (N,) steps ahead; cells: label → (N,) cells with P ≥ P_th; mass: label → (N,) probability in those cells.
    """

    danger_weights: FloatArray
    differing: dict[str, FloatArray]
    own_weight: dict[str, float]
    steps: FloatArray
    cells: dict[str, FloatArray]
    mass: dict[str, FloatArray]


def reasons(
    models: dict[str, HumanModel], *, time_step: float, states: int, generator: np.random.Generator, limit: float = 0.05
) -> Reasons:
    """Measure both, over random encounters within 5 m.

    Args:
        models: label → model; time_step: s; states: random states per weight; limit: P_th.
        generator: of the states.
    """
    weights = np.geomspace(1.0, 1000.0, 10)
    drawn = [
        (generator.uniform(-5, 5, 2), generator.uniform(-5, 5, 2), generator.uniform(-6, 6, 2)) for _ in range(states)
    ]
    differing: dict[str, FloatArray] = {}
    cells: dict[str, FloatArray] = {}
    mass: dict[str, FloatArray] = {}
    steps = np.arange(1, 11)
    for label, model in models.items():
        shares = [_share(replace(model, danger_weight=float(w), horizon=5), drawn, time_step) for w in weights]
        differing[label] = np.array(shares)
        cells[label], mass[label] = _above(replace(model, horizon=5), time_step, len(steps), limit)
    own = {label: model.danger_weight for label, model in models.items()}
    return Reasons(
        danger_weights=weights, differing=differing, own_weight=own, steps=steps.astype(float), cells=cells, mass=mass
    )


def _share(model: HumanModel, drawn: list[tuple[FloatArray, FloatArray, FloatArray]], time_step: float) -> float:
    differ = 0
    for place, robot, goal in drawn:
        lattice = frame_of(model, place, None, time_step)
        path = straight(robot, -robot, speed=1.0, time_step=time_step, steps=6)
        best = [best_actions(model, lattice, PointGoal(goal), path, b, time_step) for b in (0, 1)]
        differ += not (best[0] & best[1]).any()
    return differ / len(drawn)


def _above(model: HumanModel, time_step: float, horizon: int, limit: float) -> tuple[FloatArray, FloatArray]:
    """Cells with P ≥ `limit` at each step and the mass in them; the person of Section IV, the robot far away."""
    place = np.array([-5.0, 0.0])
    path = straight(np.array([0.0, -10.0]), np.array([0.0, 10.0]), speed=2.0, time_step=time_step, steps=horizon + 7)
    seen = predict(
        model=model,
        lattice=frame_of(model, place, None, time_step),
        goals=[PointGoal((5.0, 0.0))],
        weights=[[0.5, 0.5]],
        robot_path=path,
        horizon=horizon,
        time_step=time_step,
    )
    likely = seen.occupancy.probability[1:].reshape(horizon, -1)
    above = likely >= limit
    return above.sum(axis=1).astype(float), np.where(above, likely, 0.0).sum(axis=1)
