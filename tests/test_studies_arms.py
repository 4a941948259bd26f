"""Studies with and without something: seeded, resumable, and what each of them claims."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from sidestep.cli import BAD_INPUT, execute
from sidestep.io.checkpoints import Checkpoints
from sidestep.safety_filter import SafetyFilter
from sidestep.simulation.assembly import planner_of
from sidestep.simulation.lab import run_lab
from sidestep.simulation.lab_room import LabSettings
from sidestep.simulation.loop import simulate
from sidestep.simulation.run import Run
from sidestep.studies import brakes, hidden_goals, robots, scale, signalling
from sidestep.studies.arms import run_study, studies
from sidestep.studies.conditions import conditions
from sidestep.studies.filtering import BlindStraight, Guarded
from sidestep.studies.lab import KINDS, outcome_of
from sidestep.studies.lab_proof import outcomes
from sidestep.studies.opponents import trip_of
from sidestep.viewer.figure_studies import study_figure


def _same(one, other):
    assert one.keys() == other.keys()
    for arm in one:
        for name, values in one[arm].items():
            np.testing.assert_array_equal(values, other[arm][name])


@pytest.mark.slow
def test_a_hidden_goal_is_as_good_as_a_known_one_within_five_steps():
    found = run_study("goals", episodes=24)
    told, hidden = hidden_goals.means(found)
    assert told[0] - hidden[0] > 0.5  # it was hidden: four places all around
    assert (told[5:] - hidden[5:] < 0.05).all()
    sure = [found[hidden_goals.HIDDEN][f"seen_{k}"] for k in range(hidden_goals.STEPS)]
    assert np.isfinite(sure).all()


def test_numbers_do_not_depend_on_interruptions(tmp_path):
    kept = run_study("goals", episodes=3, store=Checkpoints(tmp_path))
    assert list(tmp_path.iterdir())
    _same(kept, run_study("goals", episodes=3, store=Checkpoints(tmp_path)))
    _same(kept, run_study("goals", episodes=3))


def test_an_episode_that_was_interrupted_is_no_result(tmp_path, monkeypatch):
    """Its first part was counted and kept as a trip that did not arrive, and the study went on."""
    step, steps = Run.advance, itertools.count()

    def advance(run):
        if next(steps) == 30:
            raise KeyboardInterrupt
        return step(run)

    with monkeypatch.context() as patched:
        patched.setattr(Run, "advance", advance)
        with pytest.raises(KeyboardInterrupt):
            run_study("goals", episodes=3, store=Checkpoints(tmp_path))
    _same(run_study("goals", episodes=3), run_study("goals", episodes=3, store=Checkpoints(tmp_path)))


def test_every_study_has_a_row_per_arm_as_long_as_its_header():
    for study in studies().values():
        assert study.header
        assert study.episodes >= 100
    assert set(studies()) == {"robots", "filter", "signal", "goals", "lab", "lab-mujoco", "scale", "brakes"}


@pytest.mark.slow
def test_bases_that_cannot_stop_at_once_are_compared_on_the_same_encounters():
    slow, free = brakes.meeting(3, "0.5 m/s²", 0.1), brakes.meeting(3, "any acceleration", 0.1)
    assert slow.people == free.people
    assert (slow.robot.max_acceleration, free.robot.max_acceleration) == (0.5, None)
    found = run_study("brakes", episodes=1)
    assert len(found) == len(brakes.BASES) * len(brakes.RATES)
    for base in ("1 m/s²", "0.5 m/s²", "two wheels, 1 m/s²"):  # whoever must speed up first takes longer
        assert found[f"{base} · 2 Hz"]["time"].mean() > found["any acceleration · 2 Hz"]["time"].mean() + 0.3
    assert all(c["reached"].all() for c in found.values())
    rows = studies()["brakes"].rows(found)
    assert [row[:3] for row in rows[:1]] == [["any acceleration", "2 Hz", 1]]
    figure = study_figure("brakes", found)
    assert figure is not None
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == list(brakes.BASES)


@pytest.mark.slow
def test_robots_that_announce_do_not_touch_and_others_would():
    found = run_study("robots", episodes=3)
    assert {arm: len(c["reached"]) for arm, c in found.items()} == {"announced": 3, "unaware of each other": 1}
    told = found["announced"]
    assert not told["robot_contact"].any()
    assert (told["robot_min_distance"] >= 0.6).all()
    assert any(robots.episode(seed, announce=False)["robot_contact"] for seed in range(6))  # three in five do
    assert len(robots.ROBOTS.rows(found)[0]) == len(robots.ROBOTS.header)


@pytest.mark.slow
def test_a_signal_that_is_heeded_makes_people_concerned_and_saves_time():
    found = run_study("signal", episodes=4)
    assert found[signalling.WITH]["heeded"].any()
    assert not found[signalling.WITHOUT]["heeded"].any()
    mean, low, high = signalling.gain(found)
    assert low <= mean <= high
    assert len(signalling.SIGNAL.rows(found)[0]) == len(signalling.SIGNAL.header)


def test_the_filter_keeps_a_blind_controller_from_driving_into_people():
    touched = {False: 0, True: 0}
    for seed in range(3):
        scenario = conditions()["crossing"].scenario(seed)
        blind = BlindStraight(trip_of(scenario))
        guard = Guarded(blind, SafetyFilter(planner_of(scenario)))
        for guarded, navigator in ((False, blind), (True, guard)):
            record = simulate(scenario, navigator=navigator, snapshots=0)
            gaps = np.linalg.norm(record.people_positions - record.robot_positions[:, None], axis=2)
            touched[guarded] += bool((gaps < 0.6).any())
        assert 0 < guard.interfered < guard.calls  # lets through what is safe
    assert touched[True] == 0
    assert touched[False] > 0


@pytest.mark.slow
def test_encounters_come_from_all_sides_and_would_touch_but_for_the_planner():
    found = run_study("scale", episodes=2)
    for column in found.values():
        assert column["moving_contact"].sum() == 0
        assert (column["promised"] >= 0).all()
        assert (column["seconds"] > 0).all()
    told = scale.SCALE.remarks(found)[0]
    assert "A million of them take" in told
    assert len(scale.SCALE.rows(found)[0]) == len(scale.SCALE.header)
    touched, sides = 0, set()
    for seed in range(8):
        scenario = scale.encounter(seed, "unconcerned")
        record = simulate(scenario, navigator=BlindStraight(trip_of(scenario)), snapshots=0)
        touched += bool((np.linalg.norm(record.people_positions - record.robot_positions[:, None], axis=2) < 0.6).any())
        sides.add(scenario.people[0].start[0] > 0)
    assert touched >= 4
    assert sides == {False, True}


def test_the_efficiency_of_workers_is_that_of_the_same_episodes(monkeypatch):
    monkeypatch.setattr(scale, "TIMED", 1)
    (line,) = scale.efficiency(1, pieces=2)
    assert line.endswith("parallel efficiency 1.00.")


def test_the_command_writes_a_table_and_a_page(tmp_path, capsys):
    page = tmp_path / "page.json"
    options = ["--episodes", "4", "--workers", "1", "--out", str(tmp_path), "--page", str(page), "--json"]
    assert execute(["study", "goals", *options]) == 0
    result = json.loads(capsys.readouterr().out)
    assert len(result["table"]) == hidden_goals.STEPS
    written = json.loads(page.read_text())
    assert written["command"] == "sidestep study goals --episodes 4"
    assert all(len(row) == len(written["tables"][0]["header"]) for row in written["tables"][0]["rows"])


def test_a_misspelt_study_is_named_with_the_nearest(tmp_path, capsys):
    assert execute(["study", "robot", "--out", str(tmp_path)]) == BAD_INPUT
    assert "robots" in capsys.readouterr().err


@pytest.mark.slow
def test_the_laboratory_counts_what_its_runs_say():
    found = run_study("lab", episodes=1)
    assert list(found) == [f"{c} · {k}" for c in ("scans at once", "200 ms late, 20 % lost") for k in KINDS]
    alone = outcome_of(run_lab(LabSettings(human="unconcerned"), snapshots=0))
    row = found["scans at once · unconcerned"]
    assert row["min_distance"][0] == alone.min_distance
    assert row["matches"][0] == alone.matches
    late = found["200 ms late, 20 % lost · concerned"]
    assert late["scan_age"][0] > 0.25
    both = outcomes(found)["scans at once"]
    assert [o.human for o in both] == list(KINDS)
    assert both[1].PI_R == alone.PI_R
    assert study_figure("lab", found).axes
