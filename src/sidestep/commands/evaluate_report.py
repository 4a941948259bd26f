"""The page of evidence of `sidestep evaluate` against other navigators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sidestep.studies.evaluate_table import FAIR

Row = Mapping[str, Any]

_COLUMNS = (
    ("navigator", "navigator", ""), ("episodes", "n", ""), ("collision_moving", "contact moving", ".3f"),
    ("collision_moving_upper99", "≤ (99 %)", ".3f"), ("collision_standing", "standing", ".3f"),
    ("success", "success", ".3f"), ("time_to_goal", "time to goal, s", ".2f"), ("spl", "SPL", ".3f"),
    ("min_distance_p5", "nearest (5 %), m", ".2f"), ("time_personal", "in personal space, s", ".2f"),
    ("acceleration", "acceleration, m/s²", ".2f"), ("plan_ms_p95", "plan (95 %), ms", ".1f"),
)  # fmt: skip
_AIMED = (
    "condition", "n", "contact ≤ (99 %)", "reached", "fastest safe opponent", "time by its time", "within 5 %",
    "McNemar p",
)  # fmt: skip
_OVERALL = ("navigator", "conditions", "episodes", "contact moving", "99 % interval", "time by shortest")
_SAME = (
    "Everybody meets the same people, with the same sensor, the same limits and the same seeds, on a trip of 10 m. "
    "Bodies touch below 0.6 m between centres; a contact counts as *moving* when the robot moved as it began, or moved "
    "on toward the person. People follow other models than the predictor's: straight lines, ORCA, social force, random "
    "steps. Nobody's goal is told, and nobody's coming step shows in their velocity."
)
_AIMS = (
    "What we aim at: moving contacts at most 0.05 to the upper 99 % bound in every condition (90 episodes without one "
    "are needed for that; fewer cannot show it, whatever happened in them), and a time to goal within 5 % of the "
    "fastest opponent that collides in less than 20 % of its episodes."
)
_PARTS = (
    "Each of these planners is ours with one part taken away, in the same episodes. A part may earn its place in a few "
    "conditions only; the tables by condition say in which."
)


def write_peers_page(result: Mapping[str, Any], page: Path, command: str) -> None:
    """Write the page of evidence with its figures.

    Args:
        result: of the command: "conditions", "aims", "pooled", "price_of_unconcern".
        page: JSON file for the site.
        command: that makes it again.
    """
    from sidestep.commands.evidence import Picture, write_evidence
    from sidestep.viewer.figure_peers import by_condition_figure, overall_figure, parts_figure

    rows, aims = result["conditions"], result["aims"]
    pooled = [{**row, "kind": _kind(row["navigator"])} for row in result["pooled"]]
    among_peers = any(row["kind"] == "opponent" for row in pooled)
    name = page.stem.lstrip("0123456789-")
    told = "Share of episodes with a moving contact, with exact 99 % intervals, and the mean time to goal, one "
    overall = Picture(
        file=f"{name}-overall.png",
        alt=told + ("mark per navigator." if among_peers else "line per navigator."),
        figure=overall_figure(pooled) if among_peers else parts_figure(pooled),
    )
    pictures = [overall]
    if among_peers and len(aims) > 1:
        pictures.append(
            Picture(
                file=f"{name}-conditions.png",
                alt="Per condition: moving contacts of ours, to the 99 % bound, and of others; our time by the fastest "
                "safe opponent's.",
                figure=by_condition_figure(rows, aims, _shown(pooled)),
            )
        )
    write_evidence(
        page,
        title=page_title([a["name"] for a in aims], among_peers=among_peers),
        lead=[_SAME, _AIMS if among_peers else _PARTS],
        command=command,
        tables=_tables(rows, pooled, aims if among_peers else None),
        pictures=pictures,
        remarks=_remarks(result, among_peers),
    )


def page_title(names: Sequence[str], *, among_peers: bool) -> str:
    """Return the title of a page about the conditions `names`, with opponents or ablations of ours."""
    from sidestep.studies.conditions import conditions

    if not among_peers:
        return "What each part is worth"
    return "Against other planners" + (f": {_few(names)}" if len(names) < len(conditions()) else "")


def _few(names: Sequence[str]) -> str:
    """A condition in words, or several by name, those that begin alike ("crowd-…") by their first word."""
    if len(names) == 1:
        return _worded(names[0])
    firsts = [name.split("-")[0] for name in names]
    return ", ".join(dict.fromkeys(f if firsts.count(f) > 1 else n for f, n in zip(firsts, names, strict=True)))


def _worded(condition: str) -> str:
    from sidestep.studies.conditions import conditions

    return conditions()[condition].description


def _tables(rows: Sequence[Row], pooled: Sequence[Row], aims: Sequence[Row] | None) -> list[dict[str, Any]]:
    from sidestep.studies.opponents import contestants

    tables: list[dict[str, Any]] = []
    if aims is not None:
        tables.append({"title": "What was aimed at", "header": _AIMED, "rows": [_aim(aim, rows) for aim in aims]})
    tables.append({"title": "Over all conditions", "header": _OVERALL, "rows": [_whole(row) for row in pooled]})
    parts = [row["navigator"] for row in pooled if row["kind"] == "ablation"]
    if parts:
        told = [[name, contestants()[name].description] for name in parts]
        tables.append({"title": "Ours with one part taken away", "header": ["navigator", "what differs"], "rows": told})
    head = [words for _, words, _ in _COLUMNS]
    for name in dict.fromkeys(row["name"] for row in rows):
        body = [[_text(row.get(key), form) for key, _, form in _COLUMNS] for row in rows if row["name"] == name]
        tables.append({"title": f"{name}: {_worded(name)}", "header": head, "rows": body})
    return tables


def _kind(navigator: str) -> str:
    from sidestep.studies.opponents import contestants

    return contestants()[navigator].kind


def _shown(pooled: Sequence[Row]) -> list[str]:
    """Five navigators whom the figure by condition has room for: ours, opponents, and ablations where these are few."""
    order = ("ours", "opponent", "ablation")
    return [row["navigator"] for row in sorted(pooled, key=lambda row: order.index(row["kind"]))][:5]


def _aim(aim: Row, rows: Sequence[Row]) -> list[Any]:
    own = next(r for r in rows if r["name"] == aim["name"] and r["navigator"] == "sidestep")
    against = own.get("against")
    return [
        aim["name"],
        own["episodes"],
        _text(aim["collision_moving_upper99"], ".3f"),
        aim["safe"],
        aim["fastest_opponent"],
        _text(aim["time_ratio"], ".3f"),
        aim["fast"],
        None if against is None else _text(against["mcnemar_p"], ".2g"),
    ]


def _whole(row: Row) -> list[Any]:
    low, high = row["collision_moving_ci99"]
    return [
        row["navigator"],
        row["conditions"],
        row["episodes"],
        _text(row["collision_moving"], ".3f"),
        f"{low:.3f} to {high:.3f}",
        _text(row["time_ratio"], ".3f"),
    ]


def _remarks(result: Mapping[str, Any], among_peers: bool) -> list[str]:
    if not among_peers:
        return ["Where a condition had fewer episodes, these are the first ones of it, the same for everybody."]
    aims = result["aims"]
    safe, fast = sum(a["safe"] for a in aims), sum(bool(a["fast"]) for a in aims)
    judged = sum(a["fast"] is not None for a in aims)
    lines = [
        f"The bound on moving contacts is reached in {safe} of {len(aims)} conditions, the time in {fast} of {judged}"
        + ("; in the others no opponent collides in less than 20 %." if judged < len(aims) else "."),
        "Who is expensive had fewer episodes, the first ones of the others; pairs, and times, are compared on those "
        f"that both had, and an opponent with fewer episodes than ours and fewer than {FAIR} is no yardstick.",
    ]
    prices = result["price_of_unconcern"]
    if prices:
        told = ", ".join(f"{name} {price:.2f}" for name, price in prices.items())
        lines.append(f"Price of unconcern, our mean time among the unconcerned by that among the concerned: {told}.")
    return lines


def _text(value: Any, form: str) -> str:
    return "–" if value is None else format(value, form) if form else str(value)
