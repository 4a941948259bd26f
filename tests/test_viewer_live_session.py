"""One visitor's world without a browser: clock, steering, trips, settings, records."""

from __future__ import annotations

import gc
import json
import struct
import sys
import weakref
from dataclasses import replace

import numpy as np
import pytest

from made_records import made_record
from scripted_navigators import Blind, Pondering
from sidestep.cli import execute
from sidestep.errors import InvalidInput, MissingExtra
from sidestep.io.records import read_record, write_record
from sidestep.io.scenarios import load_obstacles, load_scenario, shipped_names
from sidestep.simulation.metrics import measure
from sidestep.viewer.live import messages, stage
from sidestep.viewer.live.chronicle import samples
from sidestep.viewer.live.replay import Replay
from sidestep.viewer.live.session import MOST_WAITING, Session
from sidestep.viewer.live.settings import LiveSettings
from sidestep.viewer.live.visits import MOST_VISITORS, Visits


def _choose(name, scenario, walls):
    return Blind(scenario) if name in ("orca", "cv_mpc") else Pondering(scenario)


def _session(seed=0, **changes):
    return Session(load=load_scenario, settings=LiveSettings(**changes), seed=seed, choose=_choose)


def _read(packet):
    if isinstance(packet, str):
        return json.loads(packet)
    (length,) = struct.unpack("<I", packet[:4])
    return json.loads(packet[4 : 4 + length])


def _run(world, seconds):
    """All messages of that time, by type."""
    said = {"scene": [], "plan": [], "frame": [], "history": []}
    for _ in range(round(seconds / world.interval)):
        for packet in world.tick():
            message = _read(packet)
            said[message["type"]].append(message)
    return said


def _say(world, **fields):
    message = messages.read(json.dumps(fields))
    assert message is not None
    world.post(message)


def test_a_page_that_has_just_opened_is_told_everything():
    said = _run(_session(), 0.05)
    (scene,) = said["scene"]
    (frame,) = said["frame"]
    assert scene["mode"] == "live"
    assert [person["you"] for person in scene["people"]] == [True]
    assert frame["running"] is True
    assert len(frame["panels"]) == len(scene["panels"]) == 1
    assert frame["panels"][0]["words"].endswith(".")
    (plan,) = said["plan"]
    assert len(plan["positions"]) == scene["horizon"] + 1
    assert plan["heats"][0]["instants"][-1] == scene["horizon"]


def test_frames_come_twenty_times_a_second_and_plans_at_their_own_rate():
    said = _run(_session(planning_rate=5), 2.0)
    assert len(said["frame"]) == 40
    assert len(said["plan"]) == 10
    times = [frame["time"] for frame in said["frame"]]
    np.testing.assert_allclose(np.diff(times), 0.05, atol=1e-6)


def test_the_planner_sees_where_the_visitor_was_and_not_what_they_will_do():
    session = _session()
    _say(session, type="walk", direction=[1.0, 0.0])
    frames = _run(session, 1.0)["frame"]
    seen = session.worlds[0].run.navigator.seen
    shown = {frame["time"]: frame["panels"][0]["people"][0][:2] for frame in frames}
    for time, people in seen[1:]:
        place, velocity = people["you"]
        np.testing.assert_allclose(place, shown[round(time, 3)], atol=1e-3)
        before = np.array(shown[round(time - 0.05, 3)]) if time > 0.05 else np.array([-5.0, 0.0])
        np.testing.assert_allclose(velocity, (place - before) / 0.05, atol=0.03)


def test_paused_nothing_moves_and_a_step_is_one_planning_step():
    session = _session(planning_rate=2)
    _say(session, type="walk", direction=[1.0, 0.0])
    _say(session, type="pause")
    frames = _run(session, 1.0)["frame"]
    assert {frame["time"] for frame in frames} == {0.0}
    _say(session, type="step")
    frames = _run(session, 2.0)["frame"]
    assert frames[-1]["time"] == pytest.approx(0.5)
    assert frames[-1]["running"] is False
    _say(session, type="play")
    assert _run(session, 1.0)["frame"][-1]["time"] == pytest.approx(1.5)


def test_reset_puts_everybody_back():
    session = _session()
    _say(session, type="drag", point=[3.0, 3.0])
    _run(session, 2.0)
    _say(session, type="reset")
    said = _run(session, 0.05)
    assert len(said["scene"]) == 1
    (frame,) = said["frame"]
    assert frame["time"] <= 0.05
    np.testing.assert_allclose(frame["panels"][0]["people"][0][:2], [-5.0, 0.0], atol=0.01)
    assert frame["hand"] is None


