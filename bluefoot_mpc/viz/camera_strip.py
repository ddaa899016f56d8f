"""The camera's pictures in the report: a few of them, with what was found drawn over each."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.pictures import KeptPicture, PictureBook
from bluefoot_mpc.types import Guided
from bluefoot_mpc.viz.guided_series import GuidedSeries
from bluefoot_mpc.viz.style import GUIDED_NAMES
from bluefoot_mpc.viz.verdict import number

MOST = 12
"""Pictures in the report."""
_EVENTS = 6
"""Pictures of events among them, at most, if others are there to show the rest of the run."""
_REST = str(Guided.ARRIVED)
_QUALITY = 82  # of JPEG, 0..100


@dataclass(frozen=True, kw_only=True, slots=True)
class Overlay:
    """One picture with what is drawn over it; all in pixels of the camera.

    Attributes:
        source: the picture, as a data address.
        time: s, from the first tick.
        width: pixels.
        height: pixels.
        column: of the marker; the bearing line stands there. None where it was not found.
        row: of the marker.
        radius: of the marker.
        bearing: horizontal direction of the marker, as text.
        distance: to the marker, as text; empty where it is not known.
        label: what led, or what happened.
        is_event: True where something happened.
    """

    source: str
    time: float
    width: int
    height: int
    column: float | None
    row: float | None
    radius: float | None
    bearing: str
    distance: str
    label: str
    is_event: bool

    @property
    def description(self) -> str:
        """What the picture shows, for those who do not see it."""
        found = f"marker {self.bearing}, {self.distance or 'distance unknown'}"
        return f"{self.time:.1f} s, {self.label}: {found if self.column is not None else 'no marker found'}"


def kept_pictures(run: RunData) -> tuple[KeptPicture, ...]:
    """The pictures that a run kept; those of frames that still hold theirs, where it kept none."""
    if len(run.pictures):
        return run.pictures.pictures()
    book = PictureBook()
    for frame, telemetry in zip(run.frames, run.telemetry, strict=False):
        book.keep(frame, telemetry)
    return book.pictures()


def camera_strip(
    pictures: Sequence[KeptPicture], guided: GuidedSeries, view_deg: float, start: float
) -> list[Overlay]:
    """The pictures to show.

    Args:
        pictures: what was kept.
        guided: how the run found its way.
        view_deg: degrees from the left edge of a picture to its right edge.
        start: s, time of the first tick.
    """
    rests = [picture for picture in pictures if not picture.event and _led(guided, picture, start) == _REST]
    # A robot that has arrived stands, and one picture of it is like the other: the last will do.
    shown = [picture for picture in pictures if picture not in rests[:-1]]
    return [_overlay(picture, guided, view_deg, start) for picture in choose(shown)]


def choose(pictures: Sequence[KeptPicture]) -> list[KeptPicture]:
    """At most `MOST` pictures in order of time.

    Half of them may show events; of the others, those with the marker go before those without, but a
    third is for these: the search is a part of the run.
    """
    events = [picture for picture in pictures if picture.event]
    others = [picture for picture in pictures if not picture.event]
    found = [picture for picture in others if np.isfinite(picture.marker[0])]
    rest = [picture for picture in others if not np.isfinite(picture.marker[0])]
    chosen = _spread(events, max(_EVENTS, MOST - len(others)))
    room = MOST - len(chosen)
    chosen += _spread(found, max(room - len(rest), room - room // 3))
    chosen += _spread(rest, MOST - len(chosen))
    return sorted(chosen, key=lambda picture: picture.time)


def _spread(pictures: Sequence[KeptPicture], count: int) -> list[KeptPicture]:
    """At most `count` of them, the first and the last included."""
    if len(pictures) <= count:
        return list(pictures)
    return [pictures[k] for k in np.unique(np.linspace(0, len(pictures) - 1, count).round().astype(int))]


def _overlay(picture: KeptPicture, guided: GuidedSeries, view_deg: float, start: float) -> Overlay:
    height, width = (picture.shrunk * side for side in picture.pixels.shape[:2])
    tick = _tick(guided, picture, start)
    is_found = bool(np.isfinite(picture.marker).all())
    column, row, radius = (float(x) for x in picture.marker) if is_found else (None, None, None)
    bearing = "" if column is None else _bearing(column, width, view_deg)
    led = guided.guided[tick]
    return Overlay(
        source=data_address(picture.pixels), time=picture.time - start, width=width, height=height,
        column=column, row=row, radius=radius, bearing=bearing,
        distance=_distance(guided, tick) if is_found else "",
        label=picture.event or GUIDED_NAMES.get(led, led) or "no task", is_event=bool(picture.event),
    )  # fmt: skip


def _tick(guided: GuidedSeries, picture: KeptPicture, start: float) -> int:
    return int(np.argmin(np.abs(guided.time - (picture.time - start))))


def _led(guided: GuidedSeries, picture: KeptPicture, start: float) -> str:
    return guided.guided[_tick(guided, picture, start)]


def _bearing(column: float, width: int, view_deg: float) -> str:
    focal = 0.5 * width / math.tan(0.5 * math.radians(view_deg))
    angle = math.degrees(math.atan((0.5 * width - column) / focal))
    side = "left" if angle > 0.05 else "right" if angle < -0.05 else "ahead"
    return f"{abs(angle):.1f}° {side}"


def _distance(guided: GuidedSeries, tick: int) -> str:
    believed, true = guided.distance_estimate[tick], guided.distance_true[tick]
    if not math.isfinite(believed):
        return ""
    text = f"{number(believed, 2)} m"
    return f"{text} (true {number(true, 2)})" if math.isfinite(true) else text


def data_address(pixels: NDArray[np.uint8]) -> str:
    """A picture (height, width, 3), RGB, as a JPEG inside an address.

    Raises:
        BlueFootError: OpenCV cannot encode it.
    """
    import cv2  # noqa: PLC0415 - only reports with pictures need it

    done, data = cv2.imencode(
        ".jpg", cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    )
    if not done:
        raise BlueFootError(f"a picture of {pixels.shape} could not be written as JPEG")
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode("ascii")
