"""What a person's past says: the filter against the textbook, laws of the learning, and sensors that misbehave."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alternatives import habits as naive
from sidestep._kernels import habits as kernel
from sidestep.errors import InvalidInput
from sidestep.human.habit_settings import HabitSettings, class_tables
from sidestep.human.habits import Habits, meet, settled_variance, update


def walk(path, *, hz=10.0, duration=8.0, noise=0.0, seed=0, **options):
    """Follow `path(t)` with measurement noise and return the last state."""
    rng = np.random.default_rng(seed)
    covariance = np.eye(2) * max(noise, 0.005) ** 2
    state = meet(0.0, path(0.0), covariance, **options)
    assert state is not None
    for k in range(1, int(duration * hz) + 1):
        state = update(state, k / hz, path(k / hz) + noise * rng.normal(size=2), covariance)
    return state


def straight(t):
    return np.array([1.2 * t, 0.5 * t])


def restless(seed=1, period=0.5):
    actions = np.random.default_rng(seed).choice([-1.0, -0.5, 0.0, 0.5, 1.0], size=(60, 2))
    corners = np.vstack([[0, 0], np.cumsum(actions * period, axis=0)])
    times = np.arange(61) * period
    return lambda t: np.array([np.interp(t, times, corners[:, a]) for a in (0, 1)])


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_filter_is_the_textbook_filter(d, compiled):
    rng = np.random.default_rng(d)
    step = kernel.filter_step if compiled else kernel.filter_step.py_func
    mean = rng.normal(size=2 * d)
    start = np.diag(rng.uniform(0.1, 2.0, 2 * d))
    cov, noise = start.copy(), start.copy()
    expected = (mean.copy(), start, start)
    for _ in range(12):
        a = rng.normal(size=(d, d))
        r = a @ a.T * 0.01 + 1e-4 * np.eye(d)
        z, dt = rng.normal(size=d), float(rng.uniform(0.02, 0.6))
        expected = naive.kalman(*expected, dt, 1.0, z, r)
        step(mean, cov, noise, dt, 1.0, z, r)
        np.testing.assert_allclose(mean, expected[0], atol=1e-9)
        np.testing.assert_allclose(cov, expected[1], atol=1e-9)
        np.testing.assert_allclose(noise, expected[2], atol=1e-9)


@pytest.mark.parametrize("compiled", [True, False])
def test_steadiness_is_bayes_on_velocity_changes(compiled):
    rng = np.random.default_rng(4)
    s = HabitSettings()
    history = np.full((8, 9), np.nan)
    history[:6, 0] = 5.0 - 0.4 * np.arange(6)
    history[:6, 1:5] = rng.normal(size=(6, 4)) * 0.1
    history[:6, 5:] = 1e-4
    weights = np.zeros(len(s.scales))
    evidence = kernel.steadiness_evidence if compiled else kernel.steadiness_evidence.py_func
    log_prior = class_tables(s).walking
    evidence(history, class_tables(s).scales, s.window, s.spacing, s.freedom, weights)
    weights = weights * s.tempering + log_prior
    (kernel.normalise_log if compiled else kernel.normalise_log.py_func)(weights)
    velocities = np.diff(history[:6, 1:3], axis=0) / 0.4
    expected = naive.class_posterior(
        np.diff(velocities, axis=0), 0.8, 6e-4 / 0.16, s.scales, np.exp(log_prior), s.freedom, s.tempering
    )
    np.testing.assert_allclose(weights, expected, atol=1e-9)


@pytest.mark.parametrize("hz", [2.0, 10.0, 30.0])
def test_a_steady_walker_is_known_as_one(hz):
    state = walk(straight, hz=hz)
    np.testing.assert_allclose(state.velocity, [1.2, 0.5], atol=0.02)
    np.testing.assert_allclose(state.mean_velocity, [1.2, 0.5], atol=0.02)
    np.testing.assert_allclose(state.extrapolated_velocity, [1.2, 0.5], atol=0.05)
    assert state.randomness < 0.15
    assert state.steadiness[:4].sum() > 0.7  # a third before anything was seen
    assert not state.standing
    assert state.top_speed == pytest.approx(1.3, abs=0.1)


@pytest.mark.parametrize("hz", [2.0, 10.0])
def test_a_restless_person_is_known_as_one(hz):
    state = walk(restless(), hz=hz)
    steady = walk(straight, hz=hz)
    assert state.randomness > 0.4 > steady.randomness
    assert state.steadiness[-1] > 0.7
    weights, sigmas = state.spread([0.5, 1.0, 2.0])
    calm_weights, calm_sigmas = steady.spread([0.5, 1.0, 2.0])
    assert ((sigmas**2) @ weights > (calm_sigmas**2) @ calm_weights).all()


def test_randomness_starts_at_its_prior_and_counts_by_time_not_by_calls():
    first = meet(0.0, (0.0, 0.0))
    assert first is not None
    assert first.randomness == pytest.approx(0.1)
    slow, fast = walk(straight, hz=4.0), walk(straight, hz=20.0)
    assert slow.randomness == pytest.approx(fast.randomness, abs=0.02)
    assert slow.unchanged == pytest.approx(fast.unchanged, rel=0.05)


def test_noise_is_not_mistaken_for_a_habit():
    noisy = walk(straight, noise=0.1, duration=15.0)
    assert noisy.randomness < 0.25
    assert noisy.steadiness[-1] < 0.5


def test_spread_of_a_stander_grows_linearly_and_of_a_walker_faster():
    stander = walk(lambda t: np.zeros(2))
    assert stander.standing
    t = np.array([1.0, 2.0, 4.0])
    s = HabitSettings()
    floor = s.floor
    for state, q in ((stander, s.standing_exponent), (walk(straight), s.walking_exponent)):
        _, sigmas = state.spread(t)
        growth = np.sqrt(sigmas**2 - floor**2)
        np.testing.assert_allclose(growth[2] / growth[0], 4.0**q, rtol=1e-6)
        assert (np.diff(sigmas, axis=1) > 0).all()


def test_only_a_sensor_worse_than_the_habitual_one_spreads_the_prediction():
    t = np.array([1.0, 4.0])

    def widest(noise, habitual):
        state = walk(straight, noise=noise, settings=HabitSettings(habitual_noise=habitual))
        weights, sigmas = state.spread(t)
        bare = np.sqrt(state.settings.floor**2 + (t[:, None] ** 1.3 * class_tables(state.settings).scales) ** 2)
        return np.abs(sigmas - bare).max(axis=0)[0], weights

    assert widest(0.02, 0.03)[0] == 0.0
    assert widest(0.02, 0.0)[0] > 0.1
    assert widest(0.1, 0.03)[0] > 0.1
    first = meet(0.0, (0.0, 0.0))
    assert first is not None
    assert first.spread(t)[1].min() > 1.0  # a velocity that nobody has seen yet is doubtful


@pytest.mark.parametrize("step", [0.02, 0.1, 0.4, 1.0])
def test_the_settled_velocity_noise_is_that_of_the_textbook_filter(step):
    """Error of a still person's velocity after many noisy looks, by plain matrices."""
    q, r = 1.3, 0.05
    move = np.array([[1.0, step], [0.0, 1.0]])
    walk_noise = q * np.array([[step**3 / 3, step**2 / 2], [step**2 / 2, step]])
    see = np.array([[1.0, 0.0]])
    whole, alone = np.eye(2), np.eye(2)
    for _ in range(400):
        whole = move @ whole @ move.T + walk_noise
        gain = whole @ see.T / (see @ whole @ see.T + r**2)
        left = np.eye(2) - gain @ see
        whole = left @ whole
        alone = left @ move @ alone @ move.T @ left.T + r**2 * gain @ gain.T
    assert settled_variance(q, r, step) == pytest.approx(alone[1, 1], rel=1e-3)


