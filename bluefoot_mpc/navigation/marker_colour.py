"""Patches of the marker's colour in a picture, and circles to start from."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.types import FloatArray

HALF = 2
"""Pictures are searched at half size: a quarter of the work, and a ball eight metres away still shows."""
LARGEST_PATCH = 330
"""Pixels: larger patches are measured in a reduced picture; a large ball has edge enough."""
LEAST_FILL = 0.25
"""Share of its box that a patch fills at least: less are thin lines and crumbs."""
MOST_EDGES = 0.08
"""Share of a patch that edges may take: Hough's transform of grain takes seconds and finds nothing."""
HOUGH_CIRCLES = 3
"""Circles of Hough's transform that are examined in each channel."""
TRIPLES = 48
"""Circles that are tried through three points of a contour each."""
ON_CIRCLE = 0.06
"""Of the radius: how close to a circle a contour's point is on it (and always within 1.2 pixels)."""

Circle = tuple[float, float, float]
"""Column, row and radius, pixels of the whole picture."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ColourRange:
    """Bounds in OpenCV's hue (0..179), saturation and value (0..255).

    Attributes:
        bounds: one pair of lower and upper bound, or two where the range of hues passes through red.
    """

    bounds: tuple[tuple[tuple[int, int, int], tuple[int, int, int]], ...]

    @classmethod
    def around(
        cls, colour: tuple[float, float, float], tolerance_deg: float, saturation: float, value: float
    ) -> ColourRange:
        """The range around a colour (red, green, blue, 0..1); shading and exposure keep the hue."""
        hue = 180.0 * colorsys.rgb_to_hsv(*colour)[0]
        least, most = hue - 0.5 * tolerance_deg, hue + 0.5 * tolerance_deg
        low = (round(255 * saturation), round(255 * value))

        def pair(first: float, last: float) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
            return (round(first), *low), (round(last), 255, 255)

        if least < 0.0:
            return cls(bounds=(pair(0.0, most), pair(least + 180.0, 179.0)))
        if most > 179.0:
            return cls(bounds=(pair(least, 179.0), pair(0.0, most - 180.0)))
        return cls(bounds=(pair(least, most),))


@dataclass(frozen=True, kw_only=True, slots=True)
class Blob:
    """A patch of the marker's colour: left, upper, right and lower edge in pixels of the whole picture."""

    left: int
    upper: int
    right: int
    lower: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Patch:
    """The picture around a blob, reduced where it is large.

    Attributes:
        pixels: (h, w, 3) red, green, blue.
        hsv: (h, w, 3) hue, saturation and value.
        mask: (h, w) 255 where the colour is the marker's.
        left: pixels of the whole picture, left edge of the patch.
        upper: pixels of the whole picture, its upper edge.
        scale: pixels of the whole picture per pixel of the patch.
        width: pixels, of the whole picture.
        height: pixels, of the whole picture.
    """

    pixels: NDArray[np.uint8]
    hsv: NDArray[np.uint8]
    mask: NDArray[np.uint8]
    left: float
    upper: float
    scale: float
    width: int
    height: int


def colour_mask(hsv: Any, colour: ColourRange) -> Any:
    """(h, w) 255 where the pixels (h, w, 3), hue, saturation, value, have the colour, else 0."""
    import cv2  # noqa: PLC0415

    masks = [cv2.inRange(hsv, np.array(low), np.array(high)) for low, high in colour.bounds]
    return masks[0] if len(masks) == 1 else cv2.bitwise_or(masks[0], masks[1])


