"""Where people were predicted to be, seen from one instant, beside what the robot planned then."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.image import AxesImage
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Affine2D
from scipy.ndimage import gaussian_filter

from sidestep.lattice import Lattice
from sidestep.simulation.record import Record, Snapshot
from sidestep.types import FloatArray, IntArray
from sidestep.viewer import style
from sidestep.viewer.figure_scene import AXIS_NAMES, Plane, draw_walls
from sidestep.viewer.nearest import closest_approaches, distances, people_by_nearness

AHEAD = ("#E8B400", "#C8512A", "#7A1E6C", "#23124F")
"""Near to far future: light to dark, so that the order survives a grey print."""
FAINTEST = 0.1
"""Cells fainter than this on the scale of `_shade` stay white."""
FINE, MARGIN = 0.1, 2.0
"""m; cells of a spread-out prediction, and how far beyond the lattice it is drawn at most."""

THIN, DENSE = 2e-3, 2.0
"""1/m²; largest density of what is drawn as faintly, and as strongly, as anything is."""

MOST = 400
"""Cells per axis of such a prediction, or time and memory grow beyond all bounds with the steps' length."""
STRIP = 0.25
"""m; half the height at which a line's cells are drawn in a plane."""


def chosen_steps(record: Record, most: int = 4) -> list[int]:
    """Return at most `most` recorded steps with a snapshot, from the start to shortly after the closest approach."""
    steps = np.unique([s.step for s in record.snapshots])
    if len(steps) <= most:
        return [int(s) for s in steps]
    near = closest_approaches(record)
    until = near[0].time + 0.5 if near else float(record.time[-1])
    wanted = np.linspace(float(record.time[0]), max(until, float(record.time[steps[min(most, len(steps)) - 1]])), most)
    nearest = [int(steps[np.argmin(np.abs(record.time[steps] - t))]) for t in wanted]
    return sorted(set(nearest))


def draw_prediction(axes: Axes, record: Record, step: int, plane: Plane = (0, 1)) -> None:
    """Draw one panel: the predicted occupancy at a few instants ahead of `step`, and the plan at the same instants."""
    snapshots = [s for s in record.snapshots if s.step == step]
    instants = shown_instants(snapshots)
    draw_walls(axes, record, plane)
    for snapshot in snapshots:
        for order, k in enumerate(instants):
            for row in np.flatnonzero(snapshot.instants == k):
                draw_occupancy(axes, snapshot, int(row), ahead_colour(order, len(instants)), plane)
    _draw_now(axes, record, step, plane)
    _draw_plan(axes, record, step, instants, plane)
    style.style_axes(
        axes,
        x=f"{AXIS_NAMES[plane[0]]} (m)",
        y=f"{AXIS_NAMES[plane[1]]} (m)",
        title=f"seen at {record.time[step]:.1f} s",
        grid=False,
    )


def frame_predictions(panels: Sequence[Axes], record: Record, steps: Sequence[int], plane: Plane = (0, 1)) -> None:
    """Give all panels one scale, each centred on the robot, its plan, and the nearest person at that step.

    Where these are too far apart for one panel, the robot is in it.
    """
    boxes: list[tuple[FloatArray, FloatArray]] = []
    _, gaps = distances(record)
    for step in steps:
        near = int(np.nanargmin(gaps[step])) if np.isfinite(gaps[step]).any() else None
        points = [record.robot_positions[step][None], record.plans[step]]
        points += [record.people_positions[step, near][None]] if near is not None else []
        flat = np.concatenate(points)[:, list(plane)]
        boxes.append((np.nanmin(flat, axis=0), np.nanmax(flat, axis=0)))
    reach = min(max(float((high - low).max()) / 2 for low, high in boxes), 4.0)
    half = 0.9 + reach
    for axes, step, (low, high) in zip(panels, steps, boxes, strict=True):
        robot = record.robot_positions[step, list(plane)]
        x, y = (float(c) for c in np.clip((low + high) / 2, robot - reach, robot + reach))
        axes.set_xlim(x - half, x + half)
        axes.set_ylim(y - half, y + half)
        axes.set_aspect("equal")
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))


