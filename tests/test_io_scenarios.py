"""Scenario files: what ships, what users write, what `--set` changes, and what goes wrong."""

import math
import os
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sidestep.errors import InvalidFile, InvalidInput, OutputError, UnknownName
from sidestep.io.scenarios import load_obstacles, load_scenario, shipped_names, shipped_text, write_scenario
from sidestep.io.toml import to_toml
from sidestep.simulation.settings import without_none

MINE = """
[robot]
start = [0, -5]
goal = [0, 5]

[[people]]
start = [-5, 0]
goal = [5, 0]
"""


def test_the_promised_scenarios_ship():
    promised = {"crossing", "head-on", "overtaking", "paper-printed", "paper-authors", "lab-printed", "lab-meeting"}
    assert promised <= set(shipped_names())


@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_scenario_is_sound(name, tmp_path):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    write_scenario(scenario, tmp_path / "copy.toml")
    assert load_scenario(tmp_path / "copy.toml") == scenario


def test_the_mark_that_some_editors_put_before_text_is_no_part_of_a_scenario(tmp_path):
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8-sig")
    assert load_scenario(tmp_path / "mine.toml").robot.goal == (0.0, 5.0)


@pytest.mark.parametrize("name", ["crossing", "head-on"])
def test_without_a_reaction_robot_and_person_would_meet(name):
    from blind_driver import BlindDriver
    from sidestep.simulation.loop import simulate
    from sidestep.simulation.metrics import measure

    scenario = load_scenario(name, ["people.0.kind=straight"])
    blind = BlindDriver(goal=scenario.robot.goal, speed=scenario.robot.max_speed)
    assert measure(simulate(scenario, navigator=blind)).min_distance < 0.3


def test_recommended_scenarios_use_the_defaults():
    from sidestep.human.model import HumanModel
    from sidestep.planning.settings import PlannerSettings

    for name in ("crossing", "head-on", "overtaking"):
        scenario = load_scenario(name)
        assert scenario.planner == PlannerSettings()
        assert scenario.human == HumanModel()


def test_paper_scenarios_hold_the_papers_numbers():
    printed = load_scenario("paper-printed")
    assert (printed.human.danger_weight, printed.human.danger_rate, printed.human.danger_decay) == (
        2.5, 0.008, "distance",
    )  # fmt: skip
    assert (printed.planner.goal_weight, printed.planner.effort_weight, printed.planner.risk_limit) == (
        100.0,
        0.06,
        0.05,
    )
    assert (printed.planner.risk_rule, printed.planner.clearance, printed.human.randomness) == ("cells", 0.5, 0.5)
    authors = load_scenario("paper-authors")
    assert (authors.human.goal_weight, authors.human.effort_weight) == (2.5, 8.0)
    assert (authors.human.danger_weight, authors.human.danger_rate, authors.human.danger_decay) == (
        100.0, 0.06, "squared_distance",
    )  # fmt: skip
    assert authors.human.randomness == 0.2
    for scenario in (printed, authors, load_scenario("lab-printed"), load_scenario("lab-meeting")):
        learned = (scenario.human.motion_filter, scenario.human.steadiness, scenario.human.online_randomness)
        assert not any(learned)
        assert scenario.planner.soft_risk_weight == 0.0
        assert scenario.human.frame == "world"
        assert (scenario.planner.first_step_limit is None) == (scenario.name != "lab-meeting")
    lab = load_scenario("lab-printed")
    assert (lab.robot.max_speed, lab.robot.shape, lab.planner.horizon) == (0.1, "box", 2)


