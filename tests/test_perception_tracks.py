"""Scan → clusters → legs → people: found, kept apart, remembered in the shade, from a robot that moves."""

import itertools

import numpy as np
import pytest

from made_scans import EXACT, Film, line, room
from sidestep.perception.classifier import load_classifier
from sidestep.perception.clear_mot import ClearMot
from sidestep.perception.clusters import find_clusters
from sidestep.perception.legs import find_legs
from sidestep.perception.scan import Scan
from sidestep.perception.tracks import Tracker
from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import RPLIDAR_A2M8
from sidestep.simulation.scene import rectangle


def follow(film, seconds, *, settle=1.0, tracker=None):
    """CLEAR MOT after `settle` (s), and the list of what was reported at each scan."""
    tracker = Tracker() if tracker is None else tracker
    mot, reports = ClearMot(), []
    while film.time < seconds:
        truth = film.truth(film.time)
        found = tracker.update(film.next())
        reports.append(found)
        if film.time > settle:
            places = np.array([p.position for p in found]).reshape(-1, 2)
            mot.update(list(truth), np.array(list(truth.values())).reshape(-1, 2), [p.id for p in found], places)
    return mot.score(), reports


def test_clusters_part_where_surfaces_do_and_join_across_the_seam():
    ranges = np.full(800, np.inf)
    ranges[[*range(396, 404)]] = 2.0  # ahead
    ranges[[*range(404, 410)]] = 2.5  # behind it
    ranges[[797, 798, 799, 0, 1, 2]] = 1.0  # across the seam
    ranges[[200, 201]] = 1.0  # too few
    clusters = find_clusters(Scan(time=0.0, ranges=ranges, beams=RPLIDAR_A2M8))
    sizes = sorted(np.diff(clusters.start).tolist())
    assert sizes == [6, 6, 8]
    seam = int(np.argmin(clusters.centroids[:, 0]))
    assert clusters.centroids[seam] == pytest.approx([-1.0, 0.0], abs=0.01)


def test_features_are_those_of_the_shape_not_of_the_bearing():
    def cluster(bearing):
        place = 2.0 * np.array([np.cos(bearing), np.sin(bearing)])
        scan, _ = EXACT.sense(
            room(half=30.0), np.array([[*place, 0.07, 0, 0]]), np.zeros(3), np.zeros(3), 0.0, np.random.default_rng(0)
        )
        found = find_clusters(scan)
        return found.features[np.argmin(np.abs(found.feature("range") - 2.0))]

    step = 2 * np.pi / 800
    np.testing.assert_allclose(cluster(20 * step), cluster(333 * step), rtol=1e-6, atol=1e-9)


def test_legs_are_told_from_a_wall_and_their_middles_are_where_they_are():
    legs = Gait().legs(np.array([2.0, 0.5]), np.zeros(2), 0.3, 0.0)
    scan, _ = EXACT.sense(room(), legs, np.zeros(3), np.zeros(3), 0.0, np.random.default_rng(0))
    found = find_legs(scan, load_classifier())
    likely = np.flatnonzero(found.leg > 1.0)
    apart = np.hypot(*(found.positions[likely][:, None] - legs[None, :, :2]).transpose(2, 0, 1))
    assert np.all(apart.min(axis=0) < 0.04)  # both legs are among them
    assert len(likely) <= 3


def test_one_walker_has_one_identity_and_a_velocity_with_honest_covariance():
    film = Film(room(), [line((-3, 1.5), (3, 1.5), 1.0, begins=1.0)])
    score, reports = follow(film, 6.0)
    assert score.recall > 0.95
    assert score.precision > 0.9
    assert score.id_switches == 0
    assert score.error < 0.10
    walking = [p for found in reports[30:55] for p in found if abs(p.position[1] - 1.5) < 0.5]
    speeds = np.array([p.velocity for p in walking])
    assert speeds.mean(axis=0) == pytest.approx([1.0, 0.0], abs=0.12)
    claimed = np.sqrt(np.mean([p.velocity_covariance[0, 0] for p in walking]))
    real = np.sqrt(np.mean((speeds - [1.0, 0.0]) ** 2))
    assert 0.3 < real / claimed < 1.5


def test_people_who_pass_each_other_keep_their_identities():
    people = [line((-3, 1.6), (3, 1.6), 1.0, begins=0.5), line((3, 2.4), (-3, 2.4), 1.0, begins=0.5)]
    score, _ = follow(Film(room(), people), 6.0)
    assert score.id_switches == 0
    assert score.recall > 0.9


def test_someone_behind_a_pillar_is_remembered_and_still_the_same():
    pillar = rectangle((0.0, 1.2), (0.4, 0.2))
    film = Film(room(pillar), [line((-2.5, 2.4), (2.5, 2.4), 1.0, begins=0.5)])
    tracker = Tracker()
    hidden, ids = 0, []
    while film.time < 5.4:
        place = film.truth(film.time)[0]
        found = tracker.update(film.next())
        near = [p for p in found if np.hypot(*(p.position - place)) < 0.75]
        shaded = abs(place[0]) < 0.35
        hidden += shaded
        if film.time > 1.5:
            ids += [p.id for p in near]
            assert near, f"lost at {film.time:.1f} s"
    assert hidden >= 4
    assert len(set(ids)) == 1


