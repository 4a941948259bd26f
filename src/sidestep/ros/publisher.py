"""Motions, plans and reports → messages on topics."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from sidestep.planning.plan import PersonPlan, Plan
from sidestep.ros import outgoing
from sidestep.ros.geometry import Pose2
from sidestep.ros.outgoing import Maker
from sidestep.ros.settings import NodeParameters
from sidestep.ros.status import Motion, Report
from sidestep.types import FloatArray, Vector

TOPICS = {
    "cmd_vel": "geometry_msgs/Twist",
    "plan": "nav_msgs/Path",
    "predicted_occupancy": "nav_msgs/OccupancyGrid",
    "beliefs": "visualization_msgs/MarkerArray",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}
"""What a node publishes."""

_HEIGHT = 1.7  # m, of a person's cylinder


class Publisher:
    """Sends what `Runner` has to tell.

    Args:
        make: the dialect of the messages.
        send: (topic, message).
        node: settings.
        raster: (plan, corner (2,) m, resolution m, cells) → (cells, cells) probabilities.
        radius: m, of a person's body.
    """

    def __init__(
        self,
        *,
        make: Maker,
        send: Callable[[str, Any], None],
        node: NodeParameters,
        raster: Callable[[Plan, Vector, float, int], FloatArray],
        radius: float,
    ) -> None:
        self._make = make
        self._send = send
        self._node = node
        self._raster = raster
        self._radius = radius

    def motion(self, motion: Motion) -> None:
        """geometry_msgs/Twist on `cmd_vel`."""
        self._send("cmd_vel", outgoing.twist(self._make, motion.forward, motion.sideways, motion.turn_rate))

    def report(self, report: Report) -> None:
        """diagnostic_msgs/DiagnosticArray on `/diagnostics`."""
        self._send(
            "/diagnostics",
            outgoing.diagnostics(
                self._make, report.time, level=report.level, message=report.summary, values=report.values()
            ),
        )

    def plan(self, plan: Plan) -> None:
        """nav_msgs/Path and MarkerArray of a new plan."""
        make, frame = self._make, self._node.frame
        self._send("plan", outgoing.path(make, frame, plan.time, plan.positions, plan.time_step))
        self._send("beliefs", outgoing.marker_array(make, self._markers(plan)))

    def prediction(self, plan: Plan) -> None:
        """nav_msgs/OccupancyGrid of what a plan predicts."""
        make, frame = self._make, self._node.frame
        cells = max(1, round(self._node.grid_size / self._node.grid_resolution))
        corner = plan.positions[0] - cells * self._node.grid_resolution / 2
        probability = self._raster(plan, corner, self._node.grid_resolution, cells)
        self._send(
            "predicted_occupancy",
            outgoing.grid(make, frame, plan.time, corner, self._node.grid_resolution, probability),
        )

    def _markers(self, plan: Plan) -> Iterator[Any]:
        lifetime = self._node.plan_lifetime
        for name, person in plan.people.items():
            yield from belief_markers(
                self._make, self._node.frame, plan.time, name, person, radius=self._radius, lifetime=lifetime
            )


def belief_markers(
    make: Maker, frame: str, time: float, name: str, person: PersonPlan, *, radius: float, lifetime: float
) -> Iterator[Any]:
    """A cylinder from red (unconcerned) to green (concerned), its velocity, and the belief in figures."""
    number = zlib.crc32(name.encode()) & 0x7FFFFFFF
    place = Pose2(float(person.position[0]), float(person.position[1]))
    colour = (1.0 - person.belief, person.belief, 0.2, 0.6)
    common: Mapping[str, Any] = {"number": number, "lifetime": lifetime}
    yield outgoing.marker(
        make, frame, time, namespace="people", kind=outgoing.CYLINDER, place=place, height=_HEIGHT / 2,
        size=(2 * radius, 2 * radius, _HEIGHT), colour=colour, **common,
    )  # fmt: skip
    speed = float(np.linalg.norm(person.velocity))
    if speed > 0.05:
        yaw = float(np.arctan2(person.velocity[1], person.velocity[0]))
        yield outgoing.marker(
            make, frame, time, namespace="velocities", kind=outgoing.ARROW,
            place=Pose2(place.x, place.y, yaw), height=0.1, size=(speed, 0.06, 0.06),
            colour=(0.2, 0.4, 1.0, 0.9), **common,
        )  # fmt: skip
    yield outgoing.marker(
        make, frame, time, namespace="beliefs", kind=outgoing.TEXT, place=place, height=_HEIGHT + 0.2,
        size=(0.0, 0.0, 0.25), colour=(1.0, 1.0, 1.0, 1.0), text=f"{name}: concerned {person.belief:.2f}", **common,
    )  # fmt: skip
