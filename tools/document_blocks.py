"""Run what a Markdown page tells its readers to run.

    python tools/document_blocks.py README.md [MORE.md ...]

Each page runs in an empty folder of its own, top to bottom, in the environment of this interpreter:

- ```` ```python ```` blocks share one namespace per page;
- lines that begin with `$ ` in ```` ```console ```` blocks run in bash; what they print is not compared;
- blocks with a title (```` ```toml title="corridor.toml" ````) are written to a file of that name;
- everything else is left alone, and so is a block right below `<!-- not run: why -->`.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(
    r"^(?P<indent> *)(?P<ticks>```+)(?P<info>[^`\n]*)\n(?P<body>.*?)^(?P=indent)(?P=ticks) *$", re.M | re.S
)
TITLE = re.compile(r'title="([^"]+)"')
NOT_RUN = re.compile(r"<!-- not run: .+? -->\s*$", re.S)
CONTINUED = re.compile(r"\\\n(?:> )?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """One fenced block: its language, its title (a file name) if it has one, its text, and its line in the page."""

    language: str
    title: str | None
    text: str
    line: int

    @property
    def commands(self) -> list[str]:
        """The shell commands of a console block."""
        joined = CONTINUED.sub("", self.text)
        return [line[2:] for line in joined.splitlines() if line.startswith("$ ")]


def blocks(markdown: str) -> list[Block]:
    """Return the blocks that are to be run or written, in their order."""
    found: list[Block] = []
    for match in FENCE.finditer(markdown):
        if NOT_RUN.search(markdown[: match.start()]):
            continue
        title = TITLE.search(match["info"])
        language = match["info"].split()[0].strip() if match["info"].strip() else ""
        if language in ("python", "console") or title:
            found.append(
                Block(
                    language=language,
                    title=title[1] if title else None,
                    text=textwrap.dedent(match["body"]),
                    line=markdown[: match.start()].count("\n") + 1,
                )
            )
    return found


def in_shell(command: str) -> int:
    """Run one command in bash, as a reader does; return its exit status."""
    binaries = str(Path(sys.executable).parent)
    environment = {**os.environ, "PATH": f"{binaries}{os.pathsep}{os.environ.get('PATH', '')}", "MPLBACKEND": "Agg"}
    return subprocess.run(["bash", "-euo", "pipefail", "-c", command], env=environment, check=False).returncode


def run_page(page: Path, folder: Path, run: Callable[[str], int] = in_shell) -> int:
    """Run all blocks of `page` in `folder`; return how many there were. The first failure is raised.

    Args:
        page: Markdown.
        folder: empty; becomes the working folder.
        run: one command of a console → its exit status.
    """
    namespace: dict[str, object] = {"__name__": "__main__"}
    found = blocks(page.read_text(encoding="utf-8"))
    os.chdir(folder)
    for block in found:
        where = f"{page.name}:{block.line}"
        print(f"-- {where} {block.title or block.language}", flush=True)
        if block.title:
            (folder / block.title).write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            padded = "\n" * block.line + block.text  # so that a traceback names the line of the page
            exec(compile(padded, str(page), "exec"), namespace)
        for command in block.commands if block.language == "console" else ():
            print(f"$ {command}", flush=True)
            status = run(command)
            if status != 0:
                raise SystemExit(f"{where}: exit status {status}: {command}")
    return len(found)


def main(arguments: list[str]) -> None:
    """Run the pages named on the command line."""
    for page in (Path(a).resolve() for a in arguments):
        with tempfile.TemporaryDirectory() as folder:
            count = run_page(page, Path(folder))
            os.chdir(page.parent)
        print(f"{page.name}: {count} blocks run")


if __name__ == "__main__":
    main(sys.argv[1:])
