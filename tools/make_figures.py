"""Remake the pictures and films of the README and the site, all of them or those that are named.

python tools/make_figures.py [NAME ...]
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "figures"
sys.path.insert(0, str(ROOT / "tools" / "figures"))

import method_pictures  # noqa: E402
import run_pictures  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from PIL import Image  # noqa: E402

from sidestep.viewer.animation import animate  # noqa: E402
from sidestep.viewer.figures import save_figure  # noqa: E402

PICTURES: dict[str, Callable[[], Figure]] = {
    "crossing": run_pictures.one_run,
    "awareness": run_pictures.two_kinds,
    "parameter-sets": run_pictures.parameter_sets,
    "policies": method_pictures.policies,
    "looking-ahead": method_pictures.looking_ahead,
    "hole": method_pictures.hole,
    "lab": run_pictures.laboratory,
}
FILMS = {"stubborn": "unconcerned", "courteous": "concerned"}


def main(names: list[str]) -> None:
    """Make what is named, or everything, the pictures of the examples included."""
    for name, draw in PICTURES.items():
        if not names or name in names:
            began = time.perf_counter()
            save_figure(draw(), FOLDER / f"{name}.png")
            print(f"{name}.png, {time.perf_counter() - began:.1f} s", flush=True)
    for name, kind in FILMS.items():
        if not names or name in names:
            animate(run_pictures.crossing(kind), FOLDER / f"{name}.mp4", fps=20)
            print(f"{name}.mp4", flush=True)
    if not names or "examples" in names:
        subprocess.run([sys.executable, str(ROOT / "tools" / "run_examples.py"), str(FOLDER / "examples")], check=True)
        for picture in sorted((FOLDER / "examples").glob("*.png")):
            slim(picture)


def slim(picture: Path, *, most: int = 150_000, width: int = 1200) -> None:
    """Make a picture of more than `most` bytes smaller: at most `width` pixels wide, a palette of 128 colours."""
    if picture.stat().st_size <= most:
        return
    with Image.open(picture) as whole:
        smaller = whole.convert("RGB")
    smaller.thumbnail((width, 4 * width))
    smaller.quantize(128).save(picture, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
