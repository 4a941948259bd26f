"""Figures say what the record says, readably, without touching global state."""

from __future__ import annotations

import json
import logging
import subprocess
import sys
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.text import Text
from PIL import Image

from made_records import made_record
from sidestep.errors import OutputError
from sidestep.lattice import Lattice, heading_rotation
from sidestep.simulation.metrics import measure
from sidestep.simulation.record import Record
from sidestep.viewer import style
from sidestep.viewer.figure_occupancy import AHEAD, _projected, chosen_steps, draw_occupancy, shown_mass
from sidestep.viewer.figure_scene import draw_paths, time_marks
from sidestep.viewer.figures import run_figure, save_figure
from sidestep.viewer.live.messages import Seek
from sidestep.viewer.live.replay import Replay
from sidestep.viewer.nearest import closest_approaches, distances

WALL = np.array([[1.5, -1.0], [3.0, -1.0], [3.0, -3.0], [1.5, -3.0]])
KINDS = {
    "one person": {},
    "two people and walls": {"people": 2, "walls": [WALL, WALL - [5.0, 0.0]]},
    "a crowd, awareness unknown, one comes late": {"people": 9, "awareness_known": False, "late": True},
    "alone": {"people": 0},
    "no snapshots": {"snapshots": False},
    "on a line": {"dimension": 1, "people": 2},
    "in space": {"dimension": 3, "people": 2},
    "three steps": {"steps": 3},
}


def panels(figure: Figure, label: str) -> list:
    return [axes for axes in figure.axes if axes.get_ylabel() == label]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_record_is_drawn_with_units_and_inside_the_figure(kind, caplog):
    with caplog.at_level(logging.WARNING, logger="matplotlib"):
        figure = run_figure(made_record(**KINDS[kind]))
        figure.draw_without_rendering()
    assert not caplog.records
    labels = {axes.get_ylabel() for axes in figure.axes} | {axes.get_xlabel() for axes in figure.axes}
    assert {"distance (m)", "P(concerned)", "probability", "time (s)"} <= labels
    assert all("(" in label for label in labels - {"", "probability"})
    for text in figure.findobj(Text):
        box = text.get_window_extent()
        if text.get_visible() and text.get_text() and box.width > 0 and text.get_clip_on() is False:
            assert box.x0 > -2, text.get_text()
            assert box.x1 < figure.bbox.width + 2, text.get_text()
            assert text.get_fontsize() >= 9, text.get_text()


def test_the_robot_is_in_every_panel_however_far_away_the_nearest_person_is():
    """The panel was centred between the two, and neither was in it."""
    record = made_record()
    far = replace(record, people_positions=record.robot_positions[:, None] + np.array([11.0, 3.0]))
    shown = [axes for axes in run_figure(far).axes if axes.get_title(loc="left").startswith("seen at")]
    assert len(shown) == 4
    for axes, step in zip(shown, chosen_steps(far), strict=True):
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        x, y = record.robot_positions[step]
        assert left + 0.3 < x < right - 0.3
        assert low + 0.3 < y < high - 0.3


def test_a_figure_is_written_whole_and_large_enough(tmp_path):
    path = save_figure(run_figure(made_record()), tmp_path / "run.png")
    with Image.open(path) as opened:
        picture = np.asarray(opened.convert("L"))
    assert picture.shape[1] >= 1500
    assert 0.01 < (picture < 200).mean() < 0.5
    assert [p.name for p in tmp_path.iterdir()] == ["run.png"]


def test_series_are_the_record():
    record = made_record(people=1)
    figure = run_figure(record)
    (belief,) = panels(figure, "P(concerned)")
    assert any(np.array_equal(line.get_ydata(), record.beliefs[:, 0]) for line in belief.get_lines())
    (risk,) = panels(figure, "probability")
    assert np.allclose(risk.get_lines()[0].get_ydata(), np.maximum(record.risk.max(axis=1), 1e-4))
    heights = [float(np.unique(line.get_ydata())[0]) for line in risk.get_lines()[2:]]
    assert record.risk_limit in heights
    (distance,) = panels(figure, "distance (m)")
    flat = {float(line.get_ydata()[0]) for line in distance.get_lines() if len(np.unique(line.get_ydata())) == 1}
    assert {record.clearance, 0.6} <= flat


def test_where_the_sum_of_risks_is_limited_the_sum_is_drawn():
    """The largest stage was drawn beneath the limit of the sum, and kept it where the sum did not."""
    record = made_record(people=1)
    summed = replace(record, settings={"planner": {"risk_rule": "trajectory"}})
    (risk,) = panels(run_figure(summed), "probability")
    assert np.allclose(risk.get_lines()[0].get_ydata(), np.maximum(record.risk.sum(axis=1), 1e-4))


