"""`sidestep scenarios`: what there is to run, and the TOML of each to copy and change."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter


def scenarios(
    name: str | None = None,
    /,
    *,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """List the scenarios that come with sidestep, or print one as TOML to copy and change.

    Args:
        name: print this one: `sidestep scenarios crossing > mine.toml`, then `sidestep run mine.toml`.
        json: print one JSON object.
    """
    from sidestep.commands.console import emit_json, show, table
    from sidestep.io.scenarios import load_scenario, shipped_names, shipped_text

    if name is not None:
        text = shipped_text(name)
        if json:
            emit_json({"name": name, "toml": text, "settings": load_scenario(name).settings()})
        else:
            show(text.rstrip())
        return
    found = [(n, load_scenario(n).description) for n in shipped_names()]
    if json:
        emit_json({"scenarios": [{"name": n, "description": d} for n, d in found]})
    else:
        table(found)
