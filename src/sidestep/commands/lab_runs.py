"""What `sidestep lab` does without --score and --train: rooms, robot and people."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sidestep.simulation.lab_room import LabSettings


def drive(
    settings: LabSettings,
    *,
    human: str | None,
    seeds: int,
    workers: int,
    classifier: Path | None,
    out: Path,
    json: bool,
) -> None:
    """Run the rooms; write results.json, the figure and the records of the first room; print table or JSON."""
    import json as text

    from sidestep.checks import counted
    from sidestep.commands.bars import progress_bar
    from sidestep.commands.console import emit_json, plain, show, table
    from sidestep.io.files import ready_folder, written
    from sidestep.io.records import write_record
    from sidestep.perception.classifier import load_classifier
    from sidestep.studies.engines import processes
    from sidestep.studies.lab import lab_study, lab_summary, outcome_rows
    from sidestep.viewer.figure_lab import lab_runs_figure
    from sidestep.viewer.figures import save_figure

    counted("--seeds", seeds)
    processes(workers)
    folder = ready_folder(out)
    trees = None if classifier is None else load_classifier(classifier)
    with progress_bar("laboratory") as tell:
        outcomes, records = lab_study(settings, seeds=seeds, workers=workers, classifier=trees, progress=tell)
    found = lab_summary(outcomes, human) | {
        "physics": settings.physics,
        "planner_rate": settings.planner_rate,
        "latency_ms": 1e3 * settings.latency,
        "dropout": settings.dropout,
        "goals": settings.goals,
        "first_seed": settings.seed,
    }
    files = [write_record(record, folder / f"{kind}.npz") for kind, record in records.items()]
    files.append(save_figure(lab_runs_figure(records), folder / "lab.png"))
    with written(folder / "results.json") as file:
        file.write(text.dumps(plain(found | {"each": outcome_rows(outcomes)}), indent=1).encode())
    files.append(folder / "results.json")
    if json:
        emit_json(found | {"files": [str(file) for file in files]})
        return
    table(_rows(found), title=_title(found))
    show("wrote " + ", ".join(str(file) for file in files))


def _title(found: dict[str, Any]) -> str:
    who = {"both": "concerned and unconcerned people"}.get(found["human"], f"{found['human']} people")
    return f"laboratory ({found['physics']}), {who}, {found['runs']} runs"


def _rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    tracker = found["tracker"]
    return [
        ("goal reached", f"{100 * found['reached']:.0f} %, after {found['time_to_goal_s']:.1f} s on average"),
        ("contacts", f"{found['contacts_moving']} while moving, {found['contacts_standing']} while standing"),
        ("minimum distance", f"{found['min_distance_m']:.2f} m to a person's true place"),
        ("told apart", f"{100 * found['belief_correct']:.0f} % of the {found['had_to_react']} who had to react"),
        ("PI_R ratio", f"{found['pi_r_ratio']:.2f} (unconcerned to concerned, same rooms)"),
        ("planner", f"{found['planner_hz']:.2f} Hz, {found['plan_ms']:.0f} ms per plan"),
        ("scans", f"{found['scan_hz']:.1f} Hz arrived, {found['scan_age_ms']:.0f} ms old when planning"),
        (
            "tracker",
            f"precision {tracker['precision']:.3f}, recall {tracker['recall']:.3f}, "
            f"{tracker['id_switches']} identity switches, rmse {tracker['rmse_m']:.2f} m",
        ),
    ]
