"""`sidestep live`: the page on which a visitor is the pedestrian; or a finished record in the same view."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

if TYPE_CHECKING:
    from sidestep.simulation.scenario import Scenario
    from sidestep.viewer.live.server import Shelf

LOOPBACK = "127.0.0.1"
WARM_UP_STEPS = 24


def live(
    record: Path | None = None,
    /,
    *,
    scenario: str = "crossing",
    port: int = 8080,
    host: str = LOOPBACK,
    show: Annotated[bool, Parameter(negative="--no-show")] = True,
) -> int:
    """Serve a page on which you are the pedestrian, until Ctrl-C. Nothing leaves this machine.

    Args:
        record: a record (.npz) to play back and scrub through first; "Back to live" leads to the scenario.
        scenario: name of a scenario (`sidestep scenarios`), or path of a TOML file.
        port: to listen on; 0 takes a free one.
        host: address to listen on; the default is reachable from this machine only.
        show: open the page in the browser.
    """
    from sidestep.commands.bars import first_time
    from sidestep.commands.console import say
    from sidestep.errors import InvalidInput
    from sidestep.io.records import read_record
    from sidestep.viewer.live import server
    from sidestep.viewer.live.settings import LiveSettings

    if not 0 <= port <= 65535:
        raise InvalidInput("--port", port, "0 to 65535 (0 takes a free one)")
    server.require()
    shelf = _shelf(scenario)
    settings = LiveSettings(scenario=scenario)
    shown = None if record is None else read_record(record)
    if shown is not None:
        server.warm_up(shelf, settings, steps=0)  # says now, not at "Back to live", what is wrong with the scenario
    else:
        say("getting ready (the first start after an installation takes longer)")
        first_time(walls=True)
        server.warm_up(shelf, settings, steps=WARM_UP_STEPS)

    def ready(address: str, reachable: bool) -> None:
        if reachable:
            say(f"reachable from other machines: whoever can reach port {address.rpartition(':')[2]} can use this page")
        say(f"the page is at {address} (Ctrl-C ends it)")
        if show:
            _open(address)

    server.serve(shelf, settings=settings, record=shown, host=host, port=port, on_ready=ready)
    return 0


def _shelf(scenario: str) -> Shelf:
    """What the page may load and write; a scenario of one's own is offered beside the shipped ones."""
    from functools import lru_cache

    from sidestep.errors import UnknownName
    from sidestep.io.records import read_record, write_record
    from sidestep.io.scenarios import load_obstacles, load_scenario, shipped_names
    from sidestep.viewer.live.server import Shelf

    offered = tuple(dict.fromkeys([scenario, *shipped_names()]))

    @lru_cache(maxsize=64)
    def load(name: str) -> Scenario:
        if name not in offered:  # a page must not be able to read files by their names
            raise UnknownName("scenario", name, offered)
        return load_scenario(name)

    flat = tuple(name for name in offered if name == scenario or load(name).dimension == 2)
    return Shelf(scenarios=flat, load=load, walls=load_obstacles, read_record=read_record, write_record=write_record)


def _open(address: str) -> None:
    import threading
    import webbrowser

    threading.Timer(0.7, webbrowser.open, [address]).start()
