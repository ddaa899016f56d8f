"""Support region of every sample of a contact schedule, in a size that never changes.

A region is four half-planes ``normal · p <= offset``: the convex hull of three
or four standing feet (rows left over lie `FAR` away), a narrow strip for feet on
one line, a small box for a single foot. The same code measures the signed
margin of points for plans and for reports.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import BoolArray, ContactSchedule, FloatArray
from bluefoot_mpc.zmp.binding import Bound
from bluefoot_mpc.zmp.support_symbols import FAR, margin_function, region_function

__all__ = ["FAR", "Support", "SupportConfig", "SupportPreview", "support_margins"]

_EACH = np.ones(4)
_CHUNK = 256
"""Samples that a report measures at once."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SupportConfig:
    """How far the edge of the support is stayed away from."""

    margin: float = 0.01  # m, between the edge and the region; a narrower support shrinks to its centre
    half_width: float = 0.003  # m, of the strip around feet that stand on one line

    def __post_init__(self) -> None:
        require_nonnegative(margin=self.margin)
        require_positive(half_width=self.half_width)


@dataclass(frozen=True, kw_only=True, slots=True)
class Support:
    """Regions of n samples, in the frame of the footholds; valid until the next one is built.

    Attributes:
        normals: (n, 4, 2) outward unit vectors.
        offsets: (n, 4) m, of the rows, pulled in by the margin.
        edge_offsets: (n, 4) m, of the same rows without the margin.
        edges: (n, 4, 2, 2) m, both ends of each row's edge.
        centre: (n, 2) m, mean of the standing feet.
        valid: (n,) False where no foot stands: such a sample repeats the region
            before it, at the start the first one after it; the hull of all four
            feet when no sample has a foot.
    """

    normals: FloatArray
    offsets: FloatArray
    edge_offsets: FloatArray
    edges: FloatArray
    centre: FloatArray
    valid: BoolArray


class SupportPreview:
    """Workspace for the regions of a fixed number of samples; holds no memory.

    Args:
        config: margin and width.
        samples: n.
    """

    def __init__(self, config: SupportConfig, samples: int) -> None:
        if samples < 1:
            raise ConfigurationError(f"a support preview needs at least one sample, not {samples!r}")
        self._feet, self._stance = np.zeros((samples, 4, 2)), np.zeros((samples, 4))
        widths = np.array([config.margin]), np.array([config.half_width])
        self._normals, self._offsets = np.zeros((samples, 4, 2)), np.zeros((samples, 4))
        self._plain, self._edges = np.zeros((samples, 4)), np.zeros((samples, 4, 2, 2))
        self._centre = np.zeros((samples, 2))
        outputs = (self._normals, self._offsets, self._plain, self._edges, self._centre)
        self._regions = Bound(region_function(samples), (self._feet, self._stance, *widths), outputs)
        self._point, self._margin = np.zeros((samples, 2)), np.zeros(samples)
        margin_inputs = (self._point, self._normals, self._plain, self._edges)
        self._measure = Bound(margin_function(samples), margin_inputs, (self._margin,))

    def build(self, schedule: ContactSchedule) -> Support:
        """Regions of a schedule of n samples.

        Raises:
            ConfigurationError: the schedule has another number of samples.
        """
        self._check(schedule.stance.shape)
        valid = standing_samples(schedule, self._feet, self._stance)
        self._regions.call()
        return Support(
            normals=self._normals,
            offsets=self._offsets,
            edge_offsets=self._plain,
            edges=self._edges,
            centre=self._centre,
            valid=valid,
        )

    def margins(self, point: FloatArray) -> FloatArray:
        """(n,) m, signed margins of (n, 2) points to the regions built last, without their margin.

        The array is overwritten by the next call.
        """
        self._point[:] = point
        self._measure.call()
        return self._margin

    def _check(self, shape: tuple[int, ...]) -> None:
        if shape != self._stance.shape:
            raise ConfigurationError(
                f"the schedule has {shape[0]} samples, the support preview {len(self._stance)}"
            )


def standing_samples(schedule: ContactSchedule, feet: FloatArray, stance: FloatArray) -> BoolArray:
    """Write the feet of a schedule, and for samples without any those of the sample before.

    Args:
        schedule: n samples.
        feet: (n, 4, 2) m, written.
        stance: (n, 4), written: one where a foot counts as standing. When no
            sample has a foot, all count, and the region is their hull.

    Returns:
        (n,) False where no foot stands.
    """
    feet[:] = schedule.footholds[:, :, :2]
    stance[:] = schedule.stance
    count = stance.dot(_EACH)
    valid: BoolArray = count > 0.0
    if count.min() == 0.0:
        standing = np.flatnonzero(valid)
        if len(standing) == 0:
            stance[:] = 1.0
        else:
            before = np.searchsorted(standing, np.flatnonzero(~valid)) - 1
            source = standing[np.maximum(before, 0)]
            feet[~valid], stance[~valid] = feet[source], stance[source]
    return valid


def support_margins(
    point: FloatArray, foot: FloatArray, stance: BoolArray, least_feet: int = 3
) -> FloatArray:
    """(n,) m, signed margins of points to the hulls of the standing feet, + inside.

    NaN where fewer than `least_feet` stand or the point is not finite.

    Args:
        point: (n, 2) m.
        foot: (n, 4, 2) m, in the same frame.
        stance: (n, 4) True where a foot counts.
        least_feet: number of standing feet that make a support worth a margin.
    """
    margins = np.full(len(point), np.nan)
    usable = np.flatnonzero((stance.sum(axis=1) >= max(1, least_feet)) & np.isfinite(point).all(axis=1))
    preview = SupportPreview(SupportConfig(), _CHUNK)
    time = np.zeros(_CHUNK)
    feet, standing = np.zeros((_CHUNK, 4, 3)), np.ones((_CHUNK, 4), dtype=np.bool_)
    places = np.zeros((_CHUNK, 2))
    for first in range(0, len(usable), _CHUNK):
        rows = usable[first : first + _CHUNK]
        count = len(rows)
        feet[:count, :, :2], standing[:count], places[:count] = foot[rows], stance[rows], point[rows]
        preview.build(ContactSchedule(time=time, stance=standing, footholds=feet))
        margins[rows] = preview.margins(places)[:count]
    return margins
