"""The nodes of both dialects, among real middleware: they drive, they stop, they say why."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import time

import pytest
from stack import PATIENCE, PROJECT, Stack, free_port, message, moving, standing

from sidestep.ros.station import Station

CROSSING = [
    {"name": "a", "at": [2.5, -3.0], "velocity": [0.0, 0.7]},
    {"name": "b", "at": [7.0, 1.2], "velocity": [-0.8, 0.0]},
]
CONTACT = 0.18 + 0.3  # m


@pytest.fixture(scope="session", autouse=True)
def compiled():
    """Compile once, so that the tests wait for robots and not for compilers."""
    code = "from sidestep.ros import assembly, settings; assembly.warm_up(settings.NodeSettings())"
    for dialect in (1, 2):
        environment = os.environ | {"PYTHONPATH": str(PROJECT / "src"), "NUMBA_NUM_THREADS": "1"}
        subprocess.run([PROJECT / f".venv-ros{dialect}" / "bin" / "python", "-c", code], env=environment, check=True)


@pytest.fixture(scope="module", params=[1, 2], ids=["ros1", "ros2"])
def stack(request, tmp_path_factory):
    """One graph for all tests of a dialect; a node is only started anew where its parameters differ."""
    python = PROJECT / f".venv-ros{request.param}" / "bin" / "python"
    if not python.exists():
        pytest.fail(f"{python.parent.parent.name} is missing: run tools/install-ros{request.param}.sh")
    with Stack(request.param, tmp_path_factory.mktemp(f"ros{request.param}")) as up:
        up.start_world()
        yield up


def test_it_drives_past_people_to_its_goal_and_stands_there(stack):
    stack.underway(people=CROSSING)
    told = stack.until(lambda told: message(told).startswith("arrived"), "it does not arrive")
    assert math.dist(told["pose"][:2], (4.0, 0.0)) < 0.6  # of the axle; its reference is nearer
    assert told["nearest"] > CONTACT
    assert told["diagnostics"]["level"] == 0
    assert set(told["heard"]) == {"cmd_vel", "plan", "predicted_occupancy", "beliefs", "/diagnostics"}
    assert told["plan"]["frame"] == "odom"
    assert told["plan"]["poses"] == 7
    assert told["grid"]["cells"] == 80 * 80
    assert told["beliefs"]
    before = stack.now()
    for later in stack.watch(1.0):
        assert standing(later)
        assert later["silence"] < 1.0  # commands go on
    assert stack.now()["heard"]["cmd_vel"] > before["heard"]["cmd_vel"] + 5


@pytest.mark.parametrize("missing", ["odom", "people"])
def test_a_lost_input_stops_it_and_is_named_and_its_return_lets_it_go_on(stack, missing):
    stack.underway()
    stack.order(do="mute", topic=missing)
    told = stack.until(lambda told: standing(told) and f"no {missing} for" in message(told), "it goes on blindly")
    assert told["diagnostics"]["level"] == 2
    place = stack.now()["pose"]
    time.sleep(0.5)
    assert stack.now()["pose"] == place
    stack.order(do="unmute", topic=missing)
    stack.until(moving, "it does not go on")


def test_messages_that_come_late_stop_it(stack):
    stack.underway()
    stack.order(do="late", seconds=3.0)
    stack.until(lambda told: standing(told) and "behind now" in message(told), "old measurements pass for new")


def test_markers_keep_their_identities(stack):
    stack.underway({"node": {"people_from": "markers"}}, CROSSING, eyes="people_markers")
    told = stack.until(lambda told: len(told.get("beliefs", ())) == 2, "nobody is shown")
    assert sorted(text.split(":")[0] for text in told["beliefs"]) == ["a/0", "b/0"]


def test_a_switch_stops_it(stack):
    stack.underway()
    stack.order(do="enable", on=False)
    stack.until(lambda told: standing(told) and "enable" in message(told), "the switch does nothing")
    stack.order(do="enable", on=True)
    stack.until(moving, "it does not go on")


def test_it_goes_round_a_wall_on_the_map(stack):
    stack.order(do="map", row=[10, 36], column=[28, 32])  # x 1.8 … 2.2 m, y −2 … 0.6 m
    try:
        stack.underway()
        aside = 0.0
        for told in stack.watch(PATIENCE):
            aside = max(aside, told["pose"][1])
            assert not (1.8 < told["pose"][0] < 2.2 and -2.0 < told["pose"][1] < 0.6), "it is inside the wall"
            if message(told).startswith("arrived"):
                break
        assert message(stack.now()).startswith("arrived")
        assert aside > 0.7
    finally:
        stack.order(do="map", row=[0, 0], column=[0, 0])


def test_the_last_command_is_to_stand_still(stack):
    stack.underway()
    stack.node.child.send_signal(signal.SIGTERM)
    assert stack.node.child.wait(timeout=30) == 0
    stack.until(standing, "it was left driving")


@pytest.mark.parametrize(
    ("parameters", "field"),
    [({"node": {"timeout": -1.0}}, "node.timeout"), ({"planner": {"horizont": 3}}, "planner.horizont")],
)
def test_a_wrong_parameter_ends_it_at_once_with_its_name(stack, parameters, field):
    stack.node.end()
    node = stack.start_node(parameters)
    assert node.child.wait(timeout=PATIENCE) == 2
    said = node.said() + "".join(p.read_text(errors="replace") for p in stack.folder.rglob("*.log"))
    assert field in said


def test_a_station_drives_it_and_its_end_stops_it(stack):
    port = free_port()
    stack.order(do="reset", eyes="people")
    stack.have_node({"node": {"remote": {"enabled": True, "port": port, "link_timeout": 2.0}}})
    stack.order(do="people", people=CROSSING[:1])
    stack.until(lambda told: "waiting for a station" in message(told), "it does not wait")
    station = Station(port=port)
    station.goal(4.0, 0.0)
    station.start()
    stack.until(moving, "it does not set off")
    state = next(s for s in station.states() if s["status"])
    assert state["rates"]["odom"] > 5
    assert [p["id"] for p in state["people"]] == ["1"]
    assert 0 < state["people"][0]["concerned"] < 1
    station.close()
    stack.until(lambda told: standing(told) and "has gone" in message(told), "it drives on alone")


def test_a_planner_on_another_clock_is_not_needed_to_stop(stack):
    """The node is frozen by its own scheduler: after it wakes, its first commands rest on fresh data or are a stop."""
    stack.underway()
    os.kill(stack.node.child.pid, signal.SIGSTOP)
    stack.order(do="mute", topic="odom")
    time.sleep(2.0)
    heard = stack.now()["heard"]["cmd_vel"]
    os.kill(stack.node.child.pid, signal.SIGCONT)
    told = stack.until(lambda told: told["heard"]["cmd_vel"] > heard + 3, "no more commands")
    assert standing(told)


def test_it_finds_people_in_scans_and_passes_them(stack):
    parameters = {"node": {"people_from": "scan", "mount": [0.1, 0.0, 0.0]}}
    walker = [{"name": "a", "at": [2.5, -2.0], "velocity": [0.0, 0.5]}]
    stack.underway(parameters, walker, eyes="scan")
    seen = stack.until(lambda told: told.get("beliefs"), "nobody is found")
    assert len(seen["beliefs"]) <= 2
    told = stack.until(lambda told: message(told).startswith("arrived"), "it does not arrive")
    assert told["nearest"] > CONTACT
    stack.order(do="goal", at=[0.0, 0.0])
    stack.until(moving, "it does not set off again")
    stack.order(do="mute", topic="scan")
    stack.until(lambda told: standing(told) and "no scan for" in message(told), "it goes on blindly")
