"""Processes of one ROS graph on the loopback: master (ROS 1), node, world."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import socket
import subprocess
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PROJECT = HERE.parents[1]
PATIENCE = 120.0  # s; bounds a wait on a busy machine, promises nothing
COLD = 900.0  # s; the same where a node may have to compile its kernels first

BASE = {
    "robot": {"kind": "differential", "max_speed": 0.6, "radius": 0.18, "goal_tolerance": 0.25},
    "planner": {"horizon": 6},
    "node": {
        "people_from": "poses",
        "planner_rate": 5.0,
        "control_rate": 20.0,
        "timeout": 1.0,
        "diagnostics_rate": 5.0,
    },
}


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    both = dict(base)
    for key, value in over.items():
        both[key] = merged(both[key], value) if isinstance(value, dict) and key in both else value
    return both


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


class Process:
    """A child whose lines are read as they come."""

    def __init__(self, command: list[str], environment: dict[str, str], log: Path) -> None:
        self._log = log.open("wb")
        self.log = log
        self.child = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            cwd=HERE,
            start_new_session=True,
        )
        self.lines: queue.Queue[dict[str, Any]] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.child.stdout is not None
        for line in self.child.stdout:
            with contextlib.suppress(ValueError):
                told = json.loads(line)
                if isinstance(told, dict):
                    self.lines.put(told)

    def order(self, **what: Any) -> None:
        assert self.child.stdin is not None
        self.child.stdin.write(json.dumps(what).encode() + b"\n")
        self.child.stdin.flush()

    def end(self) -> None:
        """Ask, then insist; the whole session."""
        if self.child.poll() is None:
            self.child.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.child.wait(timeout=10)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.child.pid, signal.SIGKILL)
        self.child.wait()
        for pipe in (self.child.stdin, self.child.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        self._log.close()

    def said(self) -> str:
        return self.log.read_text(errors="replace")


class Stack:
    """One graph; `dialect` 1 or 2."""

    def __init__(self, dialect: int, folder: Path) -> None:
        self.dialect = dialect
        self.folder = folder
        self.python = str(PROJECT / f".venv-ros{dialect}" / "bin" / "python")
        self.environment = os.environ | {
            "PYTHONPATH": f"{HERE}:{PROJECT / 'src'}",
            "PYTHONUNBUFFERED": "1",
            "NUMBA_NUM_THREADS": "1",
            "ROS_HOME": str(folder),
            "ROS_LOG_DIR": str(folder),
        }
        if dialect == 1:
            # The system's python3 first: roscore and roslaunch look for `python3` on the path.
            self.environment |= {"PATH": f"/usr/bin:{os.environ['PATH']}", "ROS_IP": "127.0.0.1"}
        self.environment.pop("VIRTUAL_ENV", None)
        self.processes: list[Process] = []
        self.node: Process | None = None
        self.parameters: dict[str, Any] | None = None

    def __enter__(self) -> Stack:
        if self.dialect == 1:
            port = free_port()
            self.environment["ROS_MASTER_URI"] = f"http://127.0.0.1:{port}"
            self._start(["roscore", "-p", str(port)], "roscore")
            self._until(lambda: self._master(lambda m: m.getPid("/test")), "roscore does not come up")
        else:
            self.environment |= {
                "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            }
        return self

    def __exit__(self, *_: object) -> None:
        for process in reversed(self.processes):
            process.end()

    def start_world(self, **options: Any) -> Process:
        if self.dialect == 1:
            self._master(lambda m: m.setParam("/test", "/world", options or {"tf": False}))
        self.world = self._start([self.python, str(HERE / f"world{self.dialect}.py")], "world")
        return self.world

    def underway(self, parameters: dict[str, Any] | None = None, people: Any = (), eyes: str = "people") -> None:
        """Put the world back to its beginning and wait until the robot moves toward (4, 0)."""
        self.order(do="reset", eyes=eyes)
        self.order(do="enable", on=True)
        self.have_node(parameters)
        self.until(
            lambda told: told.get("diagnostics") and "no odom" not in message(told), "the node does not get ready", COLD
        )
        self.order(do="people", people=list(people))
        self.order(do="goal", at=[4.0, 0.0])
        asked = time.monotonic()
        for told in self.watch(COLD):
            if moving(told):
                return
            if time.monotonic() - asked > 5.0 and "no goal" in message(told):  # sent before the node was discovered
                self.order(do="goal", at=[4.0, 0.0])
                asked = time.monotonic()
        raise AssertionError("the robot does not set off")

    def have_node(self, parameters: dict[str, Any] | None = None) -> None:
        """Keep the node if it was started with these parameters and lives, else start it anew."""
        alive = self.node is not None and self.node.child.poll() is None
        if alive and self.parameters == parameters:
            return
        if self.node is not None:
            self.node.end()
        self.start_node(parameters)

    def start_node(self, parameters: dict[str, Any] | None = None) -> Process:
        self.parameters = parameters
        settings = merged(BASE, parameters or {})
        command = [self.python, "-m", f"sidestep.ros.ros{self.dialect}"]
        if self.dialect == 1:
            self._master(lambda m: m.setParam("/test", "/sidestep", settings))
        else:
            file = self.folder / "parameters.yaml"
            file.write_text(json.dumps({"sidestep": {"ros__parameters": settings}}))  # JSON is YAML
            command += ["--ros-args", "--params-file", str(file)]
        self.node = self._start(command, "node")
        return self.node

    def order(self, **what: Any) -> None:
        self.world.order(**what)

    def now(self) -> dict[str, Any]:
        """What the world looks like, not older than this call."""
        asked = time.monotonic()
        return self.until(lambda told: told["at"] >= asked, "the world is silent")

    def until(
        self, wanted: Callable[[dict[str, Any]], Any], otherwise: str, patience: float = PATIENCE
    ) -> dict[str, Any]:
        """Wait until the world looks like that."""
        told: dict[str, Any] = {}
        for told in self.watch(patience):
            if wanted(told):
                return told
        raise AssertionError(
            f"{otherwise}; last seen: {told}\n--- node ---\n{self.node.said()[-3000:] if self.node else ''}"
        )

    def watch(self, seconds: float) -> Iterator[dict[str, Any]]:
        """What the world looks like, as it changes, for so long."""
        ending = time.monotonic() + seconds
        while time.monotonic() < ending:
            with contextlib.suppress(queue.Empty):
                yield self.world.lines.get(timeout=0.5)

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, env=self.environment, capture_output=True, text=True, timeout=PATIENCE, cwd=self.folder
        )

    def _start(self, command: list[str], name: str) -> Process:
        process = Process(command, self.environment, self.folder / f"{name}-{len(self.processes)}.log")
        self.processes.append(process)
        return process

    def _master(self, ask: Callable[[Any], Any]) -> Any:
        with xmlrpc.client.ServerProxy(self.environment["ROS_MASTER_URI"]) as master:
            return ask(master)

    @staticmethod
    def _until(attempt: Callable[[], Any], otherwise: str) -> None:
        ending = time.monotonic() + PATIENCE
        while time.monotonic() < ending:
            with contextlib.suppress(OSError):
                attempt()
                return
            time.sleep(0.1)
        raise AssertionError(otherwise)


def standing(told: dict[str, Any]) -> bool:
    return told["command"] == [0.0, 0.0, 0.0]


def moving(told: dict[str, Any]) -> bool:
    return not standing(told)


def message(told: dict[str, Any]) -> str:
    return told.get("diagnostics", {}).get("message", "")
