"""People between messages: names that stay, velocities that come out right, nobody who lingers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ros_stand_ins import namespace_pose
from sidestep.ros.assembly import sensing_of
from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import LaserScan, People, read_map
from sidestep.ros.sensing import MeasuredPeople, ScannedPeople
from sidestep.ros.settings import NodeSettings
from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import Scanner
from sidestep.simulation.scene import Scene, rectangle


def seen(time: float, places, ids=None) -> People:
    return People(time=time, frame="", ids=ids, positions=np.array(places, dtype=float).reshape(-1, 2))


def walked(seconds: float = 3.0, noise: float = 0.02, shuffle: bool = True):
    """Two people who cross each other's way, in messages without names and in any order."""
    generator = np.random.default_rng(3)
    eyes = MeasuredPeople(noise=noise, memory=1.0)
    for time in np.arange(0.0, seconds, 0.1):
        places = np.array([[time, 1.0], [3.0 - time, -1.0]]) + noise * generator.standard_normal((2, 2))
        eyes.people(seen(time, places[::-1] if shuffle and generator.random() < 0.5 else places), Pose2(), time)
    return eyes, time


def test_people_without_names_keep_the_ones_they_get():
    eyes, time = walked()
    assert sorted(p.id for p in eyes.now(time)) == ["1", "2"]


def test_velocities_and_the_way_forward():
    eyes, time = walked()
    upper = max(eyes.now(time + 0.3), key=lambda p: p.position[1])
    assert upper.velocity == pytest.approx([1.0, 0.0], abs=0.3)
    assert upper.position == pytest.approx([time + 0.3, 1.0], abs=0.1)
    assert upper.position_covariance is not None
    assert 0 < upper.position_covariance[0, 0] < 0.02


def test_doubt_grows_with_the_age_of_the_message():
    eyes, time = walked()
    young, old = (eyes.now(time + ahead)[0].position_covariance[0, 0] for ahead in (0.0, 0.5))
    assert old > 2 * young


def test_names_that_come_with_the_message_are_kept():
    eyes = MeasuredPeople(noise=0.02, memory=1.0)
    eyes.people(seen(0.0, [[0, 0], [0.3, 0]], ("a", "b")), Pose2(), 0.0)
    eyes.people(seen(0.1, [[0.3, 0], [0, 0]], ("a", "b")), Pose2(), 0.1)  # they have changed places: names decide
    assert [p.id for p in eyes.now(0.1)] == ["a", "b"]
    assert eyes.now(0.1)[0].position[0] > 0.2


@pytest.mark.parametrize("noise", [0.03, 0.1, 0.2])
@pytest.mark.parametrize("rate", [10.0, 30.0])
@pytest.mark.parametrize("jump", [2.0, 6.0])
def test_who_bears_the_name_of_somebody_elsewhere_is_where_they_are(noise, rate, jump):
    """They were a metre and more from there, half-way from the other, and as fast as nobody is."""
    eyes = MeasuredPeople(noise=noise, memory=1.0)
    for k in range(40):
        time, away = k / rate, jump if k >= 20 else 0.0
        eyes.people(seen(time, [[time, away], [time, jump - away]], ("a", "b")), Pose2(), time)
        told = {p.id: p for p in eyes.now(time)}
        assert list(told) == ["a", "b"]
        assert np.hypot(*(told["a"].position - (time, away))) < 0.15
        assert np.hypot(*(told["b"].position - (time, jump - away))) < 0.15
        assert max(np.hypot(*p.velocity) for p in told.values()) < 1.5


def test_who_runs_or_was_not_seen_for_a_while_is_still_the_same():
    eyes = MeasuredPeople(noise=0.05, memory=1.0)
    for time in [*np.arange(0.0, 2.0, 0.1), *np.arange(2.8, 4.0, 0.1)]:
        place = [2.5 * time, 0.0] if time < 2.0 else [5.0, 2.5 * (time - 2.0)]  # turns while nobody sees it
        eyes.people(seen(time, [place], ("a",)), Pose2(), time)
        (told,) = eyes.now(time)
        if time > 0.5:
            assert np.hypot(*told.velocity) > 1.0  # whoever is new stands at first


def test_whoever_is_not_in_the_latest_message_is_not_there():
    eyes = MeasuredPeople(noise=0.02, memory=1.0)
    eyes.people(seen(0.0, [[0, 0], [5, 5]]), Pose2(), 0.0)
    eyes.people(seen(0.1, [[5, 5]]), Pose2(), 0.1)
    assert [p.id for p in eyes.now(0.1)] == ["2"]
    eyes.people(seen(0.2, [[5, 5], [0, 0]]), Pose2(), 0.2)
    assert sorted(p.id for p in eyes.now(0.2)) == ["1", "2"]  # back within the memory
    for time in (0.3, 2.0):
        eyes.people(seen(time, []), Pose2(), time)
        assert eyes.now(time) == []
    eyes.people(seen(2.1, [[0, 0]]), Pose2(), 2.1)
    assert [p.id for p in eyes.now(2.1)] == ["3"]


def test_late_messages_change_nothing_and_frames_are_applied():
    eyes = MeasuredPeople(noise=0.02, memory=1.0)
    eyes.people(seen(1.0, [[1, 0]]), Pose2(2.0, 0.0, np.pi / 2), 1.0)
    eyes.people(seen(0.5, [[9, 9]]), Pose2(), 0.5)
    assert eyes.now(1.0)[0].position == pytest.approx([2.0, 1.0])


