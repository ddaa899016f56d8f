"""The marker in the camera's pictures: found by colour, measured on its edge."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.navigation import marker_colour, marker_edge
from bluefoot_mpc.navigation.marker_colour import Blob, Circle, Patch
from bluefoot_mpc.navigation.marker_edge import Cone, Lens, Limits
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import CameraImage

PLAIN = 0.88
"""Share of the outline on which an edge fits from which on no other circle in the same patch is tried."""
NEAR = 0.25
"""Of the expected radius: how far from where it is expected a ball may be, and how much larger or smaller."""
LEAST_SIDE = 24
"""Pixels: smaller pictures show nothing that could be measured."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MarkerConfig:
    """How the marker looks, and what is taken for it.

    The thresholds around the colour are wide, for shading and exposure; what decides is the edge: a ball's
    outline is a circle on the unit sphere around the camera, wherever in the picture it is.
    """

    red: float = 0.90  # 0..1, colour of the ball in plain light
    green: float = 0.10  # 0..1
    blue: float = 0.55  # 0..1
    hue_tolerance_deg: float = 16.0  # degrees either way on the circle of hues
    least_saturation: float = 0.38  # 0..1
    least_value: float = 0.10  # 0..1, brightest of red, green and blue
    least_radius: float = 3.5  # pixels of a picture 640 wide: 8 m away for a ball of 0.06 m
    greatest_radius: float = 0.34  # share of the picture's height: 0.2 m away for a ball of 0.06 m
    least_arc_deg: float = 110.0  # degrees of the outline that must be in sight
    least_support: float = 0.72  # share of the outline in sight where an edge fits
    least_merged_support: float = 0.62  # the same before something of the marker's colour
    greatest_residual: float = 0.008  # of the radius, mean distance of the edge from the fit
    rays: int = 48  # directions from the middle along which the edge is looked for
    candidates: int = 5  # patches of the colour that are examined, largest first

    def __post_init__(self) -> None:
        require_range(0.0, 1.0, red=self.red, green=self.green, blue=self.blue)
        require_range(1.0, 60.0, hue_tolerance_deg=self.hue_tolerance_deg)
        require_range(0.0, 1.0, least_saturation=self.least_saturation, least_value=self.least_value)
        require_positive(least_radius=self.least_radius, greatest_residual=self.greatest_residual)
        require_range(0.05, 5.0, greatest_radius=self.greatest_radius)
        require_range(45.0, 360.0, least_arc_deg=self.least_arc_deg)
        require_range(
            0.3, 1.0, least_support=self.least_support, least_merged_support=self.least_merged_support
        )
        require_range(16, 512, rays=self.rays)
        require_range(1, 50, candidates=self.candidates)


@dataclass(frozen=True, kw_only=True, slots=True)
class Sighting:
    """The marker in one picture.

    Attributes:
        time: s, time of exposure.
        column: pixels from the left edge, where the ball's centre is (0.5 is the middle of the first pixel).
        row: pixels from the upper edge.
        radius: pixels that the ball's outline would have in the middle of the picture: the tangent of its
            angular radius times the focal length. Range follows from it wherever the ball is.
        width: pixels, of the whole picture.
        height: pixels.
        focal: pixels, focal length that the measurement used.
        arc: share of the outline in sight, 0..1.
        support: share of that on which an edge fits, 0..1.
    """

    time: float
    column: float
    row: float
    radius: float
    width: int
    height: int
    focal: float
    arc: float
    support: float


