"""The marker's outline: a circle on the unit sphere, fitted to its edge in the picture.

A ball's outline in a picture is an ellipse, longer towards the corners, whose centre is not the ball's. On
the unit sphere around the camera it is a circle: all rays to the outline make one angle with the ray to the
ball's centre. So the outline is sampled and fitted there, and needs no correction afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.navigation.marker_colour import Circle, Patch
from bluefoot_mpc.types import BoolArray, FloatArray

WINDOWS = (0.25, 0.10)
"""Of the angular radius: how far from the expected edge it is looked for, on each pass."""
LEAST_WINDOW = 2.5
"""Pixels of the patch, the same for small balls."""
SAMPLE = 0.5
"""Pixels of the patch between two samples along a ray."""
LEAST_STEP = 14.0
"""Levels per pixel, red, green and blue together: a weaker edge is noise."""
INSIDE = (0.45, 0.65, 0.82)
"""Of the angular radius: where the marker's colour must be, on a ray that counts."""
OUTSIDE = 1.25
"""Of the angular radius: where it should not be; else something of the same colour is behind."""
SMALL = 8.0
"""Pixels of radius below which a square is nearly a circle, and more of the edge must fit."""
WHOLE = 0.85
"""Share of an outline in sight below which it must be half as large again: few pixels' arc has any radius."""
SMALL_SUPPORT = 0.85
"""Share of a small outline in sight on which an edge must fit."""
REWEIGHTED = 3
"""Rounds of least squares in which what is far off loses its weight."""
TOLERANCE = 0.02
"""Of the angular radius: how far from the fit an edge supports it (and always within 0.8 pixels)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Lens:
    """Pinhole of a picture: focal length and middle, pixels. Directions have axes right, down, forward."""

    focal: float
    column: float
    row: float

    def ray(self, column: float, row: float) -> FloatArray:
        """(3,) unit vector through a place in the picture."""
        ray = np.array([(column - self.column) / self.focal, (row - self.row) / self.focal, 1.0])
        return np.asarray(ray / np.linalg.norm(ray))

    def project(self, axis: FloatArray) -> tuple[float, float]:
        """Column and row of a direction."""
        x, y, z = axis.tolist()
        return self.column + self.focal * x / z, self.row + self.focal * y / z


@dataclass(frozen=True, kw_only=True, slots=True)
class Limits:
    """What counts as the marker's outline; see `marker.MarkerConfig`. Radii in pixels of the picture."""

    least_radius: float
    greatest_radius: float
    least_arc: float
    least_support: float
    least_merged_support: float
    greatest_residual: float
    rays: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Cone:
    """The ball as the camera sees it.

    Attributes:
        axis: (3,) unit vector to the ball's centre: right, down, forward.
        angle: rad, half the angle under which it appears.
        arc: share of the outline in sight.
        support: share of that on which an edge fits.
        score: for the choice between several.
    """

    axis: FloatArray
    angle: float
    arc: float = 0.0
    support: float = 0.0
    score: float = 0.0


def measure(patch: Patch, circle: Circle, lens: Lens, limits: Limits) -> Cone | None:
    """Fit the ball's outline near a circle; None where there is no such outline.

    Args:
        patch: the picture around it.
        circle: to start from, pixels of the whole picture.
        lens: of the whole picture.
        limits: what counts.
    """
    cone = _cone_of(circle, lens)
    edge: Edge | None = None
    for window in WINDOWS:
        if not _sensible(cone, lens, limits):
            return None
        rim = Rim(patch, lens, cone, limits.rays)
        edge = rim.edge(window)
        shift = _shift(edge, rim.phase, cone.angle)
        if shift is None:
            return None
        axis = cone.axis + rim.across @ shift[1:]
        cone = Cone(axis=axis / np.linalg.norm(axis), angle=cone.angle + float(shift[0]))
    if edge is None or not _sensible(cone, lens, limits):
        return None
    return _judged(Rim(patch, lens, cone, limits.rays), limits)


