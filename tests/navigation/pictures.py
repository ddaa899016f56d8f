"""Pictures of a ball, drawn from its geometry: what a pinhole sees, with shading, grain and walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.types import CameraImage

VIEW_DEG = 63.0
MARKER = (0.90, 0.10, 0.55)
NEAR_MARKER = (0.80, 0.22, 0.52)
RADIUS = 0.06
Box = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Shot:
    """A picture to draw; boxes are left, upper, right, lower edge in pixels."""

    ball: tuple[float, float, float] | None = None  # m: right, down, forward of the camera
    colour: tuple[float, float, float] = MARKER
    behind: tuple[tuple[Box, tuple[float, float, float]], ...] = ()
    before: tuple[tuple[Box, tuple[float, float, float]], ...] = ()
    light: tuple[float, float, float] = (0.3, -0.8, -0.5)
    exposure: float = 1.0
    size: tuple[int, int] = (640, 480)


def focal(width: int) -> float:
    return 0.5 * width / math.tan(math.radians(0.5 * VIEW_DEG))


def direction(distance: float, bearing_deg: float, up: float = 0.0) -> tuple[float, float, float]:
    """Place of a ball at a distance, to the right by an angle."""
    angle = math.radians(bearing_deg)
    return distance * math.sin(angle), -up, distance * math.cos(angle)


def expected(shot: Shot) -> tuple[float, float, float]:
    """Column, row and radius in the middle of the picture that the ball has by geometry."""
    assert shot.ball is not None
    x, y, z = shot.ball
    f, (width, height) = focal(shot.size[0]), shot.size
    angle = math.asin(RADIUS / math.hypot(x, y, z))
    return 0.5 * width + f * x / z, 0.5 * height + f * y / z, f * math.tan(angle)


def drawn(shot: Shot, rng: np.random.Generator | None = None, time: float = 0.0) -> CameraImage:
    width, height = shot.size
    canvas = np.empty((height, width, 3))
    canvas[:] = (0.62, 0.60, 0.56)
    canvas[height // 2 + height // 16 :] = (0.40, 0.42, 0.45)
    for box, colour in shot.behind:
        _fill(canvas, box, colour)
    if shot.ball is not None:
        _ball(canvas, shot)
    for box, colour in shot.before:
        _fill(canvas, box, colour)
    values = 255.0 * shot.exposure * canvas
    if rng is not None:
        values += rng.integers(-3, 4, values.shape, dtype=np.int8)  # grain of two levels
    return CameraImage(time=time, pixels=np.clip(values + 0.5, 0, 255).astype(np.uint8), valid=True)


def _fill(canvas: np.ndarray, box: Box, colour: tuple[float, float, float]) -> None:
    left, upper, right, lower = (max(0, round(edge)) for edge in box)
    canvas[upper:lower, left:right] = colour


def _ball(canvas: np.ndarray, shot: Shot, fine: int = 4) -> None:
    """Rays through `fine` squared points of each pixel near the ball."""
    width, height = shot.size
    f, centre = focal(width), np.array(shot.ball)
    column, row, radius = expected(shot)
    # An ellipse towards the corners: half as wide again holds it.
    left, right = (int(np.clip(column + s * 1.6 * radius, 0, width)) for s in (-1, 1))
    upper, lower = (int(np.clip(row + s * 1.6 * radius, 0, height)) for s in (-1, 1))
    right, lower = min(width, right + 2), min(height, lower + 2)
    u = left + (np.arange((right - left) * fine) + 0.5) / fine
    v = upper + (np.arange((lower - upper) * fine) + 0.5) / fine
    x, y = np.meshgrid((u - 0.5 * width) / f, (v - 0.5 * height) / f)
    ray = np.stack([x, y, np.ones_like(x)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    along = ray @ centre
    inside = along**2 - (centre @ centre - RADIUS**2)
    hit = inside > 0.0
    part = np.repeat(np.repeat(canvas[upper:lower, left:right], fine, axis=0), fine, axis=1)
    normal = (ray[hit] * (along[hit] - np.sqrt(inside[hit]))[:, None] - centre) / RADIUS
    light = np.array(shot.light) / np.linalg.norm(shot.light)
    shade = 0.45 + 0.55 * np.clip(normal @ light, 0.0, 1.0)
    part[hit] = np.array(shot.colour) * shade[:, None]
    rows, columns = lower - upper, right - left
    canvas[upper:lower, left:right] = part.reshape(rows, fine, columns, fine, 3).mean(axis=(1, 3))
