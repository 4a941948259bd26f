"""Messages by name, from the packages of an installed ROS; what ROS 1 and ROS 2 have in common."""

from __future__ import annotations

import importlib
from typing import Any


def message_class(name: str) -> Any:
    """Return the class of a message such as "geometry_msgs/Twist"."""
    package, kind = name.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), kind)


class PackagedMessages:
    """Makes messages of their classes, each looked up once; the rest of a `sidestep.ros.outgoing.Maker` differs."""

    def __init__(self) -> None:
        self._classes: dict[str, Any] = {}

    def __call__(self, name: str, /, **fields: Any) -> Any:
        """See `sidestep.ros.outgoing.Maker`."""
        if name not in self._classes:
            self._classes[name] = message_class(name)
        return self._classes[name](**fields)