def blobs(pixels: Any, colour: ColourRange, count: int, least_radius: float) -> list[Blob]:
    """The largest patches of the colour, at most `count`, too small ones left out."""
    import cv2  # noqa: PLC0415

    height, width = pixels.shape[:2]
    small = cv2.resize(pixels, (width // HALF, height // HALF), interpolation=cv2.INTER_AREA)
    mask = colour_mask(cv2.cvtColor(small, cv2.COLOR_RGB2HSV), colour)
    if not cv2.countNonZero(mask):
        return []
    _, _, stats, _ = cv2.connectedComponentsWithStats(mask)
    # A third of a disc's area must be in sight; what is smaller cannot be measured.
    least_area = max(4.0, math.pi * (least_radius / HALF) ** 2 / 3.0)
    stats = stats[1:][stats[1:, 4] >= least_area]
    stats = stats[np.argsort(-stats[:, 4], kind="stable")[:count]]
    fx, fy = width / (width // HALF), height / (height // HALF)
    return [
        Blob(
            left=int(x * fx), upper=int(y * fy), right=math.ceil((x + w) * fx), lower=math.ceil((y + h) * fy)
        )
        for x, y, w, h, _ in stats.tolist()
    ]


def cut(pixels: Any, blob: Blob, colour: ColourRange) -> Patch:
    """The picture around a blob with a margin, and where in it the marker's colour is."""
    import cv2  # noqa: PLC0415

    height, width = pixels.shape[:2]
    margin = 6 + (max(blob.right - blob.left, blob.lower - blob.upper) // 4)
    left, upper = max(0, min(blob.left - margin, width - 2)), max(0, min(blob.upper - margin, height - 2))
    right, lower = (
        max(left + 2, min(width, blob.right + margin)),
        max(upper + 2, min(height, blob.lower + margin)),
    )
    view = pixels[upper:lower, left:right]
    scale = max(1, math.ceil(max(right - left, lower - upper) / LARGEST_PATCH))
    if scale > 1:
        # Whole multiples only, so that the reduced pixels are means of the same number of pixels each.
        rows, columns = view.shape[0] // scale, view.shape[1] // scale
        view = cv2.resize(
            view[: rows * scale, : columns * scale], (columns, rows), interpolation=cv2.INTER_AREA
        )
    view = np.ascontiguousarray(view)
    hsv: Any = cv2.cvtColor(view, cv2.COLOR_RGB2HSV)
    return Patch(
        pixels=view, hsv=hsv, mask=colour_mask(hsv, colour), left=float(left), upper=float(upper),
        scale=float(scale), width=width, height=height,
    )  # fmt: skip


def cut_around(pixels: Any, circle: Circle, colour: ColourRange) -> Patch:
    """The picture around a circle, with a margin."""
    column, row, radius = circle
    box = Blob(
        left=math.floor(column - radius), upper=math.floor(row - radius),
        right=math.ceil(column + radius), lower=math.ceil(row + radius),
    )  # fmt: skip
    return cut(pixels, box, colour)


def contour_circle(patch: Patch) -> Circle | None:
    """The circle on which most of the patch's contour lies; None where there is none.

    What an obstacle or the picture's edge cuts off may miss. Circles through three points each are tried and
    scored by the contour's length on them.
    """
    points = _contour(patch)
    if len(points) < 8:
        return None
    circles = _circles_through(points)
    if not len(circles):
        return None
    distance = np.hypot(
        points[:, 0][:, None] - circles[:, 0], points[:, 1][:, None] - circles[:, 1]
    )  # (points, circles)
    near = np.abs(distance - circles[:, 2]) < np.maximum(1.2, ON_CIRCLE * circles[:, 2])
    best = int(np.argmax(near.sum(axis=0)))
    on = points[near[:, best]]
    if len(on) < max(6, 0.3 * len(points)):
        return None
    column, row, radius = _least_squares(on)
    return (
        patch.left + patch.scale * column, patch.upper + patch.scale * row, patch.scale * radius
    ) if math.isfinite(radius) else None  # fmt: skip


def hough_circles(patch: Patch, least: float, greatest: float) -> Iterator[Circle]:
    """Circles inside a patch by Hough's transform, best first: for a ball before a wall of its colour.

    Saturation, brightness and hue are searched one after the other: the wall may differ from the ball in any.
    """
    import cv2  # noqa: PLC0415

    low = max(3, math.floor(least / patch.scale))
    high = min(math.ceil(greatest / patch.scale), max(patch.mask.shape))
    if high <= low:
        return
    for channel in (1, 2, 0):
        smooth = cv2.GaussianBlur(patch.hsv[:, :, channel], (5, 5), 1.2)
        if cv2.countNonZero(cv2.Canny(smooth, 12.0, 24.0)) > MOST_EDGES * smooth.size:
            continue
        circles = cv2.HoughCircles(
            smooth, cv2.HOUGH_GRADIENT, dp=1.0, minDist=max(6.0, 0.5 * low), param1=24.0, param2=11.0,
            minRadius=low, maxRadius=high,
        )  # fmt: skip
        if circles is None:
            continue
        for column, row, radius in np.asarray(circles).reshape(-1, 3)[:HOUGH_CIRCLES].tolist():
            yield (
                patch.left + patch.scale * (column + 0.5), patch.upper + patch.scale * (row + 0.5),
                patch.scale * radius,
            )  # fmt: skip


def _contour(patch: Patch) -> FloatArray:
    """(n, 2) column, row in the patch of its largest contour: at most 120, none on the picture's edge."""
    import cv2  # noqa: PLC0415

    contours, _ = cv2.findContours(patch.mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return np.zeros((0, 2))
    # By their boxes: a thin rest beside the ball may be long but is not large.
    boxes = [cv2.boundingRect(contour) for contour in contours]
    largest = contours[max(range(len(boxes)), key=lambda k: boxes[k][2] * boxes[k][3])]
    points = largest.reshape(-1, 2)[:: max(1, len(largest) // 120)] + 0.5
    column = patch.left + patch.scale * points[:, 0]
    row = patch.upper + patch.scale * points[:, 1]
    edge = 1.6 * patch.scale
    inner = (column > edge) & (column < patch.width - edge) & (row > edge) & (row < patch.height - edge)
    return np.asarray(points[inner], dtype=np.float64)


def _circles_through(points: FloatArray) -> FloatArray:
    """(m, 3) circles through triples of (n, 2) points spread over the contour."""
    n = len(points)
    start = np.arange(TRIPLES) * n // TRIPLES
    # Thirds, quarters and sixths of the contour apart: an occluded ball has its arc on one side.
    step = np.array([n // 3, n // 4, n // 6, n // 9])[np.arange(TRIPLES) % 4]
    a, b, c = (points[(start + k * step) % n] for k in range(3))
    ab, ac = b - a, c - a
    cross = 2.0 * (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    fine = np.abs(cross) > 1e-6
    ab, ac, a, cross = ab[fine], ac[fine], a[fine], cross[fine]
    ab2, ac2 = (ab**2).sum(axis=1), (ac**2).sum(axis=1)
    x = (ac[:, 1] * ab2 - ab[:, 1] * ac2) / cross
    y = (ab[:, 0] * ac2 - ac[:, 0] * ab2) / cross
    return np.stack([a[:, 0] + x, a[:, 1] + y, np.hypot(x, y)], axis=1)


def _least_squares(points: FloatArray) -> Circle:
    """Circle through (n, 2) points by Kasa's linear least squares."""
    mean = points.mean(axis=0)
    x, y = (points - mean).T
    rows = np.stack([2.0 * x, 2.0 * y, np.ones(len(x))], axis=1)
    solution = np.linalg.lstsq(rows, x * x + y * y, rcond=None)[0]
    cx, cy, rest = solution.tolist()
    return mean[0] + cx, mean[1] + cy, math.sqrt(max(0.0, rest + cx * cx + cy * cy))