def test_steps_that_are_not_certified_are_shaded():
    record = made_record()
    (risk,) = panels(run_figure(record), "probability")
    assert len(risk.patches) == record.status.count("least_risk") > 0
    (risk,) = panels(run_figure(replace(record, status=("certified",) * len(record.status))), "probability")
    assert len(risk.patches) == 0


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 4), st.sampled_from([1, 2, 3]))
def test_closest_approach_is_that_of_a_fine_interpolation(seed, people, dimension):
    record = made_record(seed=seed, people=people, dimension=dimension, late=True)
    times, fine = distances(record, between=400)
    for approach in closest_approaches(record):
        assert approach.distance <= np.nanmin(fine[:, approach.person]) + 1e-9
        assert approach.distance == pytest.approx(np.nanmin(fine[:, approach.person]), abs=2e-3)
        between = np.linalg.norm(approach.robot_position - approach.person_position)
        assert between == pytest.approx(approach.distance, abs=1e-9)
        assert times[0] <= approach.time <= times[-1]


def test_a_person_who_is_never_seen_is_left_out():
    record = made_record(people=2)
    positions = record.people_positions.copy()
    positions[:, 1] = np.nan
    record = replace(record, people_positions=positions)
    assert [a.person for a in closest_approaches(record)] == [0]
    run_figure(record).draw_without_rendering()


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_the_darkest_cell_lies_where_the_probability_is_largest(angle):
    record = made_record()
    rotation = heading_rotation([np.cos(angle), np.sin(angle)])
    snapshot = replace(record.snapshots[3], rotation=rotation)
    axes = style.new_figure(3, 3).add_subplot()
    for row in (1, 4):
        image = draw_occupancy(axes, snapshot, row, "#000000", (0, 1))
        assert isinstance(image, AxesImage)
        alpha = np.asarray(image.get_array())[..., 3]
        b, a = np.unravel_index(np.argmax(alpha), alpha.shape)
        x0, x1, y0, y1 = image.get_extent()
        local = (x0 + (a + 0.5) * (x1 - x0) / alpha.shape[1], y0 + (b + 0.5) * (y1 - y0) / alpha.shape[0])
        centre = axes.transData.inverted().transform(image.get_transform().transform(local))
        cell = np.array(np.unravel_index(np.argmax(snapshot.probability[row]), snapshot.probability[row].shape))
        radius = (snapshot.probability.shape[1] - 1) // 2
        assert np.allclose(centre, snapshot.origin + rotation @ (snapshot.spacing * (cell - radius)))


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_a_spread_prediction_keeps_its_probability_and_gets_wider(dimension):
    shot = made_record(dimension=dimension).snapshots[3]
    weights, sigmas = np.array([0.3, 0.7]), np.linspace(0.05, 0.5, 2 * len(shot.instants)).reshape(-1, 2)
    spread = replace(shot, weights=weights, sigmas=sigmas)
    for row in (1, 4):
        narrow, p = shown_mass(shot, row)
        wide, q = shown_mass(spread, row)
        assert q.sum() == pytest.approx(1.0, abs=0.02)
        assert wide.shape == q.shape
        variance = [
            (m[..., None] * (at.positions() - at.origin) ** 2).sum() / m.sum()
            - (((m[..., None] * (at.positions() - at.origin)).reshape(-1, dimension).sum(axis=0) / m.sum()) ** 2).sum()
            for at, m in ((narrow, p), (wide, q))
        ]
        added = dimension * float(weights @ sigmas[row] ** 2)
        cell = dimension * (narrow.spacing**2 - wide.spacing**2) / 12
        assert variance[1] - variance[0] == pytest.approx(added + cell, rel=0.15)


def test_a_prediction_over_long_steps_is_drawn_with_no_more_cells():
    shot = made_record(dimension=2).snapshots[3]
    sigmas = np.linspace(5.0, 500.0, len(shot.instants))[:, None]
    for spacing in (0.5, 5.0, 50.0):  # m; the last: steps of 100 s
        lattice, p = shown_mass(replace(shot, spacing=spacing, weights=np.ones(1), sigmas=sigmas), 4)
        assert max(p.shape) < 500
        assert lattice.spacing * max(p.shape) > spacing * (shot.probability.shape[1] - 1)
        assert np.isfinite(p).all()


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_a_projection_keeps_all_probability_and_leaves_no_gaps(angle):
    record = made_record(dimension=3)
    shot = record.snapshots[3]
    lattice = Lattice(
        origin=shot.origin,
        spacing=shot.spacing,
        radius=(shot.probability.shape[1] - 1) // 2,
        rotation=heading_rotation([np.cos(angle), np.sin(angle), 0.0]),
    )
    uniform = np.full(shot.probability.shape[1:], 1 / shot.probability[0].size)
    cells, _, _ = _projected(lattice, uniform, (0, 1))
    assert cells.sum() == pytest.approx(1.0)
    middle = len(cells) // 2
    inner = cells[middle - 5 : middle + 6, middle - 5 : middle + 6]
    assert inner.min() > 0.6 * inner.max() > 0