class MarkerFinder:
    """Finds the marker in pictures, one by one; keeps no memory but the reason for the last answer.

    Colour first, on a picture of half size. Each patch of the marker's colour gets a circle through its
    contour; a patch that no circle explains (a wall of that colour behind the ball, say) is searched with
    Hough's transform for circles inside. A circle counts once its edge, sampled in the full picture, fits.

    How to call: `find(frame.camera)` whenever there is a new picture; None means not seen, and `reason`
    says why. OpenCV is imported at the first picture.

    Args:
        config: how the marker looks.
        camera_view_deg: degrees from edge to edge, `SensorMounts.camera_view_deg`.
    """

    def __init__(self, config: MarkerConfig, camera_view_deg: float = 63.0) -> None:
        self._config = config
        self._half_view = math.tan(0.5 * math.radians(camera_view_deg))
        self._colour = marker_colour.ColourRange.around(
            (config.red, config.green, config.blue), config.hue_tolerance_deg,
            config.least_saturation, config.least_value,
        )  # fmt: skip
        self._reason = "no picture yet"

    @property
    def reason(self) -> str:
        """Why the last picture gave no sighting; empty where it gave one."""
        return self._reason

    def find(self, image: CameraImage | None, expected: Circle | None = None) -> Sighting | None:
        """Look for the marker.

        Args:
            image: a picture of any size; None, an invalid, grey, empty or otherwise wrong one gives None.
            expected: column, row, radius (px) where it should be, if that is known: a good fit there ends
                the search at once, which saves time and is not led astray by a wall of its colour.
        """
        self._reason = _fault(image)
        if image is None or self._reason:
            return None
        pixels = np.ascontiguousarray(image.pixels)
        height, width = pixels.shape[:2]
        lens = Lens(focal=0.5 * width / self._half_view, column=0.5 * width, row=0.5 * height)
        best = self._near(pixels, expected, lens)
        if best is None:
            best = self._anywhere(pixels, lens)
        if best is None:
            return None
        column, row = lens.project(best.axis)
        return Sighting(
            time=image.time, column=column, row=row, radius=lens.focal * math.tan(best.angle),
            width=width, height=height, focal=lens.focal, arc=best.arc, support=best.support,
        )  # fmt: skip

    def _near(self, pixels: Any, expected: Circle | None, lens: Lens) -> Cone | None:
        """The ball where it is expected, if it is there beyond doubt."""
        limits = self._limits(pixels.shape)
        if expected is None or not limits.least_radius < expected[2] < limits.greatest_radius:
            return None
        if not (0.0 < expected[0] < pixels.shape[1] and 0.0 < expected[1] < pixels.shape[0]):
            return None
        patch = marker_colour.cut_around(pixels, expected, self._colour)
        cone = marker_edge.measure(patch, expected, lens, limits)
        if cone is None or cone.arc < PLAIN:
            return None
        # Before a wall of its colour less of the edge fits; that it is where it should be makes up for that.
        column, row = lens.project(cone.axis)
        radius = lens.focal * math.tan(cone.angle)
        off = math.hypot(column - expected[0], row - expected[1])
        near = off < NEAR * expected[2] and abs(radius - expected[2]) < NEAR * expected[2]
        return cone if near or cone.support > PLAIN else None

    def _anywhere(self, pixels: Any, lens: Lens) -> Cone | None:
        """The best ball in any patch of the colour."""
        best: Cone | None = None
        blobs = marker_colour.blobs(
            pixels, self._colour, self._config.candidates, self._least_radius(pixels.shape[1])
        )
        for blob in blobs:
            found = self._examine(pixels, blob, lens)
            if found is not None and (best is None or found.score > best.score):
                best = found
        if best is None:
            self._reason = "no round patch of the marker's colour" if blobs else "nothing of its colour"
        return best

    def _least_radius(self, width: int) -> float:
        return max(2.5, self._config.least_radius * width / 640.0)

    def _examine(self, pixels: Any, blob: Blob, lens: Lens) -> Cone | None:
        """The ball in one patch of colour, from its contour or else from circles inside."""
        patch = marker_colour.cut(pixels, blob, self._colour)
        limits = self._limits(pixels.shape)
        best: Cone | None = None
        for circle in self._circles(patch, limits):
            # What was found in a reduced picture is measured in the full one.
            close = patch if patch.scale == 1.0 else marker_colour.cut_around(pixels, circle, self._colour)
            cone = marker_edge.measure(close, circle, lens, limits)
            if cone is not None and (best is None or cone.score > best.score):
                best = cone
                if best.support > PLAIN:
                    break
        return best

    def _circles(self, patch: Patch, limits: Limits) -> Iterator[Circle]:
        """Circles to try, the likeliest first; costly ones are only worked out where they are asked for."""
        circle = marker_colour.contour_circle(patch)
        if circle is not None:
            yield circle
        yield from marker_colour.hough_circles(patch, limits.least_radius, limits.greatest_radius)

    def _limits(self, shape: tuple[int, ...]) -> Limits:
        config = self._config
        return Limits(
            least_radius=self._least_radius(shape[1]), greatest_radius=config.greatest_radius * shape[0],
            least_arc=config.least_arc_deg / 360.0, least_support=config.least_support,
            least_merged_support=config.least_merged_support, greatest_residual=config.greatest_residual,
            rays=config.rays,
        )  # fmt: skip


def _fault(image: CameraImage | None) -> str:
    """Why a picture cannot be used, in few words; empty when it can."""
    if image is None:
        return "no picture"
    if not image.valid:
        return "the camera calls the picture unusable"
    pixels = image.pixels
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8:
        return "the picture is not one of bytes"
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        return "the picture is not red, green and blue"
    if min(pixels.shape[:2]) < LEAST_SIDE:
        return f"the picture is smaller than {LEAST_SIDE} pixels"
    return "" if math.isfinite(image.time) else "the picture has no time"