def test_nothing_is_kept_of_people_who_came_and_went():
    eyes = MeasuredPeople(noise=0.02, memory=0.5)
    for k in range(2000):
        time = 0.1 * k
        eyes.people(seen(time, [[100.0 * k, 0.0]], (f"n{k}",)), Pose2(), time)
    assert len(eyes._names) <= 7
    assert len(eyes.now(time)) == 1


def looked_around(eyes: ScannedPeople, *, posts=(), walker: bool = True):
    """A robot drives past somebody who walks along x = 2.5 m, and past `posts`; where the walker ends, and the time."""
    scanner, generator, gait = Scanner(), np.random.default_rng(5), Gait()
    cylinders = np.array([(x, y, 0.05) for x, y in posts]).reshape(-1, 3)
    room = Scene(polygons=(rectangle((0.0, 0.0), (12.0, 12.0)),), cylinders=cylinders)
    phase = 0.0
    for k in range(30):
        time = 0.1 * k
        person = np.array([2.5, -1.5 + time])
        phase = gait.advance(phase, 1.0, 0.1)
        legs = gait.legs(person, np.array([0.0, 1.0]), np.pi / 2, phase) if walker else np.zeros((0, 3))
        pose = Pose2(0.3 * time, 0.0, 0.0)
        scan, _ = scanner.sense(room, legs, np.array([pose.x, 0, 0]), np.array([0.3, 0, 0]), time, generator)
        eyes.scan(LaserScan(time=time, frame="laser", beams=scan.beams, ranges=scan.ranges), pose, time)
    return person, time


def test_legs_in_scans_become_a_person_seen_from_a_moving_robot():
    eyes = ScannedPeople()
    person, time = looked_around(eyes)
    found = eyes.now(time)
    assert len(found) == 1
    assert found[0].position == pytest.approx(person, abs=0.25)
    assert found[0].velocity == pytest.approx([0.0, 1.0], abs=0.4)
    eyes.clear()
    assert eyes.now(time) == []


SETTINGS = NodeSettings.model_validate({"node": {"people_from": "scan"}})


def map_of(value: int, where=(slice(None), slice(None)), *, settings=SETTINGS):
    """A map of 12 m by 12 m around the origin, free but for the cells `where`."""
    data = np.zeros((120, 120), dtype=np.int16)
    data[where] = value
    info = SimpleNamespace(height=120, width=120, resolution=0.1, origin=namespace_pose(-6.0, -6.0))
    message = SimpleNamespace(header=SimpleNamespace(frame_id="odom"), info=info, data=data.ravel())
    return read_map(message, unknown_is_free=settings.node.unknown_is_free)


def test_what_stands_on_the_map_is_nobodys_legs():
    """Two posts as far apart as feet: a person to a scanner that knows no map. Who walks past is seen all the same."""
    posts = [(1.6, 1.0), (1.6, 1.3)]
    bare, told, walled = ScannedPeople(), sensing_of(SETTINGS), sensing_of(with_walls())
    told.map(map_of(100, (slice(69, 74), slice(74, 78))))
    for eyes, expected in ((bare, 2), (told, 1), (walled, 1)):
        _, time = looked_around(eyes, posts=posts)
        assert len(eyes.now(time)) == expected


def with_walls(**node):
    """Settings whose walls, not a map, hold the two posts."""
    corners = [[1.5, 0.9], [1.7, 0.9], [1.7, 1.4], [1.5, 1.4]]
    return NodeSettings.model_validate({"walls": [corners], "node": {"people_from": "scan"} | node})


def test_a_map_can_be_kept_from_the_scans_and_what_nobody_has_seen_hides_nobody():
    strict = NodeSettings.model_validate({"node": {"people_from": "scan", "unknown_is_free": False}})
    for settings, value, expected in ((SETTINGS, 100, 0), (strict, -1, 1), (apart(), 100, 1)):
        eyes = sensing_of(settings)
        eyes.map(map_of(value, settings=settings))
        _, time = looked_around(eyes)
        assert len(eyes.now(time)) == expected


def apart():
    """Settings that keep the map from the scans."""
    return NodeSettings.model_validate({"node": {"people_from": "scan", "map_for_scans": False}})


@pytest.mark.parametrize(("radius", "ahead", "expected"), [(0.11, 0.0, 1), (0.3, 0.0, 0), (0.11, 0.15, 0)])
def test_legs_beside_a_small_robot_are_not_taken_for_its_own_body(radius, ahead, expected):
    node = {"people_from": "scan", "mount": [ahead, 0.0, 0.0]}
    eyes = sensing_of(NodeSettings.model_validate({"node": node, "robot": {"radius": radius}}))
    scanner, generator, gait = Scanner(), np.random.default_rng(5), Gait()
    room = Scene(polygons=(rectangle((0.0, 0.0), (12.0, 12.0)),), cylinders=np.zeros((0, 3)))
    legs = gait.legs(np.array([0.26, 0.0]), np.zeros(2), np.pi, 0.0)
    for time in np.arange(0.0, 1.5, 0.1):
        scan, _ = scanner.sense(room, legs, np.zeros(3), np.zeros(3), time, generator)
        eyes.scan(LaserScan(time=time, frame="laser", beams=scan.beams, ranges=scan.ranges), Pose2(), time)
    assert len(eyes.now(time)) == expected
