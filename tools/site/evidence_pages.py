"""The evidence: pages that commands write into docs/evidence, and pages made from docs/evidence/results/*.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def titles(folder: Path) -> dict[str, str]:
    """Return address → title of the evidence pages: those that commands wrote, then those made from results."""
    written = [path for path in sorted(folder.glob("*.md")) if path.name != "index.md"]
    found = {f"evidence/{path.name}": _heading(path) for path in written}
    results = sorted((folder / "results").glob("*.json"))
    return found | {f"evidence/{_name(path)}.md": _read(path)["title"] for path in results}


def _heading(path: Path) -> str:
    lines = path.read_text(encoding="utf-8").splitlines()
    return next((line[2:].strip() for line in lines if line.startswith("# ")), path.stem)


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
