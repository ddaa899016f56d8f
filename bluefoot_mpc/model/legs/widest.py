"""The direction of a leg's last link that keeps its joints farthest from their limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.geometry import wrap_angles
from bluefoot_mpc.model.legs.geometry import ALL_LEGS, LegGeometry
from bluefoot_mpc.model.legs.inverse import REACH_TOLERANCE, inverse_in_leg
from bluefoot_mpc.types import FloatArray

# One scan over all reachable directions, fine enough to find the right hill, then
# zooms of two old steps each: two leave 0.03° (a servo step is 0.29°).
SCAN_POINTS = 33
ZOOMS = 2
_REACH_ROUNDING = 1e-9  # of the knee's cosine
_OFFSETS = 0.5 * np.pi * np.linspace(-1.0, 1.0, SCAN_POINTS)


def widest_directions(
    geometry: LegGeometry,
    feet_in_leg: FloatArray,
    legs: Sequence[int] = ALL_LEGS,
    knee_up: bool = True,
    zooms: int = ZOOMS,
) -> FloatArray:
    """Directions that keep hip_pitch, knee and ankle farthest from their imposed limits.

    A scan over the reachable directions, then zooms around the best of them.
    For feet below the hips the result is a continuous function of the foot
    point (its slope jumps where another joint becomes the closest one). On the
    knee-down branch, where hills stand at both stretched ends, the scan may
    settle on one that is some degrees lower. A foot out of reach is pointed at.

    Args:
        geometry: lengths and limits.
        feet_in_leg: (..., n, 3) m, foot points in the leg frames.
        legs: indices of the n legs.
        knee_up: branch of the knee.
        zooms: refinements after the scan, each 16 times finer.

    Returns:
        (..., n) rad.
    """
    bearing, distance = _bearing_of_feet(geometry, feet_in_leg)
    return search(geometry.links, (bearing, *_ranges(geometry, legs)), distance, knee_up, zooms)


def search(
    links: tuple[float, float, float, float],
    ranges: tuple[FloatArray, FloatArray, FloatArray],
    distance: FloatArray,
    knee_up: bool,
    zooms: int,
) -> FloatArray:
    """`widest_directions` for feet given in the legs' planes.

    Args:
        links: m, lengths.
        ranges: (...) rad, bearings of the feet from the hip_pitch axes, then the
            middles and half widths of the ranges of hip_pitch, knee and ankle,
            three of each along the first axis.
        distance: (...) m, of the feet from the hip_pitch axes.
        knee_up: branch of the knee.
        zooms: refinements after the scan.

    Returns:
        (...) rad.
    """
    bearing = ranges[0]
    # Turns are width * sin(place): at the ends the knee is stretched and its angle grows
    # with the square root of the turn, which this spacing makes smooth again.
    width = _reachable_width(links, distance)
    places = np.broadcast_to(_OFFSETS, (*distance.shape, SCAN_POINTS))
    narrowing = 1.0
    for zoom in range(zooms + 1):
        turns = width[..., None] * np.sin(places)
        best = _score(links, distance, turns, ranges, knee_up).argmax(axis=-1)[..., None]
        if zoom < zooms:
            narrowing *= 2.0 / (SCAN_POINTS - 1)
            places = np.take_along_axis(places, best, axis=-1) + narrowing * _OFFSETS
    turn = np.take_along_axis(turns, best, axis=-1)[..., 0]
    return wrap_angles(bearing + turn)


def widest_margin(
    geometry: LegGeometry,
    feet_in_leg: FloatArray,
    legs: Sequence[int] = ALL_LEGS,
    knee_up: bool = True,
    zooms: int = ZOOMS,
) -> FloatArray:
    """The margin that `widest_directions` leaves: (..., n) rad, as `limit_margin` counts it."""
    directions = widest_directions(geometry, feet_in_leg, legs, knee_up, zooms)
    return limit_margin(geometry, feet_in_leg, directions, legs, knee_up)


def limit_margin(
    geometry: LegGeometry,
    feet_in_leg: FloatArray,
    ankle: FloatArray,
    legs: Sequence[int] = ALL_LEGS,
    knee_up: bool = True,
) -> FloatArray:
    """Least distance of a leg's joints, hip_yaw included, to their limits for given ankle directions.

    Args:
        geometry: lengths and limits.
        feet_in_leg: (..., n, 3) m, foot points in the leg frames.
        ankle: (..., n) rad, directions of the last links.
        legs: indices of the n legs.
        knee_up: branch of the knee.

    Returns:
        (..., n) rad, negative where a limit is passed, -inf where out of reach.
    """
    angles, missing = inverse_in_leg(geometry, feet_in_leg, ankle, knee_up)
    index = list(legs)
    lower, upper = geometry.lower.reshape(-1, 4)[index], geometry.upper.reshape(-1, 4)[index]
    margin = np.minimum(angles - lower, upper - angles).min(axis=-1)
    return np.asarray(np.where(missing > REACH_TOLERANCE, -np.inf, margin))


def _ranges(geometry: LegGeometry, legs: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Middles and half widths of the imposed ranges of hip_pitch, knee, ankle: (3, n, 1) rad each."""
    index = list(legs)
    lower = geometry.lower.reshape(-1, 4)[index, 1:].T[..., None]
    upper = geometry.upper.reshape(-1, 4)[index, 1:].T[..., None]
    return 0.5 * (lower + upper), 0.5 * (upper - lower)


