"""Pictures of the method's parts: policies, predictions, rules. Each function returns a figure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sidestep.human.goals import PointGoal
from sidestep.human.model import HumanModel
from sidestep.human.policy import best_actions
from sidestep.io.scenarios import load_scenario
from sidestep.lattice import Lattice
from sidestep.prediction.occupancy import Prediction, frame_of, predict
from sidestep.viewer import style

STEP, HORIZON = 0.5, 6
ROBOT_START, ROBOT_SPEED = np.array([0.0, -3.0]), 1.0
PERSON, GOAL = np.array([-3.0, 0.0]), np.array([5.0, 0.0])


def robot_path(steps: int) -> NDArray[np.float64]:
    """(steps+1, 2) m: straight up, past the person's way."""
    return ROBOT_START + ROBOT_SPEED * STEP * np.arange(steps + 1)[:, None] * np.array([0.0, 1.0])


def model(**changes: object) -> HumanModel:
    """The person of these pictures: the authors' weights, so that the two kinds differ visibly."""
    return replace(load_scenario("paper-authors").human, **changes)  # type: ignore[arg-type]


def policies() -> Figure:
    """The best action from every place, for a person who cares and one who does not."""
    figure = style.new_figure(11.0, 5.2)
    lattice = Lattice(origin=np.zeros(2), spacing=0.5 * STEP, radius=14)
    path = robot_path(3 * HORIZON)[4:]
    for axes, awareness in zip(figure.subplots(1, 2), (0, 1), strict=True):
        best = best_actions(
            model=model(horizon=HORIZON), lattice=lattice, goal=PointGoal(GOAL), robot_path=path,
            awareness=awareness, time_step=STEP,
        )  # fmt: skip
        _field(axes, lattice, best)
        axes.plot(*path[: HORIZON + 1].T, "o-", color=style.ROBOT, markersize=5)
        axes.annotate(
            "robot", path[0], xytext=(8, -4), textcoords="offset points", color=style.ROBOT, fontweight="bold"
        )
        style.style_axes(axes, x="x (m)", y="y (m)", title=f"best first step, β = {awareness}", grid=False)
        axes.set_aspect("equal")
    return figure


def _field(axes: Axes, lattice: Lattice, best: NDArray[np.bool_]) -> None:
    """Arrows along the mean of the best actions of every cell."""
    reach = 2
    moves = np.array([(i, j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1)], dtype=float)
    share = best / best.sum(axis=-1, keepdims=True)
    mean = share @ moves
    places = lattice.positions()
    axes.quiver(*np.moveaxis(places, -1, 0), *np.moveaxis(mean, -1, 0), color=style.PEOPLE[0], width=0.003, scale=70)


def prediction(human: HumanModel, concerned: float) -> Prediction:
    """Where the person of these pictures will be."""
    return predict(
        model=human,
        lattice=frame_of(human, PERSON, None, STEP),
        goals=[PointGoal(GOAL)],
        weights=[[1 - concerned, concerned]],
        robot_path=robot_path(3 * HORIZON),
        horizon=HORIZON,
        time_step=STEP,
    )


def looking_ahead() -> Figure:
    """The same concerned person, who looks ahead or does not: where they are expected."""
    figure = style.new_figure(11.0, 4.6)
    for axes, horizon in zip(figure.subplots(1, 2), (0, HORIZON), strict=True):
        seen = prediction(model(horizon=horizon, randomness=0.2), 1.0).occupancy
        words = "takes the robot to stay where it is" if horizon == 0 else "anticipates the robot's plan"
        _spread(axes, seen.lattice, np.asarray(seen), (2, 4, 6))
        axes.plot(*robot_path(HORIZON).T, "o-", color=style.ROBOT, markersize=5)
        style.style_axes(axes, x="x (m)", y="y (m)", title=f"N_H = {horizon}: {words}", grid=False)
        axes.set(aspect="equal", xlim=(-4.2, 3.0), ylim=(-3.3, 2.2))
    return figure


def _spread(axes: Axes, lattice: Lattice, mass: NDArray[np.float64], instants: tuple[int, ...]) -> None:
    """Shade the cells at some instants, light to dark."""
    half = (lattice.radius + 0.5) * lattice.spacing
    x, y = lattice.origin
    for k, shade in zip(instants, ("#E8B400", "#C8512A", "#7A1E6C"), strict=True):
        colours = np.zeros((*mass[k].T.shape, 4))
        colours[..., :3] = [int(shade[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        colours[..., 3] = 0.8 * np.sqrt(mass[k].T / mass[k].max()) * (mass[k].T > 0.003)
        axes.imshow(colours, origin="lower", extent=(x - half, x + half, y - half, y + half), interpolation="nearest")
        peak = lattice.positions()[np.unravel_index(mass[k].argmax(), mass[k].shape)]
        axes.annotate(f"{k * STEP:g} s", peak, xytext=(0, 12), textcoords="offset points", ha="center", fontsize=10)


def hole() -> Figure:
    """Largest cell and probability within the clearance, over the horizon, for three degrees of randomness."""
    figure = style.new_figure(8.0, 4.2)
    axes = figure.subplots()
    k = np.arange(1, HORIZON + 3)
    for randomness, colour in ((0.1, style.PEOPLE[1]), (0.3, style.PEOPLE[3]), (0.5, style.PEOPLE[0])):
        human = model(randomness=randomness)
        seen = predict(
            model=human, lattice=frame_of(human, PERSON, None, STEP), goals=[PointGoal(GOAL)], weights=[[1.0, 0.0]],
            robot_path=robot_path(30), horizon=int(k[-1]), time_step=STEP,
        ).occupancy  # fmt: skip
        cells = np.asarray(seen)[1:]
        places = seen.lattice.positions()
        largest = cells.reshape(len(k), -1).max(axis=1)
        near = [_near(places, cells[i], 0.7) for i in range(len(k))]
        axes.plot(k, largest, "o-", color=colour, label=f"most likely cell, ω = {randomness:g}")
        axes.plot(
            k, near, "s--", color=colour, markerfacecolor="white", label=f"within 0.7 m of a place, ω = {randomness:g}"
        )
    axes.axhline(0.05, color=style.LIMIT, linestyle=":")
    axes.annotate("P_th = 0.05", (1.0, 0.05), xytext=(0, 3), textcoords="offset points", fontsize=style.SMALL)
    style.style_axes(axes, x="steps ahead", y="probability")
    axes.set(yscale="log", ylim=(0.008, 1.2))
    figure.legend(loc="outside right upper", frameon=False, fontsize=style.SMALL)
    return figure


def _near(places: NDArray[np.float64], mass: NDArray[np.float64], distance: float) -> float:
    """Largest probability within `distance` m of any one place."""
    points, weights = places.reshape(-1, 2), mass.ravel()
    held = weights > 1e-6
    gaps = np.linalg.norm(points[held][:, None] - points[held][None], axis=-1)
    return float((weights[held] * (gaps <= distance)).sum(axis=1).max())
