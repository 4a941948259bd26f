"""argv → command. The only place, with the commands themselves, that prints or exits.

A command is a function in a module of its own, named in `COMMANDS`; nothing heavier than this file is imported until
one is called.

Exit status: 0 success, 2 bad input (one line on stderr), 1 a failure of ours, 130 interrupted.
"""

from __future__ import annotations

import codecs
import difflib
import errno
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, TextIO, get_args

COMMANDS: dict[str, tuple[str, str]] = {
    "scenarios": ("sidestep.commands.scenarios:scenarios", "list what can be run, or print a scenario as TOML"),
    "run": ("sidestep.commands.run:run", "send a robot past people: table, record, figure"),
    "bench": ("sidestep.commands.bench:bench", "how fast planning is, beside other planners"),
    "reproduce": ("sidestep.commands.reproduce:reproduce", "the paper, claim by claim, with verdicts"),
    "evaluate": ("sidestep.commands.evaluate:evaluate", "ours against others, over many seeded episodes"),
    "lab": (
        "sidestep.commands.lab:lab",
        "a simulated laboratory: scanner, leg tracker, base; score or train the tracker",
    ),
    "study": (
        "sidestep.commands.study:study",
        "several robots, safety filter, danger signal, unknown goals",
    ),
    "fit": ("sidestep.commands.fit:fit", "a human model from recorded tracks, and what it is worth"),
    "live": ("sidestep.commands.live:live", "be the pedestrian: a page in the browser"),
    "animate": ("sidestep.commands.animate:animate", "a film of a recorded run"),
    "replay": ("sidestep.commands.replay:replay", "plan over a recording: predicted against actual positions"),
    "remote": ("sidestep.commands.remote:remote", "start, stop and watch a robot from a second computer"),
    "cite": ("sidestep.commands.cite:cite", "what to cite, as BibTeX"),
}
"""Name → (module:function, one line of help), in the order of the overview."""

BAD_INPUT, FAILURE, INTERRUPTED = 2, 1, 130
_UNHEARD = (errno.EPIPE, errno.ENOSPC, errno.EDQUOT)
"""What our output meets where nobody reads it, or the disk is full."""


def main() -> None:
    """Run the command line and exit."""
    sys.stdout, sys.stderr = _writable(sys.stdout), _writable(sys.stderr)
    sys.exit(execute(sys.argv[1:]))


def _writable(stream: TextIO | None) -> TextIO:
    """Return a stream that takes any text: nowhere where it is closed, else written as far as its encoding goes.

    What an encoding lacks is escaped; bytes of file names that are no UTF-8 come out as they were.
    """
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")
    if isinstance(stream, io.TextIOWrapper) and stream.errors in ("strict", "surrogateescape"):
        utf8 = codecs.lookup(stream.encoding).name == "utf-8"
        stream.reconfigure(errors="surrogateescape" if utf8 else "backslashreplace")
    return stream


def execute(argv: Sequence[str]) -> int:
    """Run one command line; the exit status."""
    try:
        status = _executed(list(argv))
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        _complain("interrupted")
        return INTERRUPTED
    except OSError as error:
        if error.errno not in _UNHEARD:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing left to complain when Python exits
        # where the reader of our output has gone, as in `sidestep scenarios | head -1`, nothing is wrong
        return 0 if error.errno == errno.EPIPE else _complain(f"output: cannot be written ({error.strerror})")


def _executed(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("--help", "-h", "help"):
        return _help(arguments[1:])
    if arguments[0] in ("--version", "-V"):
        from sidestep import __version__

        print(f"sidestep {__version__}")
        return 0
    if arguments[0] not in COMMANDS:
        near = difflib.get_close_matches(arguments[0], COMMANDS, n=1)
        mend = f"; did you mean {near[0]!r}?" if near else ""
        return _complain(f"command: got {arguments[0]!r}; allowed: {', '.join(COMMANDS)}{mend}")
    return _call(arguments)


def _help(rest: list[str]) -> int:
    """The overview, or one command's own help."""
    if rest and rest[0] in COMMANDS:
        return execute([rest[0], "--help"])
    width = max(len(name) for name in COMMANDS)
    lines = [
        "Plans a robot's motion among people who may not be watching.",
        "",
        "usage: sidestep COMMAND [options]",
        "",
    ]
    lines += [f"  {name:<{width}}  {text}" for name, (_, text) in COMMANDS.items()]
    lines += ["", "sidestep COMMAND --help explains each; sidestep --version. Start with: sidestep run crossing"]
    print("\n".join(lines))
    return 0


def _call(arguments: list[str]) -> int:
    from cyclopts import App, CycloptsError, Parameter

    from sidestep.commands.pipes import Output
    from sidestep.errors import InvalidInput, MissingExtra, OutputError, SidestepError

    # What is interrupted is told by `execute`; cyclopts would end the program without a word.
    app = App(
        name="sidestep", version_flags=(), help_format="plaintext", suppress_keyboard_interrupt=False, console=Output()
    )
    app.default_parameter = Parameter(converter=_converted)
    name = arguments[0]
    app.command(COMMANDS[name][0], name=name)
    try:
        status = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        return _complain(f"{_one_line(str(error))} (see sidestep {name} --help)")
    except (InvalidInput, MissingExtra, OutputError) as error:
        return _complain(str(error))
    except SidestepError as error:
        _complain(str(error))
        return FAILURE
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _UNHEARD:
            raise
        import traceback  # a failure of ours: everything that helps to find it

        traceback.print_exc()
        _complain(f"this is a fault of sidestep's own; please report it with the lines above (command: {name})")
        return FAILURE
    return status if isinstance(status, int) else 0


def _converted(kind: Any, tokens: Any) -> Any:
    """What the words of an option stand for; whole numbers are not made of others by rounding, as cyclopts does."""
    from cyclopts import convert

    for token in tokens if kind is int or int in get_args(kind) else ():
        if not token.value.lstrip("+-").isdigit():
            raise ValueError(f"got {token.value!r}; allowed: an integer")
    return convert(kind, tokens)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _complain(text: str) -> int:
    for line in text.splitlines():
        print(f"sidestep: {line}", file=sys.stderr)
    return BAD_INPUT
