"""Writes a run to an MCAP file while it happens.

One topic per kind of record and one for the configuration, as JSON with a
schema, so that Foxglove opens the file as it is; the camera's pictures have a
topic of their own (`bluefoot_mpc.runtime.packed_pictures`). Text is made of a few ticks
at a time, which takes half the time that it takes tick by tick, when the
controller has just had the processor's caches. Packing and compressing, of
pictures too, happen in a thread, half a second of the run at a time, and every packed half second
goes to the file at once. Where the disk does not follow for seconds, pictures are packed when they
come: raw ones that wait would fill the memory. So a killed process loses little, and
`bluefoot_mpc.runtime.log.read_log` reads what is there.
"""

from __future__ import annotations

import atexit
import contextlib
import queue
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import orjson
from mcap.writer import CompressionType, Writer

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime import packed_pictures
from bluefoot_mpc.runtime.codec import encode
from bluefoot_mpc.runtime.data import CommandRecord
from bluefoot_mpc.runtime.schema import json_schema
from bluefoot_mpc.runtime.versions import installed_versions
from bluefoot_mpc.types import (
    CameraImage,
    JointCommand,
    MotionCommand,
    SafetyRequest,
    SensorFrame,
    Telemetry,
    TruthSample,
)

LIBRARY = "bluefoot_mpc"
"""Start of the library name in the file's header; tells our logs from other MCAP files."""
RECORD_CLASSES: dict[str, type] = {
    "/frame": SensorFrame,
    "/command": CommandRecord,
    "/telemetry": Telemetry,
    "/truth": TruthSample,
}
CONFIG_TOPIC = "/config"
START, OUTCOME = "start", "outcome"
"""Names of the MCAP metadata that hold period and versions, and how the run ended."""

BATCH = 0.5
"""s of the run that are packed together; what a killed process may lose."""
_PORTION = 0.1
"""s of the run that become text together."""
_TINY = 1e-6
_QUEUE_LENGTH = 64
_RAW_LIMIT = 48_000_000
"""Bytes of raw pictures that may wait: 5 s of 640 by 480 at ten a second."""


@dataclass(frozen=True, slots=True)
class _Picture:
    """A picture and the time (s) of the frame that it came with."""

    image: CameraImage
    frame: float

    def text(self) -> bytes:
        return packed_pictures.pack(self.image, self.frame)


_Message = tuple[int, int, bytes | _Picture]


