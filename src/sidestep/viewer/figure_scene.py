"""Paths on the floor (or over time, in 1-D): where everybody went and when."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from sidestep.simulation.record import Record
from sidestep.types import FloatArray, Vector
from sidestep.viewer import style
from sidestep.viewer.nearest import Approach, closest_approaches, people_by_nearness

Plane = tuple[int, int]
AXIS_NAMES = "xyz"
NEAR = 6.0
"""m; people who never came this near to the robot do not widen the picture."""


def draw_paths(
    axes: Axes, record: Record, plane: Plane = (0, 1), *, title: str = "", names: bool = True, shape: float = 1.1
) -> None:
    """Draw all paths in one plane, with time marks, goals, walls, and the closest approach to scale.

    `names` writes who is who and the seconds beside the marks; `shape` is width over height of the panel.
    """
    i, j = plane
    frame_scene(axes, record, plane, shape=shape)
    draw_walls(axes, record, plane)
    marks = time_marks(record)
    few = len(record.people) <= 3
    robot = record.robot_positions[:, [i, j]]
    marked = [(robot, style.ROBOT, names)]  # those whose seconds find room first
    for person, rank in enumerate(people_by_nearness(record)):
        colour = style.person_colour(int(rank))
        path = record.people_positions[:, person][:, [i, j]]
        _draw_path(axes, path, colour, crowd=rank >= len(style.PEOPLE))
        if rank < len(style.PEOPLE):
            marked.append((path, colour, names and (few or rank < 2)))
            _draw_start(axes, path, colour, record.people[person] if names else "")
            _draw_goal(axes, record.people_goals[person][[i, j]], colour, "X")
    for number in range(len(record.other_radii)):
        path = record.other_robots[:, number][:, [i, j]]
        _draw_path(axes, path, style.OTHER_ROBOT)
        marked.append((path, style.OTHER_ROBOT, names))
        _draw_start(axes, path, style.OTHER_ROBOT, f"robot {number + 2}" if names else "")
        _draw_goal(axes, record.other_goals[number][[i, j]], style.OTHER_ROBOT, "*")
    _draw_path(axes, robot, style.ROBOT)
    _draw_start(axes, robot, style.ROBOT, "robot" if names else "")
    _draw_goal(axes, record.robot_goal[[i, j]], style.ROBOT, "*")
    for path, colour, written in marked:
        _draw_marks(axes, path, record.time, marks, colour, written=written)
    near = closest_approaches(record)
    if near:
        draw_approach(axes, record, near[0], plane)
    style.style_axes(axes, x=f"{AXIS_NAMES[i]} (m)", y=f"{AXIS_NAMES[j]} (m)", title=title)


def draw_paths_over_time(axes: Axes, record: Record, *, title: str = "") -> None:
    """Draw the paths of a 1-D record: position against time."""
    for person, rank in enumerate(people_by_nearness(record)):
        colour = style.person_colour(rank)
        path = record.people_positions[:, person, 0]
        axes.plot(record.time, path, color=colour, linewidth=style.LINE)
        _label_line_start(axes, record.time, path, record.people[person], colour)
        if np.isfinite(record.people_goals[person, 0]):
            axes.axhline(float(record.people_goals[person, 0]), color=colour, linewidth=1.0, linestyle=":")
    robot = record.robot_positions[:, 0]
    axes.plot(record.time, robot, color=style.ROBOT, linewidth=style.LINE)
    _label_line_start(axes, record.time, robot, "robot", style.ROBOT)
    axes.axhline(float(record.robot_goal[0]), color=style.ROBOT, linewidth=1.0, linestyle=":")
    for approach in closest_approaches(record)[:1]:
        ends = (float(approach.robot_position[0]), float(approach.person_position[0]))
        axes.plot([approach.time] * 2, ends, color=style.INK, linewidth=1.2, marker="_")
        axes.annotate(
            f"{approach.distance:.2f} m",
            (approach.time, sum(ends) / 2),
            xytext=(6, 0),
            textcoords="offset points",
            fontsize=style.SMALL,
            va="center",
            path_effects=style.halo(),
        )
    style.style_axes(axes, x="time (s)", y="position (m)", title=title)


def draw_walls(axes: Axes, record: Record, plane: Plane) -> None:
    """Fill the wall polygons (they stand in the x–y plane)."""
    if plane == (0, 1):
        for wall in record.walls:
            axes.add_patch(Polygon(wall, closed=True, facecolor=style.WALL, edgecolor="#707070", linewidth=0.8))


def draw_approach(axes: Axes, record: Record, approach: Approach, plane: Plane) -> None:
    """Draw robot and person to scale at their nearest, with the distance between them."""
    i, j = plane
    rank_colour = style.person_colour(0)
    robot, person = approach.robot_position[[i, j]], approach.person_position[[i, j]]
    for centre, radius, colour in (
        (robot, record.robot_radius, style.ROBOT),
        (person, float(record.people_radii[approach.person]), rank_colour),
    ):
        axes.add_patch(Circle((float(centre[0]), float(centre[1])), radius, facecolor=colour, alpha=0.3, zorder=4))
    axes.plot(*np.stack([robot, person], axis=1), color=style.INK, linewidth=1.2, zorder=6)


def time_marks(record: Record) -> FloatArray:
    """Return the round instants (s) at which the paths carry a mark: at most nine."""
    span = float(record.time[-1] - record.time[0])
    step = next(s for s in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 300.0, 1e9) if span / s <= 9)
    return np.arange(np.ceil(record.time[0] / step) * step, record.time[-1] + 1e-9, step)


def frame_scene(axes: Axes, record: Record, plane: Plane, *, shape: float = 1.1) -> None:
    """Set limits that hold the robot's path, its goal, and the people who came near; equal scale on both axes.

    `shape` is width over height of the panel: the limits are widened to it, so that the panel is filled.
    """
    i, j = plane
    points = [record.robot_positions[:, [i, j]], record.robot_goal[None, [i, j]]]
    near = [a.person for a in closest_approaches(record) if a.distance < NEAR]
    points += [record.people_positions[:, p][:, [i, j]] for p in near]
    points += [record.people_goals[p][None, [i, j]] for p in near]
    for number in range(len(record.other_radii)):
        points += [record.other_robots[:, number][:, [i, j]], record.other_goals[number][None, [i, j]]]
    everything = np.concatenate(points)
    low, high = np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)
    room = max(1.0, 0.065 * float((high - low).max()))  # m; for the names, which are as large in a hall as in a room
    low, high = low - 1.1 * room, high + 0.9 * room
    centre, half = (low + high) / 2, (high - low) / 2
    half = np.maximum(half, half[::-1] * np.array([shape, 1 / shape]))
    axes.set_xlim(float(centre[0] - half[0]), float(centre[0] + half[0]))
    axes.set_ylim(float(centre[1] - half[1]), float(centre[1] + half[1]))
    axes.set_aspect("equal")


def _draw_path(axes: Axes, path: FloatArray, colour: str, *, crowd: bool = False) -> None:
    axes.plot(*path.T, color=colour, linewidth=1.0 if crowd else style.LINE, alpha=0.6 if crowd else 1.0, zorder=3)


def _draw_marks(
    axes: Axes, path: FloatArray, time: FloatArray, marks: FloatArray, colour: str, *, written: bool
) -> None:
    at = np.stack([np.interp(marks, time, path[:, a], left=np.nan, right=np.nan) for a in (0, 1)], axis=1)
    axes.plot(*at.T, color=colour, marker="o", markersize=5, linestyle="", markeredgecolor="white", zorder=5)
    moved = np.linalg.norm(np.diff(at, axis=0, prepend=np.nan), axis=1) != 0.0  # who stands is marked once
    for point, instant, new in zip(at, marks, moved, strict=True):
        if written and new and np.isfinite(point).all() and instant > time[0]:
            _write_beside(axes, point, _normal(path, time, float(instant)), f"{instant:g}", colour)


def _normal(path: FloatArray, time: FloatArray, instant: float) -> Vector:
    """Return the unit vector across the path at `instant`, so that a label stands beside the line and not on it."""
    around = np.clip(np.searchsorted(time, instant) + np.array([-2, 2]), 0, len(time) - 1)
    along = np.nan_to_num(path[around[1]] - path[around[0]])
    length = float(np.linalg.norm(along))
    return np.array([along[1], -along[0]]) / length if length > 1e-6 else np.array([1.0, 0.0])


def _write_beside(axes: Axes, point: Vector, direction: Vector, text: str, colour: str) -> None:
    """Write on one side or the other, or nothing where both are taken: two labels on one place say less than one."""
    others = [other.get_window_extent() for other in axes.texts]
    for side in (direction, -direction):
        label = axes.annotate(
            text,
            (float(point[0]), float(point[1])),
            xytext=tuple(12.0 * side),
            textcoords="offset points",
            color=colour,
            fontsize=style.SMALL,
            ha="center",
            va="center",
            zorder=7,
            path_effects=style.halo(),
        )
        box = label.get_window_extent()
        if not any(box.overlaps(other) for other in others):
            return
        label.remove()


def _draw_start(axes: Axes, path: FloatArray, colour: str, label: str) -> None:
    seen = np.isfinite(path).all(axis=1)
    if not seen.any():
        return
    x, y = (float(v) for v in path[seen][0])
    upward = (
        len(path[seen]) > 1 and path[seen][min(5, seen.sum() - 1), 1] > y + 0.3
    )  # the name goes where the path does not
    axes.plot(x, y, color=colour, marker="o", markersize=9, markerfacecolor="white", markeredgewidth=2, zorder=6)
    left, right = axes.get_xlim()
    across = (x - left) / (right - left)
    axes.annotate(
        label,
        (x, y),
        xytext=(-8 if across < 0.2 else 8 if across > 0.8 else 0, -10 if upward else 10),
        textcoords="offset points",
        ha="left" if across < 0.2 else "right" if across > 0.8 else "center",
        va="top" if upward else "bottom",
        color=colour,
        fontsize=style.TEXT,
        fontweight="bold",
        zorder=8,
        path_effects=style.halo(3),
    )


def _draw_goal(axes: Axes, goal: Vector, colour: str, marker: str) -> None:
    if np.isfinite(goal).all():
        x, y = (float(v) for v in goal)
        axes.plot(x, y, color=colour, marker=marker, markersize=15, linestyle="", zorder=6, markeredgecolor="white")


def _label_line_start(axes: Axes, time: FloatArray, path: FloatArray, label: str, colour: str) -> None:
    seen = np.isfinite(path)
    if seen.any():
        axes.annotate(
            label,
            (float(time[seen][0]), float(path[seen][0])),
            xytext=(4, 6),
            textcoords="offset points",
            color=colour,
            fontsize=style.TEXT,
            fontweight="bold",
            path_effects=style.halo(3),
        )
