"""What a browser may say. Everything else is answered with nothing, and counted."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

LONGEST = 2048  # bytes; the longest honest message has about 100

Coordinate = Annotated[float, Field(ge=-1e4, le=1e4)]  # m


class _Message(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Drag(_Message):
    """The hand holds the person at `point` ((x, y) m); None lets go."""

    type: Literal["drag"]
    point: tuple[Coordinate, Coordinate] | None


class Walk(_Message):
    """The arrow keys point along `direction`; (0, 0) when none is pressed."""

    type: Literal["walk"]
    direction: tuple[Coordinate, Coordinate]
    hurry: bool = False


class Transport(_Message):
    """Play, pause, one planning step, back to the start."""

    type: Literal["play", "pause", "step", "reset"]


class Seek(_Message):
    """Show the recorded step `index`; a live world ignores it."""

    type: Literal["seek"]
    index: Annotated[int, Field(ge=0, le=10_000_000)]


class Ping(_Message):
    """Answered at once with the same number, to measure the round trip."""

    type: Literal["ping"]
    sent: Annotated[float, Field(ge=0)]


Message = Drag | Walk | Transport | Seek | Ping

_adapter: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="type")])


def read(text: str | bytes) -> Message | None:
    """Return the message in `text` (JSON), or None when it is not one."""
    if len(text) > LONGEST:
        return None
    try:
        return _adapter.validate_json(text)
    except (ValidationError, ValueError, RecursionError):
        return None
