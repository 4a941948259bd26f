"""`sidestep bench`: how fast planning is, side by side in one run."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from sidestep.commands.provenance import machine

if TYPE_CHECKING:
    from sidestep.studies.bench import Case

PEER_PROMISES = {
    "ORCA": "nothing about people who do not give way",
    "constant-velocity MPC, 15 steps": "soft distances to people who keep their velocity",
    "SciPy transcription, N = 1": "the paper's constraint, local optimum",
    "SciPy transcription, N = 2": "the paper's constraint, local optimum",
}
OURS_PROMISES = "certified bound on the collision probability, or says that there is none"


def bench(
    *, quick: bool = False, out: Path = Path("results/bench"), page: Path | None = None, json: bool = False
) -> None:
    """Measure planning times against targets, the machine's floor, and other planners; print ratios.

    Args:
        quick: fewer steps per case.
        out: folder for results.json and the figures.
        page: JSON file to write for the pages of evidence (docs/evidence/results), with the figures in ../../figures.
        json: print one JSON object and nothing else.
    """
    from sidestep.commands.bars import first_time
    from sidestep.commands.bench_report import draw, show_tables, write_bench_page
    from sidestep.commands.console import emit_json, say
    from sidestep.io.files import ready_folder, ready_for

    ready_for(page)
    folder = ready_folder(out)
    first_time(walls=True)
    result = measured(quick, say)
    figures = draw(result, folder)
    if page is not None:
        write_bench_page(result, page, f"sidestep bench{' --quick' if quick else ''}")
    if json:
        emit_json(result | {"figures": figures})
        return
    show_tables(result)
    for figure in figures:
        print(f"wrote {figure}")


def measured(quick: bool, say: Any) -> dict[str, Any]:
    """Run everything, one thing after the other; on one core, but for the threads."""
    from sidestep.studies.bench import CASES, Case, deadline_overruns, exponents, thread_ratios, time_case, time_peers
    from sidestep.studies.bench_floor import ceilings, floor_fraction, kernel_work

    steps = 60 if quick else 300
    limits = ceilings()
    timings: list[Any] = []
    for case in CASES:
        say(f"bench: {case.name}")
        timings.append(time_case(case, steps=max(20, steps // (8 if case.horizon >= 50 or case.people >= 50 else 1))))
    say("bench: other planners")
    peers, missing = time_peers(steps=steps)
    fifteen = Case(name="N = 15, one person", target=float("nan"), horizon=15)
    same = time_case(fifteen, steps=steps)
    say("bench: threads")
    threads = thread_ratios(encounters=2 if quick else 6)
    say("bench: growth")
    growth = {name: [(x, time_case(c, steps=20).median) for x, c in series] for name, series in _growth(Case)}
    say("bench: floor of the sweeps")
    floors = {f"N = {n}": floor_fraction(n, limits) for n in (5, 10, 20, 50)}
    kernels = kernel_work(20, limits)
    say("bench: deadline")
    overruns = deadline_overruns(deadline=0.01, horizon=50, steps=1000 if quick else 10_000)
    say("bench: start-up, memory, episodes, SciPy transcription")
    scipy = _scipy_times(quick)
    ours = {n: time_case(Case(name="", target=0, horizon=n), steps=40).median for n in (1, 2)}
    ratios = {f"scipy_over_sidestep_n{n}": ms / ours[n] for n, ms in scipy.items()}
    if "constant-velocity MPC, 15 steps" in peers:
        ratios["cvmpc_over_sidestep_n15"] = peers["constant-velocity MPC, 15 steps"].median / same.median
    if "ORCA" in peers:
        ratios["orca_over_sidestep_n5"] = peers["ORCA"].median / timings[0].median
    ratios |= threads
    plain = {case.horizon: t.median for case, t in zip(CASES, timings, strict=True) if case.plain}
    horizons = dict(sorted({**plain, fifteen.horizon: same.median}.items()))
    extra = {
        name: {"median_ms": t.median, "p95_ms": t.p95, "promises": PEER_PROMISES[name]} for name, t in peers.items()
    }
    extra |= {
        f"SciPy transcription, N = {n}": {
            "median_ms": ms,
            "p95_ms": ms,
            "promises": PEER_PROMISES[f"SciPy transcription, N = {n}"],
        }
        for n, ms in scipy.items()
    }
    return {
        "machine": machine(),
        "cases": [
            {"name": t.name, "median_ms": t.median, "p95_ms": t.p95, "target_ms": t.target, "promises": OURS_PROMISES}
            for t in timings
        ]
        + _other_cases(),
        "peers": extra,
        "missing": missing,
        "ratios": ratios,
        "ceilings": limits,
        "floor_fraction": {name: f["fraction"] for name, f in floors.items()},
        "floors": floors,
        "kernels": kernels,
        "exponents": exponents(growth),
        "growth": {k: [list(p) for p in v] for k, v in growth.items()},
        "deadline": overruns,
        "over_horizon": {"N": list(horizons), "ms": list(horizons.values())},
    }


def _growth(case: type[Case]) -> list[tuple[str, list[tuple[int, Case]]]]:
    """What time is measured over, with the exponent that is expected, and the cases: (size, case)."""
    one = partial(case, name="", target=0.0)
    return [
        ("N_R = N_H = N (expected 4)", [(n, one(horizon=n)) for n in (20, 30, 40)]),
        ("people (expected 1)", [(p, one(horizon=10, people=p)) for p in (5, 10, 20)]),
        ("goals (expected 1)", [(g, one(horizon=10, goals=g)) for g in (3, 6, 12)]),
        # components of actions, T per axis: T cells more per step on every axis, T sums per axis and cell
        ("actions per axis, d = 2 (expected 3)", [(2 * r + 1, one(horizon=20, reach=r)) for r in (1, 2, 3)]),
        ("d: factor per dimension over N (expected 1)", [(6**d, one(horizon=5, dimension=d)) for d in (1, 2, 3)]),
    ]


def _other_cases() -> list[dict[str, Any]]:
    """Start-up, memory and episodes: each in a fresh process."""
    found: list[dict[str, Any]] = []
    for name, target, unit, code in (
        ("import sidestep", 500.0, "ms", "import sidestep"),
        ("sidestep --help", 400.0, "ms", "from sidestep.cli import execute; execute(['--help'])"),
        ("first plan, warm cache", 1000.0, "ms", _FIRST_PLAN),
    ):
        best = min(_fresh(code) for _ in range(3))
        found.append({"name": name, "median_ms": best, "p95_ms": best, "target_ms": target, "unit": unit})
    megabytes = float(_output(_MEMORY))
    found.append({"name": "resident memory, N = 50", "median_mb": megabytes, "target_mb": 300.0, "unit": "MB"})
    rate = float(_output(_EPISODES))
    found.append({"name": "episodes of crossing per second, N = 5", "per_second": rate, "target_per_second": 40.0})
    return found


_FIRST_PLAN = """
import sidestep
p = sidestep.Planner(robot=sidestep.Holonomic(), goal=(0.0, 5.0))
p.step(time=0.0, robot=sidestep.RobotState(position=(0.0, -5.0)),
       people=[sidestep.PersonObservation(id="a", position=(-5.0, 0.0), velocity=(1.0, 0.0))])
