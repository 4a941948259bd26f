"""Check what `sidestep reproduce` wrote: every claim under both parameter sets and rules, each verdict with numbers.

python tools/check_reproduction.py RESULTS.json [PAGE.md]
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from sidestep.studies.paper import PARAMETERS, RULES
from sidestep.studies.paper_table import CLAIMS

VERDICTS = ("holds", "does not hold", "undecided")


def troubles(rows: list[dict], page: str | None) -> list[str]:
    """Return what is missing, one line each."""
    found: list[str] = []
    for claim in CLAIMS:
        for parameters in PARAMETERS:
            for rule in RULES:
                mine = [r for r in rows if (r["id"], r["parameters"], r["rule"]) == (claim.id, parameters, rule)]
                name = f"{claim.id}, {parameters}, {rule}"
                if not mine:
                    found.append(f"{name}: no verdict")
                for row in mine:
                    numbers = [row["measured"], *row["interval"]]
                    known = all(isinstance(x, (int, float)) and math.isfinite(x) for x in numbers) and row["n"] > 0
                    if row["verdict"] not in VERDICTS:
                        found.append(f"{name}: verdict {row['verdict']!r}")
                    elif not known and (row["verdict"] == "holds" or not row["quantity"]):
                        found.append(f"{name}: {row['verdict']} without numbers")
        if page is not None and f"## {claim.id}\n" not in page:
            found.append(f"{claim.id}: not on the page")
    return found


if __name__ == "__main__":
    results = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    page = Path(sys.argv[2]).read_text(encoding="utf-8") if len(sys.argv) > 2 else None
    wrong = troubles(results["claims"], page)
    print("\n".join(wrong) or f"{len(results['claims'])} verdicts, all with numbers; every claim is there")
    sys.exit(bool(wrong))
