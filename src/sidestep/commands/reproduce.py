"""`sidestep reproduce`: Sections IV and V of the paper, claim by claim."""

from __future__ import annotations

from pathlib import Path
from typing import Any

FULL_SEEDS, QUICK_SEEDS, SWEEP_SEEDS = 200, 20, 20


def reproduce(
    *,
    quick: bool = False,
    claims: str | None = None,
    out: Path = Path("results/reproduction"),
    workers: int | None = None,
    page: Path | None = None,
    data: Path | None = None,
    json: bool = False,
) -> None:
    """Run the paper's claims and print for each what it says, what was measured, and a verdict.

    Finished points are kept in the output folder and not run again; Ctrl-C loses at most the seeds under way.

    Args:
        quick: 20 seeds per point instead of 200, and no search for the region where a failing claim holds.
        claims: comma-separated ids; all by default. Only the points that they need are run.
        out: folder for results.json, figures and finished points.
        workers: processes; all cores by default.
        page: also write the documentation page (Markdown) to this file, figures beside it.
        data: folder with the recorded robot runs (tracks.csv.gz, meta.csv), to be replayed.
        json: print one JSON object and nothing else.
    """
    from sidestep.commands.console import emit_json, table
    from sidestep.commands.reproduction import make

    result = make(quick=quick, claims=claims, out=out, workers=workers, page=page, data=data)
    if json:
        emit_json(result)
        return
    table([_line(row) for row in result["claims"]], header=("claim", "set", "rule", "measured", "95 %", "n", "verdict"))
    for figure in result["figures"]:
        print(f"wrote {figure}")
    print(f"{result['seconds']:.0f} s")


def _line(row: dict[str, Any]) -> list[str]:
    low, high = row["interval"]
    name = row["id"] + (" (lateral)" if row["index_name"] == "lateral" else "")
    verdict = row["verdict"] + (f"; holds when {row['holds_when']}" if row["holds_when"] else "")
    return [
        name,
        row["parameters"],
        row["rule"],
        f"{row['measured']:.4g}",
        f"{low:.3g} … {high:.3g}",
        str(row["n"]),
        verdict,
    ]
