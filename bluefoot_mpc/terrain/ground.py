"""Where on a height map a foot may stand."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.types import FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class Ground:
    """A height map with how well a foot stands on each of its cells.

    Attributes:
        map: heights.
        quality: (n, m) 1 where a foot stands well, towards 0 where it hardly does; 0 where it must not.
    """

    map: HeightMap
    quality: FloatArray
