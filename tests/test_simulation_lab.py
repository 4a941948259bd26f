"""The laboratory: what the planner is told comes out of the tracker, late, lossy, and in the robot's own frame."""

from dataclasses import replace

import numpy as np
import pytest

from sidestep.errors import InvalidInput
from sidestep.human.observation import PersonObservation
from sidestep.robots import RobotState
from sidestep.simulation.assembly import obstacles_of
from sidestep.simulation.lab import run_lab
from sidestep.simulation.lab_check import TrackerCheck, pose_of
from sidestep.simulation.lab_room import LabSettings, lab_room
from sidestep.simulation.lab_senses import LabSenses, Odometry, SceneRays
from sidestep.simulation.lidar import Scanner
from sidestep.simulation.metrics import measure
from sidestep.simulation.scene import Scene
from sidestep.studies.lab import LabOutcome, lab_summary


class Doll:
    """Walks along x at 0.8 m/s, or stands."""

    id, awareness, radius = "doll", 0.0, 0.3

    def __init__(self, start, velocity=(0.8, 0.0)):
        self.start, self.velocity = np.array(start, dtype=float), np.array(velocity)

    def position(self, time):
        return self.start + max(time, 0.0) * self.velocity


def senses(people, **changes):
    settings = LabSettings(**changes)
    room = lab_room(settings)
    empty = replace(
        room, scene=Scene(cylinders=np.zeros((0, 3))), scenario=room.scenario.model_copy(update={"walls": ()})
    )
    rng = np.random.default_rng(0)
    found = LabSenses(
        settings,
        empty,
        rays=SceneRays(empty.scene, Scanner(), rng),
        people=people,
        start=RobotState(position=(0.0, 0.0), heading=0.0),
        generator=rng,
    )
    found.warm_up(people, 0.05)
    return found


def watch(found, people, seconds):
    return [found.observe(0.05 * k, np.zeros(2), people) for k in range(round(seconds / 0.05))]


def test_the_planner_is_told_where_people_are_now_not_where_the_scan_saw_them():
    people = [Doll((-1.5, 1.5))]
    told = watch(senses(people), people, 3.0)[-1]
    assert len(told) == 1
    assert told[0].position == pytest.approx(people[0].position(2.95), abs=0.15)
    assert told[0].velocity == pytest.approx([0.8, 0.0], abs=0.3)
    assert told[0].goal is not None  # someone who was seen to walk


def test_latency_ages_scans_and_dropouts_lose_them():
    people = [Doll((1.5, 1.0), (0.0, 0.0))]
    late = senses(people, latency=0.3)
    watch(late, people, 2.0)
    assert late.tracker.time == pytest.approx(1.95 - 0.3 - 0.1, abs=0.06)
    lossy = senses(people, dropout=0.5)
    watch(lossy, people, 6.0)
    assert 0.3 < lossy.arrived / lossy.scans < 0.7
    assert all(person.goal is None for person in late.tracker.people())  # who stands is not on the way anywhere


def test_odometry_is_exact_in_distance_up_to_its_slip_and_never_jumps():
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(40):
        pose = np.array([1.0, 2.0, 0.3])
        odometry = Odometry(pose, rng)
        for _ in range(120):
            before = odometry.pose.copy()
            pose = pose + np.array([0.05 * np.cos(pose[2]), 0.05 * np.sin(pose[2]), 0.02])
            odometry.update(pose)
            assert np.hypot(*(odometry.pose - before)[:2]) == pytest.approx(0.05, abs=0.004)
        errors.append(np.hypot(*(odometry.pose - pose)[:2]))
    assert 0.01 < np.median(errors) < 0.3  # 6 m driven


def test_the_check_asks_for_people_in_sight_alone():
    scene = Scene(cylinders=np.array([[1.0, 0.0, 0.3]]))
    check = TrackerCheck(scene)
    hidden, seen, far = [2.5, 0.0], [0.0, 2.0], [0.0, 9.0]
    check.update([], np.zeros(3), np.zeros(3), np.array([hidden, seen, far]))
    assert check.score().truths == 1


def test_rooms_leave_the_ways_free_and_are_the_same_for_both_kinds():
    for seed in range(12):
        one, other = (lab_room(LabSettings(human=h, seed=seed)) for h in ("concerned", "unconcerned"))
        np.testing.assert_array_equal(one.scene.cylinders, other.scene.cylinders)
        assert one.scenario.people[0].start == other.scenario.people[0].start
        walls = obstacles_of(one.scenario)
        way = np.linspace(one.scenario.robot.start, one.scenario.robot.goal, 50)
        assert walls.free(way, 0.3).all()
        person = one.scenario.people[0]
        assert walls.free(np.linspace(person.start, person.goal, 50), 0.3).all()


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"planner_rate": 3.0}, "planner_rate"),
        ({"latency": 5.0}, "latency"),
        ({"dropout": 1.0}, "dropout"),
        ({"human": "curious"}, "human"),
        ({"goals": "guessed"}, "goals"),
    ],
)
def test_settings_that_make_no_sense_are_refused(changes, field):
    with pytest.raises(InvalidInput, match=field):
        LabSettings(**changes)