def test_a_users_file_is_read_by_its_path_and_named_after_it(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(MINE)
    assert load_scenario(path).name == "mine"
    assert load_scenario(str(path)) == load_scenario(path)


def test_files_that_a_scenario_names_lie_beside_it(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('map = "office.yaml"\n' + MINE + '[recording]\nfile="tracks.csv"\nscene="a"\nstart=0.0\n')
    scenario = load_scenario(path)
    assert scenario.map == str(tmp_path / "office.yaml")
    assert scenario.recording is not None
    assert scenario.recording.file == str(tmp_path / "tracks.csv")


def test_changes_take_toml_values_words_and_none():
    changes = [
        "planner.horizon=5",
        "people.0.kind=unconcerned",
        "people.0.speed = 1.4",
        "robot.goal=[1.0, 5]",
        "planner.first_step_limit=none",
        "people.0.start.1=0.5",
        'description="two words"',
        "people.0.behaviour.danger_weight=3.0",
        "measurement.occlusion=true",
    ]
    s = load_scenario("crossing", changes, seed=4)
    assert (s.planner.horizon, s.people[0].kind, s.people[0].speed, s.robot.goal) == (5, "unconcerned", 1.4, (1.0, 5.0))
    assert s.planner.first_step_limit is None
    assert s.people[0].start == (-5.0, 0.5)
    assert (s.description, s.seed, s.measurement.occlusion) == ("two words", 4, True)
    assert s.model_of(s.people[0]).danger_weight == 3.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("planner.horzon=5", "did you mean 'horizon'"),
        ("planer.horizon=5", "did you mean 'planner'"),
        ("planner.horizon", "field=value"),
        ("=5", "field=value"),
        ("people.3.speed=1", "people.3"),
        ("people.x.speed=1", "people.x"),
        ("description.x.y=1", "description is a single value"),
        ("seed.x=1", "seed: got {'x': 1}; allowed: an integer"),
        ("planner.risk_limit=2", "planner.risk_limit"),
        ("people.0.start=[1e308, 0]", "people.0.start.0: got 1e+308; allowed: ≤ 1000000000"),
        ("measurement.position_noise=1e300", "measurement.position_noise: got 1e+300"),
        ("measurement.velocity_window=1e300", "measurement.velocity_window: got 1e+300"),
        ("control_step=1e-12", "control_step: got 1e-12; allowed: ≥ 0.001"),
        ("planning_period=1e-12", "planning_period: got 1e-12"),
        ("people.².speed=1", "people.²: got '²'; allowed: 0 to 0"),
        ("human.habits.scale=[1, 2]", "did you mean 'scales'"),
    ],
)
def test_each_wrong_change_gives_one_line(change, words):
    with pytest.raises(InvalidInput) as caught:
        load_scenario("crossing", [change])
    assert words in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_names_and_files_that_do_not_exist():
    with pytest.raises(UnknownName, match="did you mean 'crossing'"):
        load_scenario("crosing")
    with pytest.raises(UnknownName, match="did you mean 'head-on'"):
        shipped_text("head_on")
    with pytest.raises(InvalidFile, match=r"nowhere/x.toml: got 'no such file'"):
        load_scenario("nowhere/x.toml")


def test_broken_files_are_named(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text("robot = [")
    with pytest.raises(InvalidFile, match=r"x\.toml"):
        load_scenario(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidFile, match=r"x\.toml"):
        load_scenario(path)
    path.write_text(MINE + "[planner]\nhorzon = 3\n")
    with pytest.raises(InvalidInput, match=r"x\.toml: planner\.horzon"):
        load_scenario(path)
    with pytest.raises(InvalidFile):
        load_scenario(tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(OutputError, match="absent"):
        write_scenario(load_scenario("crossing"), tmp_path / "absent" / "x.toml")


scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**62), 2**62),
    st.floats(allow_nan=False),
    st.text(st.characters(blacklist_categories=("Cs",)), max_size=8).filter(lambda text: text != "none"),
)
keys = st.text(st.characters(blacklist_categories=("Cs",)), min_size=1, max_size=6)
nested = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(keys, nested, max_size=4))
def test_what_is_written_is_read_back(data):
    assert without_none(tomllib.loads(to_toml(data))) == data


def test_infinity_is_written():
    assert tomllib.loads(to_toml({"a": math.inf, "b": [-math.inf]})) == {"a": math.inf, "b": [-math.inf]}


def test_walls_come_from_polygons_and_the_map_beside_the_file(tmp_path):
    (tmp_path / "room.pgm").write_bytes(b"P5 4 2 255\n" + bytes([255, 255, 255, 0, 255, 255, 255, 0]))
    (tmp_path / "room.yaml").write_text("image: room.pgm\nresolution: 1.0\norigin: [2.0, -1.0, 0.0]\n")
    path = tmp_path / "mine.toml"
    path.write_text('map = "room.yaml"\nwalls = [[[-9, 0], [-8, 0], [-8, 1]]]\n' + MINE)
    obstacles = load_obstacles(load_scenario(path))
    assert obstacles is not None
    assert not obstacles.free((5.5, 0.0))
    assert not obstacles.free((-8.2, 0.2))
    assert obstacles.free((0.0, 0.0))
    assert load_obstacles(load_scenario("crossing")) is None


def test_a_file_may_have_a_name_that_is_no_text(tmp_path):
    """It was refused as a name that is no string, which nobody had given."""
    path = tmp_path / os.fsdecode(b"sz\xe4ne.toml")
    path.write_text(shipped_text("crossing"))
    scenario = load_scenario(path)
    assert scenario.name == "sz\ufffdne"
