"""A small world behind ROS topics: a robot that obeys `cmd_vel`, people who walk, a scanner. Knows no ROS.

The test talks to it in JSON lines: what it shall do on stdin, what it sees on stdout.
"""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from sidestep.ros import outgoing
from sidestep.ros.geometry import Pose2
from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import Scanner
from sidestep.simulation.scene import Scene, rectangle

RATE = 20.0  # Hz
HEARD = {
    "cmd_vel": "geometry_msgs/Twist",
    "plan": "nav_msgs/Path",
    "predicted_occupancy": "nav_msgs/OccupancyGrid",
    "beliefs": "visualization_msgs/MarkerArray",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}
SAID = {
    "odom": "nav_msgs/Odometry",
    "scan": "sensor_msgs/LaserScan",
    "people": "geometry_msgs/PoseArray",
    "people_markers": "visualization_msgs/MarkerArray",
    "goal": "geometry_msgs/PoseStamped",
    "map": "nav_msgs/OccupancyGrid",
    "enable": "std_msgs/Bool",
}
BODY = 0.3  # m, of a person; the robot's radius is 0.18 m


class Walker:
    """A person who walks to and fro between two places, or from afar to nowhere."""

    def __init__(self, start: list[float], velocity: list[float], name: str) -> None:
        self.position = np.array(start, dtype=float)
        self.velocity = np.array(velocity, dtype=float)
        self.name = name
        self.phase = 0.0
        self.gait = Gait()

    def advance(self, seconds: float) -> None:
        self.position = self.position + self.velocity * seconds
        self.phase = self.gait.advance(self.phase, float(np.hypot(*self.velocity)), seconds)

    def legs(self) -> np.ndarray:
        heading = math.atan2(self.velocity[1], self.velocity[0])
        return self.gait.legs(self.position, self.velocity, heading, self.phase)


