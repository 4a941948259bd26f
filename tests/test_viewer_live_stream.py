"""The websocket between page and world, over a real server on the loopback: nothing that arrives does harm."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress

import pytest

pytest.importorskip("nicegui", reason="the live page is an extra: pip install 'sidestep[live]'")

import uvicorn
from fastapi import FastAPI
from simple_websocket import Client, ConnectionClosed

from made_records import made_record
from sidestep.errors import InvalidInput
from sidestep.io.scenarios import load_scenario
from sidestep.viewer.live import server, stream
from sidestep.viewer.live import visits as visits_module
from sidestep.viewer.live.settings import LiveSettings
from sidestep.viewer.live.visits import Visits


class House:
    """Visitors of a record, which needs no planner, behind a server of their own."""

    def __init__(self, visits, port):
        self.visits = visits
        self.port = port

    @contextmanager
    def enter(self, token):
        page = Client.connect(f"ws://127.0.0.1:{self.port}/live/stream/{token}")
        try:
            yield page
        finally:
            with suppress(ConnectionClosed):
                page.close()


@pytest.fixture
def house():
    visits = Visits(load=load_scenario, settings=LiveSettings(), record=made_record())
    bound = server.listen(server.LOOPBACK, 0)
    with ThreadPoolExecutor(2) as workers, bound:
        application = FastAPI()
        application.include_router(stream.routes(visits, workers))
        serving = uvicorn.Server(uvicorn.Config(application, log_level="error", ws="wsproto", lifespan="off"))
        thread = threading.Thread(target=serving.run, kwargs={"sockets": [bound]})
        thread.start()
        yield House(visits, bound.getsockname()[1])
        serving.should_exit = True
        thread.join()


def _until(page, kind):
    for _ in range(200):
        packet = page.receive(timeout=20)
        message = json.loads(packet) if isinstance(packet, str) else {"type": "plan"}
        if message["type"] == kind:
            return message
    raise AssertionError(f"no {kind} came")


def test_frames_flow_and_a_ping_is_answered(house):
    with house.enter(house.visits.admit()) as page:
        assert _until(page, "scene")["mode"] == "record"
        assert _until(page, "frame")["index"] == 0
        page.send('{"type":"ping","sent":12.5}')
        assert _until(page, "pong")["sent"] == 12.5


def test_malformed_messages_do_no_harm(house):
    token = house.visits.admit()
    with house.enter(token) as page:
        _until(page, "frame")
        for nonsense in (
            "",
            "{",
            "null",
            '{"type":"walk"}',
            '{"type":"seek","index":"; DROP"}',
            "\x00" * 100,
            "9" * 5000,
        ):
            page.send(nonsense)
        page.send(b"\xff\xfe\x00")
        page.send('{"type":"seek","index":5}')
        for _ in range(40):
            if _until(page, "frame")["index"] == 5:
                break
        else:
            raise AssertionError("the honest message was not heard")
    assert house.visits.get(token).malformed == 8


def test_a_flood_of_malformed_messages_is_shown_the_door(house):
    with house.enter(house.visits.admit()) as page:
        for _ in range(stream.MOST_MALFORMED + 1):
            page.send("nonsense")
        with pytest.raises(ConnectionClosed) as closed:
            _until(page, "never")
    assert closed.value.reason == stream.TOO_MUCH


def test_many_who_open_the_page_at_once_get_no_more_worlds_than_there_are_places(house, monkeypatch):
    """A class does that: each has the page before the first of them has a world."""
    monkeypatch.setattr(visits_module, "MOST_VISITORS", 3)
    monkeypatch.setattr(stream, "GRACE", 0.05)
    tokens = [house.visits.admit() for _ in range(5)]
    with ExitStack() as open_pages:
        for token in tokens[:3]:
            _until(open_pages.enter_context(house.enter(token)), "frame")
        for token in tokens[3:]:
            with house.enter(token) as page, pytest.raises(ConnectionClosed):
                page.receive(timeout=20)
        assert house.visits.worlds == 3
        assert house.visits.admit() is None
    while house.visits.worlds:
        time.sleep(0.05)
    with house.enter(tokens[4]) as page:  # who goes on trying gets in
        _until(page, "frame")


def test_nobody_gets_in_without_a_token(house):
    with house.enter("guess") as page, pytest.raises(ConnectionClosed):
        page.receive(timeout=20)


def test_visitors_scrub_independently(house):
    first, second = house.visits.admit(), house.visits.admit()
    with house.enter(first) as one, house.enter(second) as two:
        one.send('{"type":"seek","index":9}')
        for _ in range(40):
            if _until(one, "frame")["index"] == 9:
                break
        assert house.visits.get(first).world.index == 9
        assert _until(two, "frame")["index"] == 0


def test_a_page_that_connects_again_does_not_run_twice_as_fast(house):
    """A connection that broke on its way is not known to be dead for a while; only the newest one counts."""
    token = house.visits.admit()
    with house.enter(token) as old:
        _until(old, "frame")
        with house.enter(token) as new:
            _until(new, "frame")
            with pytest.raises(ConnectionClosed):
                _until(old, "never")
            new.send('{"type":"seek","index":9}')
            while _until(new, "frame")["index"] != 9:
                pass
    assert house.visits.get(token).world.index == 9


def test_a_world_is_freed_when_its_page_is_gone(house, monkeypatch):
    monkeypatch.setattr(stream, "GRACE", 0.05)
    token = house.visits.admit()
    with house.enter(token) as page:
        _until(page, "frame")
        assert house.visits.worlds == 1
    for _ in range(100):
        if house.visits.worlds == 0:
            break
        time.sleep(0.05)
    assert house.visits.worlds == 0
    with house.enter(token) as page:  # and made anew when it comes back
        assert _until(page, "frame")["index"] == 0


def test_a_world_that_fails_begins_anew_and_the_server_goes_on(house, caplog):
    token = house.visits.admit()
    visit = house.visits.get(token)
    with house.enter(token) as page:
        _until(page, "frame")
        broken = visit.world
        broken.tick = lambda: 1 / 0
        _until(page, "scene")
    assert visit.world is not broken
    assert "begins anew" in caplog.text


@pytest.mark.parametrize("host", ["", "no such host"])
def test_a_host_that_is_none_is_named(host):
    with pytest.raises(InvalidInput, match="--host: got"):
        server.listen(host, 0)


def test_a_port_in_use_is_one_line():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InvalidInput, match=f"--port: got '127.0.0.1:{port}'"):
            server.listen("127.0.0.1", port)


def test_nothing_but_the_loopback_is_listened_to_unless_asked():
    bound = server.listen(server.LOOPBACK, 0)
    assert bound.getsockname()[0] == "127.0.0.1"
    bound.close()


@pytest.mark.parametrize(
    ("host", "answer"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("127.8.9.1", True), ("0.0.0.0", False), ("::", False)],
)
def test_which_addresses_are_the_loopback(host, answer):
    assert server.is_loopback(host) is answer


def test_what_draws_is_there_before_two_visitors_ask_for_pictures_at_once():
    """Imported by two threads at once for the first time, matplotlib is found half made by one of them."""
    program = (
        "import sys, sidestep.viewer.live.page\n"
        "sys.exit(not {'sidestep.viewer.figures', 'sidestep.viewer.animation'} <= set(sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", program], timeout=120, check=False).returncode == 0