@pytest.mark.parametrize("hz", [2.0, 2.5, 5.0, 10.0])
def test_the_habitual_sensor_spreads_nothing_at_any_rate(hz):
    state = walk(straight, hz=hz, noise=0.03, duration=20.0)
    assert state.sensed(np.array([4.8]))[0] < 0.02**2


def test_somebody_who_stands_has_the_prior_of_people_who_stand():
    settings = HabitSettings(tempering=1e-9)
    stander = walk(lambda t: np.zeros(2), settings=settings)
    np.testing.assert_allclose(np.log(stander.steadiness), class_tables(settings).standing, atol=1e-6)
    walker = walk(straight, settings=settings)
    np.testing.assert_allclose(np.log(walker.steadiness), class_tables(settings).walking, atol=1e-6)
    assert stander.modes.tolist() == list(settings.standing_modes)
    assert walker.modes.tolist() == list(settings.walking_modes)


def test_turning_is_extrapolated():
    def curve(t):
        return 2.0 * np.array([math.sin(0.8 * t), 1 - math.cos(0.8 * t)])

    state = walk(curve, duration=5.0, settings=HabitSettings(extrapolation=0.3))
    cross = state.velocity[0] * state.extrapolated_velocity[1] - state.velocity[1] * state.extrapolated_velocity[0]
    assert cross > 0.1  # further to the left than now
    assert np.linalg.norm(state.mean_velocity) < np.linalg.norm(state.velocity)


