"""The websocket between a page and its world: frames out, steering in."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from concurrent.futures import Executor

from fastapi import APIRouter, WebSocket
from starlette.websockets import WebSocketDisconnect

from sidestep.viewer.live import messages
from sidestep.viewer.live.visits import Visit, Visits
from sidestep.viewer.live.wire import Packet, text

GRACE = 3.0  # s that a world outlives its connection
MOST_MALFORMED = 500  # messages, after which a connection is closed
UNKNOWN, TOO_MUCH, FULL = 4404, 4429, 4503  # closing codes: no such visit; too many malformed messages; no place free

log = logging.getLogger("sidestep.live")


def routes(visits: Visits, workers: Executor) -> APIRouter:
    """Return the websocket route; worlds are advanced by `workers`, so that they never hold up the server."""
    router = APIRouter()

    @router.websocket("/live/stream/{token}")
    async def stream(socket: WebSocket, token: str) -> None:  # pyright: ignore[reportUnusedFunction]
        visit = visits.get(token)
        await socket.accept()
        if visit is None:
            await socket.close(UNKNOWN)
            return
        if not visit.present and visits.full:  # many may have opened the page before the first of them had a world
            await socket.close(FULL)
            return
        visit.connections += 1
        visit.driver = socket  # a page that reconnects may have left a connection behind that is not known to be dead
        listener = asyncio.create_task(_listen(socket, visit))
        try:
            await _play(socket, visit, workers, listener)
        finally:
            listener.cancel()
            visit.connections -= 1
            asyncio.get_running_loop().call_later(GRACE, _free_if_alone, visit)

    return router


async def _listen(socket: WebSocket, visit: Visit) -> None:
    """Take in what the page says until it leaves. What cannot be understood is counted and otherwise ignored."""
    malformed = 0
    while True:
        event = await socket.receive()
        if event["type"] == "websocket.disconnect":
            return
        message = messages.read(event.get("text") or event.get("bytes") or b"")
        if isinstance(message, messages.Ping):
            await socket.send_text(text(type="pong", sent=message.sent))
        elif message is not None:
            if visit.world is not None:
                visit.world.post(message)
        else:
            malformed += 1
            visit.malformed += 1
            if malformed > MOST_MALFORMED:
                await socket.close(TOO_MUCH)
                return


async def _play(socket: WebSocket, visit: Visit, workers: Executor, listener: asyncio.Task[None]) -> None:
    """Advance the world in real time, as long as the page listens; when planning is too slow the world slows down.

    Of several connections of one page the newest advances its world.
    """
    loop = asyncio.get_running_loop()
    due = loop.time()
    while not listener.done() and visit.driver is socket:
        try:
            packets, interval = await loop.run_in_executor(workers, _tick, visit)
        except Exception:  # a fault of ours must not take the server, or other visitors, with it
            log.exception("a visitor's world failed and begins anew")
            visit.free()
            await asyncio.sleep(0.5)
            continue
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            for packet in packets:
                await (socket.send_text(packet) if isinstance(packet, str) else socket.send_bytes(packet))
        now = loop.time()
        took = max(now - due, 0.0)
        due = max(due + interval, now)
        if visit.world is not None:
            visit.world.pace += 0.1 * (min(1.0, interval / max(took, 1e-6)) - visit.world.pace)
        await asyncio.wait([listener], timeout=max(due - now, 0.0))


def _tick(visit: Visit) -> tuple[list[Packet], float]:
    with visit.turn:
        world = visit.world
        if world is None:
            world = visit.enter()
        return world.tick(), world.interval


def _free_if_alone(visit: Visit) -> None:
    if visit.connections == 0:
        visit.free()
