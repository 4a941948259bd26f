"""From points to the table of claims: one row for each claim, parameter set, rule and definition of PI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sidestep.checks import one_of
from sidestep.studies.paper import PLACES, Place, Points
from sidestep.studies.paper_points import Setting
from sidestep.studies.paper_table import CLAIMS, Claim
from sidestep.types import FloatArray

INDICES = {"": "as printed: Σ‖x − g‖², m²", "_lateral": "Σ of the absolute lateral offset, m"}
_NAMES = {"": "as printed", "_lateral": "lateral"}
_VALUES = {"printed": "printed", "authors": "authors'"}
NAMED = 4  # places that a row lists; the figure and the grid of the results have all


def chosen_claims(ids: str | None) -> list[Claim]:
    """Return the claims named in a comma-separated list, or all.

    Raises:
        UnknownName: there is no such claim.
    """
    known = {c.id: c for c in CLAIMS}
    if not ids:
        return list(CLAIMS)
    names = ids.split(",")
    one_of("--claims", names, known)
    return [known[name] for name in names]


def asked_by(claims: Sequence[Claim], places: Sequence[Place] = PLACES) -> dict[Setting, set[str]]:
    """Return the points that the claims are judged by and what is asked of each.

    They are found by judging the claims on points that note what is asked for.
    """
    noting = _Noting(values={})
    rows(claims, noting, places)
    return noting.asked


@dataclass(frozen=True, kw_only=True, eq=False)
class _Noting(Points):
    """Points of one seed, all of them zero, that remember what was looked at."""

    asked: dict[Setting, set[str]] = field(default_factory=dict)

    def column(self, setting: Setting, name: str) -> FloatArray:
        self.asked.setdefault(setting, set()).add(name)
        return np.zeros(1)


def rows(claims: Sequence[Claim], points: Points, places: Sequence[Place] = PLACES) -> list[dict[str, Any]]:
    """Return one row per claim, place and definition of PI, ready for JSON.

    Args:
        claims: to be judged; points: what was run; places: parameter sets and rules, or those of a sweep.
    """
    table: list[dict[str, Any]] = []
    for claim in claims:
        for place in places:
            for index in INDICES if claim.by_index else ("",):
                found = claim.judge(points, place, index)
                table.append(
                    {
                        "id": claim.id,
                        "parameters": place.parameters,
                        "rule": place.rule,
                        "index": INDICES[index] if claim.by_index else None,
                        "index_name": _NAMES[index] if claim.by_index else None,
                        "statement": claim.statement,
                        "paper": claim.paper,
                        "measured": found.measured,
                        "interval": list(found.interval),
                        "n": found.n,
                        "verdict": found.verdict,
                        "quantity": found.quantity,
                        "detail": dict(found.detail),
                        "holds_when": "",
                        "at": place.words,
                    }
                )
    return table


def failing_claims(table: Sequence[dict[str, Any]]) -> set[tuple[str, str | None]]:
    """Return (id, definition of PI) of every claim that holds under neither parameter set, by whichever rule."""
    held = {(row["id"], row["index"]) for row in table if row["verdict"] == "holds"}
    return {(row["id"], row["index"]) for row in table} - held


def with_regions(table: Sequence[dict[str, Any]], grid: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the table with `holds_when` filled in where a claim does not hold.

    Where it holds under the other parameter set that is said; where it holds under neither, what the sweep found, "at
    none" included.

    Args:
        table: the rows of the parameter sets; grid: those of the sweep.
    """
    failing = failing_claims(table)

    def completed(row: dict[str, Any]) -> dict[str, Any]:
        same = (row["id"], row["index"])
        if same in failing:
            return row | {"holds_when": _region(*same, grid)}
        held = {r["parameters"] for r in table if (r["id"], r["index"]) == same and r["verdict"] == "holds"}
        return row if row["parameters"] in held else row | {"holds_when": f"the {_VALUES[held.pop()]} values"}

    return [completed(row) for row in table]


def _region(claim: str, index: str | None, grid: Sequence[dict[str, Any]]) -> str:
    here = [entry for entry in grid if (entry["id"], entry["index"]) == (claim, index)]
    good = [entry["at"] for entry in here if entry["verdict"] == "holds"]
    if not here:
        return ""
    if not good:
        return f"at none of {len(here)} places around the authors' values"
    more = f"; and {len(good) - NAMED} more" if len(good) > NAMED else ""
    return f"at {len(good)} of {len(here)} places around the authors' values: {'; '.join(good[:NAMED])}{more}"