class Recorder:
    """Records one run; use it as a context manager, so that the file is always completed.

    Records are read a little later than they are given: they must not change
    any more, arrays included.

    Args:
        path: the file to write; its folder is made if needed.
        config: everything resolved, as a nested table of plain values.
        period: s, command period; None lets the reader work it out from the frames.

    Raises:
        LogError: the file cannot be written, now or at any later call.
        TypeError: the configuration holds something that JSON cannot.
    """

    def __init__(self, path: str | Path, config: Mapping[str, Any], period: float | None = None) -> None:
        self.path = Path(path)
        self._config: bytes | None = orjson.dumps(dict(config))
        self._outcome: dict[str, str] = {}
        self._error: Exception | None = None
        self._closed = False
        self._time: float | None = None
        self._batch_start = self._portion_start = float("-inf")
        self._portion: list[tuple[str, float, Any]] = []
        self._batch: list[_Message] = []
        # Bytes of raw pictures: what was put in counts in the caller's thread, what is packed in the other.
        self._raw_in = self._raw_out = 0
        self._queue: queue.Queue[list[_Message] | None] = queue.Queue(_QUEUE_LENGTH)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[bytes] = self.path.open("wb")
        except OSError as error:
            raise self._failure(error) from error
        try:
            self._writer = _start_writer(self._file, period)
        except OSError as error:
            _abandon(self._file)
            raise self._failure(error) from error
        self._channels = _register(self._writer)
        # A daemon thread with an exit handler completes the file even where nobody closes it.
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def frame(self, frame: SensorFrame) -> None:
        """Record a sensor frame; its time is that of the records that follow."""
        self._time = time = frame.time
        if self._config is not None:
            self._put(CONFIG_TOPIC, time, self._config)
            self._config = None
        elif not 0.0 <= time - self._portion_start < _PORTION - _TINY:
            self._make_text()
            self._portion_start = time
            if not 0.0 <= time - self._batch_start < BATCH - _TINY:
                self._hand_over()
                self._batch_start = time
        image = frame.camera
        if image is None or not packed_pictures.can_be_packed(image):
            kept = frame if image is None else replace(frame, camera=packed_pictures.loggable(image))
            self._put("/frame", time, kept)
            return
        self._put("/frame", time, replace(frame, camera=None))
        picture, size = _Picture(image, time), image.pixels.nbytes
        if self._raw_in - self._raw_out + size > _RAW_LIMIT:
            self._put(packed_pictures.TOPIC, time, picture.text())
            return
        self._raw_in += size
        self._put(packed_pictures.TOPIC, time, picture)

    def command(self, motion: MotionCommand, joints: JointCommand, safe: SafetyRequest) -> None:
        """Record what went into the controller beside the newest frame, and its answer.

        Raises:
            LogError: no frame was recorded yet.
        """
        if self._time is None:
            raise LogError("a command was recorded before any frame")
        record = CommandRecord(time=self._time, motion=motion, safety=safe, joints=joints)
        self._put("/command", record.time, record)

    def telemetry(self, telemetry: Telemetry) -> None:
        """Record the controller's account of a tick."""
        self._put("/telemetry", telemetry.time, telemetry)

    def truth(self, sample: TruthSample) -> None:
        """Record the simulator's truth."""
        self._put("/truth", sample.time, sample)

    def finish(self, stop_reason: str, real_time_factor: float | None = None) -> None:
        """Say how the run ended; goes into the file when it is closed."""
        self._outcome["stop_reason"] = stop_reason
        if real_time_factor is not None:
            self._outcome["real_time_factor"] = repr(float(real_time_factor))

    def close(self) -> None:
        """Write what is left and complete the file. Idempotent.

        Raises:
            LogError: something could not be written.
        """
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        if self._config is not None:
            self._portion.append((CONFIG_TOPIC, 0.0, self._config))
        try:
            self._make_text()
        finally:
            self._complete()

    def _complete(self) -> None:
        self._queue.put(self._batch)
        self._queue.put(None)
        self._thread.join()
        try:
            if self._error is None:
                if self._outcome:
                    self._writer.add_metadata(OUTCOME, self._outcome)
                self._writer.finish()
                self._file.close()
        except OSError as error:
            self._error = error
        if self._error is not None:
            _abandon(self._file)
            raise self._failure(self._error)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None and not self._outcome:
            self.finish(f"{type(error).__name__}: {error}".rstrip(": "))
        self.close()

    def _put(self, topic: str, time: float, record: Any) -> None:
        if self._error is not None:
            raise self._failure(self._error)
        self._portion.append((topic, time, record))

    def _make_text(self) -> None:
        """Make messages of the records that wait; what is bytes is text already, pictures take too long."""
        portion, self._portion = self._portion, []
        for topic, time, record in portion:
            text = record if isinstance(record, bytes | _Picture) else encode(record)
            self._batch.append((self._channels[topic], max(0, round(time * 1e9)), text))

    def _hand_over(self) -> None:
        # Blocks when the disk cannot follow: late is better than lost.
        self._queue.put(self._batch)
        self._batch = []

    def _work(self) -> None:
        while (batch := self._queue.get()) is not None:
            if self._error is not None:
                continue
            try:
                for channel, time, data in batch:
                    text = data if isinstance(data, bytes) else self._packed(data)
                    self._writer.add_message(channel, time, text, time)
                self._writer.flush()
            except Exception as error:  # the run must learn of it, or it would wait for this thread for ever
                self._error = error

    def _packed(self, picture: _Picture) -> bytes:
        self._raw_out += picture.image.pixels.nbytes
        return picture.text()

    def _failure(self, error: Exception) -> LogError:
        cause = error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
        return LogError(f"cannot write the log {self.path}: {cause or error}")


def _abandon(file: IO[bytes]) -> None:
    """Close a file that cannot be written; what its buffer holds is lost."""
    with contextlib.suppress(OSError):
        file.close()


def _start_writer(file: IO[bytes], period: float | None) -> Any:
    versions = installed_versions()
    # Chunks end where the batches end, not at a size.
    writer: Any = Writer(file, chunk_size=1 << 30, compression=CompressionType.ZSTD)
    writer.start(library=f"{LIBRARY} {versions.get('bluefoot-mpc', '')}".strip())
    start = {} if period is None else {"period": repr(float(period))}
    writer.add_metadata(START, {**start, "versions": orjson.dumps(versions).decode()})
    file.flush()
    return writer


def _register(writer: Any) -> dict[str, int]:
    schemas = {topic: (cls.__name__, json_schema(cls)) for topic, cls in RECORD_CLASSES.items()}
    schemas[CONFIG_TOPIC] = ("Config", {"type": "object", "properties": {}})
    named = {topic: (f"bluefoot.{name}", schema) for topic, (name, schema) in schemas.items()}
    named[packed_pictures.TOPIC] = (packed_pictures.SCHEMA_NAME, packed_pictures.SCHEMA)
    return {
        topic: writer.register_channel(
            topic, "json", writer.register_schema(name, "jsonschema", orjson.dumps(schema))
        )
        for topic, (name, schema) in named.items()
    }
