"""Tables, figures and the documentation page of `sidestep evaluate --people`."""

from __future__ import annotations

import os
import platform
import shutil
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

Row = Mapping[str, Any]

_COLUMNS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "prediction": (
        ("file", "recording", ""), ("predictor", "predictor", ""), ("horizon", "s ahead", ".1f"),
        ("moments", "moments", ""), ("nll", "log loss, nat", ".3f"), ("brier", "Brier", ".3f"),
        ("coverage_50", "50 %", ".3f"), ("coverage_90", "90 %", ".3f"), ("coverage_95", "95 %", ".3f"),
        ("coverage_99", "99 %", ".3f"), ("area_95", "area of the 95 % region, m²", ".1f"),
    ),
    "awareness": (
        ("file", "recording", ""), ("delay", "s after onset", ".1f"), ("encounters", "encounters", ""),
        ("reacted", "reacted", ""), ("auc", "AUC", ".3f"), ("log_loss", "log loss", ".3f"),
        ("base_log_loss", "of the base rate", ".3f"), ("placebos", "placebos", ""),
        ("placebo_reacted", "of them reacted", ""), ("false_concern", "false concern", ".3f"),
    ),
    "replay": (
        ("file", "recording", ""), ("navigator", "navigator", ""), ("trips", "trips", ""),
        ("collision_moving", "contact moving", ".3f"), ("collision_moving_upper99", "≤ (99 %)", ".3f"),
        ("collision_standing", "standing", ".3f"), ("success", "success", ".3f"),
        ("time_ratio", "time / shortest", ".3f"), ("plan_ms_p95", "plan (95 %), ms", ".1f"),
    ),
}  # fmt: skip

_WORDS = {
    "prediction": "Predictions are scored by the negative log-likelihood of the 0.5 m cell in which the person turned "
    "up, and by how often the smallest region of a given probability held the person. `sidestep` has the defaults; "
    "`sidestep-fitted` and `constant-velocity` (errors: a mixture of four Gaussians along and across the heading, per "
    "class of speed) were fitted on the other scenes of the same recording.",
    "awareness": "An encounter is a person on a collision course with a vehicle. *Reacted*: gained at least 0.5 m of "
    "clearance over a person who keeps the velocity. Placebos: the same vehicles, transplanted to people with none "
    "near; false concern is the share of them with P(concerned) > 0.5.",
    "replay": "Trips of 7 to 10 m through recorded people, on which a blind robot would touch somebody. Recorded "
    "people never react: everybody is unconcerned by construction. The same trips for everybody.",
}


def report(result: dict[str, Any], folder: Path, page: Path | None, *, json: bool) -> None:
    """Write people.json and figures into `folder`, the page where asked, and print."""
    import json as text

    from sidestep.commands.console import emit_json, plain, show, table
    from sidestep.io.files import written
    from sidestep.viewer.figure_people import people_figures
    from sidestep.viewer.figures import save_figure

    result["machine"] = {"machine": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}
    result["date"] = date.today().isoformat()
    figures = [save_figure(f, folder / f"people-{name}.png") for name, f in people_figures(result["people"]).items()]
    result["files"] = [str(folder / "people.json"), *map(str, figures)]
    with written(folder / "people.json") as file:
        file.write(text.dumps(plain(result), indent=1).encode())
    if page is not None:
        write_people_page(result, figures, page)
    if json:
        emit_json(result)
        return
    for study, rows in result["people"].items():
        if chosen := _whole(rows):
            table([_cells(r, study) for r in chosen], title=study, header=[name for _, name, _ in _COLUMNS[study]])
    for name in (*result["files"], *([str(page)] if page else [])):
        show(f"wrote {name}")


def write_people_page(result: Mapping[str, Any], figures: Sequence[Path], page: Path) -> None:
    """Write `page` (Markdown) and copy the figures beside it."""
    from sidestep.io.files import written

    pictures = page.parent / "people"
    pictures.mkdir(parents=True, exist_ok=True)
    machine = result["machine"]
    lines = [
        "# Recorded people",
        "",
        f"Made by `sidestep evaluate --people … --page …` on {result['date']}, {machine['machine']} with "
        f"{machine['cores']} cores and Python {machine['python']}. Every number below was measured by that command.",
        "",
    ]
    for study, rows in result["people"].items():
        if not rows:
            continue
        lines += [f"## {study.capitalize()}", "", _WORDS[study], "", *_markdown(study, _whole(rows)), ""]
        if study == "prediction":
            lines += _per_scene(rows)
        for figure in figures:
            if figure.stem == f"people-{study}":
                shutil.copyfile(figure, pictures / figure.name)
                lines += [f"![{study}](people/{figure.name})", ""]
    with written(page) as file:
        file.write("\n".join(lines).encode())


def _markdown(study: str, rows: Sequence[Row]) -> list[str]:
    head = [name for _, name, _ in _COLUMNS[study]]
    body = ["| " + " | ".join(_cells(r, study)) + " |" for r in rows]
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *body]


def _per_scene(rows: Sequence[Row]) -> list[str]:
    """How many scenes meet the aims, by recording, predictor and horizon."""
    lines = [
        "Scene by scene, at 1.2 to 4.8 s: in how many of them the log loss is not above that of `constant-velocity`, "
        "and in how many the 95 % region covers between 92 and 98 %.",
        "",
        "| recording | predictor | s ahead | scenes | log loss not above | coverage within |",
        "|---|---|---|---|---|---|",
    ]
    scenes = [r for r in rows if r["scene"] != "all"]
    hard = {(r["file"], r["scene"], r["horizon"]): r["nll"] for r in scenes if r["predictor"] == "constant-velocity"}
    for file in dict.fromkeys(r["file"] for r in rows):
        for predictor in ("sidestep", "sidestep-fitted", "constant-velocity"):
            for horizon in (1.2, 2.4, 3.6, 4.8):
                own = [
                    r for r in scenes if r["file"] == file and r["predictor"] == predictor and r["horizon"] == horizon
                ]
                below = sum(r["nll"] <= hard[file, r["scene"], horizon] for r in own)
                within = sum(0.92 <= r["coverage_95"] <= 0.98 for r in own)
                if own:
                    lines.append(f"| {file} | {predictor} | {horizon} | {len(own)} | {below} | {within} |")
    return [*lines, ""]


def _whole(rows: Sequence[Row]) -> list[Row]:
    return [r for r in rows if r.get("scene", "all") == "all"]


def _cells(row: Row, study: str) -> list[str]:
    return [_text(row.get(key), form) for key, _, form in _COLUMNS[study]]


def _text(value: Any, form: str) -> str:
    return "–" if value is None else format(value, form) if form else str(value)
