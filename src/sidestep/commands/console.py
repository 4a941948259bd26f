"""What people and programs see: one JSON object or a table on stdout, everything else on stderr."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

IN_FILES = 120  # columns of a table that goes to a file or another program: names stay in one piece


def emit_json(data: Mapping[str, Any]) -> None:
    """Print exactly one JSON object on stdout; what is not a number there becomes null."""
    sys.stdout.write(json.dumps(plain(data), allow_nan=False) + "\n")
    sys.stdout.flush()


def say(text: str) -> None:
    """Print one line on stderr."""
    print(text, file=sys.stderr, flush=True)


def show(text: str) -> None:
    """Print one line on stdout."""
    print(text, flush=True)


def table(rows: Iterable[Sequence[str]], *, title: str = "", header: Sequence[str] = ()) -> None:
    """Print a table on stdout: the first column names, the others tell."""
    from rich.table import Table

    from sidestep.commands.pipes import Output

    grid = Table(title=title or None, title_justify="left", show_header=bool(header), box=None, pad_edge=False)
    entries = [list(row) for row in rows]
    for column in range(len(header) or max(len(row) for row in entries)):
        grid.add_column(header[column] if header else "", style="bold" if column == 0 else None, overflow="fold")
    for row in entries:
        grid.add_row(*row)
    console = Output(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, IN_FILES)
    console.print(grid, markup=False)


def plain(value: Any) -> Any:
    """Return what JSON can hold: lists for arrays and tuples, null for what is not a finite number."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    if hasattr(value, "tolist"):  # numpy arrays and scalars
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
