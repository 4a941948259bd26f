"""The documentation page of the reproduction, written from its results and by nothing else."""

from __future__ import annotations

import platform
import shutil
from datetime import date
from pathlib import Path
from typing import Any

CAPTIONS = {
    "comparison": "One run without and one with prediction in the person's decisions, and the predicted distribution.",
    "indices": "Performance indices over the horizon: median and 95 % interval of the median over all seeds.",
    "lab": "Section V with a concerned and an unconcerned person.",
    "reasons": "Why some claims do not hold: where awareness changes no action the belief cannot move; where no cell "
    "reaches P_th the rule `cells` constrains nothing.",
    "regions": "Where the claims that hold under neither parameter set do hold, around the authors' values: danger "
    "weight and rate, randomness, and the speeds of both.",
    "replay": "The recorded robot runs: the belief that was logged, and the one that our update infers.",
}


def write_page(result: dict[str, Any], figures: list[Path], page: Path) -> None:
    """Write `page` (Markdown) and copy the PNG figures beside it."""
    from sidestep.io.files import written

    pictures = page.parent / "reproduction"
    pictures.mkdir(parents=True, exist_ok=True)
    lines = [
        "# Reproduction",
        "",
        f"Made by `sidestep reproduce{' --quick' if result['quick'] else ''} --page …` on {date.today().isoformat()}, "
        f"{platform.machine()} with Python {platform.python_version()}, in {result['seconds']:.0f} s. "
        "Every number below was measured by that command.",
        "",
        "The printed text does not fully determine its figures, so every claim is judged under two parameter sets: the "
        "values that are *printed*, and those of the *authors'* public scripts. Only the direction of each effect is "
        "compared. A verdict is `undecided` when the 95 % interval covers both answers.",
        "",
    ]
    lines += _summary(result["claims"])
    for identity in dict.fromkeys(row["id"] for row in result["claims"]):
        mine = [row for row in result["claims"] if row["id"] == identity]
        lines += [f"## {identity}", "", f"**Claim:** {mine[0]['statement']}. **Paper:** {mine[0]['paper']}.", ""]
        lines += [
            "| set | rule | what | measured | 95 % | n | verdict | holds when |",
            "|---|---|---|---|---|---|---|---|",
        ]
        for row in mine:
            low, high = row["interval"]
            index = f" ({row['index']})" if row["index"] else ""
            lines.append(
                f"| {row['parameters']} | {row['rule']} | {_plain(row['quantity'])}{index} | {row['measured']:.4g} | "
                f"{low:.3g} … {high:.3g} | {row['n']} | {row['verdict']} | {_plain(row['holds_when'])} |"
            )
        lines.append("")
    lines += ["## Figures", ""]
    for figure in figures:
        if figure.suffix == ".png":
            shutil.copyfile(figure, pictures / figure.name)
            caption = CAPTIONS[figure.stem.split("-")[0]]
            lines += [f"![{caption}](reproduction/{figure.name})", "", f"*{figure.stem}: {caption}*", ""]
    with written(page) as file:
        file.write("\n".join(lines).encode())


def _summary(claims: list[dict[str, Any]]) -> list[str]:
    """Return one line per claim and definition of PI: its verdict at each place."""
    columns = list(dict.fromkeys((row["parameters"], row["rule"]) for row in claims))
    heads = [f"{parameters}, {rule}" for parameters, rule in columns]
    lines = ["## At a glance", "", f"| claim | {' | '.join(heads)} |", f"|---|{'---|' * len(heads)}"]
    verdicts: list[str] = []
    for identity, index in dict.fromkeys((row["id"], row["index_name"]) for row in claims):
        mine = {
            (r["parameters"], r["rule"]): r["verdict"]
            for r in claims
            if (r["id"], r["index_name"]) == (identity, index)
        }
        verdicts += mine.values()
        anchor = f"[{identity}](#{identity.lower()})" + (f" ({index})" if index else "")
        cells = [f"**{mine[c]}**" if mine[c] == "holds" else mine[c] for c in columns]
        lines.append(f"| {anchor} | {' | '.join(cells)} |")
    counts = [f"{verdicts.count(v)} {v}" for v in ("holds", "does not hold", "undecided")]
    return [*lines, "", f"Of {len(verdicts)} verdicts: {', '.join(counts)}.", ""]


def _plain(text: str) -> str:
    return text.replace("|", "/")