@dataclass(frozen=True, kw_only=True, slots=True)
class Edge:
    """What rays from the middle outwards meet.

    Attributes:
        angle: (n,) rad from the axis, strongest edge near the expected one.
        strength: (n,) levels per pixel.
        seen: (n,) True where the edge is inside the picture and the marker's colour inside of it.
    """

    angle: FloatArray
    strength: FloatArray
    seen: BoolArray


class Rim:
    """The picture around an expected outline, in polar coordinates on the unit sphere.

    Args:
        patch: the picture.
        lens: its pinhole.
        cone: the expected outline.
        rays: directions from the middle.
    """

    def __init__(self, patch: Patch, lens: Lens, cone: Cone, rays: int) -> None:
        self.patch, self.lens, self.cone = patch, lens, cone
        self.phase: FloatArray = np.arange(rays, dtype=np.float64) * (2.0 * math.pi / rays)
        # Two directions across the axis, the first level: the second points down for a level camera.
        level = np.array([cone.axis[2], 0.0, -cone.axis[0]])
        level /= np.linalg.norm(level)
        self.across = np.stack([level, np.cross(cone.axis, level)], axis=1)
        self._outwards = (
            np.cos(self.phase)[:, None] * self.across[:, 0] + np.sin(self.phase)[:, None] * self.across[:, 1]
        )
        self.pixel = patch.scale / lens.focal  # rad

    def place(self, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Column and row in the whole picture, (rays, k) each, of (k,) or (rays, k) angles from the axis."""
        # Of a direction cos(angle) axis + sin(angle) outwards only the ratio matters: a tangent for both.
        slope = np.tan(angle)
        across, down, ahead = (
            self.cone.axis[k] + slope * self._outwards[:, k : k + 1] for k in range(3)
        )  # (rays, k) each
        reach = self.lens.focal / np.maximum(ahead, 1e-3)
        return self.lens.column + reach * across, self.lens.row + reach * down

    def sample(self, values: NDArray[np.uint8], angle: FloatArray) -> Any:
        """(rays, k, ...) float32 values of the patch at angles from the axis."""
        import cv2  # noqa: PLC0415

        column, row = self.place(angle)
        x = ((column - self.patch.left) / self.patch.scale - 0.5).astype(np.float32)
        y = ((row - self.patch.upper) / self.patch.scale - 0.5).astype(np.float32)
        return cv2.remap(values, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float32)

    def in_picture(self, angle: FloatArray) -> BoolArray:
        """(rays, k) True where an angle from the axis is inside the picture, a margin off its edge."""
        column, row = self.place(angle)
        margin = 1.5 * self.patch.scale
        return np.asarray(
            (column > margin) & (column < self.patch.width - margin)
            & (row > margin) & (row < self.patch.height - margin)
        )  # fmt: skip

    def coloured(self, share: tuple[float, ...]) -> BoolArray:
        """(rays, k) True where the marker's colour is, at shares of the expected angle."""
        angle = self.cone.angle * np.array(share)
        return np.asarray((self.sample(self.patch.mask, angle) > 127.0) & self.in_picture(angle))

    def edge(self, window: float) -> Edge:
        """The strongest edge on each ray, within `window` of the expected angle, to a part of a pixel."""
        reach = max(window * self.cone.angle, LEAST_WINDOW * self.pixel)
        count = min(81, 2 * math.ceil(reach / (SAMPLE * self.pixel)) + 1)
        angle = np.linspace(max(0.0, self.cone.angle - reach), self.cone.angle + reach, count)
        values = self.sample(self.patch.pixels, angle)
        spacing = (angle[2] - angle[0]) / self.pixel
        slope = np.sqrt(((values[:, 2:] - values[:, :-2]) ** 2).sum(axis=2)) / spacing
        middle = angle[1:-1]
        peak = np.argmax(slope, axis=1)
        near = np.abs(middle - middle[peak][:, None]) < 1.6 * self.pixel
        weight = np.where(near, slope, 0.0) ** 2
        total = np.maximum(weight.sum(axis=1), 1e-9)
        found = (weight * middle).sum(axis=1) / total
        strength = np.take_along_axis(slope, peak[:, None], axis=1)[:, 0]
        seen = self.coloured(INSIDE).all(axis=1) & self.in_picture(found[:, None])[:, 0]
        return Edge(angle=found, strength=strength, seen=seen)


def _cone_of(circle: Circle, lens: Lens) -> Cone:
    """The cone of a circle in the picture: away from its middle a ball appears larger."""
    axis = lens.ray(circle[0], circle[1])
    return Cone(axis=axis, angle=math.atan(circle[2] / lens.focal * float(axis[2]) ** 1.5))


def _sensible(cone: Cone, lens: Lens, limits: Limits) -> bool:
    radius = lens.focal * math.tan(min(cone.angle, 1.5)) if cone.angle > 0.0 else 0.0
    column, row = lens.project(cone.axis) if cone.axis[2] > 0.1 else (math.inf, math.inf)
    return (
        0.8 * limits.least_radius < radius < limits.greatest_radius
        and abs(column - lens.column) < lens.column + radius
        and abs(row - lens.row) < lens.row + radius
    )


def _shift(edge: Edge, phase: FloatArray, angle: float) -> FloatArray | None:
    """(3,) rad: change of the angular radius and of the axis across, from what the edge says.

    On the sphere a circle that is a little off appears as ``angle + a cos(phase) + b sin(phase)``; least
    squares with weights that forget what is far off (an obstacle's edge, a pattern behind).
    """
    use = edge.seen & (edge.strength > LEAST_STEP)
    if use.sum() < 6:
        return None
    rows = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1)[use]
    offset = edge.angle[use] - angle
    weight = np.ones(len(offset))
    shift = np.zeros(3)
    for _ in range(REWEIGHTED):
        weighted = rows * weight[:, None]
        normal = weighted.T @ rows + 1e-6 * np.eye(3)
        shift = np.linalg.solve(normal, weighted.T @ offset)
        rest = np.abs(offset - rows @ shift)
        spread = max(1.5 * float(np.median(rest)), 0.01 * angle)
        weight = 1.0 / (1.0 + (rest / spread) ** 2) ** 2
    return np.asarray(shift)


