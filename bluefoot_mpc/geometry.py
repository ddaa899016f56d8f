"""Rotations, planar polygons and other geometry that every stage shares.

Rotation matrices map coordinates: ``rotation_base_to_world @ x_in_base`` is
``x_in_world``. Quaternions are ``x, y, z, w``. Euler angles are roll, pitch,
yaw of the zyx sequence: ``R = Rz(yaw) Ry(pitch) Rx(roll)``.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from bluefoot_mpc.types import FloatArray


def wrap_angle(angle: float) -> float:
    """The same angle in (-pi, pi]; nearly always it is there already, and then stays as it is."""
    if -math.pi < angle <= math.pi:
        return angle
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


def wrap_angles(angles: FloatArray) -> FloatArray:
    """(...) the same angles in (-pi, pi]."""
    return np.asarray(np.pi - (np.pi - angles) % (2.0 * np.pi))


def skew(vector: FloatArray) -> FloatArray:
    """(3, 3) matrix S with ``S @ x`` the cross product of `vector` and x."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_z(angle: float) -> FloatArray:
    """(3, 3) rotation about z by `angle` (rad)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_from_rpy(rpy: FloatArray) -> FloatArray:
    """(3, 3) rotation_base_to_world of roll, pitch, yaw (rad)."""
    roll, pitch, yaw = rpy.tolist()  # plain floats: five times faster than a small array's entries
    cr, cp, cy = math.cos(roll), math.cos(pitch), math.cos(yaw)
    sr, sp, sy = math.sin(roll), math.sin(pitch), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_from_rotation(rotation: FloatArray) -> FloatArray:
    """(3,) roll, pitch, yaw (rad) of a rotation matrix; pitch in [-pi/2, pi/2]."""
    pitch = math.asin(min(1.0, max(-1.0, -float(rotation[2, 0]))))
    roll = math.atan2(rotation[2, 1], rotation[2, 2])
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    return np.array([roll, pitch, yaw])


def rotation_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """(3, 3) rotation of a unit quaternion ``x, y, z, w``."""
    x, y, z, w = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_rpy(rpy: FloatArray) -> FloatArray:
    """(4,) quaternion ``x, y, z, w`` of roll, pitch, yaw (rad)."""
    roll, pitch, yaw = (0.5 * rpy).tolist()
    cr, cp, cy = math.cos(roll), math.cos(pitch), math.cos(yaw)
    sr, sp, sy = math.sin(roll), math.sin(pitch), math.sin(yaw)
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )


def rpy_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """(3,) roll, pitch, yaw (rad) of a unit quaternion ``x, y, z, w``."""
    return rpy_from_rotation(rotation_from_quaternion(quaternion))


def convex_hull(points: FloatArray) -> FloatArray:
    """(k, 2) corners of the convex hull of (n, 2) `points`, counter-clockwise.

    Collinear points are dropped; fewer than three distinct corners give a
    point or a segment back.
    """
    unique = sorted({(float(x), float(y)) for x, y in points})
    if len(unique) <= 2:
        return np.array(unique).reshape(-1, 2)
    lower = _half_hull(unique)
    upper = _half_hull(unique[::-1])
    return np.array(lower[:-1] + upper[:-1])


def signed_margin(point: FloatArray, polygon: FloatArray) -> float:
    """Signed distance of a planar point to a convex polygon's edge, + inside (m).

    Args:
        point: (2,) m.
        polygon: (k, 2) m, counter-clockwise corners; with k = 2 the distance to
            the segment comes back, negative; with k = 1 that to the point.
    """
    if len(polygon) >= 3:
        edges = np.roll(polygon, -1, axis=0) - polygon
        offset = point - polygon
        distance = (edges[:, 0] * offset[:, 1] - edges[:, 1] * offset[:, 0]) / np.hypot(*edges.T)
        if np.all(distance >= 0.0):
            return float(distance.min())
    corners = np.vstack([polygon, polygon[:1]])
    return -min(_segment_distance(point, a, b) for a, b in itertools.pairwise(corners))


def _half_hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    hull: list[tuple[float, float]] = []
    for p in points:
        while len(hull) >= 2 and _turn(hull[-2], hull[-1], p) <= 0.0:
            hull.pop()
        hull.append(p)
    return hull


def _turn(o: tuple[float, float], a: tuple[float, float], b: tuple[float, float]) -> float:
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def _segment_distance(point: FloatArray, a: FloatArray, b: FloatArray) -> float:
    along = b - a
    length_squared = float(along @ along)
    share = 0.0 if length_squared == 0.0 else float((point - a) @ along) / length_squared
    nearest = a + min(1.0, max(0.0, share)) * along
    return float(np.hypot(*(point - nearest)))
