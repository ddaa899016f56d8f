"""Forward kinematics and Jacobians of the legs in closed form (paper ch. 4).

A leg is a planar chain in a vertical plane that the hip_yaw joint turns. With
r the reach in that plane and psi = azimuth + hip_yaw, every point of leg i is
``hip_i + (r cos psi, r sin psi, z)`` in the base frame.

Functions that run on every tick use plain floats for one posture: on four
legs they beat small arrays several times. A stack of postures, with axes in
front, takes a vectorised path that gives the same numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from bluefoot_mpc.model.legs.geometry import ALL_LEGS, LegGeometry
from bluefoot_mpc.types import FloatArray

N_LEG_JOINTS = 4


def feet_in_base(geometry: LegGeometry, joints: FloatArray, legs: Sequence[int] = ALL_LEGS) -> FloatArray:
    """Foot points of the legs in the base frame.

    Args:
        geometry: lengths and hips.
        joints: (..., 4 n) rad, leg-major angles of the n legs named by `legs`.
        legs: indices of the legs, all four by default.

    Returns:
        (..., n, 3) m, base frame.
    """
    if joints.ndim > 1:
        return _points_of_batch(geometry, joints, legs)[..., -1, :]
    a1, a2, a3, a4 = geometry.links
    angles = _angles(joints, legs)
    values: list[float] = []
    for k, leg in enumerate(legs):
        q1, q2, q3, q4 = angles[4 * k : 4 * k + 4]
        hip = geometry.hips[leg]
        q23 = q2 + q3
        q234 = q23 + q4
        reach = a1 + a2 * cos(q2) + a3 * cos(q23) + a4 * cos(q234)
        direction = hip.azimuth + q1
        values += (
            hip.x + reach * cos(direction),
            hip.y + reach * sin(direction),
            hip.z + a2 * sin(q2) + a3 * sin(q23) + a4 * sin(q234),
        )
    return np.array(values).reshape(-1, 3)


def joint_positions_in_base(
    geometry: LegGeometry, joints: FloatArray, legs: Sequence[int] = ALL_LEGS
) -> FloatArray:
    """Origins of the four joints of each leg, then its foot point.

    The middle of link j is the mean of points j and j + 1 (`link_midpoints`).

    Args:
        geometry: lengths and hips.
        joints: (..., 4 n) rad, leg-major.
        legs: indices of the legs.

    Returns:
        (..., n, 5, 3) m in the base frame: hip_yaw, hip_pitch, knee, ankle, foot.
    """
    if joints.ndim > 1:
        return _points_of_batch(geometry, joints, legs)
    a1, a2, a3, a4 = geometry.links
    angles = _angles(joints, legs)
    values: list[float] = []
    for k, leg in enumerate(legs):
        q1, q2, q3, q4 = angles[4 * k : 4 * k + 4]
        x, y, z, azimuth, _, _ = geometry.hips[leg]
        q23 = q2 + q3
        q234 = q23 + q4
        c, s = cos(azimuth + q1), sin(azimuth + q1)
        r3, z3 = a1 + a2 * cos(q2), z + a2 * sin(q2)
        r4, z4 = r3 + a3 * cos(q23), z3 + a3 * sin(q23)
        r5, z5 = r4 + a4 * cos(q234), z4 + a4 * sin(q234)
        values += (x, y, z, x + a1 * c, y + a1 * s, z, x + r3 * c, y + r3 * s, z3)
        values += (x + r4 * c, y + r4 * s, z4, x + r5 * c, y + r5 * s, z5)
    return np.array(values).reshape(-1, 5, 3)


def link_midpoints(points: FloatArray) -> FloatArray:
    """(..., 4, 3) m, middles of the links between the (..., 5, 3) `points` of `joint_positions_in_base`."""
    return 0.5 * (points[..., :-1, :] + points[..., 1:, :])


def foot_jacobians_in_base(
    geometry: LegGeometry, joints: FloatArray, legs: Sequence[int] = ALL_LEGS
) -> FloatArray:
    """Derivatives of the foot points by the joints of their own legs.

    Args:
        geometry: lengths and hips.
        joints: (..., 4 n) rad, leg-major.
        legs: indices of the legs.

    Returns:
        (..., n, 3, 4) m/rad in the base frame.
    """
    if joints.ndim > 1:
        return _jacobians_of_batch(geometry, joints, legs)
    _, a2, a3, a4 = geometry.links
    a1 = geometry.links[0]
    angles = _angles(joints, legs)
    values: list[float] = []
    for k, leg in enumerate(legs):
        q1, q2, q3, q4 = angles[4 * k : 4 * k + 4]
        q23 = q2 + q3
        q234 = q23 + q4
        direction = geometry.hips[leg].azimuth + q1
        c, s = cos(direction), sin(direction)
        r4, z4 = a4 * cos(q234), a4 * sin(q234)
        r3, z3 = r4 + a3 * cos(q23), z4 + a3 * sin(q23)
        r2, z2 = r3 + a2 * cos(q2), z3 + a2 * sin(q2)
        reach = a1 + r2
        values += (-reach * s, -z2 * c, -z3 * c, -z4 * c)
        values += (reach * c, -z2 * s, -z3 * s, -z4 * s)
        values += (0.0, r2, r3, r4)
    return np.array(values).reshape(-1, 3, 4)


def leg_jacobian(geometry: LegGeometry, angles: FloatArray) -> FloatArray:
    """Geometric Jacobian of one leg's foot in the leg frame.

    Args:
        geometry: lengths.
        angles: (4,) rad, hip_yaw, hip_pitch, knee, ankle of the leg.

    Returns:
        (6, 4), linear velocity (m/rad) over angular velocity (rad/rad) of the
        last link at the foot point, both in the leg frame.
    """
    a1, a2, a3, a4 = geometry.links
    q1, q2, q3, q4 = (float(angle) for angle in angles)
    c, s = cos(q1), sin(q1)
    r4, z4 = a4 * cos(q2 + q3 + q4), a4 * sin(q2 + q3 + q4)
    r3, z3 = r4 + a3 * cos(q2 + q3), z4 + a3 * sin(q2 + q3)
    r2, z2 = r3 + a2 * cos(q2), z3 + a2 * sin(q2)
    reach = a1 + r2
    # A positive pitch angle raises the outer link: its axis is -y of the turned plane.
    return np.array(
        [
            [-reach * s, -z2 * c, -z3 * c, -z4 * c],
            [reach * c, -z2 * s, -z3 * s, -z4 * s],
            [0.0, r2, r3, r4],
            [0.0, s, s, s],
            [0.0, -c, -c, -c],
            [1.0, 0.0, 0.0, 0.0],
        ]
    )


def to_leg_frame(geometry: LegGeometry, points: FloatArray, legs: Sequence[int] = ALL_LEGS) -> FloatArray:
    """Points of the base frame in the frames of the legs.

    Args:
        geometry: hips.
        points: (..., n, 3) m, base frame, one point per leg.
        legs: indices of the n legs.

    Returns:
        (..., n, 3) m, each in its own leg's frame.
    """
    index = list(legs)
    offset = points - geometry.hip_position[index]
    c, s = np.cos(geometry.hip_azimuth[index]), np.sin(geometry.hip_azimuth[index])
    x, y = offset[..., 0], offset[..., 1]
    return np.stack([c * x + s * y, c * y - s * x, offset[..., 2]], axis=-1)


def _angles(joints: FloatArray, legs: Sequence[int]) -> list[float]:
    angles: list[float] = joints.tolist()
    if len(angles) != N_LEG_JOINTS * len(legs):
        raise ValueError(f"{len(legs)} legs take {N_LEG_JOINTS * len(legs)} angles, not {len(angles)}")
    return angles


def _batch_angles(
    geometry: LegGeometry, joints: FloatArray, legs: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """(..., n) directions of the legs' planes and (..., n, 3) pitches of links 2 to 4, rad."""
    angles = joints.reshape(*joints.shape[:-1], len(legs), N_LEG_JOINTS)
    direction = angles[..., 0] + geometry.hip_azimuth[list(legs)]
    return direction, np.cumsum(angles[..., 1:], axis=-1)