def draw_prediction_over_time(axes: Axes, record: Record, step: int) -> None:
    """Draw one panel of a 1-D record: occupancy over position (upright) and time ahead (across)."""
    now = float(record.time[step])
    for snapshot in (s for s in record.snapshots if s.step == step):
        rank = int(people_by_nearness(record)[snapshot.person])
        for row, k in enumerate(snapshot.instants):
            lattice, p = shown_mass(snapshot, row)
            half, y = lattice.spacing / 2, lattice.positions()[..., 0]
            shade = _shade(p, snapshot)
            kept = shade > 0.0
            axes.bar(
                np.full(int(kept.sum()), now + int(k) * record.time_step),
                2 * half,
                width=0.8 * record.time_step,
                bottom=y[kept] - half,
                color=[(*to_rgb(style.person_colour(rank)), float(a)) for a in 0.9 * shade[kept]],
            )
    plan = record.plans[step, :, 0]
    axes.plot(now + record.time_step * np.arange(len(plan)), plan, color=style.ROBOT, marker="o", markersize=4)
    style.style_axes(axes, x="time (s)", y="position (m)", title=f"seen at {now:.1f} s", grid=False)


def shown_instants(snapshots: Sequence[Snapshot]) -> IntArray:
    """Return at most four instants (steps ahead), spread over those that the snapshots hold, without "now"."""
    held = np.unique(np.concatenate([s.instants for s in snapshots])) if snapshots else np.zeros(0, dtype=np.int64)
    held = held[held > 0]
    if len(held) <= len(AHEAD):
        return held
    return held[np.unique(np.linspace(0, len(held) - 1, len(AHEAD)).round().astype(np.int64))]


def ahead_labels(record: Record, step: int) -> list[tuple[str, str]]:
    """Return (colour, text) for the instants ahead that `draw_prediction` shows."""
    instants = shown_instants([s for s in record.snapshots if s.step == step])
    return [
        (ahead_colour(order, len(instants)), f"{int(k) * record.time_step:g} s") for order, k in enumerate(instants)
    ]


def ahead_colour(order: int, count: int) -> str:
    """Return the colour of instant `order` among `count` shown ones."""
    return AHEAD[round(order * (len(AHEAD) - 1) / max(count - 1, 1))]


def draw_occupancy(axes: Axes, snapshot: Snapshot, row: int, colour: str, plane: Plane) -> AxesImage:
    """Shade the cells of one instant of a snapshot."""
    lattice, p = shown_mass(snapshot, row)
    cells, corner, turn = _in_plane(lattice, p, plane)
    strength = 1.0 if p.ndim == 1 else _strength(float(cells.max()) / lattice.spacing**2)
    alpha = 0.75 * strength * _shade(cells, snapshot)
    colours = np.concatenate([np.broadcast_to(to_rgb(colour), (*cells.shape, 3)), alpha[..., None]], axis=-1)
    size = np.array(cells.shape) * (lattice.spacing, 2 * STRIP if p.ndim == 1 else lattice.spacing)
    # An image and not a mesh: turned cells of a mesh show seams where their edges overlap.
    extent = (float(corner[0]), float(corner[0] + size[0]), float(corner[1]), float(corner[1] + size[1]))
    image = AxesImage(axes, interpolation="nearest", origin="lower", extent=extent, zorder=2)
    image.set_data(colours.transpose(1, 0, 2))
    image.set_transform(turn + axes.transData)
    image.set_clip_path(axes.patch)
    axes.add_image(image)
    return image


def _shade(cells: FloatArray, snapshot: Snapshot) -> FloatArray:
    """Return 0 (white) to 1 per cell. Single cells need a flatter scale than clouds, or their tails are lost."""
    power = 0.5 if snapshot.weights.size == 0 else 0.8
    relative = (cells / max(float(cells.max()), 1e-12)) ** power
    return np.maximum(relative - FAINTEST, 0.0) / (1.0 - FAINTEST)


def _strength(peak: float) -> float:
    """Return how strongly (0.2 to 1) a prediction of that largest density (1/m²) is drawn.

    On a logarithmic scale: who may be anywhere in a room is seen everywhere, but faintly, and hides nothing.
    """
    return float(np.clip(np.log(max(peak, 1e-12) / THIN) / np.log(DENSE / THIN), 0.2, 1.0))


