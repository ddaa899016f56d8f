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
"""m, the paper's range along x or y with the ankle direction fixed."""
PAPER_SHIFT_FREE = 0.098
"""m, the range along x or y with the ankle direction free."""
PAPER_TILT_FREE_DEG = 37.0
"""Degrees of roll or pitch that the paper states with the ankle direction free."""

_FEASIBLE = -1e-9  # rad, rounding of a joint exactly at its limit
_EDGE_TOLERANCE = 1e-6  # m or rad, of the extents


@dataclass(frozen=True, kw_only=True, slots=True)
class RomConfig:
    """How wide and how finely the study looks."""

    shift: float = 0.13  # m, half width of the x-y map
    tilt_deg: float = 50.0  # degrees, half width of the roll-pitch map
    points: int = 81  # a side of each map, odd so that the stance itself is one
    ankle_direction_deg: float | None = None  # degrees; None takes the robot's stance

    def __post_init__(self) -> None:
        require_positive(shift=self.shift, tilt_deg=self.tilt_deg, points=self.points)
        if self.points % 2 == 0:
            raise ConfigurationError(f"points = {self.points} must be odd")


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
        extents: lowest and highest first coordinate with the second at zero,
            then the same of the second, along unbroken feasible lines from the stance.
    """

    kind: Kind
    ankle: Ankle
    first: FloatArray
    second: FloatArray
    margin: FloatArray
    extents: tuple[float, float, float, float]

    @property
    def feasible(self) -> BoolArray:
        """(n, n) True where every leg stands inside its limits."""
        return np.asarray(self.margin >= _FEASIBLE)

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
        return _map(kind, ankle, axis, margin)

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


def _map(kind: Kind, ankle: Ankle, axis: FloatArray, margin: Margin) -> RomMap:
    first, second = np.meshgrid(axis, axis, indexing="ij")
    values = margin(np.column_stack([first.ravel(), second.ravel()]))
    rays = [np.array(ray) for ray in ((-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0))]
    reach = [_extent_along(margin, ray, float(axis[-1])) for ray in rays]
    return RomMap(
        kind=kind, ankle=ankle, first=axis, second=axis, margin=values.reshape(first.shape),
        extents=(-reach[0], reach[1], -reach[2], reach[3]),
    )  # fmt: skip


def _extent_along(margin: Margin, ray: FloatArray, limit: float) -> float:
    """How far along a ray every pose from the stance on is feasible, at most `limit`."""
    distances = np.linspace(0.0, limit, 101)
    bad = np.flatnonzero(margin(distances[:, None] * ray) < _FEASIBLE)
    if len(bad) == 0:
        return limit
    if bad[0] == 0:
        return 0.0
    low, high = float(distances[bad[0] - 1]), float(distances[bad[0]])
    while high - low > _EDGE_TOLERANCE:
        middle = 0.5 * (low + high)
        if margin(middle * ray[None, :])[0] >= _FEASIBLE:
            low = middle
        else:
            high = middle
    return low