@pytest.mark.slow
def test_a_run_reaches_the_goal_knows_its_people_by_the_tracker_and_repeats_itself():
    settings = LabSettings(human="unconcerned", seed=1)
    run = run_lab(settings)
    assert run.record.reached_goal
    assert measure(run.record).contacts_moving == 0
    assert run.tracking.recall > 0.8
    assert len(run.reactions) > 0
    assert run.scans > 100
    assert run.scan_age == pytest.approx(0.1, abs=0.02)
    assert np.isfinite(run.record.beliefs[-1, 0]) or np.isfinite(run.record.beliefs[:, 0]).any()
    again = run_lab(settings)
    np.testing.assert_array_equal(again.record.robot_positions, run.record.robot_positions)


@pytest.mark.slow
def test_wheels_legs_and_rays_of_the_physics_engine_do_what_ours_do():
    pytest.importorskip("mujoco")
    from sidestep.simulation.lab_physics import Physics

    room = lab_room(LabSettings(seed=0))
    exact = Scanner(noise=0.0, noise_share=0.0, missing=0.0, mixed=0.0, spurious=0.0)
    rng = np.random.default_rng(0)
    physics = Physics(room, exact, rng)
    legs = np.array([[0.5, 1.5, 0.07, 0, 0], [0.7, 1.5, 0.07, 0, 0], [-1, 0, 0.08, 0, 0], [-1.2, 0, 0.08, 0, 0]])
    pose = np.array([0.3, 2.0, 0.4])
    ours = SceneRays(room.scene, exact, rng).sense(legs, pose, np.zeros(3), 0.0)
    theirs = physics.sense(legs, pose, np.zeros(3), 0.0)
    both = np.isfinite(ours.ranges) & np.isfinite(theirs.ranges)
    assert both.mean() > 0.95
    assert np.mean(np.abs(ours.ranges[both] - theirs.ranges[both]) < 0.02) > 0.97
    state = physics.drive(np.zeros(2), None, 0.05)
    start = pose_of(state)
    ahead = 0.3 * np.array([np.cos(start[2]), np.sin(start[2])])
    for _ in range(40):
        state = physics.drive(ahead, None, 0.05)
    assert (state.position - start[:2]) @ ahead / 0.3 == pytest.approx(0.6, abs=0.08)
    assert physics.bumped == 0.0


def test_totals_count_only_who_had_to_react_and_pool_the_tracker():
    def outcome(human, seed, belief, react, **changes):
        numbers = dict.fromkeys(LabOutcome.__dataclass_fields__, 0) | {
            "human": human, "seed": seed, "belief": belief, "had_to_react": react, "reached": True, "PI_R": 100.0,
            "truths": 10, "matches": 8, "false_positives": 2, "squared_error": 0.08, "min_distance": 1.0,
        }  # fmt: skip
        return LabOutcome(**(numbers | changes))

    runs = [
        outcome("concerned", 0, 0.9, 3),
        outcome("unconcerned", 0, 0.8, 3, PI_R=150.0, contacts_standing=1, reached=False),
        outcome("concerned", 1, 0.2, 0),
        outcome("unconcerned", 1, 0.1, 2, PI_R=150.0),
    ]
    found = lab_summary(runs, None)
    assert (found["human"], found["seeds"], found["runs"], found["had_to_react"]) == ("both", 2, 4, 3)
    assert found["belief_correct"] == pytest.approx(2 / 3)
    assert found["pi_r_ratio"] == pytest.approx(1.5)
    assert found["reached"] == pytest.approx(0.75)
    assert found["contacts_standing"] == 1
    assert found["tracker"] == pytest.approx({"precision": 0.8, "recall": 0.8, "id_switches": 0, "rmse_m": 0.1})
    assert lab_summary(runs, "concerned")["belief_correct"] == 1.0


def test_who_stands_away_from_the_known_goal_is_not_said_to_be_on_the_way_there(monkeypatch):
    """A track that was swapped onto somebody who stands must not make the robot wait for them to set out."""
    found = senses([Doll((2.0, 0.0), (0.0, 0.0))], goals="known")
    monkeypatch.setattr(found.tracker, "has_moved", lambda track: True)
    goal = np.array(lab_room(LabSettings(goals="known")).destinations[0])

    def told(time, place, speed):
        seen = PersonObservation(id="1", position=place, velocity=(speed, 0.0))
        return found._with_destination(seen, time).goal

    away = goal + np.array([2.5, 0.0])
    assert told(0.0, away, 0.0) is None  # never seen to walk
    assert told(1.0, away, 0.8) is not None
    assert told(4.0, away, 0.0) is not None  # waits for the robot to pass
    assert told(6.0, away, 0.0) is None  # stays
    assert told(60.0, goal + 0.3, 0.0) is not None  # has arrived
    assert told(61.0, away, 0.8) is not None
