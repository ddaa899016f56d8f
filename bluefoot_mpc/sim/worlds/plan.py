"""The plan of a world: what stands where, in numbers that simulator, maps and files share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_finite, require_positive, require_range

Shape = Literal["box", "cylinder"]

TAKEN_NAMES = ("floor", "marker", "marker_post")
"""Names that the simulator gives to what is no solid of a plan."""

FARTHEST = 60.0
"""m from the origin, along each axis, within which the middle of anything must be."""

_BOUNDS = ("least_x", "least_y", "greatest_x", "greatest_y")


@dataclass(frozen=True, kw_only=True, slots=True)
class Solid:
    """One thing that stands on (or hangs over) the floor and does not move."""

    name: str
    shape: Shape
    x: float  # m, centre in world
    y: float  # m
    z: float  # m
    size: tuple[float, float, float]  # m: length, width, height; of a cylinder diameter twice and height
    yaw: float = 0.0  # rad, left
    colour: tuple[float, float, float] = (0.72, 0.70, 0.66)  # red, green, blue, 0..1

    def __post_init__(self) -> None:
        if not self.name or self.name in TAKEN_NAMES:
            raise ConfigurationError(f"a solid must have a name, and not one of: {', '.join(TAKEN_NAMES)}")
        try:
            self._require_possible()
        except ConfigurationError as error:
            raise ConfigurationError(f"solid '{self.name}': {error}") from error

    def _require_possible(self) -> None:
        require_finite(x=self.x, y=self.y, z=self.z, yaw=self.yaw)
        length, width, height = self.size
        require_positive(length=length, width=width, height=height)
        require_range(-FARTHEST, FARTHEST, x=self.x, y=self.y, z=self.z)
        require_range(0.0, 2.0 * FARTHEST, length=length, width=width, height=height)
        if self.shape == "cylinder" and length != width:
            raise ConfigurationError(
                f"size = {list(self.size)}: a cylinder is as wide as long: [diameter, diameter, height]"
            )
        if self.z + 0.5 * height <= 0.0:
            raise ConfigurationError(f"it is below the floor: z = {self.z:g} is its middle")
        red, green, blue = self.colour
        require_range(0.0, 1.0, red=red, green=green, blue=blue)


@dataclass(frozen=True, kw_only=True, slots=True)
class Marker:
    """The coloured ball to look for: a circle from wherever it is seen."""

    x: float  # m, centre in world
    y: float  # m
    z: float = 0.20  # m
    radius: float = 0.06  # m
    colour: tuple[float, float, float] = (0.90, 0.10, 0.55)  # red, green, blue, 0..1

    def __post_init__(self) -> None:
        require_finite(x=self.x, y=self.y)
        require_positive(radius=self.radius)
        if not self.z >= self.radius:
            raise ConfigurationError(f"marker: z = {self.z:g} must be at least its radius {self.radius:g}")
        require_finite(z=self.z)
        require_range(-FARTHEST, FARTHEST, x=self.x, y=self.y, z=self.z)
        red, green, blue = self.colour
        require_range(0.0, 1.0, red=red, green=green, blue=blue)


@dataclass(frozen=True, kw_only=True, slots=True)
class WorldPlan:
    """A world on level floor. The robot starts at the origin and looks along x.

    Attributes:
        name: of the kind of world.
        seed: that it was made from.
        bounds: m, least x, least y, greatest x, greatest y of the floor that counts.
        solids: what stands in it, walls too.
        marker: None where there is none, or a leader carries it.
    """

    name: str
    seed: int
    bounds: tuple[float, float, float, float]
    solids: tuple[Solid, ...]
    marker: Marker | None = None

    def __post_init__(self) -> None:
        names = [solid.name for solid in self.solids]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ConfigurationError(f"world '{self.name}': two solids have the name '{twice}'")
        require_finite(bounds=self.bounds)
        least_x, least_y, greatest_x, greatest_y = self.bounds
        if least_x >= greatest_x or least_y >= greatest_y:
            raise ConfigurationError(
                f"world '{self.name}': bounds = {list(self.bounds)}: least x and least y come first, "
                "then greatest x and greatest y"
            )
        require_range(-FARTHEST, FARTHEST, **dict(zip(_BOUNDS, self.bounds, strict=True)))
        if not (least_x < 0.0 < greatest_x and least_y < 0.0 < greatest_y):
            raise ConfigurationError(
                f"world '{self.name}': its bounds must hold the origin, where the robot starts"
            )
        marker = self.marker
        if marker is not None and not (
            least_x <= marker.x <= greatest_x and least_y <= marker.y <= greatest_y
        ):
            raise ConfigurationError(
                f"world '{self.name}': the marker at x = {marker.x:g}, y = {marker.y:g} is outside the "
                f"bounds {list(self.bounds)}: move it, or widen them"
            )
