"""The tables, the file and the figures of `sidestep bench`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def show_tables(result: dict[str, Any]) -> None:
    """Print what was measured."""
    from sidestep.commands.console import table

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
    table(rows, title=result["machine"], header=("case", "median ms", "p95 ms", "target", "met"))
    peers = [[n, f"{p['median_ms']:.3f}", f"{p['p95_ms']:.3f}", p["promises"]] for n, p in result["peers"].items()]
    peers.append(
        [
            "sidestep, N = 5",
            f"{result['cases'][0]['median_ms']:.3f}",
            f"{result['cases'][0]['p95_ms']:.3f}",
            result["cases"][0]["promises"],
        ]
    )
    table(peers, title="other planners, same scene", header=("planner", "median ms", "p95 ms", "promises"))
    for line in result["missing"]:
        print(f"left out: {line}")
    table([[k, f"{v:.3g}"] for k, v in result["ratios"].items()], title="ratios within this run")
    limits = result["ceilings"]
    best = f"{limits['gflops']:.1f} Gflop/s, {limits['gbytes_per_s']:.1f} GB/s"
    header = ("case", "Mflop", "MB", "floor ms", "measured ms", "fraction")
    title = f"prediction of one concerned person; this machine's ceilings: {best}"
    table(_floors(result["floors"]), title=title, header=header)
    table(_floors(result["kernels"]), title="parts of a planning step, N = 20, one person", header=header)
    table([[k, f"{v:.2f}"] for k, v in result["exponents"].items()], title="growth: exponent of time over size")
    d = result["deadline"]
    print(
        f"deadline {d['deadline_ms']:g} ms at N = {d['horizon']}: {100 * d['share']:.2f} % of {d['steps']} steps late, "
        f"worst by {d['worst_ms']:.2f} ms"
    )


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


def draw(result: dict[str, Any], out: Path) -> list[str]:
    """Write results.json and the figures; their paths."""
    from sidestep.commands.console import plain
    from sidestep.io.files import ready_folder, written
    from sidestep.viewer.figure_bench import growth_figure, horizon_figure

    folder = ready_folder(out)
    with written(folder / "results.json") as file:
        file.write(json.dumps(plain(result), indent=1).encode())
    peers = {name: p["median_ms"] for name, p in result["peers"].items()}
    floors = {int(n.partition("= ")[2]): f["floor_ms"] for n, f in result["floors"].items()}
    figures = {
        "time-over-horizon": horizon_figure(result["over_horizon"]["N"], result["over_horizon"]["ms"], floors, peers),
        "time-over-people": growth_figure(result["growth"]["people (expected 1)"]),
    }
    paths: list[str] = []
    for name, figure in figures.items():
        for kind in ("png", "pdf"):
            path = folder / f"{name}.{kind}"
            with written(path) as file:
                figure.savefig(file, format=kind, dpi=200)
            paths.append(str(path))
    return paths
