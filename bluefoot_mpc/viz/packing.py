"""Numbers small enough for a page: single precision, base64, and fewer points for long runs."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bluefoot_mpc.types import FloatArray


def pack(values: ArrayLike) -> dict[str, Any]:
    """An array as plotly.js and the replay read it: type, base64 data and, for tables, the shape.

    Single precision keeps seven digits, more than a picture shows; what is too great for it is infinite.
    """
    with np.errstate(over="ignore"):
        array = np.ascontiguousarray(values, dtype="<f4")
    packed: dict[str, Any] = {"dtype": "f4", "bdata": base64.b64encode(array.tobytes()).decode("ascii")}
    if array.ndim > 1:
        packed["shape"] = ", ".join(map(str, array.shape))
    return packed


def pack_mask(values: NDArray[np.bool_]) -> dict[str, Any]:
    """A table of zeros and ones as plotly.js reads it, a quarter as large as numbers are."""
    data = base64.b64encode(np.ascontiguousarray(values, dtype="<i1").tobytes()).decode("ascii")
    return {"dtype": "i1", "bdata": data, "shape": ", ".join(map(str, values.shape))}


def pack_bytes(values: NDArray[np.uint8]) -> str:
    """Base64 of small integers."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=np.uint8).tobytes()).decode("ascii")


def stride_for(n: int, limit: int) -> int:
    """Least step with which `n` samples become at most `limit`."""
    return max(1, -(-n // limit))


def envelope(time: FloatArray, values: FloatArray, limit: int) -> tuple[FloatArray, FloatArray]:
    """Fewer samples that still show every peak: the least and the greatest of each stretch.

    Args:
        time: (n,) s.
        values: (n, k).
        limit: most samples to give back.

    Returns:
        (m,) s and (m, k), unchanged when n <= limit.
    """
    n = len(time)
    if n <= limit:
        return time, values
    step = stride_for(n, limit // 2)
    whole = n - n % step
    blocks = values[:whole].reshape(-1, step, values.shape[1])
    low, high = blocks.min(axis=1), blocks.max(axis=1)
    thinned = np.empty((2 * len(blocks), values.shape[1]))
    thinned[0::2], thinned[1::2] = low, high
    starts = time[:whole:step]
    times = np.empty(len(thinned))
    times[0::2], times[1::2] = starts, starts + 0.5 * step * (time[1] - time[0])
    return times, thinned


def stretches(active: NDArray[np.bool_], time: FloatArray, period: float) -> list[tuple[float, float]]:
    """Start and end (s) of every stretch in which `active` (n,) is True."""
    if not len(active):
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], active, [False]]).astype(np.int8)))
    ends = np.append(time, time[-1] + period)
    return [(float(ends[a]), float(ends[b])) for a, b in zip(edges[0::2], edges[1::2], strict=True)]
