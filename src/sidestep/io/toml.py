"""Nested tables as TOML text (the standard library only reads it)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

from sidestep.simulation.settings import NONE


def to_toml(data: Mapping[str, Any]) -> str:
    """TOML text of nested tables, lists of tables, numbers, booleans, texts and lists; None becomes "none"."""
    return "\n".join(_lines(data, "")) + "\n"


def _lines(table: Mapping[str, Any], prefix: str) -> list[str]:
    lines: list[str] = []
    tables: list[tuple[str, Any]] = []
    for key, value in table.items():
        entries = cast(list[Any], value) if isinstance(value, list) else []
        if _is_table(value) or (entries and all(_is_table(entry) for entry in entries)):
            tables.append((key, value))
        else:
            lines.append(f"{_key(key)} = {_inline(value)}")
    for key, value in tables:
        name = f"{prefix}{_key(key)}"
        header, entries = (f"[{name}]", [value]) if _is_table(value) else (f"[[{name}]]", value)
        for entry in entries:
            lines += ["", header, *_lines(entry, f"{name}.")]
    return lines


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping)


def _key(key: str) -> str:
    bare = key.replace("_", "").replace("-", "")
    return key if bare.isascii() and bare.isalnum() else _text(key)


def _inline(value: Any) -> str:
    if value is None:
        return _text(NONE)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)  # inf and nan are TOML, too
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_inline(v) for v in cast(Sequence[Any], value)) + "]"
    if _is_table(value):
        return "{ " + ", ".join(f"{_key(k)} = {_inline(v)}" for k, v in value.items()) + " }"
    return str(value)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
