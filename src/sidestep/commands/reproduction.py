"""What `sidestep reproduce` does: run, judge, draw, write."""

from __future__ import annotations

import json
import os
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sidestep.io.checkpoints import Checkpoints
    from sidestep.simulation.scenario import Scenario

LABELS = ("paper-printed", "paper-authors", "lab-printed", "lab-meeting")


def make(
    *, quick: bool, claims: str | None, out: Path, workers: int | None, page: Path | None, data: Path | None
) -> dict[str, Any]:
    """Return the results as they go into JSON; arguments as for the command."""
    from sidestep.commands.bars import progress_bar
    from sidestep.commands.console import plain
    from sidestep.commands.reproduce import FULL_SEEDS, QUICK_SEEDS, SWEEP_SEEDS
    from sidestep.commands.reproduction_figures import draw
    from sidestep.commands.reproduction_page import write_page
    from sidestep.io.checkpoints import Checkpoints
    from sidestep.io.files import ready_for, written
    from sidestep.io.scenarios import load_scenario
    from sidestep.studies.engines import processes
    from sidestep.studies.paper import PLACES, run_points, sweep
    from sidestep.studies.paper_table import CLAIMS
    from sidestep.studies.paper_verdicts import asked_by, chosen_claims, failing_claims, rows, with_regions

    ready_for(page)
    recorded = _recorded(data)
    began = perf_counter()
    chosen = chosen_claims(claims)
    bases = {label: load_scenario(label) for label in LABELS}
    store = Checkpoints(out / "points")
    jobs = processes(workers)
    settings = list(asked_by(chosen)) if claims else [s for place in PLACES for s in place.settings()]
    columns = asked_by(CLAIMS)  # whichever are chosen now: what is kept serves them all
    with progress_bar("runs of the paper") as tell:
        points = run_points(
            settings,
            bases,
            columns=columns,
            seeds=QUICK_SEEDS if quick else FULL_SEEDS,
            workers=jobs,
            store=store,
            progress=tell,
        )
    table = rows(chosen, points)
    grid: list[dict[str, Any]] = []
    if not quick:
        failing = {identity for identity, _ in failing_claims(table)}
        search, places = [c for c in chosen if c.id in failing], sweep()
        columns = asked_by(search, places)
        with progress_bar("where do failing claims hold") as tell:
            around = run_points(
                list(columns), bases, columns=columns, seeds=SWEEP_SEEDS, workers=jobs, store=store, progress=tell
            )
        grid = rows(search, around, places)
        table = with_regions(table, grid)
    figures = _saved(draw(points, bases, grid, _replays(recorded, bases)), out, jobs)
    result = {
        "claims": table,
        "grid": grid,
        "figures": [str(f) for f in figures],
        "seconds": _spent(Checkpoints(out), perf_counter() - began),
        "quick": quick,
    }
    with written(out / "results.json") as file:
        file.write(json.dumps(plain(result), indent=1).encode())
    if page is not None:
        write_page(result, figures, page)
    return result


def _spent(store: Checkpoints, seconds: float) -> float:
    """Seconds of this run and of those of the same program that finished in this folder before."""
    name = "seconds"
    spent = float(store.load(name) or 0.0) + seconds
    store.keep(name, spent)
    return spent


def _recorded(data: Path | None) -> Path | None:
    """Return the folder with the recorded robot runs; None where none was named and none is known to be there."""
    from sidestep.errors import InvalidInput

    folder = data or (Path(os.environ["SIDESTEP_DATA"]) / "paper_runs" if "SIDESTEP_DATA" in os.environ else None)
    if folder is not None and all((folder / name).is_file() for name in ("tracks.csv.gz", "meta.csv")):
        return folder
    if data is not None:
        raise InvalidInput("--data", str(data), "a folder that holds tracks.csv.gz and meta.csv")
    return None


def _replays(folder: Path | None, bases: dict[str, Scenario]) -> list[tuple[str, Any, Any]]:
    """(name, logged belief, our belief) of each recorded run; empty without the recordings."""
    if folder is None:
        return []
    import csv

    import numpy as np

    from sidestep.io.tracks import read_recordings
    from sidestep.studies.paper_replay import replay

    with (folder / "meta.csv").open(encoding="utf-8") as file:
        meta = {row["file"]: row for row in csv.DictReader(file)}
    found: list[tuple[str, Any, Any]] = []
    for scene, recording in read_recordings(folder / "tracks.csv.gz").items():
        tracks = {track.agent: track.positions for track in recording.tracks}
        if not {"x_H", "x_R"} <= set(tracks) or scene not in meta:
            continue
        n = min(len(tracks["x_H"]), len(tracks["x_R"]))
        ours = replay(scene, tracks["x_H"][:n], tracks["x_R"][:n], bases["lab-meeting"].human)
        logged = np.array([float(x) for x in meta[scene]["P_beta1"].split()])
        found.append((Path(scene).stem.replace("xperiment_", ""), logged, ours.beliefs))
    return found[:5]


def _saved(figures: dict[str, Figure], out: Path, workers: int) -> list[Path]:
    """Write each figure as PDF and PNG, several at a time."""
    from sidestep.studies.engines import run_pieces

    drawn = [(figure, [out / f"{name}.{kind}" for kind in ("pdf", "png")]) for name, figure in figures.items()]
    list(run_pieces(_save, drawn, workers=workers))
    return [path for _, paths in drawn for path in paths]


def _save(drawn: tuple[Figure, list[Path]]) -> None:
    from sidestep.io.files import written

    figure, paths = drawn
    for path in paths:
        with written(path) as file:
            figure.savefig(file, format=path.suffix[1:], dpi=200)
        figure.set_layout_engine("none")  # laid out once, for both
