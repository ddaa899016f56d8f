"""Range of motion of the trunk over planted feet, inside the imposed joint limits (paper ch. 4).

The trunk stands in the default stance and is moved or tilted; a pose is
feasible when every leg reaches its foot with every joint inside its limits.
With the ankle direction fixed the trunk hardly moves; once each leg may choose
it, the reach of the stretched legs is what ends the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry, limit_margin, to_leg_frame, widest_margin
from bluefoot_mpc.model.parameters import RobotParameters, StanceParameters
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import BoolArray, FloatArray

Kind = Literal["shift", "tilt"]
Ankle = Literal["fixed", "free"]
Margin = Callable[[FloatArray], FloatArray]
"""From (k, 2) coordinates of trunk poses to (k,) least joint-limit margins, rad."""

PAPER_SHIFT_FIXED = 0.014
"""m, along x or y with the ankle direction fixed, as the paper states it."""
PAPER_TILT_DEG = 37.0
"""Degrees of roll or pitch with the ankle direction free, as the paper states it."""

_FEASIBLE = -1e-9  # rad, rounding of a joint exactly at its limit
_STEPS = 41  # along each ray, before the edge is bisected
_BISECTIONS = 14  # leaves 0.2 µm or 0.0001° of a step


@dataclass(frozen=True, kw_only=True, slots=True)
class RomConfig:
    """How wide and how finely the study looks."""

    shift: float = 0.13  # m, half width of the x-y map
    tilt_deg: float = 50.0  # degrees, half width of the roll-pitch map
    points: int = 81  # a side of each map, odd so that the stance itself is one
    rays: int = 240  # around the stance for the outlines, the four axis directions among them
    ankle_direction_deg: float | None = None  # degrees; None takes the robot's stance

    def __post_init__(self) -> None:
        require_positive(shift=self.shift, tilt_deg=self.tilt_deg, points=self.points, rays=self.rays)
        if self.points % 2 == 0:
            raise ConfigurationError(f"points = {self.points} must be odd")
        if self.rays % 4 != 0:
            raise ConfigurationError(f"rays = {self.rays} must be a multiple of 4")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RomMap:
    """Margins over a plane of trunk poses.

    Attributes:
        kind: ``shift`` (x and y of the trunk, m) or ``tilt`` (roll and pitch, rad).
        ankle: ``fixed`` or ``free``, the ankle direction.
        first: (n,) first coordinate: x, or roll.
        second: (n,) second coordinate: y, or pitch.
        margin: (n, n) rad, by [first, second]: least distance of any joint to
            its imposed limit, negative where one is passed, -inf out of reach.
        boundary: (rays, 2) last feasible pose along even rays from the stance, the first
            along + of the first coordinate, then counter-clockwise.
    """

    kind: Kind
    ankle: Ankle
    first: FloatArray
    second: FloatArray
    margin: FloatArray
    boundary: FloatArray

    @property
    def feasible(self) -> BoolArray:
        """(n, n) True where every leg stands inside its limits."""
        return np.asarray(self.margin >= _FEASIBLE)

    @property
    def extents(self) -> tuple[float, float, float, float]:
        """Lowest and highest first coordinate with the second at zero, then those of the second."""
        quarter = len(self.boundary) // 4
        highest_first, highest_second, lowest_first, lowest_second = self.boundary[::quarter]
        return (
            float(lowest_first[0]), float(highest_first[0]),
            float(lowest_second[1]), float(highest_second[1]),
        )  # fmt: skip

    @property
    def extent(self) -> float:
        """Smallest of the four extents: m or rad in every direction along the axes."""
        return min(abs(value) for value in self.extents)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RomStudy:
    """The four maps of the study.

    Attributes:
        robot: name of the robot.
        ankle_direction: rad, the fixed ankle direction.
        trunk_height: m above the foot points.
        shift_fixed: x-y map with the ankle direction fixed.
        shift_free: x-y map with the ankle direction free.
        tilt_fixed: roll-pitch map with the ankle direction fixed.
        tilt_free: roll-pitch map with the ankle direction free.
    """

    robot: str
    ankle_direction: float
    trunk_height: float
    shift_fixed: RomMap
    shift_free: RomMap
    tilt_fixed: RomMap
    tilt_free: RomMap

    @property
    def maps(self) -> tuple[RomMap, ...]:
        """All four maps, translations first."""
        return (self.shift_fixed, self.shift_free, self.tilt_fixed, self.tilt_free)

    def figures(self) -> dict[str, float]:
        """The study's numbers, cm and degrees, along the axes in every direction."""
        return {
            "ankle_direction_deg": float(np.degrees(self.ankle_direction)),
            "shift_fixed_cm": 100.0 * self.shift_fixed.extent,
            "shift_free_cm": 100.0 * self.shift_free.extent,
            "tilt_fixed_deg": float(np.degrees(self.tilt_fixed.extent)),
            "tilt_free_deg": float(np.degrees(self.tilt_free.extent)),
        }


