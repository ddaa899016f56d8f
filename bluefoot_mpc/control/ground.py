"""Ground that is not level: feet are put on the plane that the standing feet show, the trunk stays level.

The paper's laws know one ground, the horizontal plane of b'. On a ramp the
slow trim has to tilt the trunk back over its feet; here the feet are told where
the ground is instead. Heights are measured by forward kinematics against
gravity, so how the trunk tilts does not enter them: there is no loop through
the servos that could ring, and the plane can follow within two ticks. A floor
that surprised the feet lately is stepped over higher.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray

_LEAST_SPREAD = 1e-4
"""m², below it the standing feet are too close together to show a slope."""
_LIFT_RATE = 5.0
"""1/s, fastest change of the factor on the step height."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GroundAdaptationConfig:
    """How the feet follow the slope of the ground."""

    enabled: bool = False  # off, the ground is the horizontal plane of the paper's laws
    time_constant: float = 0.02  # s, with which the slope ahead follows the standing feet
    across: float = 0.1  # how much slower the slope across follows: what is met head on is the rule, 1
    max_slope: float = 0.27  # rise per metre (15°), steepest ground that the feet are put on
    max_rate: float = 6.0  # 1/s, fastest change of the slope
    even: float = 0.0015  # m, off the plane by which feet land on even ground at most
    extra_lift: float = 0.35  # share by which steps are higher after twice that much
    memory: float = 6.0  # s, for which an uneven place is remembered

    def __post_init__(self) -> None:
        require_positive(
            time_constant=self.time_constant, max_rate=self.max_rate, even=self.even, memory=self.memory
        )
        require_range(0.0, 0.6, max_slope=self.max_slope)
        require_range(0.0, 2.0, extra_lift=self.extra_lift)
        require_range(0.01, 1.0, across=self.across)


class GroundAdapter:
    """Follows the slope of the ground under the feet and puts wanted feet on it.

    The slope moves towards that which fits the standing feet, along the
    directions in which they are apart: the diagonals of a trot show one
    direction after the other, and what they do not show stays as it was. Where
    one diagonal cannot tell a slope ahead from one across, it counts as ahead:
    then the foot that goes up a step after its neighbour is expected there.

    Attributes:
        slope: (2,) rise per metre along x and y of b'.
        unevenness: m, how far off the plane a foot landed lately.
        lift: factor on the height of swinging feet, 1 on even ground.

    Args:
        config: speed and bounds.
    """

    def __init__(self, config: GroundAdaptationConfig) -> None:
        self._config = config
        self._across = math.sqrt(config.across)
        self.reset()

    def reset(self) -> None:
        """Level, even ground."""
        self.slope = np.zeros(2)
        self.unevenness = 0.0
        self.lift = 1.0

    def step(self, feet: FloatArray, standing: BoolArray, dt: float, *, walking: bool = True) -> None:
        """Take the feet of one tick.

        Args:
            feet: (4, 3) m, measured feet from the trunk, axes of b'.
            standing: (4,) feet that touch and are scheduled to stand.
            dt: s.
            walking: True while the robot walks; ground that it is put on is no surprise.
        """
        config = self._config
        if not config.enabled:
            return
        points = [place for place, stands in zip(feet.tolist(), standing.tolist(), strict=True) if stands]
        known = all(math.isfinite(value) for point in points for value in point)
        surprise = 0.0
        if len(points) > 1 and known:
            surprise = self._follow(points, dt)
        kept = self.unevenness * math.exp(-dt / config.memory)
        self.unevenness = max(kept, surprise) if walking else kept
        share = min(1.0, max(0.0, self.unevenness / config.even - 1.0))
        most = _LIFT_RATE * dt
        self.lift += min(most, max(-most, 1.0 + share * config.extra_lift - self.lift))

    def place(self, feet: FloatArray, height: FloatArray | None = None) -> FloatArray:
        """(4, 3) m, feet wanted on level ground in b', put on the ground that was seen.

        Args:
            feet: (4, 3) m, wanted feet.
            height: (4,) m, how much of their height is above the ground; None for feet that stand.
        """
        if self.lift == 1.0 and not self.slope.any():
            return feet
        placed = feet.copy()
        placed[:, 2] += feet[:, :2] @ self.slope
        if height is not None:
            placed[:, 2] += (self.lift - 1.0) * height
        return placed

    def _follow(self, points: list[list[float]], dt: float) -> float:
        """Turn the slope towards the plane through points (m); gives how far off it one lies, m."""
        config, across = self._config, self._across
        slope_x, slope_y = self.slope.tolist()
        # Where lengths across count less, the same descent turns the slope across less.
        squeezed = [[x, across * y, z] for x, y, z in points]
        (error_x, error_y), off = _slope_error(squeezed, (slope_x, slope_y / across))
        share = min(1.0, dt / config.time_constant)
        step = _shortened(share * error_x, share * across * error_y, config.max_rate * dt)
        self.slope = np.array(_shortened(slope_x + step[0], slope_y + step[1], config.max_slope))
        return off


def _slope_error(points: list[list[float]], slope: tuple[float, float]) -> tuple[tuple[float, float], float]:
    """By how much the plane through points (m) is steeper than `slope`, and how far off one is, m.

    A step of steepest descent on the squared height errors, of the size that
    removes the whole error along the direction in which the points lie apart most.
    """
    n = len(points)
    mean = [sum(column) / n for column in zip(*points, strict=True)]
    xx = xy = yy = along_x = along_y = off = 0.0
    for point in points:
        x, y, z = (value - middle for value, middle in zip(point, mean, strict=True))
        error = z - slope[0] * x - slope[1] * y
        off = max(off, abs(error))
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        along_x, along_y = along_x + x * error, along_y + y * error
    spread = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    if spread <= _LEAST_SPREAD:
        return (0.0, 0.0), 0.0
    return (along_x / spread, along_y / spread), off


def _shortened(x: float, y: float, most: float) -> tuple[float, float]:
    """The vector, no longer than `most`."""
    size = math.hypot(x, y)
    return (x, y) if size <= most else (x * most / size, y * most / size)
