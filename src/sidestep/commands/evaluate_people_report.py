"""Tables, figures and the page of evidence of `sidestep evaluate --people`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

Row = Mapping[str, Any]

_COLUMNS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "prediction": (
        ("file", "recording", ""), ("predictor", "predictor", ""), ("horizon", "s ahead", ".1f"),
        ("moments", "moments", ""), ("nll", "log loss, nat", ".3f"),
        ("over", "above constant velocity", "+.3f"), ("over_se", "± (one s.e.)", ".3f"), ("brier", "Brier", ".3f"),
        ("coverage_50", "50 %", ".3f"), ("coverage_90", "90 %", ".3f"), ("coverage_95", "95 %", ".3f"),
        ("coverage_99", "99 %", ".3f"), ("area_95", "area of the 95 % region, m²", ".1f"),
    ),
    "awareness": (
        ("file", "recording", ""), ("evidence", "evidence", ""), ("delay", "s after onset", ".1f"),
        ("encounters", "encounters", ""), ("reacted", "reacted", ""), ("auc", "AUC", ".3f"),
        ("auc_ci95", "95 % interval", ".2f"), ("begun", "reactions begun", ".2f"),
        ("gain_auc", "AUC of the gain", ".3f"), ("log_loss", "log loss", ".3f"),
        ("base_log_loss", "of the base rate", ".3f"), ("placebos", "placebos", ""),
        ("placebo_reacted", "of them reacted", ""), ("false_concern", "false concern", ".3f"),
    ),
    "replay": (
        ("file", "recording", ""), ("navigator", "navigator", ""), ("trips", "trips", ""),
        ("collision_moving", "contact moving", ".3f"), ("collision_moving_upper99", "≤ (99 %)", ".3f"),
        ("collision_standing", "standing", ".3f"), ("success", "success", ".3f"),
        ("time_ratio", "time / shortest", ".3f"), ("timeout", "timeout", ".3f"),
    ),
}  # fmt: skip

_WORDS = {
    "prediction": "Predictions are scored by the negative log-likelihood of the 0.5 m cell in which the person turned "
    "up, and by how often the smallest region of a given probability held the person. Held out: `sidestep-fitted` and "
    "`constant-velocity` (errors: a mixture of four Gaussians along and across the heading, per class of speed) are "
    "fitted on the other scenes of a recording and scored on the one left out; the former starts from round numbers, "
    "not from the defaults. `sidestep` is those defaults, to which these recordings contributed; `sidestep-no-…` and "
    "the like take one part of it away.",
    "awareness": "An encounter is a person on a collision course with a vehicle. *Reacted*: gained at least 0.5 m of "
    "clearance over a person who keeps the velocity. Placebos: the same vehicles, transplanted to people with none "
    "near; false concern is the share of them with P(concerned) > 0.5. The belief sees the past alone; the vehicle "
    "knows its own way. Evidence `clearance` is the default, `action` the last action (Eq. 8). *Reactions begun*: how "
    "many of those who reacted are on a course by then that gains 0.5 m; the AUC of that gain itself shows what the "
    "motion so far can tell.",
    "replay": "Trips of 7 to 10 m through recorded people, on which a blind robot would touch somebody. Recorded "
    "people never react: everybody is unconcerned by construction. The same trips for everybody, drawn at random: as "
    "many from each scene, start and goal near where somebody walked, nobody's track beginning within 1.5 m of the "
    "straight way during the trip (people who come out of nothing); with `--crowd`, only where never more people than "
    "that are there at once. Robot 1 m/s, seen and planned at 10 Hz, contact below 0.6 m.",
}


_ALT = {
    "prediction": "Log loss over that of constant velocity, and how often the 95 % region held the person, over the "
    "seconds ahead, one column per recording; grey: the aim.",
    "awareness": "AUC, log loss over the base rate's and false concern of P(concerned), over the time after the onset.",
    "replay": "Share of trips with contact while moving, to its exact 99 % bound, over the time by the shortest.",
}

_REMARKS = {
    "prediction": "The baseline has errors of its own along and across the heading; ours are the same in every "
    "direction. Recordings were smoothed by those who made them, and the same people occur in several scenes of CITR.",
    "awareness": "Most encounters begin with a course that only just leads too close, so that *reacted* also counts "
    'people whose step had wavered; the share of placebos that "reacted" says how often. Where few of the reactions '
    "have begun, nothing about the motion can tell who will react.",
    "replay": "Nobody makes room for the robot here, so that waiting and going around is all that is left to it. How "
    "long planning takes is measured elsewhere, on a machine that does nothing else.",
}


def report(result: dict[str, Any], folder: Path, page: Path | None, command: str, *, json: bool) -> None:
    """Write people.json and figures into `folder`, the page (which names the `command`) where asked, and print."""
    import json as text

    from sidestep.commands.console import emit_json, plain, show, table
    from sidestep.io.files import written
    from sidestep.viewer.figure_people import people_figures
    from sidestep.viewer.figures import save_figure

    figures = [save_figure(f, folder / f"people-{name}.png") for name, f in people_figures(result["people"]).items()]
    result["files"] = [str(folder / "people.json"), *map(str, figures)]
    with written(folder / "people.json") as file:
        file.write(text.dumps(plain(result), indent=1).encode())
    if page is not None:
        write_people_page(result, page, command)
    if json:
        emit_json(result)
        return
    for study, rows in result["people"].items():
        if chosen := _whole(rows):
            table([_cells(r, study) for r in chosen], title=study, header=_head(study))
    for name in (*result["files"], *([str(page)] if page else [])):
        show(f"wrote {name}")


def write_people_page(result: Mapping[str, Any], page: Path, command: str) -> None:
    """Write the page of evidence with its figures."""
    from sidestep.commands.evidence import Picture, write_evidence
    from sidestep.viewer.figure_people import people_figures

    pictures = [
        Picture(file=f"people-{study}.png", alt=_ALT[study], figure=figure)
        for study, figure in people_figures(result["people"]).items()
    ]
    tables: list[dict[str, Any]] = []
    for study, rows in result["people"].items():
        if rows:
            body = [_cells(r, study) for r in _whole(rows)]
            tables.append({"title": study.capitalize(), "header": _head(study), "rows": body})
        if rows and study == "prediction":
            tables.append(_per_scene(rows))
    write_evidence(
        page,
        title="Recorded people: " + ", ".join(study for study, rows in result["people"].items() if rows),
        lead=[_WORDS[study] for study, rows in result["people"].items() if rows],
        command=command,
        pictures=pictures,
        tables=tables,
        remarks=[_REMARKS[study] for study, rows in result["people"].items() if rows],
    )


def _head(study: str) -> list[str]:
    return [name for _, name, _ in _COLUMNS[study]]


def _per_scene(rows: Sequence[Row]) -> dict[str, Any]:
    """In how many scenes the aims are met, by recording, predictor and horizon."""
    scenes = [r for r in rows if r["scene"] != "all"]
    hard = {(r["file"], r["scene"], r["horizon"]): r["nll"] for r in scenes if r["predictor"] == "constant-velocity"}
    lines: list[list[str]] = []
    for file in dict.fromkeys(r["file"] for r in rows):
        for predictor in ("sidestep", "sidestep-fitted", "constant-velocity"):
            for horizon in (1.2, 2.4, 3.6, 4.8):
                own = [r for r in scenes if (r["file"], r["predictor"], r["horizon"]) == (file, predictor, horizon)]
                below = sum(r["nll"] <= hard[file, r["scene"], horizon] for r in own)
                within = sum(0.92 <= r["coverage_95"] <= 0.98 for r in own)
                if own:
                    lines.append([file, predictor, f"{horizon:g}", str(len(own)), str(below), str(within)])
    header = [
        "recording",
        "predictor",
        "s ahead",
        "scenes",
        "log loss not above the baseline",
        "95 % covers 92 to 98 %",
    ]
    return {"title": "Prediction, scene by scene: in how many the aims are met", "header": header, "rows": lines}


def _whole(rows: Sequence[Row]) -> list[Row]:
    return [r for r in rows if r.get("scene", "all") == "all"]


def _cells(row: Row, study: str) -> list[str]:
    return [_text(row.get(key), form) for key, _, form in _COLUMNS[study]]


def _text(value: Any, form: str) -> str:
    if isinstance(value, list | tuple):
        return " to ".join(_text(v, form) for v in value)  # pyright: ignore[reportUnknownVariableType]
    return "–" if value is None else format(value, form) if form else str(value)