def test_at_the_goal_the_trip_is_counted_and_the_robot_turns_round():
    session = _session()
    frames = _run(session, 14.0)["frame"]
    arrived = [f for f in frames if f["panels"][0]["status"] == "arrived"]
    assert arrived[0]["panels"][0]["words"].startswith("Arrived after 9.")
    last = frames[-1]["panels"][0]
    assert last["trip"] == 2
    assert last["times"] == [pytest.approx(9.7, abs=0.3)]
    assert last["goal"] == [0.0, -5.0]
    times = [frame["time"] for frame in frames]
    assert np.all(np.diff(times) > 0)


def test_two_planners_meet_the_same_person():
    session = _session(beside="orca", people=2)
    _say(session, type="drag", point=[1.0, 1.0])
    said = _run(session, 3.0)
    for frame in said["frame"]:
        ours, theirs = frame["panels"]
        assert ours["people"][0] == theirs["people"][0]
    assert [panel["title"] for panel in said["scene"][0]["panels"]] == ["sidestep", "ORCA"]
    assert said["frame"][-1]["panels"][1]["beliefs"] == [None, None, None]
    assert "half of the evading" in said["frame"][-1]["panels"][1]["words"]
    assert {plan["panel"] for plan in said["plan"]} == {0, 1}


def test_a_change_of_numbers_goes_on_from_here():
    session = _session()
    _say(session, type="drag", point=[2.0, 2.0])
    before = _run(session, 3.0)["frame"][-1]
    session.configure(session.settings.changed("risk_limit", 0.1).changed("clearance", 1.1))
    said = _run(session, 0.05)
    assert said["scene"][0]["limit"] == 0.1
    assert said["scene"][0]["clearance"] == 1.1
    after = said["frame"][-1]
    np.testing.assert_allclose(after["panels"][0]["robot"][:2], before["panels"][0]["robot"][:2], atol=0.06)
    assert after["time"] == pytest.approx(before["time"] + 0.05)


def test_a_change_of_scenario_begins_anew():
    session = _session()
    _run(session, 3.0)
    session.configure(session.settings.changed("scenario", "head-on"))
    said = _run(session, 0.05)
    assert said["scene"][0]["name"] == "head-on"
    assert said["frame"][0]["time"] <= 0.05


def test_what_does_not_fit_the_scenario_is_told_and_changes_nothing():
    def load(name):
        if name == "tall":
            raise InvalidInput("live.scenario", name, "a scenario in 2-D")
        return load_scenario(name)

    session = Session(load=load, settings=LiveSettings(), choose=_choose)
    _run(session, 1.0)
    session.configure(session.settings.changed("scenario", "tall"))
    frame = _run(session, 0.05)["frame"][-1]
    assert "2-D" in frame["trouble"]
    assert session.settings.scenario == "crossing"
    assert _run(session, 1.0)["frame"][-1]["time"] > 1.9


def test_a_planner_that_cannot_be_made_leaves_the_world_as_it_was():
    """What it needs may be missing, and only making it says so."""

    def choose(name, scenario, walls):
        if name == "orca":
            raise MissingExtra("ORCA", "peers")
        return Pondering(scenario)

    session = Session(load=load_scenario, settings=LiveSettings(), choose=choose)
    before = _run(session, 1.0)["frame"][-1]
    session.configure(session.settings.changed("beside", "orca"))
    after = _run(session, 0.05)["frame"][-1]
    assert "sidestep[peers]" in after["trouble"]
    assert session.settings.beside == "nothing"
    assert len(after["panels"]) == 1
    assert after["time"] == pytest.approx(before["time"] + 0.05)


@pytest.mark.parametrize("name", [n for n in shipped_names() if load_scenario(n).dimension == 2])
def test_every_flat_scenario_can_be_visited(name):
    session = _session(scenario=name, beside="orca")
    said = _run(session, 2.0)
    scenario = load_scenario(name)
    assert len(said["scene"][0]["people"]) == max(len(scenario.people), 1)
    x0, y0, x1, y1 = said["scene"][0]["bounds"]
    for x, y, _ in said["frame"][-1]["panels"][0]["people"]:
        assert x is None or (x0 <= x <= x1 and y0 <= y <= y1)


def test_another_scenario_comes_with_its_own_numbers():
    settings = LiveSettings().changed("clearance", 1.5).changed("people", 3).changed("ignores", "no_prediction")
    assert settings.changed("scenario", "head-on") == LiveSettings(scenario="head-on", ignores="no_prediction")


@pytest.mark.parametrize("kind", ["concerned", "unconcerned", "mixed", "random"])
def test_simulated_people_of_every_kind_walk_and_stay_apart_from_the_start(kind):
    session = _session(people=5, kind=kind)
    said = _run(session, 4.0)
    first, last = said["frame"][0]["panels"][0], said["frame"][-1]["panels"][0]
    moved = np.linalg.norm(np.array([p[:2] for p in last["people"]]) - [p[:2] for p in first["people"]], axis=1)
    assert np.all(moved[1:] > 0.2)
    assert np.all(np.linalg.norm(np.array([p[:2] for p in first["people"]]) - first["robot"][:2], axis=1) > 0.7)


