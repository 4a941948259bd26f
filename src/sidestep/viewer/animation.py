"""Record → moving picture (mp4 or gif): the scene as it went, with what was predicted and planned at each moment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from sidestep.errors import InvalidInput
from sidestep.simulation.record import Record
from sidestep.types import FloatArray
from sidestep.viewer import style
from sidestep.viewer.figure_occupancy import ahead_colour, draw_occupancy, shown_instants
from sidestep.viewer.figure_scene import draw_walls, frame_scene
from sidestep.viewer.figure_series import draw_belief, draw_distance, draw_risk
from sidestep.viewer.nearest import people_by_nearness
from sidestep.viewer.video import ENCODERS

MOST_PICTURES = 36_000
"""Of a film: half an hour at 20 per second, which takes hours to draw."""


def animate(record: Record, path: Path | str, *, fps: int = 20, speed: float = 1.0) -> Path:
    """Write the run as a film: `.mp4` (needs ffmpeg) or `.gif`. 3-D runs are seen from above, 1-D runs as a line.

    Args:
        record: the run.
        path: file to write; its suffix chooses the format.
        fps: pictures per second (1 to 60).
        speed: seconds of the run per second of film (> 0; no more than `MOST_PICTURES` pictures).

    Raises:
        InvalidInput: suffix, fps or speed is not allowed.
        MissingExtra: mp4 was asked for and there is no ffmpeg.
        OutputError: the file cannot be written.
    """
    target = Path(path)
    if target.suffix not in ENCODERS:
        raise InvalidInput("path", str(path), "a file name that ends in " + " or ".join(ENCODERS))
    if not 1 <= fps <= 60:
        raise InvalidInput("fps", fps, "1 to 60 (pictures per second)")
    duration = float(record.time[-1] - record.time[0])
    if not (np.isfinite(speed) and speed > 0 and duration * fps <= MOST_PICTURES * speed):
        least = f" and ≥ {duration * fps / MOST_PICTURES:.2g} for this run" if duration > 0 else ""
        raise InvalidInput("speed", speed, f"a number > 0{least}: a film has at most {MOST_PICTURES} pictures")
    film = _Film(record if record.robot_goal.size > 1 else _on_a_line(record))
    times = np.arange(float(record.time[0]), float(record.time[-1]) + speed / fps / 2, speed / fps)
    ENCODERS[target.suffix](film.pictures(times), film.size, fps, target)
    return target


class _Film:
    """The still parts, drawn once, and the parts that move, drawn on top for each picture."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.figure = style.new_figure(10.0, 5.4)
        self.figure.set_dpi(100)
        self.canvas = FigureCanvasAgg(self.figure)
        grid = self.figure.add_gridspec(3, 2, width_ratios=(1.3, 1.0))
        self.scene = self.figure.add_subplot(grid[:, 0])
        self._draw_scene()
        self.cursors = self._draw_series(grid)
        self.trails, self.discs, self.plan, self.clock = self._movers()
        self.canvas.draw()
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)
        self.shaded: tuple[int, list[Artist]] = (-1, [])

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = self.canvas.get_width_height()
        return int(width), int(height)

    def pictures(self, times: FloatArray) -> Iterator[bytes]:
        """Yield one RGBA picture per instant, row by row."""
        for time in times:
            self.canvas.restore_region(self.still)
            for artist in self._moved(float(time)):
                if artist.axes is not None:
                    artist.axes.draw_artist(artist)
            yield bytes(self.canvas.buffer_rgba())

    def _draw_scene(self) -> None:
        record = self.record
        draw_walls(self.scene, record, (0, 1))
        goals = [(record.robot_goal, style.ROBOT, "*"), *((g, style.OTHER_ROBOT, "*") for g in record.other_goals)]
        for person, rank in enumerate(people_by_nearness(record)):
            goals.append((record.people_goals[person], style.person_colour(int(rank)), "X"))
        for goal, colour, marker in goals:
            if np.isfinite(goal).all():
                self.scene.plot(*goal[:2], color=colour, marker=marker, markersize=14, markeredgecolor="white")
        frame_scene(self.scene, record, (0, 1), shape=1.05)
        style.style_axes(self.scene, x="x (m)", y="y (m)", title=record.scenario)

    def _draw_series(self, grid: object) -> list[Line2D]:
        axes = [self.figure.add_subplot(grid[row, 1]) for row in range(3)]  # type: ignore[index]
        for draw, panel in zip((draw_distance, draw_belief, draw_risk), axes, strict=True):
            draw(panel, self.record)
            panel.set_xlim(float(self.record.time[0]), float(self.record.time[-1]))
        for panel in axes[:2]:
            panel.tick_params(labelbottom=False)
        return [_animated(panel.axvline(0.0, color=style.INK, linewidth=1.2)) for panel in axes]

    def _movers(self) -> tuple[list[Line2D], list[Circle], Line2D, Artist]:
        record, scene = self.record, self.scene
        ranks = people_by_nearness(record)
        others = [style.OTHER_ROBOT] * len(record.other_radii)
        colours = [style.ROBOT, *others, *(style.person_colour(int(rank)) for rank in ranks)]
        radii = [record.robot_radius, *record.other_radii.tolist(), *record.people_radii.tolist()]
        trails = [_animated(_line(scene, colour, 1.6, 3)) for colour in colours]
        discs = [Circle((0.0, 0.0), r, facecolor=c, edgecolor="white") for r, c in zip(radii, colours, strict=True)]
        for disc in discs:
            disc.set(animated=True, zorder=6)
            scene.add_patch(disc)
        plan = _animated(_line(scene, style.ROBOT, 1.4, 4))
        plan.set(marker="o", markersize=3.5, linestyle=(0, (2, 1)))
        clock = scene.text(
            0.98, 0.98, "", transform=scene.transAxes, ha="right", va="top", fontsize=style.TEXT + 1, animated=True
        )
        return trails, discs, plan, clock

    def _moved(self, time: float) -> list[Artist]:
        record = self.record
        step = min(int(np.searchsorted(record.time, time + 1e-9) - 1), len(record.status) - 1)
        others = np.moveaxis(record.other_robots, 1, 0) if record.other_robots.size else ()
        paths = [record.robot_positions, *others, *np.moveaxis(record.people_positions, 1, 0)]
        for trail, disc, path in zip(self.trails, self.discs, paths, strict=True):
            here = [float(np.interp(time, record.time, path[:, a])) for a in (0, 1)]
            trail.set_data([*path[: step + 1, 0], here[0]], [*path[: step + 1, 1], here[1]])
            disc.set_center((here[0], here[1]))
            disc.set_visible(bool(np.isfinite(here).all()))
        self.plan.set_data(record.plans[step, :, 0], record.plans[step, :, 1])
        for cursor in self.cursors:
            cursor.set_xdata([time, time])
        self.clock.set(text=f"{time:.1f} s   {record.status[step].replace('_', ' ')}")
        return [*self._shading(step), *self.trails, self.plan, *self.discs, self.clock, *self.cursors]

    def _shading(self, step: int) -> list[Artist]:
        """Return the predicted occupancy in force: that of the latest recorded prediction, if it is not stale."""
        record = self.record
        patience = max(round(record.time_step / record.control_step), 1)
        held = [s.step for s in record.snapshots if step - 2 * patience < s.step <= step]
        latest = max(held, default=-1)
        if latest != self.shaded[0]:
            for old in self.shaded[1]:
                old.remove()
            self.shaded = (latest, self._shade(latest))
        return self.shaded[1]

    def _shade(self, step: int) -> list[Artist]:
        snapshots = [s for s in self.record.snapshots if s.step == step]
        instants = shown_instants(snapshots)
        drawn: list[Artist] = []
        for snapshot in snapshots:
            for order, k in enumerate(instants):
                for row in np.flatnonzero(snapshot.instants == k):
                    drawn.append(
                        draw_occupancy(self.scene, snapshot, int(row), ahead_colour(order, len(instants)), (0, 1))
                    )
        for mesh in drawn:
            mesh.set_animated(True)
        return drawn


def _line(axes: Axes, colour: str, width: float, zorder: int) -> Line2D:
    return axes.plot([], [], color=colour, linewidth=width, zorder=zorder)[0]


def _animated(line: Line2D) -> Line2D:
    line.set_animated(True)
    return line


def _on_a_line(record: Record) -> Record:
    """Return a 1-D record as one along the x axis of a plane (the occupancies stay 1-D)."""

    def lifted(values: FloatArray) -> FloatArray:
        return np.concatenate([values, np.where(np.isnan(values), np.nan, 0.0)], axis=-1)

    return replace(
        record,
        robot_positions=lifted(record.robot_positions),
        robot_velocities=lifted(record.robot_velocities),
        robot_goal=lifted(record.robot_goal),
        people_goals=lifted(record.people_goals),
        people_positions=lifted(record.people_positions),
        plans=lifted(record.plans),
        other_robots=lifted(record.other_robots) if record.other_robots.size else record.other_robots,
        other_goals=lifted(record.other_goals) if record.other_robots.size else record.other_goals,
    )
