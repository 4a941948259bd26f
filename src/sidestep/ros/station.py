"""The operator's end of the remote control. Needs neither ROS nor any package beyond the standard library."""

from __future__ import annotations

import contextlib
import json
import queue
import socket
import threading
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Self

_CONNECTING = 5.0  # s


class Refused(Exception):  # noqa: N818 (reads as a sentence where it is caught)
    """The robot did not do it; the text says why."""


class LinkLost(Exception):  # noqa: N818
    """The robot does not answer."""


class Station:
    """A connection to one robot. Answers every state at once, which keeps the link alive while this process lives.

    Args:
        host: of the robot; port: TCP.
        token: where the robot wants one.

    Raises:
        LinkLost: nobody answers there.
        Refused: the robot does not want this station.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 7070, *, token: str = "") -> None:
        self._address = f"{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout=_CONNECTING)
        except OSError as error:
            raise self._lost(error.strerror or error) from error
        self._lines = self._socket.makefile("rb")
        self._writing = threading.Lock()
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        self._state: dict[str, Any] | None = None
        self._heard = time.monotonic()
        self._news = threading.Condition()
        self._ended = False
        self._reader = threading.Thread(target=self._read, name="station", daemon=True)
        self.link_timeout = self._greet(token)
        """s without an answer, after which the robot stops."""
        self._reader.start()

    def start(self) -> None:
        """Let the robot drive; it stops when this station falls silent."""
        self.wait_for_state()
        self._ask({"type": "start"})

    def stop(self) -> None:
        """Make the robot stand."""
        self._ask({"type": "stop"})

    def goal(self, x: float, y: float) -> None:
        """Send the robot to (x, y) m in its planning frame."""
        self._ask({"type": "goal", "position": [x, y]})

    @property
    def silence(self) -> float:
        """Seconds since the robot was last heard of."""
        return time.monotonic() - self._heard

    @property
    def state(self) -> dict[str, Any] | None:
        """Latest state, or None before the first."""
        return self._state

    def states(self) -> Iterator[dict[str, Any]]:
        """Yield states as they come, skipping those that came while the caller was busy.

        Raises:
            LinkLost: the robot has not been heard of for the link's timeout, or has hung up.
        """
        last = -1
        while True:
            state = self._after(last)
            last = int(state["number"])
            yield state

    def wait_for_state(self) -> dict[str, Any]:
        """Return the next state."""
        return next(self.states())

    def close(self) -> None:
        """Hang up; a robot that this station drives stops."""
        with contextlib.suppress(OSError):  # gone already
            self._socket.shutdown(socket.SHUT_RDWR)
        if self._reader.ident is not None:
            self._reader.join(timeout=_CONNECTING)
        self._lines.close()
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _lost(self, why: object) -> LinkLost:
        return LinkLost(f"{self._address}: {why}")

    def _not_done(self, why: object) -> Refused:
        return Refused(f"{self._address}: {why}")

    def _greet(self, token: str) -> float:
        try:
            self._send({"type": "hello", "token": token})
            welcome = self._next()
            if welcome.get("type") != "welcome":
                raise self._not_done(welcome.get("reason", "not a robot of ours"))
        except (LinkLost, Refused):
            self.close()
            raise
        self._socket.settimeout(None)
        return float(welcome["link_timeout"])

    def _after(self, number: int) -> dict[str, Any]:
        def newer() -> bool:
            return self._state is not None and int(self._state["number"]) > number

        with self._news:
            self._news.wait_for(lambda: self._ended or newer(), timeout=self.link_timeout)
            if self._state is None or not newer():
                raise self._lost("the robot has hung up" if self._ended else f"silent for {self.silence:.1f} s")
            return self._state

    def _ask(self, question: dict[str, Any]) -> None:
        self._send(question)
        answer: dict[str, Any] = {}
        while answer.get("of") != question["type"]:  # an answer may come after its asker has given up
            try:
                answer = self._answers.get(timeout=self.link_timeout)
            except queue.Empty:
                raise self._lost(f"no answer to {question['type']!r}") from None
        if answer["type"] == "refused":
            raise self._not_done(answer.get("reason"))

    def _send(self, message: dict[str, Any]) -> None:
        with self._writing:
            try:
                self._socket.sendall(json.dumps(message).encode() + b"\n")
            except OSError as error:
                raise self._lost(error) from error

    def _next(self) -> dict[str, Any]:
        try:
            line = self._lines.readline()
            return json.loads(line) if line else {}
        except (OSError, ValueError) as error:
            raise self._lost(error) from error

    def _read(self) -> None:
        try:
            while message := self._next():
                self._heard = time.monotonic()
                if message.get("type") != "state":
                    self._answers.put(message)
                    continue
                self._send({"type": "seen", "number": message["number"]})
                with self._news:
                    self._state = message
                    self._news.notify_all()
        except LinkLost:
            pass
        finally:
            with self._news:
                self._ended = True
                self._news.notify_all()
