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
    """One thing that stands on (or hangs over) the floor and does not move, or a piece of the ground."""

    name: str
    shape: Shape
    x: float  # m, centre in world
    y: float  # m
    z: float  # m
    size: tuple[float, float, float]  # m: length, width, height; of a cylinder diameter twice and height
    yaw: float = 0.0  # rad, left
    pitch: float = 0.0  # rad, of a piece of ground, nose down positive; turned before yaw
    is_ground: bool = False  # to be walked on: no thing in the way, and no collision
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
        require_range(-0.8, 0.8, pitch=self.pitch)
        if self.pitch != 0.0 and not (self.is_ground and self.shape == "box"):
            raise ConfigurationError(
                f"pitch = {self.pitch:g}: only boxes of the ground are tilted: leave it out, or set is_ground"
            )
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
    """A world on level floor. The robot starts at the origin, on ground at height zero, and looks along x.

    Attributes:
        name: of the kind of world.
        seed: that it was made from.
        bounds: m, least x, least y, greatest x, greatest y of the floor that counts.
        solids: what stands in it, walls too.
        marker: None where there is none, or a leader carries it.
        floor: m, height of the floor; below zero the robot starts on a piece of ground.
    """

    name: str
    seed: int
    bounds: tuple[float, float, float, float]
    solids: tuple[Solid, ...]
    marker: Marker | None = None
    floor: float = 0.0

    def __post_init__(self) -> None:
        self._require_solids()
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
        self._require_marker()

    @property
    def is_even(self) -> bool:
        """True where the floor is all the ground there is."""
        return self.floor == 0.0 and not any(solid.is_ground for solid in self.solids)

    def _require_solids(self) -> None:
        require_range(-1.0, 0.0, floor=self.floor)
        seen: set[str] = set()
        for solid in self.solids:
            if solid.name in seen:
                raise ConfigurationError(f"world '{self.name}': two solids have the name '{solid.name}'")
            seen.add(solid.name)
            if solid.z + 0.5 * solid.size[2] <= self.floor:
                raise ConfigurationError(
                    f"solid '{solid.name}': it is below the floor: z = {solid.z:g} is its middle"
                )

    def _require_marker(self) -> None:
        least_x, least_y, greatest_x, greatest_y = self.bounds
        marker = self.marker
        if marker is not None and not (
            least_x <= marker.x <= greatest_x and least_y <= marker.y <= greatest_y
        ):
            raise ConfigurationError(
                f"world '{self.name}': the marker at x = {marker.x:g}, y = {marker.y:g} is outside the "
                f"bounds {list(self.bounds)}: move it, or widen them"
            )