def test_snapshots_are_chosen_around_the_encounter():
    record = made_record()
    steps = chosen_steps(record)
    assert 2 <= len(steps) <= 4
    assert steps[0] == 0
    nearest = closest_approaches(record)[0].time
    assert abs(record.time[steps[-1]] - nearest) <= 1.5
    assert chosen_steps(made_record(snapshots=False)) == []


@pytest.mark.parametrize("span", [0.3, 1.0, 12.0, 100.0, 5000.0])
def test_time_marks_are_few_and_round(span):
    record = made_record()
    record = replace(record, time=np.linspace(0.0, span, len(record.time)))
    marks = time_marks(record)
    assert 1 <= len(marks) <= 10
    assert np.allclose(marks % 0.5, 0.0)


def test_far_futures_are_darker():
    light = [np.dot(to_rgb(colour), (0.2126, 0.7152, 0.0722)) for colour in AHEAD]
    assert all(a > b + 0.05 for a, b in pairwise(light))


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OutputError, match="nowhere"):
        save_figure(run_figure(made_record(snapshots=False)), tmp_path / "nowhere" / "run.png")


def test_where_a_folder_has_the_name_nothing_is_left_behind(tmp_path):
    (tmp_path / "run.png").mkdir()
    with pytest.raises(OutputError, match=r"run\.png"):
        save_figure(run_figure(made_record(snapshots=False)), tmp_path / "run.png")
    assert [file.name for file in tmp_path.iterdir()] == ["run.png"]


@pytest.mark.parametrize("people", [1, 2, 3])
@pytest.mark.parametrize("narrow", [1.0, 0.1])
def test_no_two_seconds_are_written_on_one_place(people, narrow):
    """Paths that cross, or run side by side in a corridor."""
    record = made_record(people=people)
    squeezed = np.array([1.0, narrow])
    record = replace(
        record,
        robot_positions=record.robot_positions * squeezed,
        robot_goal=record.robot_goal * squeezed,
        people_positions=record.people_positions * squeezed,
    )
    axes = style.new_figure(6.0, 5.5).add_subplot()
    draw_paths(axes, record)
    boxes = [text.get_window_extent() for text in axes.texts if text.get_text().isdigit()]
    assert len(boxes) >= 3
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_who_may_be_anywhere_is_drawn_faintly():
    """Scaled by its own largest cell, it painted whole panels dark, and the plan in them was not seen."""
    shot = made_record().snapshots[0]
    axes = Figure().add_subplot()

    def strongest(spread):
        sigmas = np.full((len(shot.instants), 1), spread)  # (K, 1) m
        image = draw_occupancy(axes, replace(shot, weights=np.ones(1), sigmas=sigmas), 1, "#000000", (0, 1))
        return float(np.asarray(image.get_array())[..., 3].max())

    sharp, wide, wider = (strongest(spread) for spread in (0.05, 1.0, 3.0))
    assert sharp > 0.6
    assert wide < 0.75 * sharp
    assert 0.1 < wider < 0.4


def test_a_robot_that_waits_at_its_goal_has_arrived_when_it_came():
    """Others may be on the way still, or the visitor of the live page looks on."""
    record = made_record()
    path = record.robot_positions.copy()
    path[-6:] = record.robot_goal
    waited = replace(record, robot_positions=path)
    seconds = f"after {measure(waited).time_to_goal:.1f} s"
    assert measure(waited).time_to_goal == record.time[-6]
    assert seconds in run_figure(waited).get_suptitle()
    replay = Replay(waited)
    replay.post(Seek(type="seek", index=replay.last))
    assert seconds in json.loads(replay.tick()[-1])["panels"][0]["words"]


def test_pyplot_is_never_imported():
    code = (
        "import sys, sidestep.viewer.animation, sidestep.viewer.figures; sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, check=False).returncode == 0


def test_no_record_is_changed_by_drawing():
    record = made_record(people=2)
    before = {
        name: np.array(getattr(record, name))
        for name in Record.__dataclass_fields__
        if name != "settings" and isinstance(getattr(record, name), np.ndarray)
    }
    run_figure(record).draw_without_rendering()
    for name, values in before.items():
        assert np.array_equal(values, getattr(record, name), equal_nan=values.dtype.kind == "f"), name
