"""World and robot: turning twists, and moving a pose along one."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.types import FloatArray


def rotation_world_to_robot(theta: float) -> FloatArray:
    """R(theta) (3, 3): twist in the world to twist in the frame of a robot with heading `theta` (rad)."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def twist_in_robot(twist_in_world: FloatArray, theta: float) -> FloatArray:
    """(3,) twist in the robot's frame; yaw rates are the same in both."""
    return rotation_world_to_robot(theta) @ twist_in_world


def twist_in_world(twist_in_robot: FloatArray, theta: float) -> FloatArray:
    """(3,) twist in the world's frame: R(theta) transposed, which is its inverse."""
    return rotation_world_to_robot(theta).T @ twist_in_robot


def moved(pose: FloatArray, twist: FloatArray, dt: float) -> FloatArray:
    """(3,) pose x, y, heading in world after `dt` (s) of a constant twist (3,) in the robot's frame.

    Exact: the path is an arc about the instantaneous centre of rotation, or a straight line.
    """
    turn = float(twist[2]) * dt
    # sin(t)/t and (1 - cos(t))/t, both smooth at 0.
    along = float(np.sinc(turn / math.pi))
    across = math.sin(0.5 * turn) * float(np.sinc(0.5 * turn / math.pi))
    x = dt * (along * twist[0] - across * twist[1])
    y = dt * (across * twist[0] + along * twist[1])
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.array([pose[0] + c * x - s * y, pose[1] + s * x + c * y, pose[2] + turn])