def _points_of_batch(geometry: LegGeometry, joints: FloatArray, legs: Sequence[int]) -> FloatArray:
    direction, pitch = _batch_angles(geometry, joints, legs)
    lengths = geometry.link_lengths
    outward = np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    reach = lengths[0] + np.cumsum(lengths[1:] * np.cos(pitch), axis=-1)
    points = np.zeros((*direction.shape, 5, 3))
    points[..., 1, :2] = lengths[0] * outward
    points[..., 2:, :2] = reach[..., None] * outward[..., None, :]
    points[..., 2:, 2] = np.cumsum(lengths[1:] * np.sin(pitch), axis=-1)
    return points + geometry.hip_position[list(legs), None, :]


def _jacobians_of_batch(geometry: LegGeometry, joints: FloatArray, legs: Sequence[int]) -> FloatArray:
    direction, pitch = _batch_angles(geometry, joints, legs)
    lengths = geometry.link_lengths
    # Lever from each pitch joint to the foot, in the leg's plane: sums from the foot inwards.
    reach = np.cumsum((lengths[1:] * np.cos(pitch))[..., ::-1], axis=-1)[..., ::-1]
    height = np.cumsum((lengths[1:] * np.sin(pitch))[..., ::-1], axis=-1)[..., ::-1]
    c, s = np.cos(direction), np.sin(direction)
    jacobians = np.zeros((*direction.shape, 3, N_LEG_JOINTS))
    jacobians[..., 0, 0] = -(lengths[0] + reach[..., 0]) * s
    jacobians[..., 1, 0] = (lengths[0] + reach[..., 0]) * c
    jacobians[..., 0, 1:] = -height * c[..., None]
    jacobians[..., 1, 1:] = -height * s[..., None]
    jacobians[..., 2, 1:] = reach
    return jacobians
