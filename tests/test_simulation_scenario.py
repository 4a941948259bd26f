"""A scenario holds every number of a run, and says in one line what is wrong with one."""

import json
import math

import pytest

from sidestep.errors import InvalidInput
from sidestep.human.model import HumanModel
from sidestep.simulation.scenario import Scenario

GOOD = {
    "robot": {"start": [0.0, -5.0], "goal": [0.0, 5.0]},
    "people": [{"id": "a", "start": [-5.0, 0.0], "goal": [5.0, 0.0]}, {"start": [5.0, 0.0], "goal": [-5.0, 0.0]}],
}


def changed(field, value):
    """GOOD with one dotted field set."""
    data = json.loads(json.dumps(GOOD))
    *tables, last = field.split(".")
    place = data
    for name in tables:
        place = place[int(name)] if name.isdigit() else place.setdefault(name, {})
    place[last] = value
    return data


def test_settings_give_an_equal_scenario_back_through_json():
    data = changed("human", {"rationality": math.inf, "goal_weight": [1.0, 2.0]})
    data["walls"] = [[[3, 3], [4, 3], [4, 4]]]
    data["people"][0]["goal_changes"] = [{"time": 2.0, "goal": "robot"}, {"time": 3.0, "goal": [1.0, 1.0]}]
    scenario = Scenario.parse(data)
    text = json.dumps(scenario.settings(), allow_nan=False)
    assert Scenario.parse(json.loads(text)) == scenario


def test_a_scenario_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        Scenario.parse(GOOD).seed = 3


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("planner.horzon", 3, ["planner.horzon", "did you mean 'horizon'"]),
        ("planner.horizon", 0, ["planner.horizon", "≥ 1"]),
        ("planner.horizon", 2.5, ["planner.horizon", "an integer"]),
        ("planner.risk_limit", True, ["planner.risk_limit", "True", "a number"]),
        ("human.danger_weight", -1.0, ["human.danger_weight", "≥ 0"]),
        ("human.prior_concerned", False, ["human.prior_concerned", "False", "a number"]),
        ("human.goal_weight", [1.0, True], ["human.goal_weight", "a number"]),
        ("human.habits", {"time_out": True}, ["human.habits.time_out", "True"]),
        ("human.randomness", 1.5, ["human.randomness", "0 to 1"]),
        ("human.dangr_rate", 1.0, ["human.dangr_rate", "did you mean 'danger_rate'"]),
        ("human.goal_weight", [1.0, 1.0, 1.0], ["human.goal_weight", "2 (one per axis)"]),
        ("human.goals", [[1.0]], ["human.goals.0", "2 coordinates"]),
        ("robot.start", [0.0, math.nan], ["robot.start.1", "finite"]),
        ("robot.goal", [math.inf, 0.0], ["robot.goal.0", "finite"]),
        ("robot.goal", [0.0, 1.0, 2.0], ["robot.goal", "2 coordinates"]),
        ("robot.start", [-5.0, 0.3], ["robot.start", "clearance", "'a'", "0.30 m"]),
        ("robot.max_speed", True, ["robot.max_speed", "a number"]),
        ("robot.max_speed", "1", ["robot.max_speed", "a number"]),
        ("robot.max_speed", 0, ["robot.max_speed", "> 0"]),
        ("robot.kind", "flying", ["robot.kind", "'holonomic' or 'differential'"]),
        ("robot", 3, ["robot", "a table"]),
        ("people.0.start", [1.0], ["people.0.start", "2 coordinates"]),
        ("people.1.id", "a", ["people.1.id", "no other person"]),
        (
            "people.0.behaviour",
            {"dangr_weight": 1},
            ["people.0.behaviour.dangr_weight", "did you mean 'danger_weight'"],
        ),
        ("people.0.behaviour", {"danger_weight": -1}, ["people.0.behaviour.danger_weight", "≥ 0"]),
        ("people.0.behaviour", {"danger_weight": True}, ["people.0.behaviour.danger_weight", "True"]),
        ("people.0.speed", -1.0, ["people.0.speed", "> 0"]),
        ("people.0.randomness", 1.1, ["people.0.randomness", "≤ 1"]),
        ("people.0.vanishes", 1e-3, None),
        ("people.0.decision_interval", 0.7, ["people.0.decision_interval", "whole multiple"]),
        ("people.0.goal_changes", [{"time": 1.0, "goal": "robt"}], ["goal_changes.0.goal", "'robot'"]),
        ("people", 3, ["people", "a list"]),
        ("control_step", 0.3, ["control_step", "whole fraction", "0.5 s"]),
        ("seed", -1, ["seed", "≥ 0"]),
        ("seed", 1.5, ["seed", "an integer"]),
        ("walls", [[[0, 0], [1, 1]]], ["walls.0", "at least 3"]),
        ("scene", "x", ["scene", "one of"]),
    ],
)
def test_each_mistake_gives_one_line_that_names_field_value_and_mend(field, value, words):
    data = changed(field, value)
    if words is None:
        Scenario.parse(data)
        return
    with pytest.raises(InvalidInput) as caught:
        Scenario.parse(data, source="mine.toml")
    lines = str(caught.value).splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("mine.toml: ")
    for word in words:
        assert word in lines[0]


