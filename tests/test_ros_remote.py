"""A second computer starts, stops, gives goals and watches; when its link is lost, the robot stops."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sidestep.cli import execute
from sidestep.ros.station import LinkLost, Refused, Station

HERE = Path(__file__).parent
SLACK = 10.0  # s, for a busy machine; only bounds how long a test waits for what must happen
STATION = """
import json, sys, time
from sidestep.ros.station import Station
with Station(sys.argv[1], int(sys.argv[2]), token=sys.argv[3]) as station:
    station.goal(100.0, 0.0)
    station.start()
    print("started", flush=True)
    time.sleep(3600)
"""


class RobotProcess:
    """`remote_robot.py`, and what it prints."""

    def __init__(self, before: tuple[str, ...] = (), **options: Any) -> None:
        self.process = subprocess.Popen(
            [*before, sys.executable, str(HERE / "remote_robot.py"), json.dumps(options)],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(HERE)},
        )
        assert self.process.stdout is not None
        first = self.process.stdout.readline()
        if not first:
            self.close()
            raise AssertionError("the robot did not start")
        self.port = json.loads(first)["port"]
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self._lines.put(json.loads(line))

    def now(self) -> dict[str, Any]:
        """The latest line."""
        told = self._lines.get(timeout=SLACK)
        with contextlib.suppress(queue.Empty):
            while True:
                told = self._lines.get_nowait()
        return told

    def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Wait for a line like that."""
        ending = time.monotonic() + SLACK
        while time.monotonic() < ending:
            told = self._lines.get(timeout=SLACK)
            if wanted(told):
                return told
        raise AssertionError("it did not happen")

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


@pytest.fixture(scope="module")
def shared() -> Iterator[RobotProcess]:
    process = RobotProcess()
    yield process
    process.close()


@pytest.fixture
def robot(shared) -> RobotProcess:
    """A robot that nobody drives."""
    shared.now()
    shared.until(lambda told: standing(told) and "driving" not in told["why"])
    return shared


def station_process(host: str, port: int, token: str = "", before: tuple[str, ...] = ()) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [*before, sys.executable, "-c", STATION, host, str(port), token], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    if process.stdout.readline() != "started\n":
        end(process)
        raise AssertionError("the station did not start")
    return process


def end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


def driving(told: dict[str, Any]) -> bool:
    return told["forward"] > 0


def standing(told: dict[str, Any]) -> bool:
    return told["forward"] == 0


def test_start_goal_watch_stop(robot):
    with Station(port=robot.port) as station:
        assert station.wait_for_state()["activity"] != "driving"
        station.goal(100.0, 0.0)
        station.start()
        robot.until(driving)
        state = next(s for s in station.states() if s["activity"] == "driving")
        assert state["goal"] == [100.0, 0.0]
        assert state["status"] == "certified"
        assert len(state["plan"]) == 4
        assert state["rates"]["odom"] > 0
        station.stop()
        assert "stopped by station 127.0.0.1" in robot.until(standing)["why"] or robot.until(
            lambda told: "stopped by" in told["why"]
        )


def test_hanging_up_stops_the_robot(robot):
    with Station(port=robot.port) as station:
        station.goal(100.0, 0.0)
        station.start()
        robot.until(driving)
    robot.until(standing)
    robot.until(lambda told: "has gone" in told["why"])


def test_a_station_that_freezes_stops_the_robot_and_must_start_again(robot):
    station = station_process("127.0.0.1", robot.port)
    try:
        robot.until(driving)
        robot.now()
        os.kill(station.pid, signal.SIGSTOP)
        frozen = time.monotonic()
        stopped = robot.until(standing)
        assert stopped["at"] - frozen > 0.3  # not before its time: states answered just before still count
        robot.until(lambda told: "link lost" in told["why"])
        os.kill(station.pid, signal.SIGCONT)
        time.sleep(1.0)
        assert standing(robot.now())
        with Station(port=robot.port) as another:
            another.start()
            robot.until(driving)
    finally:
        end(station)


