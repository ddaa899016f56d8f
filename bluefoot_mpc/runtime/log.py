"""Logs read back into memory, whole or up to where they were cut off."""

from __future__ import annotations

import logging
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Channel, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from zstandard import ZstdError

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime.codec import decode
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.packed_pictures import TOPIC as CAMERA_TOPIC
from bluefoot_mpc.runtime.packed_pictures import PackedPicture, unpack
from bluefoot_mpc.runtime.recorder import CONFIG_TOPIC, LIBRARY, OUTCOME, RECORD_CLASSES, START
from bluefoot_mpc.types import SensorFrame

log = logging.getLogger(__name__)

LOG_NAME = "log.mcap"
CUT_OFF, UNKNOWN = "the log is cut off", "unknown"
"""Stop reasons of a run whose log does not say how it ended."""
_RECORD_LIMIT = 1 << 30
# What a file that ends early, or whose bytes are damaged, makes the reader raise.
_DAMAGE = (McapError, ZstdError, struct.error, ValueError, KeyError, EOFError, MemoryError, OverflowError)


@dataclass(kw_only=True, slots=True)
class RunLog(RunData):
    """A run as read from a file.

    Attributes:
        path: the file.
        truncated: True when the file ends before its end mark: the writer was
            killed, or the copy is incomplete; the lists hold what is readable.
        packed: the camera's pictures by the time (s) of the frame that they came
            with; ``frames`` are without them, since unpacked they would not fit
            into memory. (Logs of earlier versions have them in their frames.)
    """

    path: Path
    truncated: bool = False
    packed: dict[float, PackedPicture] = field(default_factory=dict, repr=False)

    def frame(self, index: int) -> SensorFrame:
        """A sensor frame as the controller got it, its picture included.

        Raises:
            LogError: its picture is not readable.
        """
        frame = self.frames[index]
        picture = self.packed.get(frame.time)
        return frame if picture is None else replace(frame, camera=picture.image())

    def look_through(self) -> None:
        """Keep a few of the pictures for a report, as the run's loop did.

        Raises:
            LogError: a picture is not readable.
        """
        for index, telemetry in enumerate(self.telemetry if self.packed else ()):
            self.keep_picture(self.frame(index), telemetry)


@dataclass(kw_only=True, slots=True)
class _Contents:
    """What was found in a file so far."""

    library: str = ""
    topics: dict[int, str] = field(default_factory=dict)
    records: dict[str, list[Any]] = field(default_factory=lambda: {topic: [] for topic in RECORD_CLASSES})
    packed: dict[float, PackedPicture] = field(default_factory=dict)
    config: dict[str, Any] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)


def read_log(path: str | Path, strict: bool = False) -> RunLog:
    """Read a recorded run.

    Args:
        path: the log, or the folder of a run that holds one.
        strict: refuse a log that is cut off instead of reading what is there.

    Raises:
        LogError: the file cannot be read, is not a log of this package, or
            (when strict) is cut off; the message says how much is readable.
    """
    file = Path(path)
    if file.is_dir():
        file /= LOG_NAME
    contents = _Contents()
    truncated = _read(file, contents)
    if not contents.library.startswith(LIBRARY):
        raise _not_a_log(file)
    run = _assemble(file, contents, truncated)
    if truncated:
        message = f"{file} is cut off or damaged: {_extent(run)}"
        if strict:
            raise LogError(message)
        log.warning("%s", message)
    return run


def _read(file: Path, contents: _Contents) -> bool:
    """Fill `contents` from a file; True when it ended too early."""
    try:
        with file.open("rb") as stream:
            try:
                for record in _records(stream):
                    _take(record, contents)
            except InvalidMagic as error:
                if not contents.library:
                    raise _not_a_log(file) from error
                return True
            except _DAMAGE as error:
                log.debug("%s: reading stops at %r", file, error)
                return True
    except OSError as error:
        raise LogError(f"cannot read the log {file}: {error.strerror or error}") from error
    return False


def _records(stream: Any) -> Iterator[McapRecord]:
    reader = StreamReader(stream, validate_crcs=True, record_size_limit=_RECORD_LIMIT)
    yield from reader.records


def _take(record: McapRecord, contents: _Contents) -> None:
    if isinstance(record, Header):
        contents.library = record.library
    elif isinstance(record, Channel):
        contents.topics[record.id] = record.topic
    elif isinstance(record, Metadata):
        contents.metadata[record.name] = dict(record.metadata)
    elif isinstance(record, Message):
        topic = contents.topics[record.channel_id]
        if topic == CONFIG_TOPIC:
            contents.config = orjson.loads(record.data)
        elif topic == CAMERA_TOPIC:
            picture = unpack(record.data)
            contents.packed[picture.frame] = picture
        elif topic in RECORD_CLASSES:
            contents.records[topic].append(decode(RECORD_CLASSES[topic], record.data))


def _assemble(file: Path, contents: _Contents, truncated: bool) -> RunLog:
    start, outcome = contents.metadata.get(START, {}), contents.metadata.get(OUTCOME, {})
    frames = contents.records["/frame"]
    factor = outcome.get("real_time_factor")
    return RunLog(
        path=file,
        truncated=truncated,
        packed=contents.packed,
        frames=frames,
        commands=contents.records["/command"],
        telemetry=contents.records["/telemetry"],
        truth=contents.records["/truth"],
        period=float(start["period"]) if "period" in start else _period(frames),
        config=contents.config,
        stop_reason=outcome.get("stop_reason", CUT_OFF if truncated else UNKNOWN),
        real_time_factor=None if factor is None else float(factor),
        versions=orjson.loads(start.get("versions", "{}")),
    )


def _period(frames: list[Any]) -> float:
    """Command period from the times of the frames, to a nanosecond."""
    if len(frames) < 2:
        return RunData().period
    return round(float(np.median(np.diff([frame.time for frame in frames]))), 9)


def _extent(run: RunLog) -> str:
    if not run.frames:
        return "no sensor frame is readable"
    seconds = run.frames[-1].time - run.frames[0].time + run.period
    return f"{seconds:.2f} s of the run are readable (sensor frames: {len(run.frames)})"


def _not_a_log(file: Path) -> LogError:
    return LogError(
        f"{file} is not a log of this package: a log is the MCAP file '{LOG_NAME}' that 'bluefoot run' writes"
    )
