"""Which frame lies where: from tf where there is one, else from the odometry and a fixed mount."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from sidestep.ros.geometry import Pose2, wrapped
from sidestep.ros.messages import Odometry

Lookup = Callable[[str, str], Pose2 | None]
"""(parent, child) → latest pose of the child in the parent, or None where unknown."""

_REMEMBERED = 200  # odometry messages; 4 s at 50 Hz


def no_lookup(parent: str, child: str) -> Pose2 | None:
    """Answer as where there is no tf."""
    del parent, child
    return None


class Frames:
    """Where things lie in the planning frame.

    Args:
        planning: name of the frame in which everything is planned.
        base: name of the robot's frame.
        mount: pose of the scanner on the robot, used where tf does not know it.
        same: frames that coincide with the planning frame (simulators without tf).
        lookup: tf.
    """

    def __init__(
        self, *, planning: str, base: str, mount: Pose2, same: Sequence[str] = (), lookup: Lookup = no_lookup
    ) -> None:
        self._planning = planning
        self._base = base
        self._mount = mount
        self._same = {"", planning, *same}
        self._lookup = lookup
        self._mounts: dict[str, Pose2] = {}
        self._past: deque[tuple[float, Pose2]] = deque(maxlen=_REMEMBERED)

    def note(self, odometry: Odometry, time: float) -> Pose2 | None:
        """Remember the pose at `time` (s); return it in the planning frame, or None where tf lacks its frame."""
        origin = self.locate(odometry.frame)
        if origin is None:
            return None
        pose = origin.after(odometry.pose)
        if self._past and time <= self._past[-1][0]:
            self._past.clear()
        self._past.append((time, pose))
        return pose

    def locate(self, frame: str, time: float | None = None) -> Pose2 | None:
        """Pose of `frame` in the planning frame; at `time` (s) for the robot's own frame. None where unknown."""
        if frame in self._same:
            return Pose2()
        if frame == self._base:
            return self.robot(time)
        return self._lookup(self._planning, frame)

    def scanner(self, frame: str, time: float) -> Pose2 | None:
        """Pose of the scanner at `time` (s): the robot's, and the mount on it. None before the first odometry."""
        if frame not in self._mounts:
            known = self._lookup(self._base, frame)
            if known is not None:
                self._mounts[frame] = known  # scanners are bolted on: asked once
        robot = self.robot(time)
        return None if robot is None else robot.after(self._mounts.get(frame, self._mount))

    def robot(self, time: float | None = None) -> Pose2 | None:
        """Pose of the robot at `time` (s), between two odometry messages; the latest one without a time."""
        if not self._past:
            return None
        times = [t for t, _ in self._past]
        if time is None or time >= times[-1]:
            return self._past[-1][1]
        after = int(np.searchsorted(times, time))
        if after == 0:
            return self._past[0][1]
        (t0, a), (t1, b) = self._past[after - 1], self._past[after]
        share = (time - t0) / (t1 - t0)
        turn = wrapped(b.yaw - a.yaw)
        return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), wrapped(a.yaw + share * turn))

    def clear(self) -> None:
        """Forget the past, as when the clock jumps back."""
        self._past.clear()
