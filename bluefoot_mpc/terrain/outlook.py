"""The ground ahead from the side: how high it is expected to be, and how far it is known without a gap."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.terrain.frame import heights_at
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap

_HIGH = 0.8
"""Share of a line's cells that lie lower than the height which counts: a gap's floor is not walked on."""


@dataclass(frozen=True, kw_only=True, slots=True)
class OutlookConfig:
    """Which strip of the ground ahead is looked along."""

    width: float = 0.40  # m, of the strip: what feet may need
    step: float = 0.02  # m, between lines across it
    far: float = 1.3  # m, its end; beyond hardly a ray meets the ground
    share: float = 0.35  # of a line that makes it a known one
    few: float = 0.1  # of a line, without which nothing is expected of it
    gap: float = 0.03  # m, unknown, at which what is known ends
    smooth: float = 0.10  # m, over which expected heights are smoothed
    dip: float = 0.14  # m, up to which what lies lower is a gap that is stepped over

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(width=self.width, smooth=self.smooth, gap=self.gap, dip=self.dip)
        require_range(0.005, 0.1, step=self.step)
        require_range(0.2, 5.0, far=self.far)
        require_range(0.01, 1.0, share=self.share, few=self.few)


@dataclass(frozen=True, kw_only=True, slots=True)
class Outlook:
    """The strip ahead of the robot.

    Attributes:
        distance: (k,) m ahead of the robot, rising.
        height: (k,) m in the odometry frame, expected; the last known one holds beyond what is known.
        known: (k,) whether enough of the line across is known.
        gap: m, unknown, at which what is known ends.
        step: m between the lines.
    """

    distance: FloatArray
    height: FloatArray
    known: BoolArray
    gap: float
    step: float

    @property
    def drop(self) -> float:
        """M by which the ground is expected to go down somewhere ahead."""
        return float((np.maximum.accumulate(self.height) - self.height).max())

    @property
    def known_until(self) -> float:
        """M ahead, where the ground that is known without a gap ends."""
        last = 0.0
        for distance in self.distance[self.known].tolist():
            if distance - last - self.step > self.gap + 1e-9:
                break
            last = distance
        return last


def outlook(ground: HeightMap, pose: FloatArray, config: OutlookConfig | None = None) -> Outlook | None:
    """Look along a strip of a map.

    Args:
        ground: the map.
        pose: (3,) m, m, rad: the robot over the ground, and its heading.
        config: which strip.

    Returns:
        The strip; None where nothing of it is known.
    """
    config = config or OutlookConfig()
    x, y, yaw = pose.tolist()
    distance = np.arange(0.0, config.far, config.step)
    aside = np.arange(-0.5 * config.width, 0.5 * config.width + 1e-9, config.step)
    ahead, left = np.meshgrid(distance, aside, indexing="ij")
    c, s = math.cos(yaw), math.sin(yaw)
    places = np.stack((x + c * ahead - s * left, y + s * ahead + c * left), axis=-1)
    heights = heights_at(ground, places)
    seen = np.isfinite(heights)
    some = seen.mean(axis=1) >= config.few
    if not some.any():
        return None
    high = [np.quantile(line[here], _HIGH) for line, here in zip(heights[some], seen[some], strict=True)]
    lines, dip = (max(1, round(length / config.step)) for length in (config.smooth, config.dip))
    expected = ndimage.grey_closing(np.interp(distance, distance[some], high), dip, mode="nearest")
    return Outlook(
        distance=distance, height=ndimage.uniform_filter1d(expected, lines, mode="nearest"),
        known=seen.mean(axis=1) >= config.share, gap=config.gap, step=config.step,
    )  # fmt: skip
