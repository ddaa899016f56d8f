"""What rays passed through is no ground: heights that many of them went below are none.

A range's noise smears the brink of a block over the next cells, where a map then shows ground that is not
there. But rays that met something farther away went through below it. Only a ray's length is noisy, its way
is known well: that is sharp where it matters, at gaps and behind brinks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.frame import cells_of
from bluefoot_mpc.types import FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class FreeSpaceConfig:
    """Which part of a ray tells of free space, and how many must agree."""

    start: float = 0.020  # m before its end, horizontally: nearer, the range's noise counts
    reach: float = 0.160  # m before its end; farther it is high above the ground
    step: float = 0.010  # m between the places that are looked at
    margin: float = 0.003  # m below a height that a ray must pass: errors of tilt, and cells' width
    rays: int = 4  # places on rays below a height, from which it is none

    def __post_init__(self) -> None:
        require_nonnegative(start=self.start, margin=self.margin)
        require_positive(rays=self.rays)
        require_range(0.01, 1.0, reach=self.reach)
        require_range(0.002, 1.0, step=self.step)


def carved(ground: HeightMap, points: FloatArray, origins: FloatArray, config: FreeSpaceConfig) -> HeightMap:
    """The map without heights that rays passed below: there the ground is unknown.

    Args:
        ground: the map.
        points: (k, 3) m, ends of rays, odometry frame.
        origins: (k, 3) m, where each came from.
        config: what counts.
    """
    count = np.zeros(ground.height.size)
    ray = points - origins
    length = np.hypot(ray[:, 0], ray[:, 1])
    usable = np.isfinite(ray).all(axis=1) & (length > config.reach)
    ends, ray = points[usable], ray[usable] / length[usable, None]
    height = ground.height + (ground.pose[2] - config.margin)
    for back in np.arange(config.start, config.reach, config.step):
        places = ends - back * ray
        i, j = cells_of(ground, places[:, :2])
        # Comparisons with NaN (unknown already) are false.
        below = (i >= 0) & (places[:, 2] < height[i, j])
        count += np.bincount(i[below] * ground.height.shape[1] + j[below], minlength=count.size)
    pierced = (count >= config.rays).reshape(ground.height.shape)
    return replace(
        ground, height=np.where(pierced, np.nan, ground.height),
        confidence=np.where(pierced, 0.0, ground.confidence),
    )  # fmt: skip
