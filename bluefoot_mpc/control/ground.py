"""Ground that is not level: feet are put on the plane that the standing feet show, the trunk stays level.

The paper's laws know one ground, the horizontal plane of b'. On a ramp the
slow trim has to tilt the trunk back over its feet; here the feet are told where
the ground is instead. Heights are measured by forward kinematics against
gravity, so how the trunk tilts does not enter them: there is no loop through
the servos that could ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray

_LEAST_SPREAD = 1e-4
"""m², below it the standing feet are too close together to show a slope."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GroundAdaptationConfig:
    """How the feet follow the slope of the ground."""

    enabled: bool = False  # off, the ground is the horizontal plane of the paper's laws
    time_constant: float = 0.15  # s, with which the slope follows the standing feet
    max_slope: float = 0.27  # rise per metre (15°), steepest ground that the feet are put on
    max_rate: float = 0.5  # 1/s, fastest change of the slope

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant, max_rate=self.max_rate)
        require_range(0.0, 0.6, max_slope=self.max_slope)


class GroundAdapter:
    """Follows the slope of the ground under the feet and puts wanted feet on it.

    The slope moves towards that which fits the standing feet, along the
    directions in which they are apart: the diagonals of a trot show one
    direction after the other, and what they do not show stays as it was.

    Attributes:
        slope: (2,) rise per metre along x and y of b'.

    Args:
        config: speed and bounds.
    """

    def __init__(self, config: GroundAdaptationConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Level ground."""
        self.slope = np.zeros(2)

    def step(self, feet: FloatArray, standing: BoolArray, dt: float) -> None:
        """Take the feet of one tick.

        Args:
            feet: (4, 3) m, measured feet from the trunk, axes of b'.
            standing: (4,) feet that touch and are scheduled to stand.
            dt: s.
        """
        config = self._config
        if not config.enabled:
            return
        points = [place for place, stands in zip(feet.tolist(), standing.tolist(), strict=True) if stands]
        if len(points) < 2 or not all(math.isfinite(value) for point in points for value in point):
            return
        toward = _slope_error(points, self.slope.tolist())
        share = min(1.0, dt / config.time_constant)
        step = _shortened(share * toward[0], share * toward[1], config.max_rate * dt)
        slope_x, slope_y = self.slope.tolist()
        self.slope = np.array(_shortened(slope_x + step[0], slope_y + step[1], config.max_slope))

    def place(self, feet: FloatArray) -> FloatArray:
        """(4, 3) m, feet wanted on level ground in b', put on the ground that was seen."""
        if not self.slope.any():
            return feet
        placed = feet.copy()
        placed[:, 2] += feet[:, :2] @ self.slope
        return placed


def _slope_error(points: list[list[float]], slope: list[float]) -> tuple[float, float]:
    """By how much the plane through points (m) is steeper than `slope`, seen along their longest extent.

    A step of steepest descent on the squared height errors, of the size that
    removes the whole error along the direction in which the points lie apart most.
    """
    n = len(points)
    mean = [sum(column) / n for column in zip(*points, strict=True)]
    xx = xy = yy = along_x = along_y = 0.0
    for point in points:
        x, y, z = (value - middle for value, middle in zip(point, mean, strict=True))
        error = z - slope[0] * x - slope[1] * y
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        along_x, along_y = along_x + x * error, along_y + y * error
    spread = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    return (along_x / spread, along_y / spread) if spread > _LEAST_SPREAD else (0.0, 0.0)


def _shortened(x: float, y: float, most: float) -> tuple[float, float]:
    """The vector, no longer than `most`."""
    size = math.hypot(x, y)
    return (x, y) if size <= most else (x * most / size, y * most / size)
