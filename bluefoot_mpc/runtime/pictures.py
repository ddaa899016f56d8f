"""Pictures of a run that are kept in memory: few, however long it is.

A run of two minutes takes 1200 pictures, a gigabyte. A report shows a dozen. So
one is kept every two seconds, every other one of them is dropped each time that
they become too many, and those at which something happened are kept besides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.types import CameraImage, FloatArray, Guided, NavigationReport, SensorFrame, Telemetry

EVERY = 2.0
"""s between the pictures that are kept of a short run."""
MOST = 32
"""Most pictures that are kept for nothing but their time."""
PER_EVENT = 4
"""Most pictures of one kind of event: half of them the first ones, the rest the last ones."""
WIDTH = 320
"""Pixels, about the width that pictures are shrunk to."""
LOST = 1.0
"""s that the marker must be out of view until it counts as lost."""

FIRST_SEEN, SEEN_AGAIN, MARKER_LOST = "marker first seen", "marker seen again", "marker lost"
ARRIVED, BOXED_IN, BLIND = "arrived", "boxed in", "nothing to go by"
_LEADS = {Guided.ARRIVED: ARRIVED, Guided.ESCAPE: BOXED_IN, Guided.BLIND: BLIND}
_UNSEEN = np.full(3, np.nan)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class KeptPicture:
    """One picture, and what was found in it.

    Attributes:
        time: s, time of the tick that it is kept for.
        pixels: (height, width, 3) uint8, RGB, shrunk.
        shrunk: pixels of the camera, along each side, that became one.
        marker: (3,) pixels of the camera: column, row and radius of the marker; NaN where none was found.
        event: what happened then; empty where it is kept for its time alone.
    """

    time: float
    pixels: NDArray[np.uint8]
    shrunk: int
    marker: FloatArray
    event: str = ""


@dataclass(slots=True, eq=False)
class PictureBook:
    """Chooses the pictures to keep while a run goes on, or while its log is read."""

    _regular: list[KeptPicture] = field(default_factory=list)
    _events: dict[str, list[KeptPicture]] = field(default_factory=dict)
    _interval: float = EVERY
    _newest: CameraImage | None = None
    _marker: FloatArray = field(default_factory=lambda: _UNSEEN)
    _has_seen: bool = False
    _is_lost: bool = False
    _guided: Guided | None = None

    def __len__(self) -> int:
        return len(self._regular) + sum(map(len, self._events.values()))

    def keep(self, frame: SensorFrame, telemetry: Telemetry) -> None:
        """Look at a tick, and keep its picture where it is worth it.

        Args:
            frame: the tick's frame, its picture included.
            telemetry: what the controller made of it.
        """
        if frame.camera is not None and frame.camera.valid and is_picture(frame.camera.pixels):
            self._newest = frame.camera
            self._marker = _UNSEEN if telemetry.navigation is None else telemetry.navigation.marker
            self._keep_for_time(telemetry.time)
        for event in self._happened(telemetry.navigation):
            self._keep_for_event(telemetry.time, event)

    def pictures(self) -> tuple[KeptPicture, ...]:
        """All that are kept, oldest first; one of each instant."""
        found: dict[float, KeptPicture] = {picture.time: picture for picture in self._regular}
        for picture in (picture for kept in self._events.values() for picture in kept):
            same = found.get(picture.time)
            event = f"{same.event}, {picture.event}" if same is not None and same.event else picture.event
            found[picture.time] = replace(picture, event=event)
        return tuple(found[time] for time in sorted(found))

    def _keep_for_time(self, time: float) -> None:
        kept = self._regular
        if kept and time - kept[-1].time < self._interval - 1e-6:
            return
        kept.append(self._shrink(time, ""))
        if len(kept) > MOST:
            del kept[1::2]
            self._interval *= 2.0

    def _keep_for_event(self, time: float, event: str) -> None:
        if self._newest is None:
            return
        kept = self._events.setdefault(event, [])
        kept.append(self._shrink(time, event))
        if len(kept) > PER_EVENT:
            del kept[PER_EVENT // 2]

    def _happened(self, report: NavigationReport | None) -> list[str]:
        """What is new on this tick."""
        if report is None:
            return []
        found: list[str] = []
        if report.guided is not self._guided:
            self._guided = report.guided
            found += [_LEADS[report.guided]] if report.guided in _LEADS else []
        if math.isfinite(report.marker[0]):
            if not self._has_seen:
                found.append(FIRST_SEEN)
            elif self._is_lost:
                found.append(SEEN_AGAIN)
            self._has_seen, self._is_lost = True, False
        elif self._has_seen and not self._is_lost and report.marker_age > LOST:
            self._is_lost = True
            found.append(MARKER_LOST)
        return found

    def _shrink(self, time: float, event: str) -> KeptPicture:
        image = self._newest
        if image is None:
            raise RuntimeError("there is no picture to shrink yet")
        pixels, side = shrink(image.pixels)
        return KeptPicture(time=time, pixels=pixels, shrunk=side, marker=self._marker.copy(), event=event)


def is_picture(pixels: object) -> bool:
    """True of an array of bytes (height, width, 3): whatever a camera gives, the run goes on."""
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8:
        return False
    return pixels.ndim == 3 and pixels.shape[2] == 3 and min(pixels.shape[:2]) > 0


def shrink(pixels: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], int]:
    """A picture about `WIDTH` wide, each pixel the mean of a square, and the square's side.

    Args:
        pixels: (height, width, 3) uint8.
    """
    side = max(1, min(16, round(pixels.shape[1] / WIDTH), pixels.shape[0]))
    if side == 1:
        return pixels.copy(), 1
    height, width = (side * (length // side) for length in pixels.shape[:2])
    # 16 x 16 bytes still fit into sixteen bits.
    total = np.zeros((height // side, width // side, 3), dtype=np.uint16)
    for row in range(side):
        for column in range(side):
            total += pixels[row:height:side, column:width:side]
    return (total // (side * side)).astype(np.uint8), side
