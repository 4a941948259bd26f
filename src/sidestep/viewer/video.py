"""Pictures → film file. Knows nothing of what is on them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from PIL import Image

from sidestep.errors import MissingExtra, OutputError

Encoder = Callable[[Iterable[bytes], tuple[int, int], int, Path], None]
"""(RGBA pictures, (width, height) in pixels, pictures per second, file) → None."""


def write_gif(pictures: Iterable[bytes], size: tuple[int, int], fps: int, target: Path) -> None:
    """Write an endless gif with one palette of 256 colours."""
    first: Image.Image | None = None
    rest: list[Image.Image] = []
    for data in pictures:
        picture = Image.frombytes("RGBA", size, data).convert("RGB")
        if first is None:
            first = picture.quantize(256, dither=Image.Dither.NONE)
        else:
            rest.append(picture.quantize(palette=first, dither=Image.Dither.NONE))
    if first is None:
        return
    with _whole(target) as part:
        first.save(part, save_all=True, append_images=rest, duration=round(1000 / fps), loop=0, optimize=False)


def write_mp4(pictures: Iterable[bytes], size: tuple[int, int], fps: int, target: Path) -> None:
    """Write an H.264 mp4 that every browser plays."""
    command = [*_find_ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba"]
    command += ["-s", f"{size[0]}x{size[1]}"]
    command += ["-r", str(fps), "-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-an", "-c:v", "libx264"]
    command += ["-pix_fmt", "yuv420p", "-crf", "23", "-movflags", "+faststart"]
    with _whole(target) as part:
        command.append(f"file:{part}")  # a name with a colon would be taken for an address
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            _feed(process, pictures)
            why = process.stderr.read().decode(errors="replace").strip() if process.stderr else ""
            failed = process.wait() != 0
        if failed:
            raise OutputError(target, why.splitlines()[-1] if why else "ffmpeg failed")


def _feed(process: subprocess.Popen[bytes], pictures: Iterable[bytes]) -> None:
    if process.stdin is None:
        return
    try:
        for data in pictures:
            process.stdin.write(data)
        process.stdin.close()
    except BrokenPipeError:
        pass  # ffmpeg gave up; its own message says why


def _find_ffmpeg() -> list[str]:
    """Return the start of a command line: the system's ffmpeg, or the one that the extra `live` brings."""
    system = shutil.which("ffmpeg")
    if system:
        return [system]
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise MissingExtra("writing mp4 files without an installed ffmpeg", "live") from error
    return [imageio_ffmpeg.get_ffmpeg_exe()]


@contextmanager
def _whole(target: Path) -> Generator[Path]:
    """Yield where to write a file that takes the place of `target` when the block ends without an exception.

    Raises:
        OutputError: it cannot be written there.
    """
    part = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        yield part
        os.replace(part, target)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(target, error.strerror or str(error)) from error
    finally:
        with suppress(OSError):  # it is gone, or never was
            part.unlink()


ENCODERS: Mapping[str, Encoder] = {".mp4": write_mp4, ".gif": write_gif}
