"""`sidestep run`, from arguments to files."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from blind_driver import BlindDriver
from sidestep.cli import execute
from sidestep.io.records import read_record
from sidestep.io.scenarios import load_scenario

DATA = Path(os.environ.get("SIDESTEP_DATA", Path(__file__).parents[2] / "shared" / "data"))
PROMISED = {
    "scenario", "seed", "steps", "reached_goal", "time_to_goal", "min_distance", "clearance_violations",
    "max_collision_probability", "status_counts", "belief", "robot_positions", "human_positions",
    "PI_R", "PI_H", "PI_T", "path_length", "plan_ms",
}  # fmt: skip
SHORT = ["--set", "duration=2.0"]


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")


def told(capsys, *argv):
    """The JSON object that a command prints, and nothing else."""
    status = execute([*argv, "--json"])
    out, err = capsys.readouterr()
    assert status == 0, err
    assert len(out.splitlines()) == 1
    return json.loads(out)


def test_json_has_the_promised_keys_and_consistent_values(capsys):
    found = told(capsys, "run", "crossing", "--seed", "3", "--out", "here")
    assert set(found) >= PROMISED
    assert (found["scenario"], found["seed"], found["reached_goal"]) == ("crossing", 3, True)
    robot, human = np.array(found["robot_positions"]), np.array(found["human_positions"])
    assert robot.shape == human.shape == (found["steps"] + 1, 2)
    assert len(found["belief"]) == found["steps"]
    assert sum(found["status_counts"].values()) == found["steps"]
    assert set(found["status_counts"]) == {"certified", "least_risk", "stopped"}
    assert found["min_distance"] <= np.linalg.norm(robot - human, axis=1).min() + 1e-9
    assert found["path_length"] == pytest.approx(np.linalg.norm(np.diff(robot, axis=0), axis=1).sum())
    assert found["PI_R"] == pytest.approx(((robot - [0.0, 5.0]) ** 2).sum())
    assert found["PI_T"] == pytest.approx(found["PI_R"] + found["PI_H"])
    assert set(found["plan_ms"]) == {"median", "p95", "max"}
    assert found["time_to_goal"] == found["time"][-1]


def test_files_are_written_and_read_back(capsys):
    found = told(capsys, "run", "head-on", "--human", "unconcerned", "--seed", "2", *SHORT, "--horizon", "4")
    folder = Path("runs/head-on-unconcerned-2")
    assert sorted(p.name for p in folder.iterdir()) == ["figure.png", "record.npz", "scenario.toml"]
    assert [Path(f).name for f in found["files"]] == ["record.npz", "scenario.toml", "figure.png"]
    record = read_record(folder / "record.npz")
    np.testing.assert_allclose(record.robot_positions, found["robot_positions"])
    scenario = load_scenario(folder / "scenario.toml")
    assert (scenario.seed, scenario.planner.horizon, scenario.people[0].kind) == (2, 4, "unconcerned")
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_the_written_scenario_gives_the_same_run(capsys):
    first = told(capsys, "run", "crossing", "--set", "people.0.randomness=0.4", *SHORT, "--out", "a")
    again = told(capsys, "run", "a/scenario.toml", "--out", "b")
    assert again["robot_positions"] == first["robot_positions"]
    assert again["human_positions"] == first["human_positions"]


def test_without_json_a_table_tells_the_same(capsys):
    assert execute(["run", "crossing", *SHORT, "--out", "here"]) == 0
    out, err = capsys.readouterr()
    for words in ("minimum distance", "status", "planning", "here/record.npz", "P(concerned)"):
        assert words in out
    assert err == ""


def test_switching_people_are_unconcerned_first(capsys):
    found = told(capsys, "run", "crossing", "--human", "switching", "--set", "people.0.switch_times=[1.0]", *SHORT)
    assert found["people"]["pedestrian"]["concerned"][:3] == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["crosing"], "did you mean 'crossing'"),
        (["nowhere/x.toml"], "no such file"),
        (["crossing", "--horizon", "0"], "planner.horizon"),
        (["crossing", "--set", "human.danger_weight=-1"], "human.danger_weight"),
        (["crossing", "--set", "human.randomness=1.2"], "human.randomness"),
        (["crossing", "--set", "human.randomnes=0.2"], "did you mean 'randomness'"),
        (["crossing", "--set", "robot.start=[nan, 0]"], "robot.start.0"),
        (["crossing", "--set", "robot.start=[-5.0, 0.2]"], "robot.start"),
        (["crossing", "--set", "robot.goal=[1.0, 2.0, 3.0]"], "robot.goal"),
        (["crossing", "--set", "people.0.kind=robot"], "people.0.kind"),
        (["crossing", "--set", "walls=[[[-1, 4], [1, 4], [1, 6], [-1, 6]]]"], "robot.goal"),
        (["crossing", "--scene", "zara1"], "--people"),
        (["crossing", "--start", "3"], "--people"),
        (["crossing", "--people", "absent.csv"], "absent.csv"),
        (["crossing", "--people", "absent.csv", "--human", "concerned"], "--human"),
        (["crossing", "--set", "people=[]", "--human", "concerned"], "--human: got 'concerned'; allowed: only where"),
        (["crossing", "--set", "planner.horizon=5", "--horizon", "6"], "only without --horizon"),
        (["crossing", "--set", "seed = 5", "--seed", "6"], "only without --seed"),
        (["crossing", "--seed", "-1"], "seed"),
        (["crossing", "--out", "a-file/here"], "a-file/here"),
    ],
)
def test_bad_input_gives_one_line_and_status_2(argv, words, capsys):
    Path("a-file").write_text("")
    assert execute(["run", *argv, "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert words in err


def test_duplicate_ids_in_a_file_are_bad_input(capsys):
    person = '[[people]]\nid = "a"\nstart = [{x}, 0]\n'
    robot = "[robot]\nstart = [0, -5]\ngoal = [0, 5]\n"
    Path("two.toml").write_text(robot + person.format(x=-5) + person.format(x=5))
    assert execute(["run", "two.toml"]) == 2
    assert "people.1.id: got 'a'" in capsys.readouterr().err


def crowd(path):
    """A CSV of people who walk to and fro across a square."""
    rng = np.random.default_rng(1)
    lines = ["scene,t,agent,kind,x,y"]
    for agent in range(10):
        phase, lane = rng.uniform(0, 24, 2)
        for k in range(100):
            t = 0.4 * k
            lines.append(f"square,{t:.1f},{agent},ped,{abs((1.2 * t + phase) % 24 - 12):.3f},{lane / 2:.3f}")
    path.write_text("\n".join(lines) + "\n")


def test_recorded_people_in_place_of_simulated_ones(tmp_path, capsys):
    crowd(tmp_path / "square.csv")
    argv = ["run", "crossing", "--people", "square.csv", "--scene", "square", "--seed", "1", "--set", "duration=4.0"]
    found = told(capsys, *argv)
    assert set(found) >= PROMISED
    assert set(found["people"]) <= {str(i) for i in range(10)}
    assert set(found["human_positions"]) == set(found["people"])
    assert np.diff(found["time"]) == pytest.approx(0.4)
    folder = Path("runs/crossing-square-recorded-1")
    record = read_record(folder / "record.npz")
    robot = record.settings["robot"]
    assert 7.0 <= np.linalg.norm(np.subtract(robot["goal"], robot["start"])) <= 10.0
    assert record.settings["recording"]["scene"] == "square"
    again = told(capsys, "run", str(folder / "scenario.toml"), "--out", "again")
    assert again["robot_positions"] == found["robot_positions"]


def test_a_recorded_run_starts_when_and_where_told(tmp_path, capsys):
    crowd(tmp_path / "square.csv")
    trip = ["--set", "robot.start=[-3.0, -3.0]", "--set", "robot.goal=[6.0, 9.0]", "--start", "4.1"]
    told(capsys, "run", "crossing", "--people", "square.csv", *trip, "--set", "duration=1.2", "--out", "here")
    record = read_record("here/record.npz")
    np.testing.assert_allclose(record.robot_positions[0], (-3.0, -3.0))
    assert record.settings["recording"]["start"] == pytest.approx(4.0)  # the recording's own instant


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize(("name", "scene"), [("eth_ucy", "zara1"), ("citr", "p2p_bi/bidirection_no_vehicle_3v7_01")])
def test_real_people(name, scene, capsys):
    path = DATA / name / "tracks.csv.gz"
    if not path.exists():
        pytest.skip(f"no recordings in {DATA}; set SIDESTEP_DATA")
    found = told(capsys, "run", "crossing", "--people", str(path), "--scene", scene, "--set", "duration=8.0")
    assert found["steps"] > 10
    assert len(found["people"]) >= 2
    known = [b for person in found["people"].values() for b in person["belief"] if b is not None]
    assert known
    assert all(0 < b < 1 for b in known)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("robot.start=[0,-2]", "--set: got 'robot.start=[0,-2]'; allowed: robot.start and robot.goal together"),
        ("robot.goal.0=1.0", "--set: got 'robot.goal.0=1.0'; allowed: robot.start and robot.goal together"),
        ("people.0.speed=1.4", "--set: got 'people.0.speed=1.4'; allowed: only without --people"),
    ],
)
def test_changes_that_recorded_people_make_void_are_refused(change, words, capsys):
    """The robot set out from elsewhere without a word."""
    crowd(Path("square.csv"))
    assert execute(["run", "crossing", "--people", "square.csv", "--set", change]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(("at", "steps"), [(3.0, 6), (0.0, 0)])
def test_interruption_keeps_what_was_done(at, steps, capsys, monkeypatch):
    driver = BlindDriver(goal=(0.0, 5.0), interrupt_at=at)
    monkeypatch.setattr("sidestep.simulation.run.planner_of", lambda scenario, obstacles: driver)
    assert execute(["run", "crossing", "--out", "cut"]) == 130
    out, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    if steps == 0:
        assert "nothing is kept" in err
        assert not Path("cut/record.npz").exists()
    else:
        assert "the finished part is kept" in err
        assert "cut/record.npz" in out
        assert len(read_record("cut/record.npz").status) == steps


def test_a_fault_of_the_planner_is_no_result(capsys, monkeypatch):
    def broken(*args, **kwargs):
        raise RuntimeError("broken on purpose")

    monkeypatch.setattr("sidestep.planner.Planner._planned", broken)
    assert execute(["run", "crossing", "--out", "here", "--json"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "broken on purpose" in err.splitlines()[-1]
    assert not Path("here/record.npz").exists()


def test_a_run_with_nobody_is_a_run(capsys):
    found = told(capsys, "run", "crossing", "--set", "people=[]", "--out", "here")
    assert (found["human_positions"], found["belief"], found["people"]) == ({}, {}, {})
    assert found["min_distance"] is None
    assert found["time_to_goal"] == pytest.approx(10.0, abs=0.51)