def _bearing_of_feet(geometry: LegGeometry, feet_in_leg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(...) direction (rad) and distance (m) of the feet from the hip_pitch axes, in the legs' planes."""
    reach = np.hypot(feet_in_leg[..., 0], feet_in_leg[..., 1]) - geometry.links[0]
    height = feet_in_leg[..., 2]
    return np.arctan2(height, reach), np.maximum(np.hypot(reach, height), 1e-9)


def _reachable_width(links: tuple[float, float, float, float], distance: FloatArray) -> FloatArray:
    """(...) rad, how far the last link may turn from the foot's bearing with the ankle still in reach."""
    _, a2, a3, a4 = links
    cosine = (distance**2 + a4**2 - (a2 + a3) ** 2) / (2.0 * distance * a4)
    return np.asarray(np.arccos(np.minimum(np.maximum(cosine, -1.0), 1.0)))


def _score(
    links: tuple[float, float, float, float],
    distance: FloatArray,
    turn: FloatArray,
    ranges: tuple[FloatArray, FloatArray, FloatArray],
    knee_up: bool,
) -> FloatArray:
    """Margin for last links turned by `turn` from the bearing; far below any margin out of reach.

    Written out again, in axes along the bearing, because `inverse_in_leg` is
    three times slower: it wraps and stacks what the search does not need.
    """
    bearing, (middle2, middle3, middle4), (half2, half3, half4) = ranges
    _, a2, a3, a4 = links
    distance = distance[..., None]
    x, y = distance - a4 * np.cos(turn), -a4 * np.sin(turn)
    raw = (x * x + y * y - (a2 * a2 + a3 * a3)) / (2.0 * a2 * a3)
    c3 = np.minimum(np.maximum(raw, -1.0), 1.0)
    s3 = np.sqrt(1.0 - c3 * c3)
    if knee_up:
        s3 = -s3
    q3 = np.arctan2(s3, c3)
    lean = np.arctan2(y, x) - np.arctan2(a3 * s3, a2 + a3 * c3)
    margin = half2 - np.abs(lean + (bearing[..., None] - middle2))
    margin = np.minimum(margin, half3 - np.abs(q3 - middle3))
    margin = np.minimum(margin, half4 - np.abs(turn - lean - q3 - middle4))
    lacking = np.abs(raw - c3)
    return np.where(lacking > _REACH_ROUNDING, -10.0 - lacking, margin)
