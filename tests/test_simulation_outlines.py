"""A map becomes rectangles that cover its walls exactly."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sidestep.obstacles import Obstacles, OccupancyGrid
from sidestep.simulation.outlines import outlines


@settings(max_examples=40, deadline=None)
@given(
    arrays(np.bool_, st.tuples(st.integers(1, 6), st.integers(1, 6))),
    st.floats(-3, 3),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5)),
)
def test_the_rectangles_are_the_map(cells, yaw, origin):
    grid = OccupancyGrid(occupied=cells, resolution=0.5, origin=origin, yaw=yaw)
    boxes = outlines(Obstacles(grid=grid))
    middles = 0.5 * (np.stack(np.meshgrid(*map(np.arange, cells.shape), indexing="ij"), axis=-1) + 0.5)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    covered = ~Obstacles(polygons=boxes).free(middles @ turn.T + origin, -0.01)
    np.testing.assert_array_equal(covered, cells)
    around = np.random.default_rng(0).uniform(-9, 9, (200, 2))
    by_map, by_boxes = Obstacles(grid=grid).distance(around), Obstacles(polygons=boxes).distance(around)
    np.testing.assert_array_equal(by_map < 0, by_boxes < 0)
    np.testing.assert_allclose(np.maximum(by_map, 0), np.maximum(by_boxes, 0), atol=1e-9)
    areas = [np.linalg.norm(b[1] - b[0]) * np.linalg.norm(b[2] - b[1]) for b in boxes]
    assert np.isclose(sum(areas), 0.25 * cells.sum())  # no overlap


def test_a_plain_wall_takes_one_rectangle():
    cells = np.zeros((50, 40), dtype=bool)
    cells[10:30, 5:9] = True
    assert len(outlines(Obstacles(grid=OccupancyGrid(occupied=cells, resolution=0.1)))) == 1
    assert outlines(None) == ()
