"""`sidestep animate`: a film of a recorded run."""

from __future__ import annotations

from pathlib import Path


def animate(record: Path, /, *, out: Path | None = None, fps: int = 20, speed: float = 1.0) -> None:
    """Make a film of a run: who went where, what was predicted and planned at each moment.

    Args:
        record: a record (.npz), as `sidestep run` writes it.
        out: file to write, .mp4 (needs ffmpeg) or .gif; beside the record, as .mp4, unless given.
        fps: pictures per second, 1 to 60.
        speed: seconds of the run per second of film.
    """
    from sidestep.commands.console import show
    from sidestep.io.files import ready_for
    from sidestep.io.records import read_record
    from sidestep.viewer.animation import animate as filmed

    shown = read_record(record)
    target = out or record.with_suffix(".mp4")
    ready_for(target)
    filmed(shown, target, fps=fps, speed=speed)
    show(f"wrote {target}")
