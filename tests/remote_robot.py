"""A robot in a process of its own: the real threads, core and server; wheels, senses and planner are stand-ins.

Prints {"port": …} and then, 50 times a second, {"at": s of the machine's clock, "forward": m/s, "x": m, "why": …}.
"""

from __future__ import annotations

import json
import sys
import threading
import time

import numpy as np

from ros_stand_ins import Eyes, StraightPlanner, Wheels
from sidestep.ros.core import Core
from sidestep.ros.frames import Frames
from sidestep.ros.geometry import Pose2
from sidestep.ros.inputs import Inputs
from sidestep.ros.messages import Odometry, People
from sidestep.ros.runner import Runner
from sidestep.ros.settings import NodeSettings
from sidestep.ros.status import STANDSTILL, Motion


class Floor:
    """Where the commands go, and where the odometry comes from."""

    def __init__(self) -> None:
        self.motion_now: Motion = STANDSTILL
        self.x = 0.0
        self.why = ""

    def motion(self, motion: Motion) -> None:
        self.motion_now = motion

    def plan(self, plan) -> None:
        pass

    prediction = plan

    def report(self, report) -> None:
        self.why = report.summary


def robot(*, host: str = "127.0.0.1", token: str = "", link_timeout: float = 0.6, floor: Floor | None = None):
    """Return (runner, inputs, floor)."""
    floor = floor or Floor()
    settings = NodeSettings.parse(
        {
            "robot": {"kind": "holonomic"},
            "node": {
                "people_from": "poses",
                "control_rate": 50.0,
                "remote": {
                    "enabled": True,
                    "host": host,
                    "port": 0,
                    "token": token,
                    "link_timeout": link_timeout,
                    "state_rate": 20.0,
                },
            },
        }
    )
    frames = Frames(planning="odom", base="base_link", mount=Pose2())
    inputs = Inputs(settings, sensing=Eyes(), frames=frames)
    core = Core(settings, inputs=inputs, wheels=Wheels(), make_planner=lambda goal, grid: StraightPlanner())
    return Runner(settings, core=core, inputs=inputs, outlet=floor, clock=time.monotonic), inputs, floor


def drive(inputs: Inputs, floor: Floor, ending: threading.Event) -> None:
    """Move the floor under the wheels until told to end."""
    before = time.monotonic()
    while not ending.is_set():
        now = time.monotonic()
        floor.x += floor.motion_now.forward * (now - before)
        before = now
        velocity = np.array([floor.motion_now.forward, 0.0])
        inputs.take_odometry(
            Odometry(time=now, frame="odom", pose=Pose2(x=floor.x), velocity=velocity, turn_rate=0.0), now
        )
        inputs.take_people(People(time=now, frame="odom", ids=None, positions=np.zeros((0, 2))), now)
        ending.wait(0.02)


def main() -> None:
    options = json.loads(sys.argv[1]) if len(sys.argv) > 1 else {}
    runner, inputs, floor = robot(**options)
    ending = threading.Event()
    threading.Thread(target=drive, args=(inputs, floor, ending), daemon=True).start()
    runner.start()
    assert runner.server is not None
    print(json.dumps({"port": runner.server.port}), flush=True)
    try:
        while True:
            time.sleep(0.02)
            told = {"at": time.monotonic(), "forward": floor.motion_now.forward, "x": floor.x, "why": floor.why}
            print(json.dumps(told), flush=True)
    except (KeyboardInterrupt, BrokenPipeError):
        ending.set()
        runner.stop()


if __name__ == "__main__":
    main()
