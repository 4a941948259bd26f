"""Write src/sidestep/_kernels/needed.txt: what kernels a first run calls, with what arguments, and what each takes.

    NUMBA_CACHE_DIR=$(mktemp -d) python tools/list_kernels.py

compiles everything on one processor, which takes a few minutes. To be run when a test says that the list is outdated.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from numba.core.dispatcher import Dispatcher

from sidestep import DifferentialDrive, Holonomic, Planner
from sidestep.compiling import TABLE, code_of
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.loop import simulate

Seconds = dict[tuple[str, tuple[str, ...]], float]


def watched() -> Seconds:
    """Return what fills with every version of a kernel that is called from Python, and the seconds to get it ready."""
    seconds: Seconds = {}
    get_ready = Dispatcher._compile_for_args

    def timed(kernel: Any, *arguments: Any, **named: Any) -> Any:
        room, _, module = kernel.py_func.__module__.rpartition(".")
        began = time.perf_counter()
        found = get_ready(kernel, *arguments, **named)
        if room == "sidestep._kernels":
            kinds = tuple(code_of(kernel.typeof_pyval(argument)) for argument in arguments)
            seconds[f"{module}.{kernel.py_func.__name__}", kinds] = time.perf_counter() - began
        return found

    Dispatcher._compile_for_args = timed
    return seconds


def first_runs(*, walls: bool) -> None:
    """Do what a first run does: the first scenario, and planning in the plane with both bases."""
    if not walls:
        scenario = load_scenario("crossing")
        for kind in ("unconcerned", "concerned"):
            people = tuple(person.model_copy(update={"kind": kind}) for person in scenario.people)
            simulate(scenario.model_copy(update={"people": people}), seed=0)
    for robot in (Holonomic(), DifferentialDrive()):
        Planner(robot=robot, goal=(4.0, 0.0)).warm_up(walled=walls)


def listed() -> tuple[Seconds, int]:
    """Return what is called, and how much of it where there are no walls."""
    seconds = watched()
    first_runs(walls=False)
    always = len(seconds)
    first_runs(walls=True)
    return seconds, always


def listed_elsewhere() -> tuple[Seconds, int]:
    """Return `listed` of a process of its own."""
    code = "import json, list_kernels as own; found, n = own.listed(); print(json.dumps([list(found.items()), n]))"
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, capture_output=True, check=True)
    found, always = json.loads(done.stdout.splitlines()[-1])
    return {(kernel, tuple(kinds)): took for (kernel, kinds), took in found}, always


def main() -> int:
    """Write the list."""
    TABLE.write_text("")  # nothing is compiled ahead
    cold, _ = listed_elsewhere()
    seconds, always = listed_elsewhere()  # where a kernel compiles another one, nobody has to get that ready any more
    lines: list[str] = []
    for n, ((kernel, kinds), took) in enumerate(seconds.items()):
        longest, walls = max(took, cold.get((kernel, kinds), 0.1)), n >= always
        lines.append(f"{kernel} {longest:.1f} {'walls' if walls else 'always'} {' '.join(kinds)}")
    part = TABLE.with_suffix(".part")
    part.write_text("\n".join(lines) + "\n")
    part.replace(TABLE)
    print(f"{len(lines)} versions, {sum(cold.values()):.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
