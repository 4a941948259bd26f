"""The threads of a node: what they leave behind when it ends."""

from __future__ import annotations

import threading

from remote_robot import Floor, robot
from sidestep.ros.status import STANDSTILL, Motion


class Lagging(Floor):
    """Sends by a thread of its own, the newest command only, as ROS does; what it has not sent at the end is lost."""

    def __init__(self) -> None:
        super().__init__()
        self.ends, self.newest = False, STANDSTILL
        self.closed = threading.Event()
        self.sender = threading.Thread(target=self.send, daemon=True)
        self.sender.start()

    def motion(self, motion: Motion) -> None:
        self.newest = motion if self.ends else Motion(forward=0.5)  # it drives until then

    def send(self) -> None:
        while not self.closed.wait(0.1):
            self.motion_now = self.newest


def test_the_last_command_is_sent_before_the_node_has_ended():
    floor = Lagging()
    runner, _, _ = robot(floor=floor)
    runner.start()
    while floor.motion_now == STANDSTILL:
        floor.closed.wait(0.01)
    floor.ends = True
    runner.stop()
    floor.closed.set()
    floor.sender.join()
    assert floor.motion_now == STANDSTILL
