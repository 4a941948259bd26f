"""What pydantic says about a mistake, turned into one line: field, value, what is allowed, how to mend it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, get_args, get_type_hints

from pydantic import BaseModel, ValidationError

from sidestep.errors import InvalidInput

_MISSING = "(missing)"


def one_line(error: ValidationError, model: type[Any], source: str = "") -> InvalidInput:
    """Return the complaint for `error`: one line for the first mistake, and each further mistake on a line of its own.

    Args:
        error: what pydantic raised.
        model: the class that was read; its fields are suggested where a name is unknown.
        source: file or name, put before each field.
    """
    faults = _joined([_fault(dict(detail), model) for detail in error.errors(include_url=False)])
    return faults[0] if len(faults) == 1 and not source else _Complaint(faults, source)


class _Complaint(InvalidInput):
    """Mistakes in one source, one line each."""

    def __init__(self, faults: Sequence[InvalidInput], source: str) -> None:
        first = faults[0]
        super().__init__(first.field, first.value, first.allowed, first.mend)
        before = f"{source}: " if source else ""
        self.args = ("\n".join(f"{before}{fault}" for fault in faults),)


def _joined(faults: Sequence[InvalidInput]) -> list[InvalidInput]:
    """One fault per field: where a value fits none of several alternatives, each alternative complains."""
    merged: dict[str, InvalidInput] = {}
    for fault in faults:
        before = merged.get(fault.field)
        if before is not None and fault.allowed != before.allowed:
            fault = InvalidInput(fault.field, fault.value, f"{before.allowed}, or {fault.allowed}", before.mend)
        merged[fault.field] = fault
    return list(merged.values())


def _fault(detail: dict[str, Any], model: type[Any]) -> InvalidInput:
    inner = detail.get("ctx", {}).get("error")
    place = _place(detail["loc"])
    if isinstance(inner, InvalidInput):
        return inner
    kind = str(detail["type"])
    if kind in ("extra_forbidden", "unexpected_keyword_argument"):
        known = _known(model, detail["loc"])
        near = difflib.get_close_matches(str(detail["loc"][-1]), known, n=1, cutoff=0.5)
        mend = f"did you mean {near[0]!r}?" if near else ""
        return InvalidInput(place, detail["input"], "one of " + ", ".join(known) if known else "a known name", mend)
    if kind.startswith("missing"):
        return InvalidInput(place, _MISSING, "a value", "add it")
    return InvalidInput(place, detail["input"], _allowed(str(detail["msg"])))


_WORDS = (
    (r"^Input should be |^Value error, ", ""),
    (r"a valid dictionary.*", "a table"),
    (r"a valid tuple", "a list"),
    (r"a valid (number|integer|string|boolean)(, unable to parse.*)?", r"a \1"),
    (r"\ba integer", "an integer"),
    (r"[Tt]uple should have (.*) items? after validation, not.*", r"a list with \1 entries"),
    (r"greater than or equal to ", "≥ "),
    (r"less than or equal to ", "≤ "),
    (r"greater than ", "> "),
    (r"less than ", "< "),
)


def _allowed(message: str) -> str:
    for pattern, words in _WORDS:
        message = re.sub(pattern, words, message)
    return message[:1].lower() + message[1:]


def _place(location: Sequence[str | int]) -> str:
    """Dotted path, without the names that pydantic gives to the alternatives of a union."""
    parts = [str(part) for part in location]
    return ".".join(p for p in parts if "[" not in p and p not in ("float", "str", "int")) or "scenario"


def _known(model: type[Any], location: Sequence[str | int]) -> list[str]:
    """Names that are allowed in the table in which the last name of `location` stands."""
    table: Any = model
    for part in location[:-1]:
        if isinstance(part, int):
            continue
        table = _inner(table, part)
        if table is None:
            return []
    return sorted(_fields(table))


def _fields(table: Any) -> Mapping[str, Any]:
    if isinstance(table, type) and issubclass(table, BaseModel):
        return {name: info.annotation for name, info in table.model_fields.items()}
    if is_dataclass(table):
        hints = get_type_hints(table)
        return {field.name: hints[field.name] for field in fields(table)}
    return {}


def _inner(table: Any, name: str) -> Any:
    """Class of the table that field `name` of `table` holds, unwrapped from tuples and options."""
    waiting = [_fields(table).get(name)]
    while waiting:
        found = waiting.pop()
        if _fields(found):
            return found
        waiting.extend(get_args(found))
    return None
