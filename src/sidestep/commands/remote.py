"""`sidestep remote`: start, stop, send and watch a robot from a second computer."""

from __future__ import annotations

import sys
from typing import Annotated, Any

from cyclopts import Parameter


def remote(
    address: str = "127.0.0.1:7070",
    /,
    *,
    goal: tuple[float, float] | None = None,
    stop: Annotated[bool, Parameter(negative="")] = False,
    token: Annotated[str, Parameter(env_var="SIDESTEP_TOKEN")] = "",
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Watch a robot; with a goal, start it and stay connected until it has arrived. Ctrl-C stops a started robot.

    The robot also stops when this computer, this program or the network between falls silent.

    Args:
        address: HOST:PORT of the node (parameters node.remote.*).
        goal: x y in m, in the robot's planning frame.
        stop: stop the robot, and leave.
        token: where the robot wants one; SIDESTEP_TOKEN in the environment serves as well.
        json: print one JSON object, the last state, when done.
    """
    from sidestep.commands.console import emit_json, say
    from sidestep.commands.options import refuse
    from sidestep.ros.station import LinkLost, Refused, Station

    if stop:
        refuse(remote, "only without --stop", goal=goal)
    host, port = _address(address)
    state: dict[str, Any] = {}
    try:
        with Station(host, port, token=token) as station:
            if stop:
                station.stop()
            elif goal is not None:
                station.goal(*goal)
                station.start()
            for state in station.states():
                _show(state)
                if stop or (goal is not None and state["activity"] == "arrived"):
                    break
                if goal is not None and state["driver"] is None:
                    say(f"no longer driving: {state['reason']}")
                    return 1
    except (LinkLost, Refused) as error:
        say(f"sidestep: {error}")
        return 1
    finally:
        if sys.stderr.isatty():
            say("")
    if json:
        emit_json(state)
    return 0


def _address(text: str) -> tuple[str, int]:
    from sidestep.errors import InvalidInput

    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise InvalidInput("address", text, "HOST:PORT, such as 127.0.0.1:7070")
    return host.strip("[]"), int(port)


def _show(state: dict[str, Any]) -> None:
    """One line on stderr that renews itself in a terminal, and stands alone elsewhere."""
    place = state["robot"]
    where = "robot unknown" if place is None else f"robot ({place[0]:.2f}, {place[1]:.2f})"
    beliefs = ", ".join(f"{p['id']} {p['concerned']:.2f}" for p in state["people"])
    rates = ", ".join(f"{name} {rate:.1f}" for name, rate in state["rates"].items())
    text = f"{state['activity']}{': ' if state['reason'] else ''}{state['reason']} | {where}"
    text += f" | concerned: {beliefs or 'nobody there'} | Hz: {rates}"
    sys.stderr.write(f"\r\x1b[K{text[:240]}" if sys.stderr.isatty() else f"{text}\n")
    sys.stderr.flush()
