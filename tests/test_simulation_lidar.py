"""The simulated scanner: exact geometry, errors at their stated rates, a mirror that takes its time, feet that rest."""

from dataclasses import replace

import numpy as np
import pytest

from made_scans import EXACT, room
from sidestep.errors import InvalidFile
from sidestep.io.scans import read_scan_recording, write_scan_recording
from sidestep.perception.scan import Annotations, LegLabels, ScanRecording
from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import RPLIDAR_A2M8, Scanner
from sidestep.simulation.rooms import random_room

NOBODY = np.zeros((0, 5))


def look(scanner, scene, legs=NOBODY, pose=(0, 0, 0), twist=(0, 0, 0), seed=0):
    pose, twist = np.array(pose, dtype=float), np.array(twist, dtype=float)
    return scanner.sense(scene, legs, pose, twist, 0.0, np.random.default_rng(seed))


def test_the_scanner_is_the_one_of_the_paper():
    assert (RPLIDAR_A2M8.count, RPLIDAR_A2M8.range_max, Scanner().rate) == (800, 10.0, 10.0)
    assert RPLIDAR_A2M8.closed


def test_without_errors_all_returns_lie_on_the_walls():
    scan, hits = look(EXACT, room(half=4.0), pose=(1.0, -0.5, 0.7))
    c, s = np.cos(0.7), np.sin(0.7)
    world = scan.points() @ np.array([[c, s], [-s, c]]) + [1.0, -0.5]
    np.testing.assert_allclose(np.abs(world).max(axis=1), 4.0, atol=1e-9)
    assert np.all(hits == 0)


def test_errors_come_at_their_rates():
    fine = replace(RPLIDAR_A2M8, count=8000, angle_increment=2 * np.pi / 8000)
    scanner = replace(EXACT, noise=0.01, missing=0.1, failed=0.05, beams=fine)
    exact, _ = look(replace(scanner, noise=0.0, missing=0.0, failed=0.0), room(half=4.0))
    scan, _ = look(scanner, room(half=4.0))
    assert np.mean(np.isposinf(scan.ranges)) == pytest.approx(0.1 * 0.95, abs=0.02)
    assert np.mean(np.isnan(scan.ranges)) == pytest.approx(0.05, abs=0.01)
    seen = np.isfinite(scan.ranges)
    assert np.std((scan.ranges - exact.ranges)[seen]) == pytest.approx(0.01, rel=0.05)


def test_what_is_too_near_or_too_far_is_no_measurement():
    far, _ = look(EXACT, room(half=12.0))
    assert np.isposinf(far.ranges[400])
    near, _ = look(EXACT, room(half=12.0), np.array([[0.14, 0.0, 0.05, 0, 0]]))
    assert not near.valid()[400]


def test_a_leg_that_walks_during_the_scan_is_seen_where_it_is_by_then():
    beside = np.array([[0.0, 2.0, 0.1, 1.0, 0.0]])  # at bearing 90°: three quarters of the turn, 0.075 s
    _, hits = look(EXACT, room(), beside)
    middle = RPLIDAR_A2M8.bearings[np.flatnonzero(hits == 1)].mean()
    assert np.pi / 2 - middle == pytest.approx(0.075 / 2.0, abs=0.004)


def test_turning_on_the_spot_shifts_later_beams_more():
    still, _ = look(EXACT, room(half=3.0))
    turning, _ = look(EXACT, room(half=3.0), twist=(0, 0, 1.0))
    shifted = np.interp(RPLIDAR_A2M8.bearings * (1 + 0.1 / (2 * np.pi)) + 0.05, RPLIDAR_A2M8.bearings, still.ranges)
    np.testing.assert_allclose(turning.ranges[20:700], shifted[20:700], atol=0.01)


def test_the_same_generator_gives_the_same_scan():
    scene = random_room(np.random.default_rng(3))
    one, other = look(Scanner(), scene, seed=5)[0], look(Scanner(), scene, seed=5)[0]
    np.testing.assert_array_equal(one.ranges, other.ranges)
    assert not np.array_equal(one.ranges, look(Scanner(), scene, seed=6)[0].ranges)


def test_a_standing_foot_rests_on_the_ground_and_legs_stay_about_the_body():
    gait, phase, dt = Gait(swing=1.0), 0.1, 0.01
    velocity = np.array([1.0, 0.0])
    for k in range(300):
        legs = gait.legs(k * dt * velocity, velocity, 0.0, phase)
        slowest = np.hypot(*legs[:, 3:].T).min()
        assert slowest < 1e-9  # at every moment one foot stands
        assert np.all(np.abs(legs[:, 0] - k * dt) < 0.6)
        phase = gait.advance(phase, 1.0, dt)
    at_rest = gait.legs(np.zeros(2), np.zeros(2), 0.0, phase)
    assert np.all(at_rest[:, 3:] == 0)


def test_velocities_of_legs_are_the_derivatives_of_their_places():
    gait, phase, dt = Gait(swing=0.8), 0.3, 1e-4
    velocity = np.array([0.9, 0.3])
    heading = float(np.arctan2(0.3, 0.9))
    for _ in range(50):
        now = gait.legs(np.zeros(2), velocity, heading, phase)
        later = gait.legs(dt * velocity, velocity, heading, gait.advance(phase, float(np.hypot(*velocity)), dt))
        np.testing.assert_allclose((later - now)[:, :2] / dt, now[:, 3:], atol=0.02)
        phase = gait.advance(phase, float(np.hypot(*velocity)), 0.023)


def test_recordings_survive_writing_and_reading(tmp_path):
    rng = np.random.default_rng(0)
    ranges = np.round(rng.uniform(0.2, 9.0, (3, 800)), 3)
    ranges[0, :4] = [np.inf, np.nan, 0.151, 5.0]
    recording = ScanRecording(
        name="walk",
        beams=RPLIDAR_A2M8,
        times=np.array([0.0, 0.1, 0.2]),
        ranges=ranges,
        poses=rng.normal(size=(3, 3)),
        people=Annotations(
            scan=np.array([0, 2]), person=np.array([4, 4]), positions=np.array([[1.0, 2.0], [1.5, 2.0]])
        ),
        legs=LegLabels(scans=np.array([1]), beams=rng.integers(0, 3, (3, 800))),
    )
    write_scan_recording(recording, tmp_path / "walk.npz")
    back = read_scan_recording(tmp_path / "walk.npz")
    np.testing.assert_allclose(back.ranges, ranges, atol=5e-4)
    np.testing.assert_array_equal(back.poses, recording.poses)
    np.testing.assert_array_equal(back.people.positions, recording.people.positions)
    np.testing.assert_array_equal(back.legs.beams, recording.legs.beams)
    assert back.beams == RPLIDAR_A2M8
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.parametrize(("content", "names"), [(b"", "broken.npz"), (b"not an archive", "broken.npz")])
def test_a_file_that_is_no_recording_is_named(tmp_path, content, names):
    path = tmp_path / "broken.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidFile, match=names):
        read_scan_recording(path)


def test_a_recording_without_a_key_names_it(tmp_path):
    np.savez(tmp_path / "half.npz", ranges_mm=np.zeros((2, 5), dtype=np.uint16), t=np.arange(2.0))
    with pytest.raises(InvalidFile, match="angle_min"):
        read_scan_recording(tmp_path / "half.npz")
