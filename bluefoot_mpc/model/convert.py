"""Conversion between the paper's coordinates η and Pinocchio's q and v.

``η`` (22,) is the trunk's position in the world (m), its roll, pitch and yaw
(rad, zyx sequence) and sixteen joint angles (rad); ``η̇`` (22,) is its rate: the
trunk's velocity in world axes, the rates of the three angles, the joint speeds.
The angles' rates are singular at a pitch of ±90°, far outside what the robot
survives; pitch comes back in [-90°, 90°] and roll and yaw in (-180°, 180°].
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy, rpy_from_quaternion
from bluefoot_mpc.types import FloatArray


def eta_from_q(q: FloatArray) -> FloatArray:
    """(22,) η of the configuration q (23,)."""
    return np.concatenate([q[:3], rpy_from_quaternion(q[3:7]), q[7:]])


def q_from_eta(eta: FloatArray) -> FloatArray:
    """(23,) q of η (22,)."""
    return np.concatenate([eta[:3], quaternion_from_rpy(eta[3:6]), eta[6:]])


def eta_rate_from_v(q: FloatArray, v: FloatArray) -> FloatArray:
    """(22,) η̇ of the velocity v (22,) at the configuration q (23,)."""
    rpy = rpy_from_quaternion(q[3:7])
    rate = v.copy()
    rate[:3] = rotation_from_rpy(rpy) @ v[:3]
    rate[3:6] = rpy_rate_from_angular_velocity(rpy, v[3:6])
    return rate


def v_from_eta_rate(eta: FloatArray, eta_rate: FloatArray) -> FloatArray:
    """(22,) velocity v of η̇ (22,) at η (22,)."""
    v = eta_rate.copy()
    v[:3] = eta_rate[:3] @ rotation_from_rpy(eta[3:6])
    v[3:6] = angular_velocity_map(eta[3:6]) @ eta_rate[3:6]
    return v


def velocity_map(eta: FloatArray) -> FloatArray:
    """(22, 22) matrix T with ``v = T η̇`` at η (22,).

    A mass matrix in the coordinates η is ``T.T @ M(q) @ T``, a generalised
    force ``T.T @ f``.
    """
    matrix = np.eye(22)
    matrix[:3, :3] = rotation_from_rpy(eta[3:6]).T
    matrix[3:6, 3:6] = angular_velocity_map(eta[3:6])
    return matrix


def angular_velocity_map(rpy: FloatArray) -> FloatArray:
    """(3, 3) matrix E with ``ω = E d(rpy)/dt``, ω (rad/s) in the base frame."""
    sr, cr = math.sin(rpy[0]), math.cos(rpy[0])
    sp, cp = math.sin(rpy[1]), math.cos(rpy[1])
    return np.array([[1.0, 0.0, -sp], [0.0, cr, cp * sr], [0.0, -sr, cp * cr]])


def rpy_rate_from_angular_velocity(rpy: FloatArray, angular_velocity: FloatArray) -> FloatArray:
    """(3,) rad/s, rates of roll, pitch and yaw at ω (3,) rad/s in the base frame."""
    sr, cr = math.sin(rpy[0]), math.cos(rpy[0])
    x, y, z = angular_velocity
    yaw_rate = (sr * y + cr * z) / math.cos(rpy[1])
    return np.array([x + math.sin(rpy[1]) * yaw_rate, cr * y - sr * z, yaw_rate])
