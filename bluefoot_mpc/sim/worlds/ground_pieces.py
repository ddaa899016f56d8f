"""Pieces of rough ground, and where it may lie."""

from __future__ import annotations

from bluefoot_mpc.sim.worlds.layout import Colour, Point
from bluefoot_mpc.sim.worlds.plan import Solid

START, END = 0.42, 2.2
"""m along x, where rough ground begins and ends: before it the ground is level."""

HALF_WIDTH = 1.0
"""m, how far rough ground reaches to either side."""

_LOW: Colour = (0.60, 0.58, 0.54)
_HIGH: Colour = (0.80, 0.66, 0.46)


def slab(
    name: str, at: Point, size: tuple[float, float], ends: tuple[float, float], yaw: float = 0.0,
    colour: Colour = _LOW,
) -> Solid:  # fmt: skip
    """An upright block of ground.

    Args:
        name: of the piece.
        at: m in world, its middle from above.
        size: m, length along its x axis and width.
        ends: m in world, its bottom and its top.
        yaw: rad, left.
        colour: red, green, blue, 0..1.
    """
    bottom, top = ends[0], round(float(ends[1]), 4)
    x, y = round(float(at[0]), 4), round(float(at[1]), 4)
    return Solid(
        name=name, shape="box", x=x, y=y, z=round(0.5 * (bottom + top), 5),
        size=(size[0], size[1], round(top - bottom, 4)), yaw=yaw, is_ground=True, colour=colour,
    )  # fmt: skip


def shade(height: float, greatest: float) -> Colour:
    """A colour that tells the height of a piece.

    Args:
        height: m, over the lowest.
        greatest: m, of the highest over the lowest.
    """
    share = min(1.0, max(0.0, height / greatest)) if greatest > 0.0 else 0.0
    red, green, blue = (round(low + share * (high - low), 3) for low, high in zip(_LOW, _HIGH, strict=True))
    return red, green, blue


def cut(value: float) -> float:
    """A length to the millimetre, so that a plan's file stays readable."""
    return round(float(value), 3)