@pytest.mark.parametrize("bad", [(math.nan, 0.0), (math.inf, 0.0), (0.0,), (0.0, 0.0, 0.0)])
def test_useless_observations_change_nothing(bad):
    state = walk(straight)
    assert update(state, 8.1, bad) is state


@pytest.mark.parametrize("time", [math.nan, 8.0, 7.0, -math.inf])
def test_useless_times_change_nothing(time):
    state = walk(straight)
    assert update(state, time, (9.6, 4.0)) is state


@pytest.mark.parametrize(("time", "position"), [(8.1, (60.0, 0.0)), (20.0, (9.6, 4.0)), (0.5, (9.6, 4.0))])
def test_another_person_or_another_clock_starts_anew(time, position):
    state = update(walk(straight), time, position)
    np.testing.assert_allclose(state.position, position)
    np.testing.assert_allclose(state.velocity, 0.0)
    assert state.randomness == pytest.approx(0.1)
    assert state.time == time


def test_a_given_velocity_is_believed_at_first_sight():
    state = meet(0.0, (0.0, 0.0), velocity=(1.0, -0.5))
    assert state is not None
    np.testing.assert_allclose(state.velocity, [1.0, -0.5])
    racing = meet(0.0, (0.0, 0.0), velocity=(100.0, 0.0))
    assert racing is not None
    assert np.linalg.norm(racing.velocity) <= HabitSettings().top_speed + 1e-9
    assert meet(0.0, (math.nan, 0.0)) is None
    assert meet(math.nan, (0.0, 0.0)) is None


def test_a_state_is_frozen_and_an_update_leaves_it_alone():
    state = walk(straight)
    before = state.mean.copy(), state.history.copy()
    update(state, 8.1, (9.7, 4.0))
    np.testing.assert_array_equal(state.mean, before[0])
    np.testing.assert_array_equal(state.history, before[1])
    with pytest.raises(ValueError, match="read-only"):
        state.mean[0] = 1.0


@settings(max_examples=25, deadline=None)
@given(
    angle=st.floats(-math.pi, math.pi), shift=st.tuples(st.floats(-50, 50), st.floats(-50, 50)), seed=st.integers(0, 99)
)
def test_turning_and_moving_the_world_changes_nothing_but_the_frame(angle, shift, seed):
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    path = restless(seed)
    here = walk(path, duration=4.0, hz=5.0)
    there = walk(lambda t: turn @ path(t) + shift, duration=4.0, hz=5.0)
    np.testing.assert_allclose(there.position, turn @ here.position + shift, atol=1e-6)
    np.testing.assert_allclose(there.mean_velocity, turn @ here.mean_velocity, atol=1e-6)
    np.testing.assert_allclose(there.steadiness, here.steadiness, atol=1e-6)
    assert there.randomness == pytest.approx(here.randomness, abs=1e-9)


anything = st.floats(allow_nan=True, allow_infinity=True, width=32)
sightings = st.tuples(anything | st.floats(0, 20), anything | st.floats(-5, 5), anything | st.floats(-5, 5))


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(anything | st.floats(0, 20), anything | st.floats(-5, 5), anything | st.floats(-5, 5)), max_size=30
    )
)
def test_no_sensor_breaks_it(observations):
    state: Habits | None = meet(0.0, (0.0, 0.0))
    assert state is not None
    for time, x, y in observations:
        state = update(state, time, (x, y))
        assert np.isfinite(state.mean).all()
        assert np.isfinite(state.covariance).all()
        assert np.linalg.eigvalsh(state.covariance).min() > -1e-9
        assert state.steadiness.sum() == pytest.approx(1.0)
        assert 0.002 <= state.randomness <= 0.6
        assert np.isfinite(state.extrapolated_velocity).all()
        assert np.isfinite(state.mean_velocity).all()


@pytest.mark.parametrize("covariance", [np.full((2, 2), np.nan), -np.eye(2), np.eye(3), np.zeros((2, 2))])
def test_a_bad_covariance_is_not_believed(covariance):
    state = meet(0.0, (0.0, 0.0), covariance)
    assert state is not None
    state = update(state, 0.1, (0.1, 0.0), covariance)
    assert np.isfinite(state.mean).all()
    assert np.linalg.eigvalsh(state.covariance).min() > 0


@pytest.mark.parametrize("field", ["window", "acceleration_density", "top_speed"])
def test_settings_are_checked(field):
    with pytest.raises(InvalidInput, match=f"habits.{field}"):
        HabitSettings(**{field: 0.0})
