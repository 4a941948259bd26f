"""The `Attributes:` part of our docstrings: field names → words."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

ENTRY = re.compile(r"^    (?P<names>\w+(?:, \w+)*): (?P<text>.*)$")
INLINE = re.compile(r"[;,] (?P<name>[a-z]\w+): ")


def summary(thing: object) -> str:
    """Return the first paragraph of a docstring, on one line."""
    text = inspect.getdoc(thing) or ""
    return " ".join(text.split("\n\n")[0].split())


def attributes(thing: type) -> dict[str, str]:
    """Return what the docstring of a class says of each of its fields."""
    doc = inspect.getdoc(thing) or ""
    _, _, listed = doc.partition("Attributes:\n")
    told: dict[str, str] = {}
    names: list[str] = []
    for line in listed.splitlines():
        entry = ENTRY.match(line)
        if entry:
            names = entry["names"].split(", ")
            told |= dict.fromkeys(names, entry["text"])
        elif line.startswith("        ") and names:
            told |= {name: f"{told[name]} {line.strip()}" for name in names}
        elif line.strip() and not line.startswith(" "):
            break
    return {name: part for entry, text in told.items() for name, part in _parts(entry, text)}


def _parts(name: str, text: str) -> Iterator[tuple[str, str]]:
    """Yield what an entry says of its own name and, after a comma or semicolon, of further ones."""
    further = INLINE.search(text)
    while further:
        yield name, text[: further.start()].rstrip(".") + "."
        name, text = further["name"], text[further.end() :]
        further = INLINE.search(text)
    yield name, text
