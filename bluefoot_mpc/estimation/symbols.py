"""Rotations and the legs' kinematics as CasADi expressions (numbers work as well, as ``DM``)."""

from __future__ import annotations

from typing import Any

import casadi as ca

from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.types import N_LEGS


def small_quaternion(vector: Any) -> Any:
    """Quaternion x, y, z, w of the rotation by a vector (rad)."""
    angle = ca.sqrt(ca.dot(vector, vector))
    # sin(a/2)/a near zero by its series; both branches are evaluated, so the divisor must not vanish.
    small = angle < 1e-3
    half = ca.if_else(small, 0.5 - angle * angle / 48.0, ca.sin(0.5 * angle) / ca.if_else(small, 1.0, angle))
    return ca.vertcat(half * vector, ca.cos(0.5 * angle))


def quaternion_product(a: Any, b: Any) -> Any:
    """The rotation by `b`, then by `a`, normalised."""
    vector = a[3] * b[:3] + b[3] * a[:3] + ca.cross(a[:3], b[:3])
    product = ca.vertcat(vector, a[3] * b[3] - ca.dot(a[:3], b[:3]))
    return product / ca.sqrt(ca.dot(product, product))


def rotated(quaternion: Any, vector: Any) -> Any:
    """A vector of the base frame in the world frame."""
    twice = 2.0 * ca.cross(quaternion[:3], vector)
    return vector + quaternion[3] * twice + ca.cross(quaternion[:3], twice)


def rotation_matrix(quaternion: Any) -> Any:
    """3 x 3 rotation_base_to_world."""
    x, y, z, w = ca.vertsplit(quaternion)
    return ca.vertcat(
        ca.horzcat(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        ca.horzcat(2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        ca.horzcat(2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


def rpy(quaternion: Any) -> Any:
    """Roll, pitch, yaw (rad) of the zyx sequence."""
    x, y, z, w = ca.vertsplit(quaternion)
    return ca.vertcat(
        ca.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        ca.asin(ca.fmin(1.0, ca.fmax(-1.0, 2.0 * (w * y - z * x)))),
        ca.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def foot(geometry: LegGeometry, leg: int, angles: Any) -> Any:
    """Foot point of a leg (m, base frame) by its four joint angles (rad), as in `model.legs`."""
    a1, a2, a3, a4 = geometry.links
    hip = geometry.hips[leg]
    q2, q23, q234 = angles[1], angles[1] + angles[2], angles[1] + angles[2] + angles[3]
    reach = a1 + a2 * ca.cos(q2) + a3 * ca.cos(q23) + a4 * ca.cos(q234)
    direction = hip.azimuth + angles[0]
    return ca.vertcat(
        hip.x + reach * ca.cos(direction),
        hip.y + reach * ca.sin(direction),
        hip.z + a2 * ca.sin(q2) + a3 * ca.sin(q23) + a4 * ca.sin(q234),
    )


def rolling(geometry: LegGeometry, rotation: Any, turn: Any, now: Any, before: Any) -> Any:
    """Way of the foot points (12 values, m, world) when the balls around them roll on level ground.

    Args:
        geometry: radius of the balls and directions of the legs.
        rotation: 3 x 3 rotation_base_to_world.
        turn: rad, rotation of the trunk since the last frame, base frame.
        now: 16 rad, joint angles.
        before: 16 rad, joint angles at the last frame.
    """
    ways = []
    for leg in range(N_LEGS):
        direction = geometry.hips[leg].azimuth + now[4 * leg]
        bend = sum(now[4 * leg + k] - before[4 * leg + k] for k in (1, 2, 3))
        # A positive angle raises the outer link: it turns about (sin, -cos, 0).
        link = ca.vertcat(ca.sin(direction) * bend, -ca.cos(direction) * bend, 0.0)
        spin = rotation @ (link + turn)
        # Way per turn of a ball on level ground: omega cross z.
        ways.append(geometry.foot_radius * ca.vertcat(spin[1], -spin[0], 0.0))
    return ca.vertcat(*ways)
