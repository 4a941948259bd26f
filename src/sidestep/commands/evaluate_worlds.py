"""What `sidestep evaluate` does: navigators in the same seeded worlds."""

from __future__ import annotations

from typing import Any

from sidestep.commands.evaluate_run import Run, words

FULL, QUICK = 200, 20


def evaluate_worlds(run: Run, conditions: str | None, navigators: str | None, episodes: int | None, fewer: str) -> None:
    """Ours and other navigators in the same worlds."""
    result = _comparison(run, conditions, navigators, episodes, _counts(fewer))
    if run.page is not None:
        from sidestep.commands.evaluate_report import write_peers_page

        asked = words(conditions=conditions, navigators=navigators, episodes=episodes, fewer=fewer)
        write_peers_page(result, run.page, " ".join(["sidestep evaluate", *asked]))
    header = ("condition", "navigator", "n", "moving contacts", "99 % bound", "standing", "success", "time s")
    run.told(result, "results.json", header, [_line(row) for row in result["conditions"]])


def _comparison(
    run: Run, conditions: str | None, navigators: str | None, episodes: int | None, fewer: dict[str, int]
) -> dict[str, Any]:
    from importlib.util import find_spec

    from sidestep.commands.bars import progress_bar
    from sidestep.studies.conditions import conditions as every_condition
    from sidestep.studies.evaluate import evaluate as episodes_of
    from sidestep.studies.evaluate_table import aims, condition_rows, pooled, price_of_unconcern
    from sidestep.studies.opponents import contestants

    peers = all(find_spec(name) is not None for name in ("pyrvo", "navground", "casadi"))
    worlds, everybody = every_condition(), contestants()
    skipped = [] if peers else [(n, "needs the extra [peers]") for n, c in everybody.items() if c.needs_peers]
    chosen = (
        conditions.split(",")
        if conditions
        else [n for n, c in worlds.items() if (peers or not c.needs_peers) and (c.quick or not run.quick)]
    )
    drivers = (
        navigators.split(",")
        if navigators
        else [n for n, c in everybody.items() if (peers or not c.needs_peers) and (c.quick or not run.quick)]
    )
    with progress_bar("episodes") as tell:
        found = episodes_of(
            chosen,
            drivers,
            episodes=run.count(episodes, FULL, QUICK),
            fewer=fewer,
            **run.work(tell),
        )
    rows = condition_rows(found)
    return {
        "conditions": rows,
        "aims": aims(rows),
        "pooled": pooled(found),
        "price_of_unconcern": price_of_unconcern(found),
        "skipped": [list(s) for s in skipped],
    }


def _counts(text: str) -> dict[str, int]:
    """Return name → count of "NAME=COUNT,…"."""
    from sidestep.errors import InvalidInput

    counts: dict[str, int] = {}
    for part in filter(None, text.split(",")):
        name, _, count = part.partition("=")
        if not count.isdecimal():
            raise InvalidInput("fewer", part, "NAME=COUNT, COUNT an integer ≥ 1")
        counts[name] = int(count)
    return counts


def _line(row: dict[str, Any]) -> list[str]:
    time = row["time_to_goal"]
    return [
        row["name"],
        row["navigator"],
        str(row["episodes"]),
        f"{row['collision_moving']:.3f}",
        f"{row['collision_moving_upper99']:.3f}",
        f"{row['collision_standing']:.3f}",
        f"{row['success']:.3f}",
        "–" if time is None else f"{time:.2f}",
    ]
