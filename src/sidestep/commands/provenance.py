"""On what, when and by what a result was made."""

from __future__ import annotations

import datetime
import os
import platform
import shutil
import subprocess
from pathlib import Path


def provenance(command: str) -> dict[str, str]:
    """Return date, machine, version and command, for a page of results."""
    import sidestep

    return {
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "machine": machine(),
        "version": " ".join([sidestep.__version__, *_commit(Path(sidestep.__file__).parent)]),
        "command": command,
    }


def _commit(folder: Path) -> list[str]:
    """Return ["(commit …)"] where the program is a checkout, else []."""
    git = shutil.which("git")
    if git is None:
        return []
    asked = subprocess.run([git, "log", "-1", "--format=%h", "--", "."], cwd=folder, capture_output=True, text=True)
    return [f"(commit {asked.stdout.strip()})"] if asked.returncode == 0 and asked.stdout.strip() else []


def machine() -> str:
    """Return processor, cores, operating system and Python version in a line."""
    return f"{_processor()}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
