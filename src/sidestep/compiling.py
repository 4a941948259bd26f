"""The first time: every processor compiles its share of the kernels.

numba compiles a kernel when it is first called, one after another, on one processor. What a first run calls, and with
arrays of what kind, does not depend on what is planned; so it is written down in `_kernels/needed.txt`, and other
processes compile it side by side. Each keeps what it compiles in a folder of its own, so that none disturbs another;
from there it is moved to numba's cache, where everybody finds it.

A line of `needed.txt` is a kernel, the seconds that it took to compile once, who calls it ("always" or "walls"), and
its arguments: f is a float64, s a float32, i an int64, b a truth value; f2 an array of two axes, f2r one that is
read-only. `tools/list_kernels.py` writes it.
"""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

MOST = 8
"""Processes at most: no more are of use, since one kernel alone takes a seventh of the time, and each needs 300 MB."""
WORTH = 5.0
"""Seconds of work below which no process is begun."""
TABLE = Path(__file__).parent / "_kernels" / "needed.txt"
_SHARE = "from sidestep.compiling import compile_share; compile_share()"
_KINDS = {"f": "float64", "s": "float32", "i": "int64", "b": "boolean"}
_log = logging.getLogger(__name__)
_POLL, _STALE = 0.1, 3600.0  # s
_PART = "part-"


class Needed(NamedTuple):
    """One version of a kernel that a first run calls.

    Attributes:
        number: line of the table; kernel: module and name; seconds: to compile it, once, somewhere.
        walls: whether only those call it who plan among walls.
        arguments: of which kind.
    """

    number: int
    kernel: str
    seconds: float
    walls: bool
    arguments: tuple[str, ...]


@cache
def needed() -> tuple[Needed, ...]:
    """Return what a first run calls, as `needed.txt` has it."""
    rows = [line.split() for line in TABLE.read_text().splitlines()]
    return tuple(
        Needed(number, kernel, float(seconds), where == "walls", tuple(arguments))
        for number, (kernel, seconds, where, *arguments) in enumerate(rows)
    )


def missing(*, walls: bool = False) -> list[Needed]:
    """Return what is not compiled yet of what is needed; nothing where numba keeps nothing."""
    folder = _cache_folder()
    if folder is None:
        return []
    known = {_kernel_in(file) for file in folder.glob("*.nbi")}
    return [row for row in needed() if row.kernel not in known and (walls or not row.walls)]


def pending(*, walls: bool = False) -> bool:
    """Return whether so much of what is needed is missing that compiling it takes a while."""
    return _work(missing(walls=walls)) >= WORTH


def worth_sharing(*, walls: bool = False) -> bool:
    """Return whether `compile_together` has something to do, and somebody to do it."""
    return helpers_at_most() > 1 and pending(walls=walls)


@cache
def announce(*, walls: bool) -> None:
    """Say, once, what takes so long, where much is to be compiled by whoever calls it first."""
    if pending(walls=walls):
        _log.warning("compiling the inner loops, once: a minute or two (Planner.warm_up shares it among processors)")


def compile_together(*, walls: bool = False, tell: Callable[[float], object] | None = None) -> None:
    """Compile what a first run needs on all processors; return at once where that is done or would gain nothing.

    What no process could compile is left to whoever calls it first.

    Args:
        walls: whether there will be walls.
        tell: is told which share of the work is done, again and again.
    """
    folder = _cache_folder()
    if folder is None or not worth_sharing(walls=walls):
        return
    absent = missing(walls=walls)
    with suppress(OSError), _shared(folder) as shared:
        helpers: dict[str, subprocess.Popen[bytes]] = {}
        try:
            for name in map(str, range(helpers_at_most())):
                helpers[name] = _helper(shared, name, absent)
            while any(helper.poll() is None for helper in helpers.values()):
                if tell is not None:
                    tell(_done(shared, absent))
                time.sleep(_POLL)
        finally:
            for helper in helpers.values():
                helper.terminate()
                helper.wait()
        for name, helper in helpers.items():
            if helper.returncode == 0:
                _hand_over(shared, name, folder)


