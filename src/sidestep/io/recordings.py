"""Recordings of standard messages: MCAP and ROS 1 bags, written and read without ROS.

with RecordingWriter("run.mcap") as recording:
    recording.write("/odom", "nav_msgs/Odometry", 0.0, recording.make("nav_msgs/Odometry", …))
for item in read_messages("run.mcap"):
    item.topic, item.time, item.message
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Collection, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from sidestep.errors import InvalidFile, InvalidInput, MissingExtra, OutputError

_TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms"  # not among the types that rosbags knows of ROS 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """One message of a recording.

    Attributes:
        topic: name; type: such as "nav_msgs/Odometry".
        time: s, when it was recorded.
        message: with the fields of its type; stamps have `sec` and `nanosec`, arrays are numpy arrays.
    """

    topic: str
    type: str
    time: float
    message: Any


class RecordedMaker:
    """Makes messages for a recording; see `sidestep.ros.outgoing.Maker`."""

    def __init__(self, store: Any) -> None:
        self._store = store

    def __call__(self, name: str, /, **fields: Any) -> Any:
        """Return a message; fields not given are zero or empty."""
        return self._made(_full(name), fields)

    def stamp(self, seconds: float) -> Any:
        """Return a time stamp."""
        whole = round(seconds * 1e9)
        return self("builtin_interfaces/Time", sec=whole // 10**9, nanosec=whole % 10**9)

    def duration(self, seconds: float) -> Any:
        """Return a duration."""
        whole = round(seconds * 1e9)
        return self("builtin_interfaces/Duration", sec=whole // 10**9, nanosec=whole % 10**9)

    def numbers(self, kind: str, values: Any) -> Any:
        """Return an array."""
        return np.asarray(values, dtype=kind)

    def level(self, value: int) -> Any:
        """Return a byte, which is a number here."""
        return value

    def _made(self, name: str, fields: Mapping[str, Any]) -> Any:
        definitions = self._store.fielddefs[name][1]
        filled = {field: fields[field] if field in fields else self._default(kind) for field, kind in definitions}
        return self._store.types[name](**filled)

    def _default(self, kind: Any) -> Any:
        sort, inside = int(kind[0]), kind[1]
        if sort == 2:  # another message
            return self._made(inside, {})
        if sort in (3, 4):  # an array, a sequence
            element, length = inside
            length = length if sort == 3 else 0
            if int(element[0]) == 1 and element[1][0] != "string":
                return np.zeros(length, dtype=_numpy_name(element[1][0]))
            return [self._default(element) for _ in range(length)]
        return {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}.get(inside[0], 0)


class RecordingWriter:
    """Writes one recording; the file appears when the block ends without an exception.

    Args:
        path: ends in .mcap (ROS 2 messages) or .bag (ROS 1 messages).

    Raises:
        InvalidInput: another ending. MissingExtra: the package that knows these formats is not installed.
        OutputError: it cannot be written there.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        check_recordable(self._path)
        self._one = self._path.suffix == ".bag"
        store = _store(self._one)
        self._store = store
        self.make = RecordedMaker(store)
        """Makes messages for this recording."""
        self._connections: dict[str, Any] = {}
        self._begin()

    def write(self, topic: str, kind: str, time: float, message: Any) -> None:
        """Append a message of type `kind`, such as "nav_msgs/Odometry", recorded at `time` (s, ≥ 0)."""
        name = _full(kind)
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, name, typestore=self._store)
        raw = self._store.serialize_ros1(message, name) if self._one else self._store.serialize_cdr(message, name)
        self._writer.write(self._connections[topic], round(time * 1e9), raw)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._writer.close()
            if kind is None:
                made = self._part if self._one else next(self._part.glob("*.mcap"))
                made.replace(self._path)
        except OSError as failure:
            raise OutputError(self._path, failure.strerror or str(failure)) from None
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _begin(self) -> None:
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as Writer2

        try:
            self._folder = Path(tempfile.mkdtemp(prefix=f".{self._path.name}.", dir=self._path.parent))
        except OSError as error:
            raise OutputError(self._path, error.strerror or str(error)) from None
        self._part = self._folder / ("part.bag" if self._one else "part")
        self._writer: Any = (
            Writer1(self._part) if self._one else Writer2(self._part, version=9, storage_plugin=StoragePlugin.MCAP)
        )
        self._writer.open()


def check_recordable(path: str | Path) -> None:
    """Check that a recording can be written there, without writing one.

    Raises:
        InvalidInput, MissingExtra, OutputError: as `RecordingWriter`.
    """
    path = Path(path)
    if path.suffix not in (".mcap", ".bag"):
        raise InvalidInput("record", str(path), "a file that ends in .mcap (ROS 2) or .bag (ROS 1)")
    _store(path.suffix == ".bag")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OutputError(path, error.strerror or str(error)) from None


def recorded_topics(path: str | Path) -> dict[str, str]:
    """Return the topics of a recording and their types, such as {"/odom": "nav_msgs/Odometry"}.

    Raises:
        InvalidFile, MissingExtra: as `read_messages`.
    """
    with _opened(Path(path)) as reader:
        return {c.topic: c.msgtype.replace("/msg/", "/") for c in reader.connections}


def read_messages(path: str | Path, *, types: Collection[str] = (), topics: Collection[str] = ()) -> Iterator[Recorded]:
    """Yield the messages of a recording in the order of time.

    Args:
        path: an .mcap, .bag or .db3 file, or the folder of a ROS 2 bag.
        types: only messages of these types, such as "nav_msgs/Odometry"; empty: all that can be read.
        topics: only messages on these topics; empty: all.

    Raises:
        InvalidFile: it does not exist, or is no recording.
        MissingExtra: the package that knows these formats is not installed.
    """
    wanted = {_full(name) for name in types}
    with _opened(Path(path)) as reader:
        connections = [
            c for c in reader.connections if (not wanted or c.msgtype in wanted) and (not topics or c.topic in topics)
        ]
        for connection, nanoseconds, raw in reader.messages(connections) if connections else ():
            yield Recorded(
                topic=connection.topic,
                type=connection.msgtype.replace("/msg/", "/"),
                time=nanoseconds * 1e-9,
                message=reader.deserialize(raw, connection.msgtype),
            )


@contextmanager
def _opened(path: Path) -> Generator[Any]:
    """Open a recording; whatever it holds wrongly is said in one line."""
    try:
        from rosbags.highlevel import AnyReader
    except ImportError:
        raise MissingExtra("reading recordings", "ros") from None
    allowed = "a recording: .mcap, .bag, .db3, or the folder of a ROS 2 bag"
    if not path.exists():
        raise InvalidFile(str(path), "no such file", allowed)
    try:
        with AnyReader([path], default_typestore=_store(path.suffix == ".bag")) as reader:
            yield reader
    except Exception as error:  # whoever parses what is no recording may fail in any way
        raise InvalidFile(str(path), str(error) or type(error).__name__, allowed) from None


def _store(one: bool) -> Any:
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError:
        raise MissingExtra("recording", "ros") from None
    store = get_typestore(Stores.ROS1_NOETIC if one else Stores.ROS2_JAZZY)
    if one:
        store.register(get_types_from_msg(_TF_MESSAGE, "tf2_msgs/msg/TFMessage"))
    return store


def _full(name: str) -> str:
    return name if "/msg/" in name else name.replace("/", "/msg/")


def _numpy_name(kind: str) -> str:
    return {"byte": "uint8", "octet": "uint8", "char": "uint8"}.get(kind, kind)
