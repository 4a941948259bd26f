"""The risk around people against direct sums, and the laws it must obey."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as options
from hypothesis import strategies as st

from alternatives import risk as naive
from made_masses import person, still_person
from made_people import draw_encounter, predicted
from sidestep._kernels import blocks, risk, risk_along, risk_profile, risk_raster
from sidestep.prediction.collision import PersonMass, RiskField, RiskRasters, all_in_reach
from sidestep.prediction.profiles import GRAIN, KEPT, profile_of

PLACES = st.tuples(st.floats(-2, 3), st.floats(-2, 2))


def field(*people, distances=0.7, **more):
    return RiskField(people=people, distances=np.broadcast_to(np.asarray(distances, float), len(people)).copy(), **more)


@given(place=PLACES, heading=st.floats(-3.2, 3.2), block=st.integers(0, 6), distance=st.floats(0.2, 1.5))
@options(max_examples=40)
def test_sharp_risk_is_the_sum_over_cells(place, heading, block, distance):
    someone = person(horizon=3, position=(0.5, 0.2), heading=heading)
    exact = naive.risk_at([someone], [distance], block, np.array(place))
    assert field(someone, distances=distance).at(block, np.array([place]))[0] == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("position", [(0.4,), (0.4, 0.1), (0.4, 0.1, -0.3)])
@pytest.mark.parametrize("spread", [False, True])
def test_risk_is_the_sum_over_cells_in_every_dimension(position, spread):
    someone = person(horizon=2, position=position, heading=0.0, spread=spread)
    other = person(horizon=2, position=tuple(-x for x in position), heading=0.0, spread=spread, straight=0.3)
    both = field(someone, other, distances=(0.5, 0.8))
    rng = np.random.default_rng(1)
    points = rng.uniform(-1, 1.5, (6, len(position)))
    for block in range(5):
        expected = [naive.risk_at([someone, other], [0.5, 0.8], block, p) for p in points]
        assert both.at(block, points) == pytest.approx(expected, abs=3e-4 if spread else 1e-9)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_blob_in_ball(d):
    rng = np.random.default_rng(d)
    table = risk_profile.blob_table(d)
    nodes = np.stack(np.polynomial.legendre.leggauss(40))
    for _ in range(60):
        distance, radius, sigma = rng.uniform(0, 3), rng.uniform(0.3, 1.2), 10 ** rng.uniform(-2, 0.3)
        exact = naive.share_within(np.array([distance]), radius, sigma, d)[0]
        if np.isnan(exact):
            continue
        assert risk_profile.ball_probability(distance, radius, sigma, d, nodes) == pytest.approx(exact, abs=2e-5)
        assert risk_profile.blob.py_func(distance, radius, sigma, table) == pytest.approx(exact, abs=2e-4)
        assert risk_profile.blob(distance, radius, sigma, table) == pytest.approx(exact, abs=2e-4)


def test_profile_follows_its_mixture():
    weights, sigmas = np.array([0.2, 0.5, 0.3]), np.array([[0.03, 0.1, 0.9], [0.0, 0.3, 0.3]])
    table = risk_profile.blob_table(2)
    samples, grids = profile_of(0.7, weights, sigmas, 2)
    for b in (0, 1):
        for d in np.linspace(0, 6, 241):
            expected = risk_profile.mixture(d, 0.7, weights, sigmas[b], table)
            slack = 1e-3 if b == 0 or abs(d - 0.7) > 0.02 else 0.3  # a step is drawn over its neighbourhood
            assert risk_profile.profile_value(d, samples[b], grids[b]) == pytest.approx(expected, abs=slack)


@pytest.mark.parametrize("instants", [2, KEPT])  # tables that are kept, and those that are not
def test_profiles_of_other_weights_and_radii_are_their_own(instants):
    sigmas = np.round(np.linspace([0.1, 0.4], [0.2, 0.9], instants), GRAIN)
    table = risk_profile.blob_table(2)
    for weights in (np.array([1.0, 0.0]), np.array([0.25, 0.75])):
        for radius in (0.5, 0.8):
            for kernel in (risk_profile.mixed_profiles, risk_profile.mixed_profiles.py_func):
                apart, grids = risk_profile.class_profiles(radius, sigmas, table)
                known, known_grids = profile_of(radius, weights, sigmas, 2)
                assert kernel(weights, apart) == pytest.approx(np.tensordot(weights, apart, 1), abs=1e-15)
                assert known == pytest.approx(kernel(weights, apart), abs=1e-15)
                assert np.array_equal(known_grids, grids)


@pytest.mark.parametrize("position", [(0.4,), (0.4, 0.1), (0.4, 0.1, -0.3)])
def test_sharp_raster_is_the_direct_sum(position):
    d = len(position)
    people = field(person(horizon=2, position=position, heading=0.5), still_person(2, [-0.3] * d), distances=(0.5, 0.4))
    origin = np.full(d, 0.13)
    radius = 6 if d == 3 else 12
    axis = 0.11 * np.arange(-radius, radius + 1)
    places = origin + np.stack(np.meshgrid(*([axis] * d), indexing="ij"), axis=-1).reshape(-1, d)
    for block in range(5):
        raster = people.raster(block, origin, 0.11, radius)
        assert raster.ravel() == pytest.approx(people.at(block, places), abs=1e-6)


def test_blurred_raster_serves_its_limit():
    """Heavy cells are bounded from above, closely where it matters; smooth parts follow the direct sum."""
    limit = 0.02
    people = field(person(horizon=6, position=(0.4, 0.1), heading=0.5, spread=True))
    origin, radius, spacing = np.array([0.13, 0.0]), 30, 0.1
    axis = spacing * np.arange(-radius, radius + 1)
    places = origin + np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    for block in (1, 4, 7, 12):
        raster = people.raster(block, origin, spacing, radius, limit=limit).ravel()
        exact = people.at(block, places)
        assert (np.minimum(raster, limit) - np.minimum(exact, limit)).min() > -0.3 * limit
        forbidden = exact > limit
        assert np.mean(raster[forbidden] > 0.8 * limit) > 0.999
        assert np.mean(raster[exact < 0.3 * limit] < limit) > 0.97


def test_staircase_bounds_the_profile():
    table = risk_profile.blob_table(2)
    weights, sigmas = np.array([0.6, 0.4]), np.array([0.05, 0.12])
    radii, shares = np.zeros(risk_raster.STEPS), np.zeros(risk_raster.STEPS)
    used = risk_raster.staircase(0.7, weights, sigmas, table, 0.02, risk_raster.STEPS, radii, shares)
    assert shares[:used].sum() == pytest.approx(risk_profile.mixture(0.0, 0.7, weights, sigmas, table))
    for d in np.linspace(0, 2, 201):
        stairs = shares[:used][d <= radii[:used]].sum()
        exact = risk_profile.mixture(d, 0.7, weights, sigmas, table)
        assert stairs >= exact - 0.05 * 0.02 - 1e-4


def test_rasters_hold_the_raster_of_every_half_instant():
    people = field(person(horizon=3, position=(0.9, 0.1)), distances=0.6)
    whole = people.rasters(np.zeros(2), 0.125, all_in_reach(3, 4, 2), limit=1e-9)
    for b in range(1, 7):
        radius = (4 * b + 1) // 2
        part = whole.values[whole.starts[b] : whole.starts[b + 1]]
        assert part == pytest.approx(people.raster(b, np.zeros(2), 0.125, radius).ravel(), abs=1e-6)
        assert whole.some[b] == (part.max() > 0)
    assert (
        not field(person(horizon=3, position=(50.0, 0.0))).rasters(np.zeros(2), 0.125, all_in_reach(3, 4, 2)).some.any()
    )


def test_rasters_are_drawn_once_where_one_look_covers_another():
    people, origin = field(person(horizon=3, position=(0.9, 0.1)), distances=0.6), np.array([0.1, -0.2])
    narrow, wide = all_in_reach(3, 2, 2), all_in_reach(3, 4, 2)
    first = people.rasters(origin, 0.125, narrow)
    whole = people.rasters(origin, 0.125, wide)
    assert whole is not first
    assert whole.boxes is wide
    assert people.rasters(origin, 0.125, narrow) is whole
    assert people.rasters(origin, 0.25, narrow) is not whole
    assert people.rasters(origin + 0.1, 0.125, narrow) is not whole
    assert people.rasters(origin, 0.125, narrow, limit=0.3) is not whole
    anew = people.draw(origin, 0.125, narrow)
    for b in range(1, 7):
        small, large = (r.values[r.starts[b] : r.starts[b + 1]].reshape(r.boxes[1][b]) for r in (anew, whole))
        at = anew.boxes[0][b] - whole.boxes[0][b]
        part = large[tuple(slice(a, a + n) for a, n in zip(at, small.shape, strict=True))]
        assert part == pytest.approx(small, abs=1e-6)


@given(place=PLACES, block=st.integers(1, 6), small=st.floats(0.1, 1.0), more=st.floats(0.0, 0.5), spread=st.booleans())
@options(max_examples=40)
def test_risk_falls_as_clearance_falls(place, block, small, more, spread):
    someone = person(horizon=3, position=(0.5, 0.2), spread=spread)
    points = np.array([place])
    near, wide = (field(someone, distances=r).at(block, points)[0] for r in (small, small + more))
    assert 0.0 <= near <= wide + 2e-4 * spread <= 1.0 + 2e-4


@given(place=PLACES, other=PLACES, block=st.integers(1, 6), spread=st.booleans())
@options(max_examples=40)
def test_more_people_never_lower_the_risk(place, other, block, spread):
    someone = person(horizon=3, position=(0.5, 0.2), spread=spread)
    company = person(horizon=3, position=other, heading=1.0)
    points = np.array([place])
    alone = field(someone).at(block, points)[0]
    together = field(someone, company).at(block, points)[0]
    apart = field(someone, company).per_person(np.array([block]), points)[:, 0]
    assert together >= alone - 1e-12
    assert together == pytest.approx(1 - (1 - apart[0]) * (1 - apart[1]), abs=1e-12)
    axis = (np.zeros(2), 0.2, 5)
    assert (field(someone, company).raster(block, *axis) >= field(someone).raster(block, *axis) - 1e-6).all()


def test_along_reads_steps_and_midpoints():
    people = field(person(horizon=3, position=(1.0, 0.1)))
    path = np.array([[0.0, 0.0], [0.3, 0.1], [0.5, 0.1], [0.9, 0.2]])
    along = people.along(path)
    for k in range(3):
        assert along[2 * k] == people.at(2 * k + 1, 0.5 * (path[k] + path[k + 1])[None])[0]
        assert along[2 * k + 1] == people.at(2 * k + 2, path[k + 1][None])[0]
    steps_only = field(person(horizon=3, position=(1.0, 0.1), midway=False)).along(path)
    assert (steps_only[0::2] == 0).all()
    assert steps_only[1::2] == pytest.approx(along[1::2])
    assert field(person(horizon=3, position=(1.0, 0.1)), midway=False).along(path) == pytest.approx(steps_only)


def test_certificate_does_not_depend_on_the_frame():
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    path = np.array([[0.0, 0.0], [0.3, 0.1], [0.5, 0.1], [0.9, 0.2]])
    for spread in (False, True):
        one = field(person(horizon=3, position=(1.0, 0.1), spread=spread)).along(path)
        two = field(person(horizon=3, position=(1.0, 0.1), spread=spread, turn=turn)).along(path @ turn.T)
        assert two == pytest.approx(one, abs=1e-9)


def test_cells_rule_marks_cells_above_the_threshold():
    someone = person(horizon=3, position=(0.5, 0.2))
    marked = field(someone, distances=0.5).cells_above(0.1)
    for block in (2, 4, 6):
        cells, masses = naive.places(someone, block)
        heavy = cells[masses >= 0.1]
        for point in np.random.default_rng(block).uniform(-1, 1.5, (30, 2)):
            close = np.linalg.norm(heavy - point, axis=1) < 0.5
            assert marked.at(block, point[None])[0] == float(close.any())
    assert not marked.has_midway


def test_nobody_is_no_risk():
    nobody = field()
    assert (nobody.along(np.zeros((4, 2))) == 0).all()
    assert nobody.blocks == 0
    assert not nobody.has_midway
    assert not RiskRasters.nobody(all_in_reach(3, 4, 2)).some.any()
    assert (nobody.raster(1, np.zeros(2), 0.1, 3) == 0).all()


def test_compact_leaves_out_no_more_than_the_tolerance():
    someone = person(horizon=4, position=(0.5, 0.2), straight=0.6)
    for tolerance in (0.0, 1e-6, 1e-3, 0.1):
        _, masses, starts = someone.cells(tolerance)
        for b in range(len(starts) - 1):
            whole = someone.flat[someone.offsets[b] : someone.offsets[b + 1]].sum()
            kept = masses[starts[b] : starts[b + 1]].sum()
            assert whole - tolerance - 1e-12 <= kept <= whole + 1e-12


def test_kernels_without_compilation_agree():
    someone = person(horizon=2, position=(0.5, 0.2), spread=True)
    arguments = (someone.flat, someone.offsets, someone.radii, someone.spacings, np.array([0.0, 0.5, 0.2]), np.eye(3),
                 np.array([0, 1, 1]))  # fmt: skip
    points = np.array([[0.0, 0.4, 0.1], [0.0, 0.9, -0.3]])
    instants = np.array([3, 4])
    assert risk.mass_within.py_func(points, instants, *arguments, 0.6) == pytest.approx(
        risk.mass_within(points, instants, *arguments, 0.6)
    )
    compiled, plain = (f(*arguments, *someone.spans, 1e-4) for f in (risk.compact, risk.compact.py_func))
    for a, b in zip(compiled, plain, strict=True):
        assert a == pytest.approx(b)
    samples, grids = profile_of(0.6, someone.weights, someone.sigmas, 2)
    near = risk.mass_near(points, instants, *arguments, *someone.spans, samples, grids)
    assert risk.mass_near.py_func(points, instants, *arguments, *someone.spans, samples, grids) == pytest.approx(near)
    path = np.array([[0.0, -0.2], [0.3, 0.1], [0.5, 0.1]])
    places = np.array([[0.0, *x] for x in (0.5 * (path[0] + path[1]), path[1], 0.5 * (path[1] + path[2]), path[2])])
    for along, at, rest in (
        (risk_along.mass_within_along, risk.mass_within, (*arguments, 0.6)),
        (risk_along.mass_near_along, risk.mass_near, (*arguments, *someone.spans, samples, grids)),
    ):
        expected = at.py_func(places, np.array([1, 2, 3, 4]), *rest)
        for kernel in (along, along.py_func):
            assert kernel(path, True, *rest) == pytest.approx(expected)
            assert kernel(path, False, *rest) == pytest.approx(expected * [0, 1, 0, 1])
    where = someone.flat, someone.offsets, someone.radii, np.array([0, 1, 1])
    for a, b in zip(risk.row_spans(*where, 1e-4), risk.row_spans.py_func(*where, 1e-4), strict=True):
        assert a == pytest.approx(b)


@pytest.mark.parametrize("tolerance", [0.0, 1e-6, 1e-2])
def test_spans_hold_all_but_the_tolerance_and_what_they_leave_out_is_told(tolerance):
    someone = person(horizon=4, position=(0.5, 0.2), straight=0.6)
    spans, starts, outside = risk.row_spans(someone.flat, someone.offsets, someone.radii, someone.frame[2], tolerance)
    assert (outside <= tolerance + 1e-12).all()
    for b, r in enumerate(someone.radii):
        rows = someone.flat[someone.offsets[b] : someone.offsets[b + 1]].reshape(-1, 2 * r + 1)
        inside = sum(
            row[r + left : r + right].sum() for row, (left, right) in zip(rows, spans[starts[b] :], strict=False)
        )
        assert inside + outside[b] == pytest.approx(rows.sum(), abs=1e-12)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("midway", [False, True])
def test_blocks_of_a_prediction_are_its_steps_and_mid_steps(d, midway):
    case = draw_encounter(d, d=d, reach=1, steps=2, horizon=3, walls=False)
    for kernel in (blocks.take_steps, blocks.take_steps.py_func):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("sidestep.prediction.occupancy.take_steps", kernel)
            prediction = predicted(case, midway=midway)
            assert prediction.occupancy.probability.sum() == pytest.approx(4.0)
        found = PersonMass.of_prediction(prediction)
        steps = prediction.occupancy.probability
        plain = PersonMass.of(lattice=prediction.occupancy.lattice, steps=steps, midway=prediction.midway, reach=1)
        assert len(prediction.midway) == (3 if midway else 0)
        np.testing.assert_array_equal(found.flat, plain.flat)
        np.testing.assert_array_equal(found.offsets, plain.offsets)
        filled = np.diff(plain.offsets) > 0
        np.testing.assert_array_equal(found.radii[filled], plain.radii[filled])


def test_mass_from_steps_drops_empty_margins():
    someone = person(horizon=3, position=(0.5, 0.2))
    assert list(someone.radii) == [0, 1, 1, 3, 2, 5, 3]
    for b in range(7):
        assert someone.flat[someone.offsets[b] : someone.offsets[b + 1]].sum() == pytest.approx(1.0)
    again = PersonMass.of(lattice=someone.lattice, steps=np.ones((2, 7, 7)), reach=1)
    assert again.offsets[2] == again.offsets[1]