class World:
    """Robot, people, scanner, and what was heard of the node.

    Args:
        make: dialect of the messages.
        publish: (topic, message).
        broadcast: (parent, child, pose) on tf, or None where there is no tf.
        clock: s, of the stamps.
    """

    def __init__(
        self,
        make: Any,
        publish: Callable[[str, Any], None],
        clock: Callable[[], float],
        broadcast: Callable[[str, str, Pose2], None] | None = None,
    ) -> None:
        self.make, self.publish, self.clock, self.broadcast = make, publish, clock, broadcast
        self.lock = threading.Lock()
        self.pose = Pose2()
        self.command = (0.0, 0.0, 0.0)
        self.commanded = -math.inf
        self.walkers: list[Walker] = []
        self.muted: set[str] = {"scan", "people", "people_markers"}
        self.late = 0.0  # s, by which stamps lie in the past
        self.origin = Pose2()  # of the odometry's frame in the map
        self.heard: Counter[str] = Counter()
        self.last: dict[str, Any] = {}
        self.nearest = math.inf
        self.scanner = Scanner()
        self.room = Scene(
            polygons=(rectangle((3.0, 0.0), (14.0, 10.0)), rectangle((2.0, -3.5), (1.0, 0.5))),
            cylinders=np.array([[-2.0, 3.0, 0.15]]),
        )
        self.generator = np.random.default_rng(7)
        self.ticks = 0

    def listen(self, topic: str, message: Any) -> None:
        """Take a message of the node's."""
        with self.lock:
            self.heard[topic] += 1
            if topic == "cmd_vel":
                self.command = (message.linear.x, message.linear.y, message.angular.z)
                self.commanded = time.monotonic()
            elif topic == "plan":
                last = message.poses[-1].pose.position
                self.last["plan"] = {"frame": message.header.frame_id, "poses": len(message.poses), "x": last.x}
            elif topic == "predicted_occupancy":
                data = np.asarray(message.data)
                self.last["grid"] = {"cells": data.size, "top": int(data.max()), "some": int((data > 0).sum())}
            elif topic == "beliefs":
                texts = [m.text for m in message.markers if m.text]
                self.last["beliefs"] = texts
            else:
                status = message.status[0]
                level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
                self.last["diagnostics"] = {
                    "level": level,
                    "message": status.message,
                    "values": {pair.key: pair.value for pair in status.values},
                }

    def advance(self, seconds: float) -> None:
        """Move everybody; without new commands this base keeps the last one, as no real one should."""
        with self.lock:
            forward, sideways, turn = self.command
            middle = self.pose.yaw + turn * seconds / 2
            dx = forward * math.cos(middle) - sideways * math.sin(middle)
            dy = forward * math.sin(middle) + sideways * math.cos(middle)
            self.pose = Pose2(self.pose.x + dx * seconds, self.pose.y + dy * seconds, self.pose.yaw + turn * seconds)
            for walker in self.walkers:
                walker.advance(seconds)
                gap = float(np.linalg.norm(walker.position - self.pose.position))
                if forward or sideways or turn:
                    self.nearest = min(self.nearest, gap)

    def say(self) -> None:
        """Publish what the sensors see."""
        self.ticks += 1
        now = self.clock() - self.late
        make = self.make
        forward, sideways, turn = self.command
        velocity = self.pose.rotation @ np.array([forward, sideways])
        if "odom" not in self.muted:
            self.publish("odom", outgoing.odometry(make, "odom", "base_link", now, self.pose, velocity, turn))
        if self.broadcast is not None:
            self.broadcast("odom", "base_link", self.pose)
            self.broadcast("map", "odom", self.origin)
            self.broadcast("base_link", "laser", Pose2(0.1, 0.0, 0.0))
        if self.ticks % 2:
            return
        places = np.array([w.position for w in self.walkers]).reshape(-1, 2)
        if "people" not in self.muted:
            self.publish("people", outgoing.pose_array(make, "odom", now, places))
        if "people_markers" not in self.muted:
            self.publish("people_markers", outgoing.marker_array(make, [self._marker(w, now) for w in self.walkers]))
        if "scan" not in self.muted:
            self.publish("scan", self._scan(now, velocity, turn))

    def _marker(self, walker: Walker, now: float) -> Any:
        return outgoing.marker(
            self.make, "odom", now, namespace=walker.name, number=0, kind=3,
            place=Pose2(float(walker.position[0]), float(walker.position[1])), size=(0.6, 0.6, 1.7),
            colour=(1.0, 1.0, 1.0, 1.0), lifetime=0.5,
        )  # fmt: skip

    def _scan(self, now: float, velocity: np.ndarray, turn: float) -> Any:
        legs = np.concatenate([w.legs() for w in self.walkers]) if self.walkers else np.zeros((0, 5))
        eye = self.pose.after(Pose2(0.1, 0.0, 0.0))
        scan, _ = self.scanner.sense(
            self.room, legs, np.array([eye.x, eye.y, eye.yaw]), np.array([*velocity, turn]), now, self.generator
        )
        beams = scan.beams
        return self.make(
            "sensor_msgs/LaserScan",
            header=outgoing.header(self.make, "laser", now),
            angle_min=beams.angle_min,
            angle_max=beams.angle_min + beams.angle_increment * (beams.count - 1),
            angle_increment=beams.angle_increment,
            time_increment=beams.time_increment,
            scan_time=0.1,
            range_min=beams.range_min,
            range_max=beams.range_max,
            ranges=self.make.numbers("float32", scan.ranges),
        )

    def obey(self, order: dict[str, Any]) -> None:
        """Do what the test wants."""
        what = order["do"]
        with self.lock:
            if what == "mute":
                self.muted.add(order["topic"])
            elif what == "unmute":
                self.muted.discard(order["topic"])
            elif what == "late":
                self.late = order["seconds"]
            elif what == "people":
                self.walkers = [Walker(p["at"], p["velocity"], p["name"]) for p in order["people"]]
                self.nearest = math.inf
            elif what == "place":
                self.pose = Pose2(*order["pose"])
            elif what == "reset":
                self.pose, self.command, self.walkers, self.late = Pose2(), (0.0, 0.0, 0.0), [], 0.0
                self.muted = {"scan", "people", "people_markers"} - {order["eyes"]}
                self.last.clear()
            elif what == "origin":
                self.origin = Pose2(*order["pose"])
        make = self.make
        if what == "goal":
            place = Pose2(*order["at"])
            self.publish("goal", outgoing.pose_stamped(make, order.get("frame", "odom"), self.clock(), place))
        elif what == "enable":
            self.publish("enable", make("std_msgs/Bool", data=order["on"]))
        elif what == "map":
            grid = np.zeros((60, 100))
            grid[order["row"][0] : order["row"][1], order["column"][0] : order["column"][1]] = 1.0
            self.publish("map", outgoing.grid(make, "odom", self.clock(), np.array([-1.0, -3.0]), 0.1, grid))

    def tell(self) -> dict[str, Any]:
        """What the test is told."""
        with self.lock:
            return {
                "at": time.monotonic(),
                "pose": [self.pose.x, self.pose.y, self.pose.yaw],
                "command": list(self.command),
                "silence": time.monotonic() - self.commanded,
                "nearest": self.nearest,
                "heard": dict(self.heard),
                **self.last,
            }

    def run(self, alive: Callable[[], bool]) -> None:
        """Turn until the test hangs up."""
        orders = threading.Thread(target=self._orders, daemon=True)
        orders.start()
        before = time.monotonic()
        while alive() and orders.is_alive():
            now = time.monotonic()
            self.advance(now - before)
            before = now
            self.say()
            if self.ticks % 2 == 0:
                print(json.dumps(self.tell()), flush=True)
            time.sleep(max(0.0, 1.0 / RATE - (time.monotonic() - now)))

    def _orders(self) -> None:
        for line in sys.stdin:
            self.obey(json.loads(line))
