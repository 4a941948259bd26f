"""What every kind of `sidestep evaluate` is asked for alike, and how it ends: a file and a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

if TYPE_CHECKING:
    from sidestep.studies.engines import Store


class Work(TypedDict):
    """How the pieces of a study are done, as its keyword arguments."""

    seed: int
    workers: int
    engine: str
    address: str | None
    store: Store
    progress: Callable[[int, int], object] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What is asked for alike, whatever is evaluated; see `sidestep evaluate --help`."""

    quick: bool
    seed: int
    folder: Path
    workers: int
    engine: str
    address: str | None
    page: Path | None
    json: bool

    def count(self, asked: int | None, full: int, few: int) -> int:
        """How many, where `asked` may leave it open."""
        return (few if self.quick else full) if asked is None else asked

    def work(self, progress: Callable[[int, int], object] | None) -> Work:
        """How the pieces are done, finished ones being kept in the folder; `progress` as studies call it."""
        from sidestep.io.checkpoints import Checkpoints

        return {
            "seed": self.seed,
            "workers": self.workers,
            "engine": self.engine,
            "address": self.address,
            "store": Checkpoints(self.folder / "pieces"),
            "progress": progress,
        }

    def told(self, result: dict[str, Any], file: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Write the result into the folder, and print it."""
        import json as text

        from sidestep.commands.console import emit_json, plain, table
        from sidestep.io.files import written

        with written(self.folder / file) as place:
            place.write(text.dumps(plain(result), indent=1).encode())
        if self.json:
            emit_json(result)
            return
        table(rows, header=header)
        for name, why in result.get("skipped", []):
            print(f"left out: {name} ({why})")


def words(**given: object) -> list[str]:
    """The options that were given, as they are typed."""
    return [f"--{name} {value}" for name, value in given.items() if value]
