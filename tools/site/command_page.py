"""The command line as a page, from the program itself."""

from __future__ import annotations

from cyclopts import App

from sidestep.cli import COMMANDS


def command_page() -> str:
    """Return the page as Markdown."""
    parts = [
        "# Command line",
        "This page is made from the program. `sidestep COMMAND --help` says the same.",
        "\n".join(
            ["| command | what it does |", "|---|---|"]
            + [f"| [`sidestep {name}`](#sidestep-{name}) | {text} |" for name, (_, text) in COMMANDS.items()]
        ),
        "Results go to stdout, progress and messages to stderr. With `--json` stdout holds exactly one JSON object. "
        "Exit status: 0 success, 2 bad input (one line on stderr that names the field and the mend), 1 a failure of "
        "ours, 130 interrupted.",
    ]
    for name, (where, _) in COMMANDS.items():
        app = App(name="sidestep", version_flags=(), help_format="plaintext")
        app.command(where, name=name)
        text = app.generate_docs(output_format="markdown", usage_name="sidestep")
        parts.append(f"## sidestep {name}\n" + text.split(f"## sidestep {name}\n", 1)[1].strip())
    return "\n\n".join(parts) + "\n"
