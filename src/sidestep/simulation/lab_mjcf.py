"""The lab as a MuJoCo model: a base on two wheels and two casters, furniture, and legs that are moved from outside."""

from __future__ import annotations

from xml.etree import ElementTree as Xml

import numpy as np

from sidestep.simulation.scene import Scene
from sidestep.types import FloatArray

WHEEL_RADIUS = 0.038  # m
TRACK_WIDTH = 0.23  # m between the wheels
SCAN_HEIGHT = 0.30  # m, of the scanner above the floor
SEEN, UNSEEN = 0, 1  # geom groups: at the scanner's height; or floor and robot
_BASE_HEIGHT = 0.11  # m, of the body
_WALL_HEIGHT = 0.8  # m
_LEG_HEIGHT = 0.8  # m


def lab_model(scene: Scene, *, radius: float, legs: FloatArray, start: FloatArray, step: float) -> str:
    """Return the model as MJCF.

    Args:
        scene: walls and furniture, as upright prisms and cylinders.
        radius: m, of the round base.
        legs: (L,) m, radii of all legs; they are mocap bodies "leg0", "leg1", … that touch nothing.
        start: (3,) m, m, rad, of the base.
        step: s of the simulation.
    """
    root = Xml.Element("mujoco", model="lab")
    Xml.SubElement(root, "option", timestep=f"{step}", integrator="implicitfast", cone="elliptic")
    assets = Xml.SubElement(root, "asset")
    world = Xml.SubElement(root, "worldbody")
    Xml.SubElement(world, "geom", name="floor", type="plane", size="20 20 0.1", group=f"{UNSEEN}")
    _furnish(assets, world, scene)
    for k, leg in enumerate(legs):
        body = Xml.SubElement(world, "body", name=f"leg{k}", mocap="true", pos=f"{30 + k} 0 {_LEG_HEIGHT / 2}")
        _geom(body, f"leg{k}", "cylinder", f"{leg} {_LEG_HEIGHT / 2}", contype="0", conaffinity="0", group=f"{SEEN}")
    _base(world, radius, start)
    actuators = Xml.SubElement(root, "actuator")
    for side in ("left", "right"):
        Xml.SubElement(actuators, "velocity", name=side, joint=side, kv="0.5", forcerange="-1.5 1.5")
    return Xml.tostring(root, encoding="unicode")


def _furnish(assets: Xml.Element, world: Xml.Element, scene: Scene) -> None:
    """Add walls and furniture."""
    for k, polygon in enumerate(scene.polygons):
        corners = [f"{x} {y} {z}" for z in (0.0, _WALL_HEIGHT) for x, y in polygon]
        Xml.SubElement(assets, "mesh", name=f"prism{k}", vertex=" ".join(corners))
        Xml.SubElement(world, "geom", name=f"prism{k}", type="mesh", mesh=f"prism{k}", group=f"{SEEN}")
    for k, (x, y, radius) in enumerate(scene.cylinders):
        size, place = f"{radius} {_WALL_HEIGHT / 2}", f"{x} {y} {_WALL_HEIGHT / 2}"
        _geom(world, f"pillar{k}", "cylinder", size, pos=place, group=f"{SEEN}")


def _base(world: Xml.Element, radius: float, start: FloatArray) -> None:
    """Add the robot: a disc on two wheels, with two casters that slide."""
    turn = f"{np.cos(start[2] / 2)} 0 0 {np.sin(start[2] / 2)}"
    base = Xml.SubElement(world, "body", name="base", pos=f"{start[0]} {start[1]} {WHEEL_RADIUS}", quat=turn)
    Xml.SubElement(base, "freejoint")
    height = _BASE_HEIGHT / 2
    _geom(base, "base", "cylinder", f"{radius} {height}", pos=f"0 0 {height + 0.01}", mass="5", group=f"{UNSEEN}")
    for side, y in (("left", TRACK_WIDTH / 2), ("right", -TRACK_WIDTH / 2)):
        wheel = Xml.SubElement(base, "body", name=side, pos=f"0 {y} 0")
        Xml.SubElement(wheel, "joint", name=side, type="hinge", axis="0 1 0", damping="0.002", armature="0.001")
        grip = {"euler": "90 0 0", "mass": "0.2", "friction": "1.2 0.005 0.0001", "group": f"{UNSEEN}"}
        _geom(wheel, side, "cylinder", f"{WHEEL_RADIUS} 0.012", **grip)
    for name, x in (("front", 0.11), ("rear", -0.11)):
        # Contact friction is the larger of the two surfaces' unless one has priority: casters must be allowed to slide.
        slide = {"mass": "0.05", "friction": "0.01 0.001 0.0001", "priority": "1", "group": f"{UNSEEN}"}
        _geom(base, name, "sphere", "0.012", pos=f"{x} 0 {0.0125 - WHEEL_RADIUS}", **slide)


def _geom(parent: Xml.Element, name: str, kind: str, size: str, **more: str) -> None:
    Xml.SubElement(parent, "geom", {"name": name, "type": kind, "size": size} | more)
