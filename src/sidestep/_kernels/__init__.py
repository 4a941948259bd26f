"""Compiled kernels: arrays in, arrays out; no classes, no validation, no random numbers."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

_STAMP = "sources"


def forget_outdated(folder: Path) -> set[str]:
    """Delete the compiled code in `folder`/__pycache__ that was made of other sources than are there now.

    numba keeps compiled code until the file that it stands in changes. But a kernel also holds the code of those that
    it calls from other files: after one of them is edited, or a new version pulled, the old code would go on running.

    Returns:
        The modules whose code was out of date. A folder that cannot be written to is left alone: nobody edits it,
        either.
    """
    stamp = folder / "__pycache__" / _STAMP
    seen = {path.stem: path.stat() for path in sorted(folder.glob("*.py"))}
    lines = [f"{name} {s.st_mtime_ns} {s.st_size}" for name, s in seen.items()]
    known: list[str] = []
    with contextlib.suppress(OSError):
        known = stamp.read_text().splitlines()
    if known == lines or not os.access(folder, os.W_OK):
        return set()
    changed = {line.partition(" ")[0] for line in set(lines) - set(known)}
    outdated = _with_callers(folder, changed, set(seen)) if known else changed
    with contextlib.suppress(OSError):
        for compiled in stamp.parent.glob("*.nb[ic]"):
            if compiled.name.partition(".")[0] in outdated:
                compiled.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        part = stamp.with_suffix(".part")
        part.write_text("\n".join(lines))
        part.replace(stamp)
    return outdated


def _with_callers(folder: Path, changed: set[str], modules: set[str]) -> set[str]:
    """`changed` and all `modules` that import one of them, however indirectly."""
    import ast

    imports: dict[str, set[str]] = {}
    for name in modules:
        words: set[str] = set()
        for node in ast.walk(ast.parse((folder / f"{name}.py").read_text())):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                words |= {part for alias in node.names for part in alias.name.split(".")}
                words |= set((getattr(node, "module", None) or "").split("."))
        imports[name] = words & modules
    outdated = set(changed)
    while callers := {name for name in modules - outdated if imports[name] & outdated}:
        outdated |= callers
    return outdated


forget_outdated(Path(__file__).parent)
