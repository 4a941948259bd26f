"""The loop: who knows what when, what is written down, and how a run ends."""

import numpy as np
import pytest

from blind_driver import BlindDriver, crossing
from sidestep.errors import InvalidInput
from sidestep.simulation.loop import simulate
from sidestep.simulation.metrics import measure
from sidestep.simulation.recordings import Recording, Track
from sidestep.simulation.scenario import Scenario

UP = (0.0, 5.0)


def test_a_blind_robot_meets_the_person_in_the_middle():
    m = measure(simulate(crossing(), navigator=BlindDriver(goal=UP)))
    assert m.min_distance == pytest.approx(0.0, abs=1e-9)
    assert m.contacts_moving == 1


def test_record_shapes_and_immutability():
    record = simulate(crossing(), navigator=BlindDriver(goal=UP))
    t = len(record.status)
    assert t == 20  # 10 m at 1 m/s in steps of 0.5 s, less the goal tolerance
    assert record.time.shape == (t + 1,)
    assert record.people_positions.shape == (t + 1, 1, 2)
    assert record.beliefs.shape == (t, 1)
    assert record.plans.shape == (t, 9, 2)
    np.testing.assert_allclose(record.robot_velocities, np.tile([0.0, 1.0], (t, 1)), atol=1e-9)
    np.testing.assert_allclose(np.diff(record.time), 0.5)
    assert record.reached_goal
    with pytest.raises(ValueError, match="read-only"):
        record.robot_positions[0] = 1.0


def test_settings_in_the_record_give_the_same_run_again():
    scenario = crossing(people=[{"id": "a", "start": (-5, 0), "goal": (5, 0), "randomness": 0.5}], seed=7)
    first = simulate(scenario, navigator=BlindDriver(goal=UP))
    again = simulate(Scenario.parse(first.settings), navigator=BlindDriver(goal=UP))
    np.testing.assert_array_equal(again.people_positions, first.people_positions)
    other = simulate(scenario, navigator=BlindDriver(goal=UP), seed=8)
    assert other.seed == 8
    assert other.settings["seed"] == 8
    assert not np.array_equal(other.people_positions, first.people_positions)


def test_the_navigator_is_called_once_per_planning_period():
    driver = BlindDriver(goal=UP)
    record = simulate(crossing(control_step=0.1), navigator=driver)
    np.testing.assert_allclose(np.diff([t for t, _, _ in driver.heard]), 0.5)
    np.testing.assert_allclose(record.plan_age[:6], [0.0, 0.1, 0.2, 0.3, 0.4, 0.0], atol=1e-9)
    assert (record.planning_time[record.plan_age > 1e-6] == 0).all()
    assert driver.resets == 1


def test_a_person_who_appears_at_the_robot_is_no_bad_input():
    late = {"id": "a", "kind": "straight", "start": (0, -5), "goal": (5, 0), "appears": 3.0}
    simulate(crossing(people=[late]), navigator=BlindDriver(goal=UP))


def test_runs_end_with_the_time_or_the_goal():
    short = simulate(crossing(duration=3.0), navigator=BlindDriver(goal=UP))
    assert (short.time[-1], short.reached_goal) == (3.0, False)
    stay = simulate(crossing(duration=14.0, stop_at_goal=False), navigator=BlindDriver(goal=UP))
    assert (stay.time[-1], stay.reached_goal) == (14.0, True)


def test_an_interrupted_run_keeps_its_whole_steps():
    whole = simulate(crossing(), navigator=BlindDriver(goal=UP))
    cut = simulate(crossing(), navigator=BlindDriver(goal=UP, interrupt_at=3.0), keep_interrupted=True)
    assert len(cut.status) == 6
    np.testing.assert_array_equal(cut.robot_positions, whole.robot_positions[:7])
    assert not measure(cut).finished
    nothing = simulate(crossing(), navigator=BlindDriver(goal=UP, interrupt_at=0.0), keep_interrupted=True)
    assert len(nothing.status) == 0
    assert measure(whole).finished


def test_who_does_not_ask_for_part_of_a_run_is_interrupted():
    """A study that took it for a whole one would count a trip that did not arrive, and go on."""
    with pytest.raises(KeyboardInterrupt):
        simulate(crossing(), navigator=BlindDriver(goal=UP, interrupt_at=3.0))
    further = {"start": (8.0, 8.0), "goal": (8.0, -8.0)}
    with pytest.raises(KeyboardInterrupt):
        simulate(crossing(robots=[further]), navigator=BlindDriver(goal=UP, interrupt_at=1.0))


