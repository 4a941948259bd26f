"""From points to the table of claims: one row for each claim, parameter set, rule and definition of PI."""

from __future__ import annotations

from typing import Any

import numpy as np

from sidestep.errors import UnknownName
from sidestep.studies.paper import PARAMETERS, RULES, Points
from sidestep.studies.paper_claims import below
from sidestep.studies.paper_points import Setting
from sidestep.studies.paper_table import CLAIMS, Claim

INDICES = {"": "as printed: Σ‖x − g‖², m²", "_lateral": "Σ of the absolute lateral offset, m"}


def chosen_claims(ids: str | None) -> list[Claim]:
    """Return the claims named in a comma-separated list, or all.

    Raises:
        UnknownName: there is no such claim.
    """
    known = {c.id: c for c in CLAIMS}
    if not ids:
        return list(CLAIMS)
    for name in ids.split(","):
        if name not in known:
            raise UnknownName("--claims", name, known)
    return [known[name] for name in ids.split(",")]


def rows(claims: list[Claim], points: Points, regions: dict[str, str]) -> list[dict[str, Any]]:
    """Return one row per claim, parameter set, rule and definition of PI, ready for JSON.

    Args:
        claims: to be judged; points: what was run; regions: claim id → where it holds, from `holds_when`.
    """
    table: list[dict[str, Any]] = []
    for claim in claims:
        for parameters in PARAMETERS:
            for rule in RULES:
                for index in INDICES if claim.by_index else ("",):
                    found = claim.judge(points, parameters, rule, index)
                    table.append(
                        {
                            "id": claim.id,
                            "parameters": parameters,
                            "rule": rule,
                            "index": INDICES[index] if claim.by_index else None,
                            "statement": claim.statement,
                            "paper": claim.paper,
                            "measured": found.measured,
                            "interval": list(found.interval),
                            "n": found.n,
                            "verdict": found.verdict,
                            "quantity": found.quantity,
                            "detail": dict(found.detail),
                            "holds_when": regions.get(claim.id, "") if found.verdict != "holds" else "",
                        }
                    )
    return table


def holds_when(points: Points, settings: list[Setting]) -> tuple[dict[str, str], list[dict[str, Any]]]:
    """Look for the region of parameters in which the claims of Section IV-A (and the telling apart) hold.

    Returns:
        claim id → region in words; and the whole grid, one entry per claim and point.
    """
    quantities = {"IV-A-shorter": "robot_length", "IV-A-smoother": "robot_turning", "IV-A-narrower": "entropy"}
    grid: list[dict[str, Any]] = []
    for changes in dict.fromkeys(s.changes for s in settings):
        here = {(s.human, s.anticipation): s for s in settings if s.changes == changes}
        for claim, column in quantities.items():
            ahead = points.column(here["concerned", 5], column)
            blind = points.column(here["concerned", 0], column)
            found = below(ahead - blind, 0.0, column)
            grid.append(_entry(claim, changes, found.measured, found.interval, found.verdict))
        right = np.concatenate(
            [
                points.column(here["concerned", 5], "belief_at_closest") > 0.9,
                points.column(here["unconcerned", 5], "belief_at_closest") < 0.1,
            ]
        )
        share = float(right.mean())
        grid.append(
            _entry("V-distinguishes", changes, share, (share, share), "holds" if share >= 0.9 else "does not hold")
        )
    regions: dict[str, str] = {}
    for claim in {entry["claim"] for entry in grid}:
        good = [entry["at"] for entry in grid if entry["claim"] == claim and entry["verdict"] == "holds"]
        regions[claim] = "authors' values but " + " | ".join(good) if good else "nowhere in the sweep"
    return regions, grid


def _entry(
    claim: str, changes: tuple[tuple[str, float], ...], measured: float, interval: tuple[float, float], verdict: str
) -> dict[str, Any]:
    at = ", ".join(f"{k} {v:g}" for k, v in changes)
    return {
        "claim": claim,
        "at": at,
        "changes": dict(changes),
        "measured": measured,
        "interval": list(interval),
        "verdict": verdict,
    }