class Proxy:
    """A cable that can be pulled: bytes wait inside while it is."""

    def __init__(self, port: int) -> None:
        self._target = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.plugged = threading.Event()
        self.plugged.set()
        self._sockets: list[socket.socket] = [self._listener]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            near, _ = self._listener.accept()
            far = socket.create_connection(("127.0.0.1", self._target))
            self._sockets += [near, far]
            for a, b in ((near, far), (far, near)):
                threading.Thread(target=self._carry, args=(a, b), daemon=True).start()

    def _carry(self, source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                self.plugged.wait()
                target.sendall(data)

    def close(self) -> None:
        self.plugged.set()
        for each in self._sockets:
            each.close()


def test_an_interrupted_link_stops_the_robot_and_its_return_does_not_set_it_off(robot):
    proxy = Proxy(robot.port)
    station = Station(port=proxy.port)
    try:
        station.goal(100.0, 0.0)
        station.start()
        robot.until(driving)
        robot.now()
        proxy.plugged.clear()
        assert robot.until(lambda told: "link lost" in told["why"])["forward"] == 0
        with pytest.raises(LinkLost):
            for _ in station.states():
                pass
        place = robot.now()["x"]
        proxy.plugged.set()  # everything that waited in the cable arrives at once
        time.sleep(0.5)
        assert standing(robot.now())
        assert robot.now()["x"] == place
        station.start()
        robot.until(driving)
    finally:
        station.close()
        proxy.close()


def test_two_stations_one_drives_both_may_stop(robot):
    with Station(port=robot.port) as driver, Station(port=robot.port) as watcher:
        driver.goal(100.0, 0.0)
        driver.start()
        robot.until(driving)
        with pytest.raises(Refused, match="is driving"):
            watcher.start()
        with pytest.raises(Refused, match="is driving"):
            watcher.goal(0.0, 0.0)
        watcher.stop()
        robot.until(standing)


@pytest.mark.parametrize(
    "position",
    [[1.0], [1.0, "a"], [1.0, None], "12", None, [True, False], [float("nan"), 0.0], [1e300, 0.0], [10**400, 0]],
)
def test_goals_that_are_no_places_are_refused(robot, position):
    with Station(port=robot.port) as station, pytest.raises(Refused, match="two finite numbers"):
        station._ask({"type": "goal", "position": position})


NONSENSE = [
    b"\n",
    b"[]\n",
    b"{}\n",
    b"\xff\xfe\n",
    b"x" * 100_000,
    b'{"type": "start"}\n',
    b'{"type": "hello"',
    b"",
    b"[" * 4000 + b"\n",
]


def test_nonsense_does_not_disturb_whoever_drives(robot):
    with Station(port=robot.port) as station:
        station.goal(100.0, 0.0)
        station.start()
        robot.until(driving)
        for bad in NONSENSE:
            with socket.create_connection(("127.0.0.1", robot.port)) as intruder, contextlib.suppress(OSError):
                intruder.sendall(bad)
        time.sleep(0.3)
        assert driving(robot.now())


def test_a_wrong_token_is_turned_away():
    robot = RobotProcess(token="open sesame")
    try:
        with pytest.raises(Refused, match="wrong token"):
            Station(port=robot.port, token="open barley")
        with Station(port=robot.port, token="open sesame") as station:
            station.wait_for_state()
    finally:
        robot.close()


def test_nobody_there_is_said_in_one_line():
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(LinkLost, match=f"127.0.0.1:{port}"):
        Station(port=port)


def test_the_command_names_once_whom_it_cannot_reach(capsys):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    assert execute(["remote", f"127.0.0.1:{port}"]) == 1
    assert capsys.readouterr().err == f"sidestep: 127.0.0.1:{port}: Connection refused\n"


def test_a_goal_beside_stop_is_refused(capsys):
    assert execute(["remote", "--stop", "--goal", "4", "0"]) == 2
    assert "--goal: got (4.0, 0.0); allowed: only without --stop" in capsys.readouterr().err


def test_it_listens_on_the_loopback_only(robot):
    listening = Path("/proc/net/tcp").read_text() if Path("/proc/net/tcp").exists() else pytest.skip("no /proc")
    found = [line.split()[1] for line in listening.splitlines()[1:] if line.split()[3] == "0A"]
    assert f"0100007F:{robot.port:04X}" in found
    assert f"00000000:{robot.port:04X}" not in found


class Network:
    """Two network namespaces joined by a cable, as two computers are."""

    def __init__(self) -> None:
        self.names = [f"sidestep-{side}-{os.getpid()}" for side in ("robot", "station")]
        self.cables = [f"v{side}{os.getpid()}"[:15] for side in ("r", "s")]

    def __enter__(self) -> Network:
        if shutil.which("ip") is None or os.geteuid() != 0:
            pytest.skip("network namespaces need root and iproute2")
        if subprocess.run(["ip", "netns", "add", self.names[0]], capture_output=True).returncode:
            pytest.skip("network namespaces are not allowed here")
        self._ip("netns", "add", self.names[1])
        self._ip("link", "add", self.cables[0], "type", "veth", "peer", "name", self.cables[1])
        for number, (name, cable) in enumerate(zip(self.names, self.cables, strict=True), start=1):
            self._ip("link", "set", cable, "netns", name)
            self._ip("-n", name, "address", "add", f"10.99.0.{number}/24", "dev", cable)
            self._ip("-n", name, "link", "set", cable, "up")
            self._ip("-n", name, "link", "set", "lo", "up")
        return self

    def __exit__(self, *_: object) -> None:
        for name in self.names:
            subprocess.run(["ip", "netns", "del", name], capture_output=True)

    def cable(self, state: str) -> None:
        """Plug ("up") or pull ("down") it."""
        self._ip("-n", self.names[1], "link", "set", self.cables[1], state)

    def inside(self, side: int) -> tuple[str, ...]:
        """How a command runs on one of the computers."""
        return ("ip", "netns", "exec", self.names[side])

    def _ip(self, *arguments: str) -> None:
        subprocess.run(["ip", *arguments], check=True, capture_output=True)


def test_two_computers_and_a_pulled_cable():
    with Network() as network:
        robot = RobotProcess(network.inside(0), host="10.99.0.1", token="open sesame")
        station = None
        try:
            station = station_process("10.99.0.1", robot.port, "open sesame", network.inside(1))
            robot.until(driving)
            robot.now()
            network.cable("down")
            pulled = time.monotonic()
            stopped = robot.until(standing)
            assert stopped["at"] - pulled > 0.3
            robot.until(lambda told: "link lost" in told["why"])
            network.cable("up")
            time.sleep(1.0)
            assert standing(robot.now())
        finally:
            robot.close()
            if station is not None:
                end(station)
