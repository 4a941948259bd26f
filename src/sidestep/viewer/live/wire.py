"""Messages to the browser: JSON text, or JSON with images behind it."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Sequence
from typing import Any

from sidestep.types import FloatArray
from sidestep.viewer.live.heat import Heat

Packet = str | bytes


def text(**fields: Any) -> str:
    """Return one JSON message; what is not a finite number becomes null."""
    return json.dumps(_plain(fields), separators=(",", ":"), allow_nan=False)


def with_images(heats: Sequence[Heat], **fields: Any) -> bytes:
    """Return a binary message: length of the JSON part (4 bytes, little-endian), that part, the images' pixels."""
    head = text(**fields, heats=[h.header() for h in heats]).encode()
    return struct.pack("<I", len(head)) + head + b"".join(h.pixels.tobytes() for h in heats)


def numbers(values: FloatArray, digits: int = 3) -> Any:
    """Return nested lists of `values` ((K,) or (K, d)), rounded; NaN and infinities become None."""
    if values.ndim > 1:
        return [numbers(row, digits) for row in values]
    return [round(float(value), digits) if math.isfinite(value) else None for value in values]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]  # pyright: ignore[reportUnknownArgumentType]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
