"""Compiled kernels: arrays in, arrays out; no classes, no validation, no random numbers."""

from __future__ import annotations

import contextlib
from pathlib import Path

_STAMP = "sources"


def forget_outdated(folder: Path) -> bool:
    """Delete the compiled code in `folder`/__pycache__ unless it was made of the sources that are there now.

    numba keeps compiled code until the file that it stands in changes. But a kernel also holds the code of those that
    it calls from other files: after one of them is edited, or a new version pulled, the old code would go on running.

    Returns:
        Whether anything was out of date. A folder that cannot be written to is left alone: nobody edits it, either.
    """
    cache = folder / "__pycache__"
    seen = [(path.name, path.stat()) for path in sorted(folder.glob("*.py"))]
    sources = "\n".join(f"{name} {s.st_mtime_ns} {s.st_size}" for name, s in seen)
    with contextlib.suppress(OSError):
        if (cache / _STAMP).read_text() == sources:
            return False
    with contextlib.suppress(OSError):
        for compiled in cache.glob("*.nb[ic]"):
            compiled.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        part = cache / f"{_STAMP}.part"
        part.write_text(sources)
        part.replace(cache / _STAMP)
    return True


forget_outdated(Path(__file__).parent)