def test_several_mistakes_give_a_line_each():
    data = changed("planner.horzon", 3)
    data["human"] = {"walking_speed": "fast"}
    data["name"] = 3
    with pytest.raises(InvalidInput) as caught:
        Scenario.parse(data)
    lines = str(caught.value).splitlines()
    assert [line.split(":")[0] for line in lines] == ["name", "planner.horzon", "human.walking_speed"]


def test_missing_fields_are_named():
    with pytest.raises(InvalidInput, match=r"robot.goal: got '\(missing\)'"):
        Scenario.parse({"robot": {"start": [0.0, 0.0]}})


@pytest.mark.parametrize("extra", [{"walls": [[[0, 0], [1, 0], [1, 1]]]}, {"map": "a.yaml"}])
def test_walls_are_for_the_plane(extra):
    data = {"robot": {"start": [0.0, 0.0, 0.0], "goal": [1.0, 0.0, 0.0]}} | extra
    with pytest.raises(InvalidInput, match="2 coordinates"):
        Scenario.parse(data)


def test_own_parameters_replace_the_predictors():
    people = [
        {"start": [-5.0, 0.0], "speed": 1.6, "radius": 0.2, "behaviour": {"danger_weight": 50.0, "reach": 4}},
        {"start": [5.0, 0.0], "kind": "random"},
        {"start": [5.0, 2.0]},
    ]
    scenario = Scenario.parse(GOOD | {"people": people, "human": {"randomness": 0.1}})
    first, second, third = (scenario.model_of(person) for person in scenario.people)
    assert (first.walking_speed, first.radius, first.danger_weight, first.randomness) == (0.4, 0.2, 50.0, 0.1)
    assert second.randomness == 1.0
    assert third == HumanModel(randomness=0.1)


def test_steps_fall_back_on_the_planner():
    assert (Scenario.parse(GOOD).step, Scenario.parse(GOOD).period) == (0.5, 0.5)
    finer = Scenario.parse(GOOD | {"control_step": 0.1})
    assert (finer.step, finer.period) == (0.1, 0.5)
    faster = Scenario.parse(GOOD | {"planning_period": 0.1})
    assert (faster.step, faster.period) == (0.1, 0.1)


def test_clearance_left_open_is_contact_and_ten_centimetres():
    assert Scenario.parse(GOOD).clearance == pytest.approx(0.3 + 0.3 + 0.1)
    assert Scenario.parse(changed("people.0.radius", 0.5)).clearance == pytest.approx(0.3 + 0.5 + 0.1)
    assert Scenario.parse(changed("planner.clearance", 2.0)).clearance == 2.0


def test_changed_values_are_checked_again():
    scenario = Scenario.parse(GOOD)
    assert scenario.changed(seed=5).seed == 5
    with pytest.raises(InvalidInput, match="seed"):
        scenario.changed(seed=-5)