def _judged(rim: Rim, limits: Limits) -> Cone | None:
    """The cone with its figures, or None where too little of the outline speaks for it."""
    cone = rim.cone
    if rim.lens.focal * math.tan(cone.angle) < limits.least_radius:
        return None
    edge = rim.edge(WINDOWS[-1])
    distance = np.abs(edge.angle - cone.angle)
    fits = edge.seen & (edge.strength > LEAST_STEP)
    fits &= distance < max(TOLERANCE * cone.angle, 0.8 * rim.pixel)
    arc = float(edge.seen.mean())
    if arc < limits.least_arc or fits.mean() < 0.8 * limits.least_arc:
        return None
    support = float(fits.sum() / edge.seen.sum())
    merged = float(rim.coloured((OUTSIDE,))[edge.seen].mean()) > 0.2
    residual = float(distance[fits].mean())
    least = limits.least_merged_support if merged else limits.least_support
    if cone.angle < SMALL * rim.pixel:
        least = max(least, SMALL_SUPPORT)
    if arc < WHOLE and cone.angle < 1.5 * SMALL * rim.pixel:
        return None
    if support < least:
        return None
    if residual > max(limits.greatest_residual * cone.angle, 0.4 * rim.pixel):
        return None
    score = support * math.sqrt(arc) * (0.8 if merged else 1.0)
    return Cone(axis=cone.axis, angle=cone.angle, arc=arc, support=support, score=score)
