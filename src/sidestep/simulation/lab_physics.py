"""The lab in MuJoCo: wheels that push, furniture that pushes back, and beams cast by another hand than ours."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sidestep.errors import MissingExtra
from sidestep.perception.scan import Scan
from sidestep.robots import DifferentialDrive, RobotState
from sidestep.simulation.assembly import robot_of, start_of
from sidestep.simulation.lab_check import pose_of
from sidestep.simulation.lab_mjcf import SCAN_HEIGHT, SEEN, TRACK_WIDTH, WHEEL_RADIUS, lab_model
from sidestep.simulation.lab_room import LabRoom
from sidestep.simulation.lidar import Scanner
from sidestep.types import FloatArray, Vector

_STEP = 0.005  # s
_SETTLE = 100  # steps until the base rests on its wheels
_SECTORS = 10  # parts of a scan, each with legs and scanner where they are by then
_TOUCH = 1e-4  # m of overlap that counts as touching
_LEG = 0.065  # m; radius until the first scan says otherwise


class Physics:
    """Base and scanner of the lab, both in MuJoCo; stands for `Base` and for `Rays`.

    Args:
        room: to build.
        scanner: its beams and errors.
        generator: of those errors.

    Attributes:
        bumped: s during which the base touched furniture.

    Raises:
        MissingExtra: MuJoCo is not installed.
    """

    def __init__(self, room: LabRoom, scanner: Scanner, generator: np.random.Generator) -> None:
        try:
            import mujoco as engine
        except ImportError:
            raise MissingExtra("the lab with physics", "lab") from None
        mujoco: Any = engine
        self._mujoco = mujoco
        robot = robot_of(room.scenario)
        assert isinstance(robot, DifferentialDrive)
        self._robot, self._scanner, self._generator = robot, scanner, generator
        radii = np.full(2 * len(room.scenario.people), _LEG)
        text = lab_model(
            room.scene, radius=robot.radius, legs=radii, start=pose_of(start_of(room.scenario)), step=_STEP
        )
        self._model: Any = mujoco.MjModel.from_xml_string(text)
        self._data: Any = mujoco.MjData(self._model)
        names = [self._model.geom(g).name for g in range(self._model.ngeom)]
        self._furniture = frozenset(g for g, name in enumerate(names) if name.startswith(("prism", "pillar")))
        self._legs = [self._model.geom(f"leg{k}").id for k in range(radii.size)]
        self._mocaps = [int(self._model.body(f"leg{k}").mocapid[0]) for k in range(radii.size)]
        self.bumped = 0.0
        for _ in range(_SETTLE):
            mujoco.mj_step(self._model, self._data)

    def drive(self, velocity: Vector, state: RobotState, duration: float) -> RobotState:
        """Make the reference follow a velocity (2,) m/s for `duration` s: wheel speeds, set once.

        The base is where physics has left it; `state` is not looked at.
        """
        v, turn = self._robot.command(velocity, self._state(), hold=duration)
        half = turn * TRACK_WIDTH / 2
        self._data.ctrl[:] = ((v - half) / WHEEL_RADIUS, (v + half) / WHEEL_RADIUS)
        for _ in range(max(round(duration / _STEP), 1)):
            self._mujoco.mj_step(self._model, self._data)
            self.bumped += _STEP * self._touches()
        return self._state()

    def sense(self, legs: FloatArray, pose: FloatArray, twist: FloatArray, time: float) -> Scan:
        """Return one scan, in sectors: for each, legs and scanner have moved on."""
        beams = self._scanner.beams
        offsets = beams.time_increment * np.arange(beams.count, dtype=np.float64)
        ranges, squareness = np.full(beams.count, np.inf), np.zeros(beams.count)
        for part in np.array_split(np.arange(beams.count), _SECTORS):
            moment = float(offsets[part].mean())
            self._place(legs, moment)
            bearings = pose[2] + twist[2] * offsets[part] + beams.bearings[part]
            origin = np.array([*(pose[:2] + moment * twist[:2]), SCAN_HEIGHT])
            ranges[part], squareness[part] = self._rays(origin, bearings)
        hits = np.where(np.isfinite(ranges), 0, -1).astype(np.int64)
        noisy, _ = self._scanner.with_errors(ranges, hits, squareness, self._generator)
        return Scan(time=time, ranges=noisy, beams=beams, pose=pose.copy())

    def _rays(self, origin: FloatArray, bearings: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (B,) m ranges, and |cos| of the angles between beams and normals, 0 where nothing is hit."""
        count = bearings.size
        directions = np.stack((np.cos(bearings), np.sin(bearings), np.zeros(count)), axis=1)
        groups = np.zeros(6, dtype=np.uint8)
        groups[SEEN] = 1
        geoms, distances = np.full(count, -1, dtype=np.int32), np.zeros(count)
        normals = np.zeros(3 * count)
        limit = self._scanner.beams.range_max
        self._mujoco.mj_multiRay(
            self._model,
            self._data,
            origin,
            directions.ravel(),
            groups,
            True,
            -1,
            geoms,
            distances,
            normals,
            count,
            limit,
        )
        squareness = np.abs(np.sum(normals.reshape(-1, 3) * directions, axis=1))
        return np.where(geoms >= 0, distances, np.inf), np.where(geoms >= 0, squareness, 0.0)

    def _place(self, legs: FloatArray, moment: float) -> None:
        """Put the legs (L, 5) where they are `moment` s after the scan began, those of nobody far away."""
        for k, (geom, mocap) in enumerate(zip(self._legs, self._mocaps, strict=True)):
            away = k >= len(legs)
            self._data.mocap_pos[mocap, :2] = (30.0 + k, 0.0) if away else legs[k, :2] + moment * legs[k, 3:]
            if not away:
                self._model.geom_size[geom, 0] = legs[k, 2]
        self._mujoco.mj_kinematics(self._model, self._data)

    def _touches(self) -> bool:
        return any(
            c.dist < -_TOUCH and (c.geom1 in self._furniture or c.geom2 in self._furniture) for c in self._data.contact
        )

    def _state(self) -> RobotState:
        """The base now."""
        x, y, _, w, _, _, z = self._data.qpos[:7]
        heading = 2 * math.atan2(z, w)
        ahead, left = (
            np.array([math.cos(heading), math.sin(heading)]),
            np.array([-math.sin(heading), math.cos(heading)]),
        )
        speed, turn = float(self._data.qvel[:2] @ ahead), float(self._data.qvel[5])
        velocity = speed * ahead + turn * self._robot.offset * left
        return RobotState(position=(float(x), float(y)), heading=heading, velocity=velocity)
