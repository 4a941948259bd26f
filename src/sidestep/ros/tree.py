"""Transforms as they were recorded: which frame lay where, without tf."""

from __future__ import annotations

from typing import Any

from sidestep.ros.geometry import Pose2
from sidestep.ros.messages import read_transform


class TransformTree:
    """The latest of each transform, flattened to the plane."""

    def __init__(self) -> None:
        self._above: dict[str, tuple[str, Pose2]] = {}

    def take(self, message: Any) -> None:
        """Take a tf2_msgs/TFMessage."""
        for stamped in message.transforms:
            pose = read_transform(stamped)
            if pose is not None:
                child, parent = (name.removeprefix("/") for name in (stamped.child_frame_id, stamped.header.frame_id))
                self._above[child] = parent, pose

    def lookup(self, parent: str, child: str) -> Pose2 | None:
        """Return the latest pose of `child` in `parent`, or None where no chain joins them."""
        from_parent, from_child = self._to_root(parent), self._to_root(child)
        for frame, pose in from_child.items():
            if frame in from_parent:
                return from_parent[frame].inverse().after(pose)
        return None

    def _to_root(self, frame: str) -> dict[str, Pose2]:
        """Every frame above `frame`, nearest first, and the pose of `frame` in it; ends where a circle would begin."""
        found = {frame: Pose2()}
        while frame in self._above:
            above, pose = self._above[frame]
            if above in found:
                break
            found[above] = pose.after(found[frame])
            frame = above
        return found
