"""Two scripted visitors in a real browser: one does not yield, one does. The page shows what the robot makes of it."""

from __future__ import annotations

import pytest

ALLOWED = 0.7  # m, the clearance that the page shows


def _walk_into_its_way(tab, *, until):
    """Set out so as to meet the robot in the middle of its way, by the arrow key."""
    tab.page.locator("#scene").focus()
    tab.page.keyboard.press("r")
    tab.until("f.time < 0.5")
    tab.until("f.time > 1.1")
    tab.page.keyboard.down("ArrowRight")
    tab.until(until)


def _whole_trip(tab):
    tab.until("p.times.length > 0 || p.status === 'arrived'", seconds=90)
    return tab.panel()


@pytest.fixture(scope="module")
def outcomes():
    return {}


def test_a_visitor_who_does_not_yield(visit, measured, outcomes):
    tab = visit()
    _walk_into_its_way(tab, until="p.distance < 2.5")
    tab.picture("not-yielding-near")
    believed = [sample["belief"] for sample in tab.charts()]
    tab.until("p.people[0][0] > 2.5")
    tab.page.keyboard.up("ArrowRight")
    tab.picture("not-yielding-passed")
    believed = [sample["belief"] for sample in tab.charts()]
    assert max(believed[:4]) > 0.4
    assert min(believed) < 0.2
    panel = _whole_trip(tab)
    tab.picture("not-yielding-arrived")
    measured["not yielding"] = tab.report() | {
        "lowest_belief": min(believed), "closest_m": panel["closest"],
        "closest_approaching_m": panel["closest_approaching"], "trip_s": panel["times"][0],
    }  # fmt: skip
    assert panel["contacts"] == [0, 0]
    assert panel["closest_approaching"] >= ALLOWED
    outcomes["not yielding"] = panel["times"][0]


def test_a_visitor_who_yields_is_passed_sooner(visit, measured, outcomes):
    tab = visit()
    _walk_into_its_way(tab, until="p.distance < 3.2")
    tab.page.keyboard.up("ArrowRight")
    tab.page.keyboard.down("ArrowLeft")
    tab.until("p.people[0][0] < -2.6")
    tab.page.keyboard.up("ArrowLeft")
    tab.picture("yielding")
    panel = _whole_trip(tab)
    tab.picture("yielding-arrived")
    believed = [sample["belief"] for sample in tab.charts()]
    measured["yielding"] = tab.report() | {
        "highest_belief": max(believed), "closest_m": panel["closest"], "trip_s": panel["times"][0],
    }  # fmt: skip
    assert panel["contacts"] == [0, 0]
    assert panel["closest"] >= ALLOWED
    assert panel["times"][0] < outcomes["not yielding"]


def test_the_words_say_what_the_charts_show(visit):
    tab = visit()
    _walk_into_its_way(tab, until="p.distance < 2.2")
    words = tab.page.locator("#words").inner_text()
    tab.page.keyboard.up("ArrowRight")
    assert "unconcerned" in words or "not reacted" in words or "Not yet clear" in words, words


def test_frame_rate_round_trip_and_planning_time_are_measured(visit, measured):
    tab = visit()
    x, y = tab.on_screen(-4.0, 0.0)
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    for k in range(40):
        tab.page.mouse.move(*tab.on_screen(-4.0 + 0.1 * k, -1.0))
        tab.page.wait_for_timeout(60)
    tab.page.mouse.up()
    figures = tab.report()
    measured["dragging"] = figures
    assert all(value > 0 for value in figures.values())  # reported, not judged: this machine may be busy