def test_an_interruption_by_the_watcher_keeps_a_whole_record():
    def watch(step):
        if step.index == 4:
            raise KeyboardInterrupt

    cut = simulate(crossing(), navigator=BlindDriver(goal=UP), on_step=watch, keep_interrupted=True)
    assert len(cut.robot_positions) == len(cut.status) + 1
    measure(cut)


def test_watchers_see_every_step():
    seen = []
    simulate(crossing(), navigator=BlindDriver(goal=UP), on_step=seen.append)
    assert [s.index for s in seen] == list(range(20))
    assert seen[3].distance == pytest.approx(8.5)


def test_walls_stop_the_robot():
    wall = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)]
    record = simulate(crossing(walls=[wall], people=[]), navigator=BlindDriver(goal=UP))
    assert record.robot_positions[:, 1].max() <= 0.0
    assert len(record.walls) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robot": {"start": (0, -5), "goal": (0, 0.5)}}, "robot.goal"),
        ({"robot": {"start": (0, 0.5), "goal": (0, 5)}}, "robot.start"),
        ({"people": [{"id": "a", "start": (0.5, 0.5)}]}, "people.0.start"),
        ({"people": [{"id": "a", "start": (5, 0), "goal": (0.5, 0.5)}]}, "people.0.goal"),
    ],
)
def test_nobody_starts_or_ends_in_a_wall(changes, words):
    wall = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)]
    with pytest.raises(InvalidInput, match=words):
        simulate(crossing(walls=[wall], **changes), navigator=BlindDriver(goal=UP))


def test_a_scenario_with_a_recording_needs_it_and_checks_the_start():
    scenario = crossing(people=[], recording={"file": "f", "scene": "s", "start": 2.0})
    with pytest.raises(InvalidInput, match="recording"):
        simulate(scenario, navigator=BlindDriver(goal=UP))
    track = Track(agent="r", kind="ped", time=np.array([0.0, 9.0]), positions=np.array([[0.0, -5.2], [0.0, -5.2]]))
    with pytest.raises(InvalidInput, match=r"robot.start.*'r' \(0.20 m\)"):
        simulate(scenario, navigator=BlindDriver(goal=UP), recording=Recording(name="s", tracks=(track,)))


def test_a_differential_drive_follows_too():
    robot = {"kind": "differential", "start": (0, -5), "goal": (0, 5), "max_speed": 1.0, "heading": 0.0}
    record = simulate(crossing(robot=robot, people=[], control_step=0.1), navigator=BlindDriver(goal=UP))
    assert record.reached_goal
    assert np.isfinite(record.robot_headings).all()
    assert record.robot_headings[0] == 0.0


@pytest.mark.parametrize("kind", ["concerned", "unconcerned"])
def test_the_planner_passes_and_tells_the_kinds_apart(kind):
    one = {"id": "a", "kind": kind, "start": (-5, 0), "goal": (5, 0), "randomness": 0.0, "arrives_with": (1.0, 0.0)}
    record = simulate(crossing(people=[one]))
    m = measure(record)
    assert m.reached_goal
    assert m.contacts_moving + m.contacts_standing == 0
    assert set(m.status_counts) == {"certified", "least_risk", "stopped"}
    assert np.isfinite(record.beliefs).all()
    assert ((record.beliefs > 0) & (record.beliefs < 1)).all()
    gaps = np.linalg.norm(record.people_positions[:, 0] - record.robot_positions, axis=-1)
    before = record.beliefs[: int(np.argmin(gaps)), 0]
    assert (before.max() > 0.9) if kind == "concerned" else (before.min() < 0.1)
    assert record.snapshots
    for shot in record.snapshots:
        np.testing.assert_allclose(shot.probability.reshape(len(shot.instants), -1).sum(axis=1), 1.0, atol=1e-9)


def test_the_planner_gives_the_same_run_twice():
    scenario = crossing(people=[{"id": "a", "start": (-5, 0), "goal": (5, 0), "randomness": 0.3}], duration=4.0)
    a, b = simulate(scenario), simulate(scenario)
    np.testing.assert_array_equal(a.robot_positions, b.robot_positions)
    np.testing.assert_array_equal(a.beliefs, b.beliefs)
