"""The camera's pictures in a log: PNG on a topic of their own, which Foxglove shows as it is.

A picture of 640 by 480 is 900 kB, as text in a frame 1.2 MB. PNG at level 3
without a filter takes 3 ms and 33 kB for a picture of the arena (20 MB a minute at
ten a second), and gives every bit back, which rethinking needs. Level 1 takes 36 kB
and no less time, level 6 with a filter 23 kB and 7 ms; zstd alone is faster and
smaller, but no viewer shows it.
"""

from __future__ import annotations

import base64
import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime.pictures import is_picture
from bluefoot_mpc.types import CameraImage

TOPIC, SCHEMA_NAME = "/camera", "foxglove.CompressedImage"
SCHEMA: dict[str, Any] = {
    "title": SCHEMA_NAME,
    "description": "A picture of the robot's camera",
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "title": "time",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
            "description": "time of exposure",
        },
        "frame_id": {"type": "string", "description": "where it was taken"},
        "data": {"type": "string", "contentEncoding": "base64", "description": "the picture, in its format"},
        "format": {"type": "string"},
        "time": {"type": "number", "description": "s, time of exposure, exactly"},
        "frame": {"type": "number", "description": "s, time of the sensor frame that it came with, exactly"},
        "valid": {"type": "boolean", "description": "False where the picture must not be used"},
    },
}

_NANOSECONDS = 1_000_000_000
_LATEST = 1e9
"""s; a message's time of exposure has no room for more, nor for what is no number."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PackedPicture:
    """A picture as a log keeps it.

    Attributes:
        frame: s, time of the sensor frame that it came with.
        time: s, time of exposure.
        valid: False where it must not be used.
        png: the picture in PNG.
    """

    frame: float
    time: float
    valid: bool
    png: bytes

    def image(self) -> CameraImage:
        """The picture as the robot saw it, bit for bit.

        Raises:
            LogError: the data are no picture.
        """
        cv2 = importlib.import_module("cv2")
        pixels = cv2.imdecode(np.frombuffer(self.png, dtype=np.uint8), cv2.IMREAD_COLOR)
        if pixels is None:
            raise LogError(f"the picture taken at {self.time:.3f} s is not readable")
        return CameraImage(time=self.time, pixels=cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB), valid=self.valid)


def can_be_packed(image: CameraImage) -> bool:
    """Whether a message can hold it: bytes in three colours, at least one pixel, taken at some time."""
    return is_picture(image.pixels) and abs(image.time) < _LATEST


def loggable(image: CameraImage) -> CameraImage:
    """What a frame's text can hold of a picture: all of it, or nothing where it has no bytes as pixels."""
    if isinstance(image.pixels, np.ndarray) and image.pixels.dtype == np.uint8:
        return image
    return CameraImage(time=image.time, pixels=np.zeros((0, 0, 3), dtype=np.uint8), valid=False)


def pack(image: CameraImage, frame: float) -> bytes:
    """A picture as a message of its topic.

    Args:
        image: for which `can_be_packed` holds.
        frame: s, time of the sensor frame that it came with.
    """
    cv2 = importlib.import_module("cv2")
    options = [cv2.IMWRITE_PNG_COMPRESSION, 3, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE]
    _, data = cv2.imencode(".png", cv2.cvtColor(image.pixels, cv2.COLOR_RGB2BGR), options)
    nanoseconds = max(0, round(image.time * _NANOSECONDS))
    return orjson.dumps(
        {
            "timestamp": {"sec": nanoseconds // _NANOSECONDS, "nsec": nanoseconds % _NANOSECONDS},
            "frame_id": "camera",
            "data": base64.b64encode(data).decode("ascii"),
            "format": "png",
            "time": image.time,
            "frame": frame,
            "valid": image.valid,
        }
    )


def unpack(data: bytes) -> PackedPicture:
    """The packed picture in a message of its topic.

    Raises:
        LogError: the data are not such a message.
    """
    try:
        table = orjson.loads(data)
        return PackedPicture(
            frame=float(table["frame"]), time=float(table["time"]), valid=bool(table["valid"]),
            png=base64.b64decode(table["data"], validate=True),
        )  # fmt: skip
    except (TypeError, ValueError, KeyError) as error:
        raise LogError(f"not a picture of a log: {error}") from error
