"""Walls against brute force and the laws of distance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st

from sidestep._kernels import walls as kernels
from sidestep._kernels.search_maps import wall_box
from sidestep.errors import InvalidInput
from sidestep.lattice import Lattice
from sidestep.obstacles import SEGMENT_STEP, Obstacles, OccupancyGrid

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
HOOK = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (2.0, 2.0), (2.0, 1.0), (0.0, 1.0)]
PLACE = st.tuples(st.floats(-3, 5), st.floats(-3, 5))


def boundary_distance(polygon, point, samples=4000):
    corners = np.array(polygon)
    t = np.linspace(0, 1, samples)[:, None]
    return min(
        np.linalg.norm(a + t * (b - a) - point, axis=1).min()
        for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)
    )


def inside_hook(p):
    return (0 < p[0] < 3 and 0 < p[1] < 1) or (2 < p[0] < 3 and 0 < p[1] < 2)


def some_grid(seed=0, yaw=0.3):
    cells = np.random.default_rng(seed).random((12, 9)) < 0.2
    return OccupancyGrid(occupied=cells, resolution=0.25, origin=(-1.0, -0.5), yaw=yaw)


def grid_distance(grid, point, fine=11):
    """Distance to the squares by sampling them; 0 inside."""
    turn = np.array([[math.cos(grid.yaw), -math.sin(grid.yaw)], [math.sin(grid.yaw), math.cos(grid.yaw)]])
    axis = np.linspace(0, 1, fine)
    inner = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    best = np.inf
    for cell in np.argwhere(grid.occupied):
        places = (cell + inner) * grid.resolution @ turn.T + grid.origin
        best = min(best, np.linalg.norm(places - point, axis=1).min())
    return best


@given(place=PLACE)
def test_distance_to_a_polygon(place):
    walls = Obstacles(polygons=[HOOK])
    exact = boundary_distance(HOOK, np.array(place))
    got = float(walls.distance(place))
    assert abs(got) == pytest.approx(exact, abs=1e-3)
    if exact > 1e-3:
        assert (got < 0) == inside_hook(place)


@given(place=PLACE)
@options(max_examples=40)
def test_distance_to_a_map(place):
    grid = some_grid()
    got = float(Obstacles(grid=grid).distance(place))
    exact = grid_distance(grid, np.array(place))
    if got > 0:
        assert got <= exact + 1e-9
        assert exact <= got + 0.02
    else:
        assert exact < 0.02


@pytest.mark.parametrize("seed", range(4))
def test_of_many_polygons_the_nearest_counts_wherever_it_stands_in_the_list(seed):
    """Most are passed over whole; alone, none is."""
    rng = np.random.default_rng(seed)
    turns = [np.sort(rng.uniform(0.0, 2 * np.pi, n)) for n in rng.integers(2, 12, 60)]
    polygons = [
        rng.uniform(-6, 6, 2) + rng.uniform(0.05, 2.0) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        for turn in turns
    ]
    points = rng.uniform(-8, 8, (400, 2))
    alone = np.array([Obstacles(polygons=[polygon]).distance(points) for polygon in polygons])
    inside = (alone < 0.0).any(axis=0)
    assert inside.any()
    expected = np.where(inside, -1.0, 1.0) * np.abs(alone).min(axis=0)
    assert Obstacles(polygons=polygons).distance(points) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("polygons", [None, 5])
def test_what_is_no_list_of_polygons_is_refused(polygons):
    with pytest.raises(InvalidInput, match=r"obstacles\.polygons: got .*allowed: a list of polygons"):
        Obstacles(polygons=polygons)


def test_walls_of_both_kinds_count():
    both = Obstacles(polygons=[SQUARE], grid=some_grid())
    points = np.random.default_rng(1).uniform(-3, 4, (50, 2))
    apart = np.minimum(Obstacles(polygons=[SQUARE]).distance(points), Obstacles(grid=some_grid()).distance(points))
    assert both.distance(points) == pytest.approx(apart)


@given(place=st.tuples(st.floats(-7, 9), st.floats(-7, 9)), margin=st.floats(-0.3, 5.0))
@options(max_examples=100)
def test_free_is_distance_at_least_margin(place, margin):
    for walls in (Obstacles(polygons=[HOOK]), Obstacles(grid=some_grid())):
        gap = float(walls.distance(place)) - margin
        if abs(gap) > 1e-9:
            assert bool(walls.free(place, margin)) == (gap > 0)


@given(bearing=st.floats(-math.pi, math.pi), away=st.floats(0.0, 9.0), mapped=st.booleans())
def test_samples_bound_the_distance_near_walls_and_far_from_them(bearing, away, mapped):
    walls = Obstacles(grid=some_grid()) if mapped else Obstacles(polygons=[HOOK])
    x, y = 1.0 + 10.0**away * math.cos(bearing), 1.0 + 10.0**away * math.sin(bearing)
    *_, samples, corner = walls.shapes
    least, most = kernels.distance_bounds(x, y, samples, corner)
    distance = float(walls.distance((x, y)))
    assert least <= distance + 1e-6
    assert most >= distance - 1e-6
    assert least >= 0.5 * (distance - 10.0)  # far away the steps along a segment are as long as it is far


@given(
    x=st.floats(-8, 10), y=st.floats(-8, 10), spacing=st.floats(0.02, 0.5), margin=st.floats(-0.3, 4.0),
    half=st.sampled_from([(0, 3, 25), (0, 17, 8), (6, 9, 2)]), mapped=st.booleans(),
)  # fmt: skip
@options(max_examples=80)
def test_box_of_walls_is_distance_below_the_margin_at_every_place(x, y, spacing, margin, half, mapped):
    """Near walls and far from them, on the samples and off them, margins wider than these reach included."""
    walls = Obstacles(polygons=[HOOK], grid=some_grid() if mapped else None)
    origin = np.array([x, y, 0.0]) if half[0] else np.array([0.0, x, y])
    box = wall_box(origin, spacing, np.array(half), margin, *walls.shapes)
    flat = half[:2] if half[0] else half[1:]
    axes = [at + spacing * np.arange(-n, n + 1) for at, n in zip((x, y), flat, strict=True)]
    gap = walls.distance(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)) - margin
    gap = gap[:, :, None] if half[0] else gap[None]
    assert ((box == (gap < 0)) | (np.abs(gap) < 1e-9)).all()


@given(a=PLACE, b=PLACE, margin=st.floats(0, 0.6))
@options(max_examples=60)
def test_segment_is_free_if_all_its_points_are(a, b, margin):
    walls = Obstacles(polygons=[HOOK], grid=some_grid())
    way = np.array(a) + np.linspace(0, 1, 2001)[:, None] * (np.array(b) - np.array(a))
    lowest = float(walls.distance(way).min())
    free = bool(walls.segment_free(a, b, margin))
    if lowest < margin - SEGMENT_STEP / 2:
        assert not free
    if lowest >= margin + 1e-9 + 0.004:  # what lies between the 2001 samples
        assert free


def test_distance_changes_by_at_most_the_way_gone():
    walls = Obstacles(polygons=[HOOK], grid=some_grid())
    rng = np.random.default_rng(2)
    a = rng.uniform(-3, 5, (200, 2))
    b = a + rng.uniform(-0.3, 0.3, (200, 2))
    assert (np.abs(walls.distance(a) - walls.distance(b)) <= np.linalg.norm(a - b, axis=1) + 1e-9).all()


class Watched:
    """A map that counts how many of its cells are read."""

    def __init__(self, cells):
        self.cells, self.shape, self.looks = cells, cells.shape, 0

    def __getitem__(self, cell):
        self.looks += 1
        return self.cells[cell]


@pytest.mark.parametrize("place", [(-70.0, 30.0), (230.0, 260.0), (100.0, -90.0), (3.0, 190.0)])
def test_a_place_beside_a_sparse_map_is_not_compared_with_all_of_it(place):
    cells = np.zeros((200, 200), dtype=bool)
    cells[90:110, 60:140] = True
    _, _, frame, sizes = Obstacles(grid=OccupancyGrid(occupied=cells, resolution=1.0))._shapes
    watched = Watched(cells)
    got = kernels._grid_distance.py_func(*place, watched, frame, sizes)
    assert got == pytest.approx(
        math.hypot(*(max(a - x, x - b, 0.0) for x, a, b in zip(place, (90, 60), (110, 140), strict=True)))
    )
    assert watched.looks < 1500


def test_shapes_follow_the_points():
    walls = Obstacles(polygons=[SQUARE])
    assert walls.free((2.0, 0.5), margin=0.3).shape == ()
    assert walls.free(np.zeros((4, 3, 2))).shape == (4, 3)
    assert walls.distance(np.array([2.0, 0.5, 7.0])) == pytest.approx(1.0)  # walls reach to the sky
    lattice = Lattice(origin=np.array([0.5, 0.5]), spacing=0.5, radius=2)
    cells = walls.free_cells(lattice, margin=0.1)
    assert cells.shape == (5, 5)
    assert not cells[2, 2]
    assert cells[0, 0]


def test_thin_wall_and_no_wall():
    thin = Obstacles(polygons=[[(0.0, 0.0), (2.0, 0.0)]])
    assert float(thin.distance((1.0, 0.4))) == pytest.approx(0.4)
    assert not thin.segment_free((1.0, -1.0), (1.0, 1.0))
    none = Obstacles()
    assert np.isinf(none.distance((0.0, 0.0)))
    assert none.free((0.0, 0.0), 5.0)
    assert none.segment_free((0, 0), (9, 9), 5.0)
    assert none.bounds == (0.0, 0.0, 0.0, 0.0)
    empty = Obstacles(grid=OccupancyGrid(occupied=np.zeros((3, 3), dtype=bool), resolution=0.1))
    assert empty.free((0.1, 0.1), 1.0)
    full = Obstacles(grid=OccupancyGrid(occupied=np.ones((3, 4), dtype=bool), resolution=1.0))
    assert float(full.distance((1.5, 2.0))) == pytest.approx(-1.5)
    assert float(full.distance((-1.0, 2.0))) == pytest.approx(1.0)


def test_kernels_without_compilation_agree():
    walls = Obstacles(polygons=[HOOK], grid=some_grid())
    points = np.random.default_rng(4).uniform(-2, 4, (20, 2))
    shapes = walls._shapes
    assert kernels.wall_distances.py_func(points, *shapes) == pytest.approx(kernels.wall_distances(points, *shapes))
    assert (kernels.free_points.py_func(points, 0.2, *shapes, *walls._samples) == walls.free(points, 0.2)).all()
    straight = kernels.free_segments.py_func(points[:10], points[10:], 0.1, 0.01, *shapes, *walls._samples)
    assert (straight == kernels.free_segments(points[:10], points[10:], 0.1, 0.01, *shapes, *walls._samples)).all()


@pytest.mark.parametrize("made", [
    lambda: Obstacles(polygons=[[(0.0, 0.0)]]),
    lambda: Obstacles(polygons=[[(0.0, np.nan), (1.0, 1.0), (2.0, 0.0)]]),
    lambda: OccupancyGrid(occupied=np.zeros((0, 3), dtype=bool), resolution=0.1),
    lambda: OccupancyGrid(occupied=np.zeros((3, 3), dtype=bool), resolution=0.0),
    lambda: Obstacles().free((1.0,)),
    lambda: Obstacles().segment_free((0, 0), [(1, 1), (2, 2)]),
])  # fmt: skip
def test_bad_walls_are_refused_in_one_line(made):
    with pytest.raises(InvalidInput, match=r"^[^\n]*allowed[^\n]*$"):
        made()


def test_ways_out_of_a_wall_lead_out_once_and_into_no_other():
    walls = Obstacles(polygons=[SQUARE, [(1.5, 0.0), (1.6, 0.0), (1.6, 1.0), (1.5, 1.0)]])
    ends = np.array([(1.2, 0.5), (2.5, 0.5), (-0.5, 0.5), (0.8, -1.0), (0.9, 0.8)])
    starts = np.full_like(ends, (0.9, 0.5))
    assert walls.come_out(starts, ends, 0.3).tolist() == [True, False, False, True, True]


@pytest.mark.parametrize("walls", [Obstacles(), Obstacles(polygons=[SQUARE])], ids=["none", "some"])
def test_where_nobody_knows_is_not_free(walls):
    """A way from NaN had no end, and was walked along for ever; NaN itself was free."""
    nan = (math.nan, 5.0)
    assert walls.free([nan, (9.0, 9.0)]).tolist() == [False, True]
    assert np.isnan(walls.distance(nan))
    assert walls.segment_free([nan, (9.0, 9.0), (9.0, 8.0)], [(9.0, 9.0), nan, (9.0, 9.0)]).tolist() == [
        False, False, True,
    ]  # fmt: skip
    assert not walls.segment_free((9.0, 9.0), (math.inf, 9.0))


@pytest.mark.parametrize("points", ["here", [(1.0, 2.0), (3.0,)], {}, (1j, 0.0), (10**400, 0.0)])
def test_what_is_no_place_is_refused_in_one_line(points):
    walls = Obstacles(polygons=[[(0, 0), (1, 0), (1, 1)]])
    for ask in (walls.free, walls.distance, lambda p: walls.segment_free((0.0, 0.0), p)):
        with pytest.raises(InvalidInput, match=r"points: got .* allowed: \(…, 2\)"):
            ask(points)
    with pytest.raises(InvalidInput, match="margin: got"):
        walls.free((1.0, 2.0), margin="wide")
    with pytest.raises(InvalidInput, match="polygons"):
        Obstacles(polygons=[[(10**400, 0), (1, 0), (1, 1)]])