def test_the_same_seed_gives_the_same_crowd_and_another_seed_another():
    places = [
        [p[:2] for p in _run(_session(seed=seed, people=4), 0.05)["frame"][0]["panels"][0]["people"]]
        for seed in (1, 1, 2)
    ]
    assert places[0] == places[1]
    assert places[0] != places[2]


def test_a_flood_of_messages_does_not_grow():
    session = _session()
    for i in range(50 * MOST_WAITING):
        _say(session, type="drag", point=[float(i % 7), 0.0])
    assert len(session._inbox) <= MOST_WAITING
    _run(session, 0.05)
    assert len(session._inbox) == 0


def test_what_happened_is_a_record_like_any_other(tmp_path):
    session = _session(people=1)
    _say(session, type="drag", point=[2.0, -1.0])
    frames = _run(session, 4.0)["frame"]
    record = read_record(write_record(session.record(), tmp_path / "trip.npz"))
    assert record.people == ("you", "p1")
    shown = np.array([f["panels"][0]["people"][0][:2] for f in frames])
    np.testing.assert_allclose(record.people_positions[1 : len(shown) + 1, 0], shown, atol=1e-3)
    assert np.isfinite(measure(record).min_distance)
    assert record.snapshots


def test_a_replay_shows_what_the_live_page_showed():
    session = _session(people=1)
    _say(session, type="drag", point=[2.0, -1.0])
    live = _run(session, 4.0)["frame"]
    replay = Replay(session.record())
    _say(replay, type="play")
    shown = _run(replay, 4.2)["frame"]
    by_time = {round(frame["time"], 3): frame["panels"][0] for frame in shown}
    for frame in live[:-1]:
        again, first = by_time[round(frame["time"], 3)], frame["panels"][0]
        np.testing.assert_allclose(again["robot"][:2], first["robot"][:2], atol=2e-3)
        np.testing.assert_allclose([p[:2] for p in again["people"]], [p[:2] for p in first["people"]], atol=2e-3)
    assert shown[-1]["running"] is False


def test_where_the_sum_of_risks_is_limited_the_page_shows_and_tells_the_sum():
    """It showed the largest stage beside the limit of the sum."""
    record = replace(made_record(people=1), settings={"planner": {"risk_rule": "trajectory"}})
    summed = record.risk.sum(axis=1)[record.plan_age <= 1e-9]
    assert [s["risk"] for s in samples(record)] == pytest.approx(summed, abs=1e-5)
    assert json.loads(Replay(record).scene())["summed"]
    assert not json.loads(Replay(made_record()).scene())["summed"]
    summing = Session(
        load=lambda name: load_scenario(name, ['planner.risk_rule="trajectory"']), settings=LiveSettings(), seed=1
    )
    said = _run(summing, 1.0)
    assert said["scene"][0]["summed"]
    for plan in said["plan"]:
        assert plan["sample"]["risk"] == pytest.approx(sum(plan["risk"]), abs=1e-4)
    assert max(plan["sample"]["risk"] for plan in said["plan"]) > 0


def test_a_record_is_scrubbed_stepped_and_played_again():
    replay = Replay(made_record())
    said = _run(replay, 0.05)
    assert said["scene"][0]["mode"] == "record"
    steps = said["scene"][0]["steps"]
    assert len(said["history"][0]["samples"]) == steps
    _say(replay, type="seek", index=7)
    (frame,) = _run(replay, 0.05)["frame"]
    assert (frame["index"], frame["time"]) == (7, pytest.approx(3.5))
    _say(replay, type="step")
    assert _run(replay, 0.05)["frame"][0]["index"] == 8
    _say(replay, type="seek", index=10_000)
    assert _run(replay, 0.05)["frame"][0]["index"] == steps
    _say(replay, type="play")
    assert _run(replay, 0.05)["frame"][0]["index"] == 0
    _say(replay, type="drag", point=[0.0, 0.0])
    assert _run(replay, 0.05)["frame"][0]["hand"] is None


@pytest.mark.parametrize(("dimension", "people"), [(1, 1), (2, 0), (2, 4), (3, 2)])
def test_records_of_any_dimension_and_company_can_be_watched(dimension, people):
    replay = Replay(made_record(dimension=dimension, people=people, late=people > 1))
    _say(replay, type="play")
    said = _run(replay, 13.0)
    assert len(said["frame"][-1]["panels"][0]["people"]) == people
    assert said["frame"][-1]["index"] == said["scene"][0]["steps"]
    assert all(len(plan["positions"][0]) == 2 for plan in said["plan"])


