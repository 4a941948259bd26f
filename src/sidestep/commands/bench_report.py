"""The tables, the file and the figures of `sidestep bench`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def show_tables(result: dict[str, Any]) -> None:
    """Print what was measured."""
    from sidestep.commands.console import table

    for part in _tables(result):
        table(part["rows"], title=part["title"], header=part["header"])
    for line in result["missing"]:
        print(f"left out: {line}")
    for line in _remarks(result):
        print(line)


def write_bench_page(result: dict[str, Any], page: Path, command: str) -> None:
    """Write the page of evidence with its figures."""
    from sidestep.commands.evidence import Picture, write_evidence

    write_evidence(
        page,
        title="How fast planning is",
        lead=[
            "One core, after warm-up; a planning step is everything between an observation and a command: all rounds "
            "of prediction and search, and the certificate. Times are of one machine; the ratios are within one run."
        ],
        command=command,
        pictures=[
            Picture(file=f"bench-{name}.png", alt=f"Planning time: {name.replace('-', ' ')}", figure=figure)
            for name, figure in _figures(result).items()
        ],
        tables=_tables(result),
        remarks=_remarks(result),
    )


def _remarks(result: dict[str, Any]) -> list[str]:
    from sidestep.rehearsal import HORIZONS

    d = result["deadline"]
    return [
        f"Deadline {d['deadline_ms']:g} ms at N = {d['horizon']}: {100 * d['share']:.2f} % of {d['steps']} steps late, "
        f"worst by {d['worst_ms']:.2f} ms.",
        f"Floors count every cell of every sweep. From N = {HORIZONS[-1]} on, cells where the robot makes no "
        "difference are not visited, so that a fraction there may be more than the sweeps themselves reach.",
    ]


def _tables(result: dict[str, Any]) -> list[dict[str, Any]]:
    """Everything that was measured, as titles, headers and rows of text."""
    limits = result["ceilings"]
    best = f"{limits['gflops']:.1f} Gflop/s, {limits['gbytes_per_s']:.1f} GB/s"
    work = ("case", "Mflop", "MB", "floor ms", "measured ms", "fraction")
    return [
        {"title": "Targets", "header": ("case", "median ms", "p95 ms", "target", "met"), "rows": _cases(result)},
        {
            "title": "Other planners, same scene",
            "header": ("planner", "median ms", "p95 ms", "promises"),
            "rows": _peers(result),
        },
        {
            "title": "Ratios within this run",
            "header": ("ratio", "value"),
            "rows": [[k, f"{v:.3g}"] for k, v in result["ratios"].items()],
        },
        {
            "title": f"Prediction of one concerned person; ceilings of this machine: {best}",
            "header": work,
            "rows": _floors(result["floors"]),
        },
        {
            "title": "Parts of a planning step, N = 20, one person",
            "header": work,
            "rows": _floors(result["kernels"]),
        },
        {
            "title": "Growth: exponent of time over size",
            "header": ("over", "exponent"),
            "rows": [[k, f"{v:.2f}"] for k, v in result["exponents"].items()],
        },
    ]


def _cases(result: dict[str, Any]) -> list[list[str]]:
    rows: list[list[str]] = []
    for case in result["cases"]:
        if "median_ms" in case:
            met = "yes" if case["p95_ms"] <= case["target_ms"] else "no"
            rows.append(
                [case["name"], f"{case['median_ms']:.2f}", f"{case['p95_ms']:.2f}", f"{case['target_ms']:g}", met]
            )
        elif "median_mb" in case:
            met = "yes" if case["median_mb"] <= case["target_mb"] else "no"
            rows.append([case["name"], f"{case['median_mb']:.0f} MB", "", f"{case['target_mb']:g} MB", met])
        else:
            met = "yes" if case["per_second"] >= case["target_per_second"] else "no"
            rows.append([case["name"], f"{case['per_second']:.1f}/s", "", f"{case['target_per_second']:g}/s", met])
    return rows


def _peers(result: dict[str, Any]) -> list[list[str]]:
    ours = result["cases"][0]
    found = {**result["peers"], "sidestep, N = 5": ours}
    return [[n, f"{p['median_ms']:.3f}", f"{p['p95_ms']:.3f}", p["promises"]] for n, p in found.items()]


def _floors(found: dict[str, Any]) -> list[list[str]]:
    """Rows of what must be done, how long that would take at the ceilings, and how long it took."""
    return [
        [
            name,
            f"{f['flop'] / 1e6:.1f}",
            f"{f['bytes'] / 1e6:.1f}",
            f"{f['floor_ms']:.3f}",
            f"{f['ms']:.3f}",
            f"{f['fraction']:.2f}",
        ]
        for name, f in found.items()
    ]


def draw(result: dict[str, Any], folder: Path) -> list[str]:
    """Write results.json and the figures; their paths."""
    from sidestep.commands.console import plain
    from sidestep.io.files import written

    with written(folder / "results.json") as file:
        file.write(json.dumps(plain(result), indent=1).encode())
    paths: list[str] = []
    for name, figure in _figures(result).items():
        for kind in ("png", "pdf"):
            path = folder / f"{name}.{kind}"
            with written(path) as file:
                figure.savefig(file, format=kind, dpi=200)
            paths.append(str(path))
    return paths


_FIGURES = ("time-over-horizon", "time-over-people")


def _figures(result: dict[str, Any]) -> dict[str, Any]:
    from sidestep.viewer.figure_bench import growth_figure, horizon_figure

    peers = {name: p["median_ms"] for name, p in result["peers"].items()}
    floors = {int(n.partition("= ")[2]): f["floor_ms"] for n, f in result["floors"].items()}
    over, people = result["over_horizon"], result["growth"]["people (expected 1)"]
    drawn = (
        horizon_figure(over["N"], over["ms"], floors, peers),
        growth_figure(people),
    )
    return dict(zip(_FIGURES, drawn, strict=True))
