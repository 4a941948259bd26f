"""`sidestep study`: a question, the same seeded episodes with and without, a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def study(
    name: str,
    /,
    *,
    episodes: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    engine: str = "joblib",
    address: str | None = None,
    out: Path = Path("results/studies"),
    page: Path | None = None,
    json: bool = False,
) -> None:
    """Run one study; finished pieces are kept and not run again.

    Args:
        name: robots (several robots), filter (the safety filter around others), signal (the danger signal), goals
            (unknown goals), lab (the laboratory, scans at once and late), lab-mujoco (the same in MuJoCo), scale
            (encounters by the thousand, and what a million cost) or brakes (bases that cannot stop at once).
        episodes: per arm (of controls a tenth); as many as the study asks for unless given.
        seed: of the first episode.
        workers: processes; all cores by default.
        engine: joblib (this machine) or ray (a cluster).
        address: of the Ray cluster; one is started here unless given.
        out: folder for results and finished pieces.
        page: JSON file to write for the pages of evidence (docs/evidence/results); a figure goes to docs/figures.
        json: print one JSON object and nothing else.
    """
    from sidestep.commands.bars import progress_bar
    from sidestep.commands.console import emit_json, show, table
    from sidestep.commands.evidence import Picture, write_evidence, write_json
    from sidestep.io.checkpoints import Checkpoints
    from sidestep.io.files import ready_folder, ready_for
    from sidestep.studies.arms import run_study, studies
    from sidestep.studies.engines import processes
    from sidestep.viewer.figure_studies import study_figure
    from sidestep.viewer.figures import save_figure

    ready_for(page)
    folder, jobs = ready_folder(out), processes(workers)
    with progress_bar(name) as tell:
        found = run_study(
            name,
            episodes=episodes,
            seed=seed,
            workers=jobs,
            engine=engine,
            address=address,
            store=Checkpoints(folder / "pieces"),
            progress=tell,
        )
    asked = studies()[name]
    rows, remarks = asked.rows(found), asked.remarks(found)
    if asked.measured is not None:
        remarks = remarks + asked.measured(jobs)
    result: dict[str, Any] = {
        "study": name,
        "table": [dict(zip(asked.header, row, strict=True)) for row in rows],
        "remarks": remarks,
        "episodes": found,
    }
    write_json(folder / f"{name}.json", result)
    figure = study_figure(name, found)
    if figure is not None:
        save_figure(figure, folder / f"{name}.png")
    if page is not None:
        count = asked.episodes if episodes is None else episodes
        write_evidence(
            page,
            title=asked.title,
            lead=[asked.lead],
            command=f"sidestep study {name} --episodes {count}",
            tables=[{"title": "Results", "header": list(asked.header), "rows": rows}],
            pictures=[] if figure is None else [Picture(file=f"study-{name}.png", alt=asked.title, figure=figure)],
            remarks=remarks,
        )
    if json:
        emit_json(result)
        return
    table([[str(cell) for cell in row] for row in rows], title=asked.title, header=asked.header)
    for line in remarks:
        show(line)