"""
# VmHWM, not `ru_maxrss`: the latter of a process just started is at least what its parent held
_MEMORY = """
import sidestep
p = sidestep.Planner(robot=sidestep.Holonomic(), goal=(0.0, 5.0), horizon=50)
for i in range(3):
    p.step(time=0.5 * i, robot=sidestep.RobotState(position=(0.0, -5.0)),
           people=[sidestep.PersonObservation(id="a", position=(-3.0, 0.0), velocity=(1.0, 0.0), goal=(5.0, 0.0))])
print(next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""
_EPISODES = """
from time import perf_counter
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.loop import simulate
s = load_scenario("crossing", ["planner.horizon=5"])
for seed in range(10):  # by then everything that an episode may need has been loaded
    simulate(s, seed=seed, snapshots=0)
t = perf_counter()
for seed in range(10, 50):
    simulate(s, seed=seed, snapshots=0)
print(40 / (perf_counter() - t))
"""


def _fresh(code: str) -> float:
    """Milliseconds of a fresh interpreter running `code`, less those of one that does nothing."""
    return max(_run_time(code) - _run_time("pass"), 0.0)


def _run_time(code: str) -> float:
    warm = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}  # its cache is one of those meant
    began = perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, env=warm)
    return 1e3 * (perf_counter() - began)


def _output(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout


def _scipy_times(quick: bool) -> dict[int, float]:
    """Ms per planning step of the transcription, where the source tree is at hand."""
    script = Path(__file__).parents[3] / "benchmarks" / "scipy_transcription.py"
    if not script.is_file():
        return {}
    return {n: 1e3 * float(_script(script, n)) for n in ((1,) if quick else (1, 2))}


def _script(script: Path, n: int) -> str:
    return subprocess.run([sys.executable, str(script), str(n)], check=True, capture_output=True, text=True).stdout