@pytest.mark.parametrize("ignores", ["assume_concerned", "assume_unconcerned", "no_prediction"])
def test_what_the_robot_ignores_is_switched_off_in_its_model_of_people(ignores):
    scenario = load_scenario("crossing")
    human = stage.ignoring(scenario, ignores).human
    if ignores == "no_prediction":
        assert human.horizon == 0
        assert human.prior_concerned == scenario.human.prior_concerned
    else:
        assert human.prior_concerned == pytest.approx(float(ignores == "assume_concerned"), abs=1e-6)


def test_visitors_do_not_disturb_each_other():
    visits = Visits(load=load_scenario, settings=LiveSettings(), record=None)
    first, second = (visits.get(visits.admit()) for _ in range(2))
    one, two = first.enter(), second.enter()
    _say(one, type="drag", point=[2.0, 2.0])
    first.change("risk_limit", 0.2)
    one.tick()
    two.tick()
    assert two.visitor.hand is None
    assert second.settings.risk_limit is None


def test_a_closed_tab_frees_its_planner():
    visits = Visits(load=load_scenario, settings=LiveSettings(), record=None)
    token = visits.admit()
    world = visits.get(token).enter()
    planner = weakref.ref(world.worlds[0].run.navigator)
    del world
    assert visits.worlds == 1
    visits.leave(token)
    gc.collect()
    assert planner() is None
    assert (len(visits), visits.worlds) == (0, 0)


def test_a_full_house_admits_nobody():
    visits = Visits(load=load_scenario, settings=LiveSettings(), record=made_record())
    for _ in range(MOST_VISITORS):
        visits.get(visits.admit()).enter()
    assert visits.admit() is None


def test_a_bad_setting_leaves_a_visit_as_it_was():
    visits = Visits(load=load_scenario, settings=LiveSettings(), record=None)
    visit = visits.get(visits.admit())
    with pytest.raises(InvalidInput):
        visit.change("horizon", 0)
    with pytest.raises(InvalidInput):
        visit.change("scenario", "nowhere")
    assert visit.settings == LiveSettings()


@pytest.mark.parametrize(("name", "package"), [("orca", "pyrvo"), ("cv_mpc", "casadi")])
def test_a_planner_that_is_not_installed_is_refused_with_what_to_install(monkeypatch, name, package):
    monkeypatch.setitem(sys.modules, package, None)
    visits = Visits(load=load_scenario, settings=LiveSettings(), record=None)
    visit = visits.get(visits.admit())
    with pytest.raises(MissingExtra, match=r"sidestep\[peers\]"):
        visit.change("beside", name)
    assert visit.settings == LiveSettings()
    assert _run(visit.enter(), 0.1)["frame"]


def test_a_map_file_stops_the_visitor_and_is_drawn(tmp_path):
    cells = np.full((60, 80), 254, dtype=np.uint8)
    cells[20:40, 38:42] = 0  # x −0.2 … 0.2 m, y −1 … 1 m
    (tmp_path / "room.pgm").write_bytes(b"P5 80 60 255\n" + cells.tobytes())
    (tmp_path / "room.yaml").write_text(
        "image: room.pgm\nresolution: 0.1\norigin: [-4, -3, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "room.toml").write_text(
        'map = "room.yaml"\n[robot]\nstart = [-3.0, 2.0]\ngoal = [3.0, 2.0]\n[[people]]\nkind = "concerned"\n'
        "start = [2.0, 0.0]\n"
    )
    settings = LiveSettings(scenario=str(tmp_path / "room.toml"))
    session = Session(load=load_scenario, settings=settings, choose=_choose, walls=load_obstacles)
    _say(session, type="walk", direction=[-1, 0], hurry=True)
    said = _run(session, 3.0)
    (wall,) = said["scene"][0]["walls"]
    assert np.ptp(wall, axis=0) == pytest.approx([0.4, 2.0])
    x0, y0, x1, y1 = said["scene"][0]["bounds"]
    assert (x0, y0, x1, y1) == pytest.approx((-5.5, -4.5, 5.5, 4.5))  # the whole map, and some floor around
    assert said["frame"][-1]["panels"][0]["people"][0][0] == pytest.approx(0.2 + session.visitor.radius, abs=0.11)


@pytest.mark.parametrize(("scenario", "words"), [("nowhere", "scenario: got 'nowhere'"), ("drone", "in 2-D")])
def test_a_scenario_that_cannot_be_shown_is_told_at_once_where_a_record_comes_first(
    scenario, words, tmp_path, capsys, monkeypatch
):
    pytest.importorskip("nicegui")
    monkeypatch.setattr("sidestep.viewer.live.server.serve", lambda *_, **__: pytest.fail("the page was opened"))
    path = write_record(made_record(), tmp_path / "record.npz")
    assert execute(["live", str(path), "--scenario", scenario, "--no-show"]) == 2
    assert words in capsys.readouterr().err
