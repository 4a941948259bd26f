"""The robot's end of the remote control: JSON, one object per line, over TCP.

From a station:  {"type": "hello", "token": …}   first of all
                 {"type": "seen", "number": n}   for every state, at once: this keeps the link alive
                 {"type": "start"}   {"type": "stop"}   {"type": "goal", "position": [x, y]}
To a station:    {"type": "welcome", "link_timeout": s, "state_rate": Hz}
                 {"type": "state", "number": n, …} (see `Report.as_json`), at the state rate
                 {"type": "done", "of": …}   or   {"type": "refused", "of": …, "reason": …}

One station drives, any may watch, any may stop. Nothing a station sends can make the node fail or wait.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import logging
import threading
import time
from collections.abc import Callable
from typing import Any

from sidestep.ros.link import Link
from sidestep.ros.settings import RemoteSettings
from sidestep.types import LARGEST

_LOG = logging.getLogger(__name__)
_LONGEST_LINE = 4096  # bytes; nobody has more to say
_MOST_STATIONS = 8
_UNREAD = 200_000  # bytes; a station that does not read this much gets no more until it does
_PATIENCE = 5.0  # s for the greeting
_SILENCE = 10.0  # s, after which a station that answers no state is taken for dead and its place freed


class RemoteServer:
    """Listens for stations in a thread of its own.

    Args:
        settings: where to listen.
        link: who drives.
        goal: called with (x, y) m in the planning frame.
        state: returns what stations are told.
    """

    def __init__(
        self,
        settings: RemoteSettings,
        *,
        link: Link,
        goal: Callable[[float, float], None],
        state: Callable[[], dict[str, Any]],
    ) -> None:
        self._settings = settings
        self._link = link
        self._goal = goal
        self._state = state
        self._stations: dict[str, asyncio.StreamWriter] = {}
        self._number = 0
        self._loop = asyncio.new_event_loop()
        self._up: threading.Event = threading.Event()
        self._failure: OSError | None = None
        self._ending = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="remote", daemon=True)
        self.port = settings.port
        """TCP port, once started."""

    def start(self) -> None:
        """Listen.

        Raises:
            OSError: the address cannot be listened on.
        """
        self._thread.start()
        self._up.wait()
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """Stop listening and hang up."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ending.set)
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        try:
            server = await asyncio.start_server(
                self._meet, self._settings.host, self._settings.port, limit=_LONGEST_LINE
            )
        except OSError as error:
            self._failure = error
            self._up.set()
            return
        self.port = int(server.sockets[0].getsockname()[1])
        self._up.set()
        telling = asyncio.create_task(self._tell())
        await self._ending.wait()
        telling.cancel()
        server.close()
        for writer in list(self._stations.values()):
            writer.close()

    async def _tell(self) -> None:
        while True:
            await asyncio.sleep(1.0 / self._settings.state_rate)
            if not self._stations:
                continue
            self._number += 1
            try:
                state = self._state()
            except Exception:  # a report must not end the service
                _LOG.exception("no state for the stations")
                continue
            line = _line({"type": "state", "number": self._number, "driver": self._link.driver, **state})
            self._link.sent(self._number, time.monotonic())
            for writer in list(self._stations.values()):
                if writer.transport.get_write_buffer_size() < _UNREAD:
                    writer.write(line)

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        who = "station " + ":".join(str(part) for part in writer.get_extra_info("peername")[:2])
        try:
            hello = _parsed(await asyncio.wait_for(reader.readline(), _PATIENCE))
            reason = self._unwelcome(hello)
            if reason:
                writer.write(_line({"type": "refused", "of": "hello", "reason": reason}))
                return
            settings = self._settings
            writer.write(
                _line({"type": "welcome", "link_timeout": settings.link_timeout, "state_rate": settings.state_rate})
            )
            self._stations[who] = writer
            await self._listen(who, reader, writer)
        except (TimeoutError, OSError, ValueError, RecursionError, asyncio.IncompleteReadError):
            pass  # hung up, or talks nonsense: for the robot the same
        finally:
            self._stations.pop(who, None)
            self._link.gone(who)
            writer.close()

    def _unwelcome(self, hello: dict[str, Any]) -> str:
        if hello.get("type") != "hello":
            return "say hello first"
        if not hmac.compare_digest(str(hello.get("token", "")).encode(), self._settings.token.encode()):
            return "wrong token"
        return "too many stations" if len(self._stations) >= _MOST_STATIONS else ""

    async def _listen(self, who: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        seen = -1
        while line := await asyncio.wait_for(reader.readline(), _SILENCE):
            told = _parsed(line)
            kind = told.get("type")
            if kind == "seen" and isinstance(told.get("number"), int):
                seen = told["number"]
                self._link.beat(who, seen)
                continue
            reason = self._obey(who, kind, told, seen)
            answer = {"type": "refused", "of": kind, "reason": reason} if reason else {"type": "done", "of": kind}
            writer.write(_line(answer))

    def _obey(self, who: str, kind: object, told: dict[str, Any], seen: int) -> str:
        """Do what a station asks; return why not, or ""."""
        if kind == "stop":
            self._link.stop(who)
            return ""
        if kind == "start":
            return self._link.start(who, seen, time.monotonic())
        if kind != "goal":
            return "unknown; one of hello, seen, start, stop, goal"
        if self._link.driver not in (None, who):
            return f"{self._link.driver} is driving"
        position = told.get("position")
        if not (isinstance(position, list) and len(position) == 2 and all(map(_is_number, position))):
            return "position must be two finite numbers (m)"
        self._goal(float(position[0]), float(position[1]))
        return ""


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _line(value: dict[str, Any]) -> bytes:
    return json.dumps(value, allow_nan=False).encode() + b"\n"


def _parsed(line: bytes) -> dict[str, Any]:
    value = json.loads(line)
    if not isinstance(value, dict):
        raise ValueError("not an object")
    return value
