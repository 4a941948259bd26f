"""Recordings of a scanner ↔ `.npz` files.

Keys of the file: `ranges_mm` uint16 (N, B) with 65535 for no return and 65534, 65533 or 0 for a failed measurement;
`t_header` (or `t`) float64 (N,) s; `angle_min`, `angle_increment` rad, `range_min`, `range_max` m, `time_increment` s.
Optional: `laser_pose_odom` (N, 3); people as `gt_scan`, `gt_id`, `gt_xy`; legs as `labelled` (N,), `leg_beam` (N, B).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sidestep.archives import read_arrays
from sidestep.errors import InvalidFile
from sidestep.io.files import written
from sidestep.perception.scan import Annotations, Beams, LegLabels, ScanRecording
from sidestep.types import FloatArray

_NO_RETURN = 65535
_FAILED = 65534
_LARGEST = 65532  # mm


def read_scan_recording(path: str | Path) -> ScanRecording:
    """Read a recording.

    Raises:
        InvalidFile: the file is missing, is not a `.npz` archive of plain arrays, lacks a key, or its shapes disagree.

    """
    path, what = Path(path), "a recording of a scanner: .npz archive of plain arrays of numbers"
    keys = read_arrays(path, what)
    try:
        return _recording(path, keys)
    except InvalidFile:
        raise
    except (ValueError, TypeError, IndexError) as error:
        raise InvalidFile(str(path), str(error), what) from None


def _recording(path: Path, keys: dict[str, Any]) -> ScanRecording:
    ranges = _metres(_need(path, keys, "ranges_mm"))
    times = np.asarray(keys.get("t_header", keys.get("t", np.empty(0))), dtype=np.float64)
    if ranges.ndim != 2 or times.shape != (ranges.shape[0],):
        raise InvalidFile(f"{path}: t_header", times.shape, f"({ranges.shape[0]},), one time for each row of ranges_mm")
    scalar = {
        name: float(_need(path, keys, name)) for name in ("angle_min", "angle_increment", "range_min", "range_max")
    }
    beams = Beams(count=ranges.shape[1], time_increment=float(keys.get("time_increment", 0.0)), **scalar)
    poses = keys.get("laser_pose_odom")
    if poses is not None and poses.shape != (times.size, 3):
        raise InvalidFile(f"{path}: laser_pose_odom", poses.shape, f"({times.size}, 3)")
    return ScanRecording(
        name=path.stem,
        beams=beams,
        times=times,
        ranges=ranges,
        poses=None if poses is None else np.asarray(poses, dtype=np.float64),
        people=_people(path, keys),
        legs=_legs(keys),
    )


def write_scan_recording(recording: ScanRecording, path: str | Path) -> None:
    """Write a recording so that `read_scan_recording` returns it, ranges rounded to whole millimetres.

    Raises:
        OutputError: the file cannot be written.

    """
    path = Path(path)
    beams = recording.beams
    keys: dict[str, Any] = {
        "ranges_mm": _millimetres(recording.ranges),
        "t_header": recording.times,
        "angle_min": beams.angle_min,
        "angle_increment": beams.angle_increment,
        "range_min": beams.range_min,
        "range_max": beams.range_max,
        "time_increment": beams.time_increment,
    }
    if recording.poses is not None:
        keys["laser_pose_odom"] = recording.poses
    if recording.people is not None:
        keys |= {
            "gt_scan": recording.people.scan,
            "gt_id": recording.people.person,
            "gt_xy": recording.people.positions,
        }
    if recording.legs is not None:
        labelled = np.zeros(len(recording), dtype=np.bool_)
        labelled[recording.legs.scans] = True
        keys |= {"labelled": labelled, "leg_beam": recording.legs.beams.astype(np.uint8)}
    with written(path) as file:
        np.savez_compressed(file, **keys)


def _need(path: Path, keys: dict[str, Any], name: str) -> Any:
    if name not in keys:
        raise InvalidFile(f"{path}: {name}", "missing", "present; keys are listed in sidestep.io.scans")
    return keys[name]


def _metres(raw: Any) -> FloatArray:
    ranges = np.asarray(raw, dtype=np.float64) / 1000.0
    ranges[raw == _NO_RETURN] = np.inf
    ranges[(raw == _FAILED) | (raw == _LARGEST + 1) | (raw == 0)] = np.nan
    return ranges


def _millimetres(ranges: FloatArray) -> Any:
    known = np.where(np.isfinite(ranges), ranges, 0.0)
    raw = np.clip(np.rint(known * 1000.0), 0, _LARGEST).astype(np.uint16)
    raw[np.isposinf(ranges)] = _NO_RETURN
    raw[np.isnan(ranges)] = _FAILED
    return raw


def _people(path: Path, keys: dict[str, Any]) -> Annotations | None:
    if "gt_scan" not in keys:
        return None
    scan = np.asarray(keys["gt_scan"], dtype=np.int64)
    person = np.asarray(_need(path, keys, "gt_id"), dtype=np.int64)
    positions = np.asarray(_need(path, keys, "gt_xy"), dtype=np.float64)
    if person.shape != scan.shape or positions.shape != (scan.size, 2):
        raise InvalidFile(f"{path}: gt_xy", positions.shape, f"({scan.size}, 2), as many rows as gt_scan")
    return Annotations(scan=scan, person=person, positions=positions)


def _legs(keys: dict[str, Any]) -> LegLabels | None:
    if "leg_beam" not in keys or "labelled" not in keys:
        return None
    beams = np.asarray(keys["leg_beam"], dtype=np.int64)
    return LegLabels(scans=np.flatnonzero(keys["labelled"]).astype(np.int64), beams=beams)
