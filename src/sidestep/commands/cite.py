"""`sidestep cite`: what to cite, as BibTeX."""

from __future__ import annotations

import re
from importlib import resources
from typing import Annotated

from cyclopts import Parameter

DEFAULT = ("sidestep", "method")


def cite(*names: str, json: Annotated[bool, Parameter(negative="")] = False) -> None:
    """Print what to cite, as BibTeX: the software and its method, or what is named.

    Args:
        names: any of: sidestep method orca hrvo hl social-force leg-tracking eth ucy; "all" is all of them.
        json: print one JSON object, name → BibTeX.
    """
    from sidestep.checks import one_of
    from sidestep.commands.console import emit_json, show

    known = entries()
    one_of("cite", names, [*known, "all"])
    wanted = tuple(known if "all" in names else dict.fromkeys(names or DEFAULT))
    if json:
        emit_json({name: known[name] for name in wanted})
    else:
        show("\n\n".join(known[name] for name in wanted))


def entries() -> dict[str, str]:
    """Return name → BibTeX entry, in the order of the file."""
    text = (resources.files("sidestep") / "references.bib").read_text(encoding="utf-8")
    found = [entry.strip() for entry in re.split(r"\n(?=@)", text) if entry.strip()]
    return {re.findall(r"@\w+\{([\w-]+),", entry)[0]: entry for entry in found}
