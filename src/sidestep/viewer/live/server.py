"""Serves the live page: binds to the loopback unless asked otherwise, and nothing else than this page."""

from __future__ import annotations

import importlib.util
import ipaddress
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sidestep.errors import InvalidInput, MissingExtra
from sidestep.simulation.record import Record
from sidestep.viewer.live import messages
from sidestep.viewer.live.session import Load, Session, Walls
from sidestep.viewer.live.settings import LiveSettings

LOOPBACK = "127.0.0.1"
LARGEST_MESSAGE = 1 << 20  # bytes, over any websocket
WORKERS = 2  # threads that plan; worlds take turns


@dataclass(frozen=True, slots=True, kw_only=True)
class Shelf:
    """How the page reads and writes files; the command line fills it in.

    Attributes:
        scenarios: names that a visitor may choose from.
        load: name → scenario.
        walls: scenario → its walls, from polygons and map file.
        read_record: path → record.
        write_record: (record, path) → path.
    """

    scenarios: tuple[str, ...]
    load: Load
    walls: Walls
    read_record: Callable[[Path], Record]
    write_record: Callable[[Record, Path], Path]


def serve(
    shelf: Shelf,
    *,
    settings: LiveSettings | None = None,
    record: Record | None = None,
    host: str = LOOPBACK,
    port: int = 8080,
    on_ready: Callable[[str, bool], object] | None = None,
) -> None:
    """Serve the page until interrupted.

    Args:
        shelf: scenarios and records.
        settings: every visitor begins with these.
        record: shown instead of a live world.
        host: address to bind to.
        port: to listen on; 0 takes a free one.
        on_ready: called with the page's address, and whether other machines can reach it, once it listens.

    Raises:
        MissingExtra: NiceGUI is not installed.
        InvalidInput: there is no such host, or the address cannot be bound.
    """
    require()
    import uvicorn

    listening = listen(host, port)
    address = _address(host, listening.getsockname()[1])
    application = build(shelf, settings=settings or LiveSettings(), record=record, host=host)
    if on_ready is not None:
        on_ready(address, not is_loopback(host))
    config = uvicorn.Config(
        application,
        log_level="warning",
        ws="wsproto",
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=2,
    )
    try:
        uvicorn.Server(config).run(sockets=[listening])
    except KeyboardInterrupt:
        pass
    finally:
        listening.close()


def require() -> None:
    """Raise `MissingExtra` where NiceGUI, which brings its server, is not installed."""
    if importlib.util.find_spec("nicegui") is None:
        raise MissingExtra("the live page", "live")


def warm_up(shelf: Shelf, settings: LiveSettings, *, steps: int) -> None:
    """Run a world for `steps` control steps that nobody sees, so that everything is compiled before the first visitor.

    Raises:
        InvalidInput: the scenario does not exist, or is not flat.
    """
    session = Session(load=shelf.load, settings=settings, walls=shelf.walls)
    session.post(messages.Walk(type="walk", direction=(1.0, 0.0)))
    for _ in range(steps):
        session.tick()


def build(shelf: Shelf, *, settings: LiveSettings, record: Record | None, host: str = LOOPBACK) -> Any:
    """Return the ASGI application; one per process, because NiceGUI keeps its own."""
    from fastapi import FastAPI
    from nicegui import ui
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.staticfiles import StaticFiles

    from sidestep.viewer.live.page import Page
    from sidestep.viewer.live.stream import routes
    from sidestep.viewer.live.visits import Visits

    visits = Visits(load=shelf.load, settings=settings, record=record, walls=shelf.walls)
    workers = ThreadPoolExecutor(max_workers=WORKERS, thread_name_prefix="sidestep-live")
    application = FastAPI(title="sidestep", docs_url=None, redoc_url=None, openapi_url=None)
    application.include_router(routes(visits, workers))
    application.mount("/live/assets", StaticFiles(directory=Path(__file__).parent / "assets"))

    @application.get("/live/state")
    def state() -> dict[str, int]:  # pyright: ignore[reportUnusedFunction]
        """How many pages are open, and how many worlds with their planners are held."""
        return {"visits": len(visits), "worlds": visits.worlds}

    if is_loopback(host):  # a page elsewhere that points its own name at this machine gets nothing
        application.add_middleware(TrustedHostMiddleware, allowed_hosts=["127.0.0.1", "localhost", "[::1]"])
    Page(shelf, visits).register()
    ui.run_with(
        application,
        title="sidestep: be the pedestrian",
        favicon=Path(__file__).parent / "assets" / "favicon.svg",
        dark=None,
        reconnect_timeout=5.0,
        tailwind=False,
        show_welcome_message=False,
    )
    return application


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens at `host` and `port`.

    Raises:
        InvalidInput: there is no such host, or the address cannot be bound.
    """
    where = "a name or an address of this machine"
    if not host:  # to the system that means all of them; nobody opens a page to everybody by leaving something out
        raise InvalidInput("--host", host, where, "0.0.0.0 is reachable from everywhere")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(128)  # from now on a browser may knock; it is answered as soon as the server runs
    except socket.gaierror as error:
        listening.close()
        raise InvalidInput("--host", host, where, error.strerror or str(error)) from None
    except (OSError, OverflowError) as error:
        listening.close()
        raise InvalidInput(
            "--port", f"{host}:{port}", "a free port of this machine", f"{error}; --port 0 takes a free one"
        ) from None
    return listening


def _address(host: str, port: int) -> str:
    name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}"


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
