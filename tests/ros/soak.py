"""Let a node run for long and watch its memory: people come and go under ever new names, goals change, stations call.

    python tests/ros/soak.py --dialect 2 --seconds 600     # prints one JSON object; exit status 1 if memory grows

What counts is the growth between the mean of the first third (after a start that does not count) and that of the last.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from stack import COLD, Stack, free_port, message

from sidestep.ros.station import Station

START = 20.0  # s, not counted: caches fill, code is loaded
LIMIT = 4.0  # MB


def resident(pid: int) -> float:
    """Memory of a process in MB."""
    line = next(x for x in Path(f"/proc/{pid}/status").read_text().splitlines() if x.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def crowd(generator: np.random.Generator, names: itertools.count) -> list[dict]:
    """A few people whom nobody has seen before."""
    return [
        {
            "name": f"n{next(names)}",
            "at": generator.uniform((-2.0, -4.0), (6.0, 4.0)).tolist(),
            "velocity": generator.normal(0.0, 0.7, 2).tolist(),
        }
        for _ in range(generator.integers(1, 5))
    ]


def soak(dialect: int, seconds: float, eyes: str) -> dict:
    generator, names = np.random.default_rng(1), itertools.count()
    port = free_port()
    source = {"people_markers": "markers", "people": "poses", "scan": "scan"}[eyes]
    samples: list[tuple[float, float]] = []
    with tempfile.TemporaryDirectory() as folder, Stack(dialect, Path(folder)) as stack:
        stack.start_world()
        remote = {"enabled": True, "port": port, "link_timeout": 30.0}
        stack.start_node({"node": {"people_from": source, "remote": remote, "timeout": 5.0}})
        stack.order(do="reset", eyes=eyes)
        stack.until(lambda told: "waiting for a station" in message(told), "it does not get ready", COLD)
        station = Station(port=port)
        began, goals = time.monotonic(), itertools.cycle(((4.0, 0.0), (0.0, 0.0)))
        last: dict = {}
        while time.monotonic() - began < START + seconds:
            stack.order(do="people", people=crowd(generator, names))
            station.goal(*next(goals))
            station.start()
            if generator.random() < 0.3:
                with Station(port=port) as watcher:  # stations come and go as well
                    watcher.wait_for_state()
            last = list(stack.watch(3.0))[-1]
            samples.append((time.monotonic() - began, resident(stack.node.child.pid)))
        station.close()
    times, memory = np.array([s for s in samples if s[0] > START]).T
    third = max(1, len(memory) // 3)
    growth = float(memory[-third:].mean() - memory[:third].mean())
    return {
        "dialect": dialect,
        "people_from": source,
        "seconds": float(times[-1] - times[0]),
        "people_seen": next(names),
        "plans": last["heard"].get("plan", 0),
        "commands": last["heard"].get("cmd_vel", 0),
        "memory_first_mb": float(memory[0]),
        "memory_last_mb": float(memory[-1]),
        "memory_largest_mb": float(memory.max()),
        "growth_mb": growth,
        "slope_mb_per_minute": float(60 * np.polyfit(times, memory, 1)[0]) if len(times) > 2 else 0.0,
        "limit_mb": LIMIT,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dialect", type=int, choices=(1, 2), default=2)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--eyes", choices=("people_markers", "people", "scan"), default="people_markers")
    options = parser.parse_args()
    found = soak(options.dialect, options.seconds, options.eyes)
    print(json.dumps(found))
    return int(found["growth_mb"] > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