def study_range_of_motion(parameters: RobotParameters, config: RomConfig | None = None) -> RomStudy:
    """Map the trunk's feasible translations and tilts in the default stance.

    Args:
        parameters: the robot, its stance and limits.
        config: size of the maps; the default resolves 3 mm and 1.25°.
    """
    config = config or RomConfig()
    degrees = config.ankle_direction_deg
    if degrees is None:
        degrees = parameters.stance.ankle_direction_deg
    direction = float(np.radians(degrees))
    geometry = LegGeometry.from_parameters(parameters)

    def make(kind: Kind, ankle: Ankle) -> RomMap:
        half = config.shift if kind == "shift" else float(np.radians(config.tilt_deg))
        axis = np.linspace(-half, half, config.points)
        margin = _margin_of(geometry, parameters.stance, kind, direction if ankle == "fixed" else None)
        return _map(kind, ankle, axis, config.rays, margin)

    return RomStudy(
        robot=parameters.name,
        ankle_direction=direction,
        trunk_height=parameters.stance.trunk_height,
        shift_fixed=make("shift", "fixed"),
        shift_free=make("shift", "free"),
        tilt_fixed=make("tilt", "fixed"),
        tilt_free=make("tilt", "free"),
    )


def stance_margin(
    geometry: LegGeometry,
    feet_in_world: FloatArray,
    trunk_position: FloatArray,
    trunk_rpy: FloatArray,
    ankle_direction: float | None = None,
) -> FloatArray:
    """Least joint-limit margin of all legs for a stack of trunk poses over planted feet.

    Args:
        geometry: lengths, hips and limits.
        feet_in_world: (4, 3) m, planted foot points.
        trunk_position: (k, 3) m, trunk origins in the world.
        trunk_rpy: (k, 3) rad, roll, pitch and yaw of the trunk.
        ankle_direction: rad for all legs; ``None`` lets each leg take its best.

    Returns:
        (k,) rad, negative where a limit is passed, -inf where a foot is out of reach.
    """
    rotation = np.array([rotation_from_rpy(rpy) for rpy in trunk_rpy])
    feet_in_leg = to_leg_frame(geometry, (feet_in_world - trunk_position[:, None, :]) @ rotation)
    if ankle_direction is None:
        margin = widest_margin(geometry, feet_in_leg)
    else:
        directions = np.full(feet_in_leg.shape[:-1], ankle_direction)
        margin = limit_margin(geometry, feet_in_leg, directions)
    return np.asarray(margin.min(axis=-1))


def _margin_of(
    geometry: LegGeometry, stance: StanceParameters, kind: Kind, direction: float | None
) -> Margin:
    """Margins as a function of x and y, or of roll and pitch."""

    def margin(coordinates: FloatArray) -> FloatArray:
        position = np.tile([0.0, 0.0, stance.trunk_height], (len(coordinates), 1))
        rpy = np.zeros((len(coordinates), 3))
        moved = position if kind == "shift" else rpy
        moved[:, :2] = coordinates
        return stance_margin(geometry, stance.foot_position, position, rpy, direction)

    return margin


def _map(kind: Kind, ankle: Ankle, axis: FloatArray, rays: int, margin: Margin) -> RomMap:
    first, second = np.meshgrid(axis, axis, indexing="ij")
    values = margin(np.column_stack([first.ravel(), second.ravel()])).reshape(first.shape)
    angles = np.linspace(0.0, 2.0 * np.pi, rays, endpoint=False)
    units = np.column_stack([np.cos(angles), np.sin(angles)])
    boundary = _reach_along(margin, units, float(axis[-1]))[:, None] * units
    return RomMap(kind=kind, ankle=ankle, first=axis, second=axis, margin=values, boundary=boundary)


def _reach_along(margin: Margin, rays: FloatArray, limit: float) -> FloatArray:
    """How far every pose along each (k, 2) ray is feasible, from the stance on, at most `limit`."""
    steps = np.linspace(0.0, limit, _STEPS)
    poses = steps[None, :, None] * rays[:, None, :]
    feasible = margin(poses.reshape(-1, 2)).reshape(len(rays), _STEPS) >= _FEASIBLE
    count = np.cumprod(feasible, axis=1).sum(axis=1)  # unbroken from the stance
    low = steps[np.maximum(count - 1, 0)]
    high = steps[np.minimum(count, _STEPS - 1)]
    high[count == 0] = 0.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        inside = margin(middle[:, None] * rays) >= _FEASIBLE
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(low)