def shown_mass(snapshot: Snapshot, row: int) -> tuple[Lattice, FloatArray]:
    """Return cells and their probability at one instant, spread as the snapshot says, on a finer lattice then."""
    p = snapshot.probability[row]
    lattice = Lattice(
        origin=snapshot.origin,
        spacing=snapshot.spacing,
        radius=(p.shape[0] - 1) // 2,
        rotation=snapshot.rotation,
    )
    if snapshot.weights.size == 0:
        return lattice, p
    fold = min(snapshot.spacing / FINE, MOST / p.shape[0])
    finer = 2 * int(fold / 2) + 1 if p.ndim < 3 else 1  # odd: a cell keeps a middle
    spacing = snapshot.spacing / finer
    widths = snapshot.sigmas[row] / spacing  # (C,) cells
    margin = int(np.ceil(min(3 * widths[snapshot.weights > 0.02].max(initial=0.0), MARGIN / spacing)))
    fine = np.pad(p, margin // finer + 1)
    for axis in range(p.ndim):
        fine = np.repeat(fine, finer, axis=axis) / finer
    spread = np.sum(
        [
            w * gaussian_filter(fine, s, mode="constant", radius=min(int(4.0 * s + 0.5), len(fine)))
            for w, s in zip(snapshot.weights, widths, strict=True)
        ],
        axis=0,
    )
    radius = (spread.shape[0] - 1) // 2
    return Lattice(origin=snapshot.origin, spacing=spacing, radius=radius, rotation=snapshot.rotation), spread


def _in_plane(lattice: Lattice, p: FloatArray, plane: Plane) -> tuple[FloatArray, FloatArray, Affine2D]:
    """Return (m, n) cells of one plane, the (2,) m lower corner in a frame of their own, and the way to the world."""
    lower = -(lattice.radius + 0.5) * lattice.spacing
    if lattice.dimension == 3:
        return _projected(lattice, p, plane)
    if lattice.dimension == 1:
        turn = Affine2D().scale(float(lattice.rotation[0, 0]), 1.0).translate(float(lattice.origin[0]), 0.0)
        return p[:, None], np.array([lower, -STRIP]), turn
    matrix = np.eye(3)
    matrix[:2, :2] = lattice.rotation
    matrix[:2, 2] = lattice.origin
    return p, np.array([lower, lower]), Affine2D(matrix)


def _projected(lattice: Lattice, p: FloatArray, plane: Plane) -> tuple[FloatArray, FloatArray, Affine2D]:
    """Sum a 3-D occupancy onto a plane of the world, around the lattice's origin; turned cells leave no gaps."""
    axes = list(plane)
    held = p > 0.0
    centres = (lattice.positions() - lattice.origin)[held]  # (M, 3)
    thirds = np.stack(np.meshgrid(*[(-1 / 3, 0.0, 1 / 3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = thirds * lattice.spacing @ lattice.rotation.T  # (27, 3)
    points = (centres[:, None] + parts[None])[..., axes].reshape(-1, 2)
    reach = (np.ceil(lattice.radius * np.sqrt(3)) + 0.5) * lattice.spacing
    edges = np.arange(-reach, reach + 0.5 * lattice.spacing, lattice.spacing)
    weights = np.repeat(p[held] / len(parts), len(parts))
    total, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=(edges, edges), weights=weights)
    x, y = (float(c) for c in lattice.origin[axes])
    return total, np.array([edges[0], edges[0]]), Affine2D().translate(x, y)


def _draw_now(axes: Axes, record: Record, step: int, plane: Plane) -> None:
    i, j = plane
    ranks = people_by_nearness(record)
    discs = [(record.robot_positions[step], record.robot_radius, style.ROBOT)]
    for person, rank in enumerate(ranks):
        discs.append(
            (record.people_positions[step, person], float(record.people_radii[person]), style.person_colour(int(rank)))
        )
    for position, radius, colour in discs:
        if np.isfinite(position).all():
            axes.add_patch(
                Circle(
                    (float(position[i]), float(position[j])),
                    radius,
                    facecolor=colour,
                    edgecolor="white",
                    linewidth=1.0,
                    zorder=5,
                )
            )


def _draw_plan(axes: Axes, record: Record, step: int, instants: IntArray, plane: Plane) -> None:
    plan = record.plans[step][:, list(plane)]
    axes.plot(*plan.T, color=style.ROBOT, linewidth=1.5, zorder=7)
    for order, k in enumerate(instants):
        if k < len(plan):
            axes.add_patch(
                Circle(
                    (float(plan[k, 0]), float(plan[k, 1])),
                    record.robot_radius,
                    facecolor="none",
                    edgecolor=ahead_colour(order, len(instants)),
                    linewidth=2.0,
                    zorder=6,
                    path_effects=[withStroke(linewidth=4.0, foreground="white")],
                )
            )
