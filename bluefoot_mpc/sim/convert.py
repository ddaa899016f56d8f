"""Conversion between the house's state and MuJoCo's for one floating robot.

MuJoCo writes quaternions ``w, x, y, z`` and the trunk's linear velocity in world
axes; the house follows Pinocchio: ``x, y, z, w`` and the whole trunk twist in
the base frame. Joints are in the same order in both. All functions return new
arrays and take the robot's own slices of MuJoCo's ``qpos`` and ``qvel``.
"""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.types import FloatArray

_TO_HOUSE = np.r_[0:3, 4, 5, 6, 3, 7:23]
_TO_MUJOCO = np.r_[0:3, 6, 3, 4, 5, 7:23]


def q_from_mujoco(qpos: FloatArray) -> FloatArray:
    """(23,) house position of MuJoCo's (23,) qpos."""
    return qpos[_TO_HOUSE]


def q_to_mujoco(q: FloatArray) -> FloatArray:
    """(23,) MuJoCo qpos of the house position (23,)."""
    return q[_TO_MUJOCO]


def v_from_mujoco(qpos: FloatArray, qvel: FloatArray) -> FloatArray:
    """(22,) house velocity of MuJoCo's (23,) qpos and (22,) qvel."""
    v = qvel.copy()
    v[:3] = qvel[:3] @ rotation_from_quaternion(qpos[_TO_HOUSE[3:7]])
    return v


def v_to_mujoco(q: FloatArray, v: FloatArray) -> FloatArray:
    """(22,) MuJoCo qvel of the house position (23,) and velocity (22,)."""
    qvel = v.copy()
    qvel[:3] = rotation_from_quaternion(q[3:7]) @ v[:3]
    return qvel


def velocity_map(q: FloatArray) -> FloatArray:
    """(22, 22) matrix T with ``qvel = T v`` at the house position q (23,).

    Forces map the other way: a generalised force ``f`` of MuJoCo is ``T.T @ f``
    in the house's coordinates, a mass matrix ``M`` is ``T.T @ M @ T``.
    """
    matrix = np.eye(22)
    matrix[:3, :3] = rotation_from_quaternion(q[3:7])
    return matrix


def velocity_map_rate(q: FloatArray, v: FloatArray) -> FloatArray:
    """(22,) ``dT/dt @ v``: what MuJoCo's acceleration has more than ``T @ dv/dt``.

    MuJoCo's trunk acceleration is that of its origin in world axes; the base
    frame turns under the house's components by the angular velocity.
    """
    (x, y, z), (wx, wy, wz) = v[:3], v[3:6]
    rate = np.zeros(22)
    turn = np.array([wy * z - wz * y, wz * x - wx * z, wx * y - wy * x])
    rate[:3] = rotation_from_quaternion(q[3:7]) @ turn
    return rate
