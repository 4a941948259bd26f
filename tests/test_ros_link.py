"""Who drives from afar: the rules, without sockets."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sidestep.ros.link import Link


class Brake:
    """Records what holds the robot."""

    def __init__(self) -> None:
        self.reason = "before the first start"

    def __call__(self, reason: str) -> None:
        self.reason = reason


def linked(timeout: float = 1.0) -> tuple[Link, Brake]:
    brake = Brake()
    return Link(brake, timeout), brake


def test_nothing_moves_before_someone_starts():
    link, brake = linked()
    brake.reason = "waiting"
    link.check(100.0)
    assert brake.reason == "waiting"
    link.sent(1, 100.0)
    assert link.start("a", 1, 100.1) == ""
    assert brake.reason == ""
    assert link.driver == "a"


def test_answers_keep_it_alive_and_silence_ends_it():
    link, brake = linked()
    link.sent(1, 0.0)
    link.start("a", 1, 0.1)
    for k in range(2, 8):
        link.sent(k, 0.5 * k)
        link.beat("a", k)
        link.check(0.5 * k + 0.9)
        assert brake.reason == ""
    link.check(3.5 + 1.1)
    assert brake.reason == "no answer from a for 1.1 s: link lost"
    link.beat("a", 7)
    link.check(3.6)
    assert "link lost" in brake.reason  # coming back is not enough


def test_a_line_that_delays_everything_is_a_lost_line():
    link, brake = linked()
    link.sent(1, 0.0)
    link.start("a", 1, 0.1)
    for k in range(1, 40):  # ten answers a second arrive, each to a state that left long ago
        link.sent(k + 1, 0.1 * k)
        link.beat("a", max(1, k - 15))
        link.check(0.1 * k)
    assert "link lost" in brake.reason
    assert link.start("a", 20, 4.0).startswith("the link is slower")


def test_answers_to_states_that_were_never_sent_are_no_answers():
    link, brake = linked()
    link.sent(1, 0.0)
    link.start("a", 1, 0.1)
    link.beat("a", 999)
    link.check(1.5)
    assert "link lost" in brake.reason


def test_one_drives_others_watch_and_anyone_may_stop():
    link, brake = linked()
    link.sent(1, 0.0)
    link.start("a", 1, 0.0)
    assert link.start("b", 1, 0.1) == "a is driving"
    link.gone("b")
    assert brake.reason == ""
    link.stop("b")
    assert brake.reason == "stopped by b"
    assert link.start("b", 1, 0.2) == ""


def test_a_driver_who_hangs_up_stops_the_robot():
    link, brake = linked()
    link.sent(1, 0.0)
    link.start("a", 1, 0.0)
    link.gone("a")
    assert brake.reason == "a has gone"


@given(st.lists(st.tuples(st.sampled_from(["sent", "beat", "start", "stop", "gone", "pause"]), st.integers(0, 3))))
def test_whatever_happens_the_robot_only_moves_under_a_driver_who_answered_in_time(events):
    link, brake = linked(timeout=1.0)
    now, number, left = 0.0, 0, {}
    answered = -10.0
    for what, amount in events:
        now += 0.25 * amount
        if what == "sent":
            number += 1
            left[number] = now
            link.sent(number, now)
        elif what == "beat":
            link.beat("a", number - amount)
            answered = max(answered, left.get(number - amount, -10.0))
        elif what == "start" and link.start("a", number, now) == "":
            answered = max(answered, left[number])
        elif what == "stop":
            link.stop("b")
        elif what == "gone":
            link.gone("a")
        link.check(now)
        if brake.reason == "":
            assert link.driver == "a"
            assert now - answered <= 1.0 + 1e-9


@pytest.mark.parametrize("timeout", [0.3, 2.0])
def test_the_timeout_is_the_one_that_was_set(timeout):
    link, brake = linked(timeout)
    link.sent(1, 0.0)
    link.start("a", 1, 0.0)
    link.check(timeout - 0.01)
    assert brake.reason == ""
    link.check(timeout + 0.01)
    assert "link lost" in brake.reason
