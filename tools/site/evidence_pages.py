"""Results of our commands → pages. One JSON file per study in docs/evidence/results, from tools/make_evidence.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def titles(results: Path) -> dict[str, str]:
    """Return address → title of the pages that there are results for, in the order of the file names."""
    return {f"evidence/{_name(path)}.md": _read(path)["title"] for path in sorted(results.glob("*.json"))}


def evidence_pages(results: Path) -> dict[str, str]:
    """Return address → Markdown."""
    return {f"evidence/{_name(path)}.md": _page(_read(path)) for path in sorted(results.glob("*.json"))}


def _name(path: Path) -> str:
    return path.stem.split("-", 1)[1] if path.stem[0].isdigit() else path.stem


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def _page(study: dict[str, Any]) -> str:
    parts = [f"# {study['title']}", *study.get("lead", [])]
    parts.append(
        f'!!! info "Measured {study["date"]}"\n'
        f"    Version {study['version']}, {study['machine']}. Again, on your machine:\n\n"
        f"    ```text\n    {study['command']}\n    ```"
    )
    parts += [f"![{figure['alt']}](../figures/{figure['file']})" for figure in study.get("figures", [])]
    for table in study.get("tables", []):
        parts.append(f"## {table['title']}")
        parts += table.get("lead", [])
        parts.append(_table(table["header"], table["rows"]))
    parts += study.get("remarks", [])
    return "\n\n".join(parts) + "\n"


def _table(header: list[str], rows: list[list[Any]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines)


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.3g}"
    return str(value).replace("|", "\\|")
