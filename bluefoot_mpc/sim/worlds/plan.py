"""The plan of a world: what stands where, in numbers that simulator, maps and files share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_finite, require_positive

Shape = Literal["box", "cylinder"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Solid:
    """One thing that stands on (or hangs over) the floor and does not move."""

    name: str
    shape: Shape
    x: float  # m, centre in world
    y: float  # m
    z: float  # m
    size: tuple[
        float, float, float
    ]  # m: full length, width and height; of a cylinder diameter twice and height
    yaw: float = 0.0  # rad, left
    colour: tuple[float, float, float] = (0.72, 0.70, 0.66)  # red, green, blue, 0..1

    def __post_init__(self) -> None:
        require_finite(x=self.x, y=self.y, z=self.z, yaw=self.yaw)
        length, width, height = self.size
        require_positive(length=length, width=width, height=height)


@dataclass(frozen=True, kw_only=True, slots=True)
class Marker:
    """The coloured ball to look for: a circle from wherever it is seen."""

    x: float  # m, centre in world
    y: float  # m
    z: float = 0.20  # m
    radius: float = 0.06  # m
    colour: tuple[float, float, float] = (0.90, 0.10, 0.55)  # red, green, blue, 0..1


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
        if len(set(names)) != len(names):
            raise ConfigurationError(f"world '{self.name}': two solids have the same name")
        least_x, least_y, greatest_x, greatest_y = self.bounds
        if not (least_x < 0.0 < greatest_x and least_y < 0.0 < greatest_y):
            raise ConfigurationError(
                f"world '{self.name}': its bounds must hold the origin, where the robot starts"
            )
