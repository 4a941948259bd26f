"""What `sidestep evaluate --calibration` does: run, draw, write."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sidestep.commands.evaluate_run import Run

WORDS = {
    "in_model": "drawn from the predictor's own model",
    "social_force": "walk by social force",
    "goal_switch": "turn toward the robot",
    "noise": "walk on; measured with 0.1 m of noise",
}
HEADER = ("people", "episodes", "steps", "pairs", "came true", "expected calibration error", "Brier score")


def calibrated(run: Run, episodes: int) -> dict[str, dict[str, Any]]:
    """Return the results by kind of people; figure and page are written."""
    from sidestep.commands.bars import progress_bar
    from sidestep.studies.calibration import calibration_study
    from sidestep.viewer.figure_calibration import calibration_figure
    from sidestep.viewer.figures import save_figure

    with progress_bar("calibration") as tell:
        found = calibration_study(episodes=episodes, **run.work(tell))
    save_figure(calibration_figure(found), run.folder / "calibration.png")
    if run.page is not None:
        _write_page(found, episodes, run.page)
    return found


def _write_page(found: Mapping[str, Mapping[str, Any]], episodes: int, page: Path) -> None:
    """Write the evidence as JSON that the site makes a page of."""
    from sidestep.commands.evidence import Picture, write_evidence
    from sidestep.viewer.figure_calibration import calibration_figure

    rows = [
        [WORDS.get(kind, kind), episodes, f["steps"], f["n"], round(sum(b["frequency"] * b["n"] for b in f["bins"])),
         f"{f['ece']:.4f}", f"{f['brier']:.4f}"]
        for kind, f in found.items()
    ]  # fmt: skip
    bins = [
        {
            "title": f"Bins: people {WORDS.get(kind, kind)}",
            "header": ["predicted", "pairs", "mean prediction", "came true", "exact 99 % interval"],
            "rows": [
                [f"{b['from']:g} to {b['to']:g}", b["n"], f"{b['predicted']:.4f}", f"{b['frequency']:.4f}",
                 f"{b['low']:.4f} to {b['high']:.4f}"]
                for b in f["bins"]
            ],
        }
        for kind, f in found.items()
    ]  # fmt: skip
    write_evidence(
        page,
        title="Do predicted collisions come true?",
        lead=[
            "P_coll(k|t) of a plan speaks of a robot that keeps to it. So the robot here keeps each plan for its five "
            "steps of 0.5 s, and is told to accept any risk; each plan gives five pairs of prediction and outcome. The "
            "error is the mean distance of prediction and frequency over the bins, weighted by their counts."
        ],
        command=f"sidestep evaluate --calibration --episodes {episodes}",
        pictures=[
            Picture(
                file="calibration.png",
                alt="Share of predicted first contacts that came true, over the predicted probability, one panel per "
                "kind of people; hollow: none came true.",
                figure=calibration_figure(found),
            )
        ],
        tables=[{"title": "Summary", "header": list(HEADER), "rows": rows}, *bins],
        remarks=["Only the first kind is drawn from the model. The others are what the model does not know."],
    )