def test_whoever_leaves_is_forgotten_within_a_second():
    stay = line((1.5, 1.0), (1.5, 1.0), 1.0)
    film = Film(room(), [lambda t: stay(t) if t < 3.0 else None])
    tracker = Tracker()
    present = []
    while film.time < 4.5:
        present.append(
            (film.time, any(np.hypot(*(p.position - [1.5, 1.0])) < 0.5 for p in tracker.update(film.next())))
        )
    assert all(seen for t, seen in present if 1.5 < t < 3.0)
    assert not any(seen for t, seen in present if t > 4.2)


def test_table_legs_that_stand_are_not_reported_for_long():
    table = [(x, y, 0.04) for x, y in itertools.product((1.0, 2.2), (1.0, 1.8))]
    score, _ = follow(Film(room(cylinders=table), []), 8.0, settle=4.0)
    assert score.false_positives == 0


def test_a_driving_robot_sees_those_who_stand_stand():
    film = Film(
        room(rectangle((2.5, -2.0), (0.8, 0.4))),
        [line((1.5, 1.5), (1.5, 1.5), 1.0), line((-1.0, -3.0), (-1.0, 3.0), 0.8, begins=1.0)],
        pose=lambda t: np.array([-2.0 + 0.4 * t, 0.2 * np.sin(t), 0.8 * np.sin(0.7 * t)]),
    )
    score, reports = follow(film, 7.0, settle=1.2)
    assert score.recall > 0.93
    assert score.id_switches == 0
    still = [p for found in reports[15:] for p in found if np.hypot(*(p.position - [1.5, 1.5])) < 0.3]
    assert np.hypot(*np.mean([p.velocity for p in still], axis=0)) < 0.05


def test_moving_the_whole_world_moves_the_tracks_alike():
    def tracks(shift, turn):
        film = Film(room(), [line((-2, 1.5), (2, 1.5), 1.0, begins=0.5)], scanner=EXACT)
        tracker, c, s = Tracker(), np.cos(turn), np.sin(turn)
        while film.time < 3.0:
            scan = film.next()
            tracker.update(Scan(time=scan.time, ranges=scan.ranges, beams=scan.beams, pose=np.array([*shift, turn])))
        return np.array([(p.position - shift) @ np.array([[c, -s], [s, c]]) for p in tracker.people()])

    np.testing.assert_allclose(tracks((0.0, 0.0), 0.0), tracks((13.1, -4.3), 0.0), atol=0.02)
    assert tracks((0.0, 0.0), 0.0)[0] == pytest.approx(tracks((0.0, 0.0), 2.0)[0], abs=0.05)


def test_prediction_ahead_widens_and_a_repeated_scan_changes_nothing():
    film = Film(room(), [line((-2, 1.5), (3, 1.5), 1.0, begins=0.5)])
    tracker = Tracker()
    while film.time < 3.0:
        scan = film.next()
        tracker.update(scan)
    before = tracker.people()
    again = tracker.update(scan)
    assert [p.id for p in again] == [p.id for p in before]
    np.testing.assert_array_equal(again[0].position, before[0].position)
    now, later = before[0], tracker.people(tracker.time + 0.5)[0]
    np.testing.assert_allclose(later.position, now.position + 0.5 * now.velocity)
    assert later.position_covariance[0, 0] > now.position_covariance[0, 0]


def test_who_has_walked_is_known_and_who_stands_has_not():
    film = Film(room(), [line((-2, 1.5), (2, 1.5), 1.0, begins=0.5), line((1.0, -1.5), (1.0, -1.5), 1.0)])
    _, reports = follow(film, 3.5, tracker=(tracker := Tracker()))

    def moved(place):
        return [tracker.has_moved(p.id) for p in reports[-1] if np.hypot(*(p.position - place)) < 0.5]

    assert moved((1.0, 1.5)) == [True]
    assert moved((1.0, -1.5)) == [False]
    assert not tracker.has_moved("123456")


def test_a_long_pause_forgets_everybody_but_counts_on():
    film = Film(room(), [line((1.5, 1.0), (1.5, 1.0), 1.0)])
    tracker = Tracker()
    while film.time < 2.0:
        scan = film.next()
        tracker.update(scan)
    old = {p.id for p in tracker.people()}
    assert old
    for k in range(20):
        late = Scan(time=scan.time + 10.0 + 0.1 * k, ranges=scan.ranges, beams=scan.beams, pose=scan.pose)
        found = tracker.update(late)
        assert not old & {p.id for p in found}


@pytest.mark.parametrize("ranges", [np.full(800, np.inf), np.full(800, np.nan), np.zeros(800)])
def test_blind_scans_report_nobody(ranges):
    tracker = Tracker()
    for k in range(5):
        assert tracker.update(Scan(time=0.1 * k, ranges=ranges, beams=RPLIDAR_A2M8, pose=np.zeros(3))) == []


def test_the_velocity_of_someone_who_stands_is_known_well_and_honestly():
    errors, claims = [], []
    for seed in range(3):
        film = Film(room(), [line((1.5, 1.0), (1.5, 1.0), 1.0), line((-1.2, 1.4), (-1.2, 1.4), 1.0)], seed=seed)
        _, reports = follow(film, 4.0)
        errors += [p.velocity for found in reports[20:] for p in found]
        claims += [p.velocity_covariance[0, 0] for found in reports[20:] for p in found]
    claimed, real = np.sqrt(np.mean(claims)), np.sqrt(np.mean(np.square(errors)))
    assert claimed < 0.25
    assert real < 1.2 * claimed