def helpers_at_most() -> int:
    """Return how many processes may compile; within a program that embeds Python 1: it is not to be started again."""
    return min(processors(), MOST) if "python" in Path(sys.executable or "").name.lower() else 1


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compile_share() -> None:
    """Compile what nobody else does of the lines of the table whose numbers are arguments of this process.

    The first two arguments are a folder that all who do so share, where every kernel is claimed by whoever comes first,
    and the name of this process among them. It ends early where the one that began it has.
    """
    shared, name, *numbers = sys.argv[1:]
    parent, rows = os.getppid(), [needed()[int(number)] for number in numbers]
    for kernel in dict.fromkeys(row.kernel for row in sorted(rows, key=lambda row: -row.seconds)):
        try:
            with Path(shared, kernel).open("x") as claim:
                claim.write(name)
        except FileExistsError:
            continue
        module, _, function = kernel.partition(".")
        compiled = getattr(import_module(f"sidestep._kernels.{module}"), function)
        for row in rows:
            if row.kernel == kernel:
                compiled.compile(tuple(map(kind_of, row.arguments)))
        if os.getppid() != parent:
            return


def kind_of(code: str) -> Any:
    """Return numba's type for a word of the table, "f2r" for instance."""
    from numba import types

    scalar = getattr(types, _KINDS[code[0]])
    return scalar if len(code) == 1 else types.Array(scalar, int(code[1]), "C", readonly=code.endswith("r"))


def code_of(kind: Any) -> str:
    """Return the word of the table for a type of numba."""
    from numba import types

    letters = {getattr(types, name): letter for letter, name in _KINDS.items()}
    if not isinstance(kind, types.Array):
        return letters[kind]
    code = f"{letters[kind.dtype]}{kind.ndim}" + ("" if kind.mutable else "r")
    if kind_of(code) != kind:
        raise ValueError(f"no word of the table says {kind}")
    return code


def _cache_folder() -> Path | None:
    """Where numba keeps compiled kernels; None: nowhere."""
    from sidestep._kernels.frames import local  # it brings numba, and to count processors needs none

    folder = getattr(getattr(local, "stats", None), "cache_path", None)  # a plain function with NUMBA_DISABLE_JIT
    return None if folder is None else Path(folder)


def _work(rows: Iterable[Needed]) -> float:
    return sum(row.seconds for row in rows)


@contextmanager
def _shared(folder: Path) -> Generator[Path]:
    """A folder within numba's cache, gone in the end; what is left of one that could not go goes now."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob(f"{_PART}*"):
        if time.time() - old.stat().st_mtime > _STALE:
            shutil.rmtree(old, ignore_errors=True)
    with TemporaryDirectory(prefix=_PART, dir=folder, ignore_cleanup_errors=True) as name:
        yield Path(name)


def _helper(shared: Path, name: str, rows: Sequence[Needed]) -> subprocess.Popen[bytes]:
    """Begin a process that keeps what it compiles in a folder of its own within the shared one."""
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [sys.executable, "-c", _SHARE, str(shared), name, *(str(row.number) for row in rows)],
        env={**os.environ, "NUMBA_CACHE_DIR": str(shared / f"of-{name}")},
        stdin=quiet,
        stdout=quiet,
        stderr=quiet,
    )


def _done(shared: Path, rows: Sequence[Needed]) -> float:
    """Which share of the work is done."""
    made = {_kernel_in(file) for file in shared.glob("of-*/*/*.nbi")}
    return _work(row for row in rows if row.kernel in made) / _work(rows)


def _hand_over(shared: Path, name: str, folder: Path) -> None:
    """Move what a process claimed to where everybody finds it, the code before the index that names it.

    What else it compiled on the way, because kernels call it, is in them already.
    """
    claimed = {path.name for path in shared.iterdir() if path.is_file() and path.read_text() == name}
    for ending in (".nbc", ".nbi"):
        for file in shared.glob(f"of-{name}/*/*{ending}"):
            if _kernel_in(file) in claimed:
                file.replace(folder / file.name)


def _kernel_in(file: Path) -> str:
    """The kernel, module and name, whose compiled code is in a file of numba's cache."""
    return file.name.rpartition("-")[0]
