"""What an inertial sensor integrates over one of its sampling windows.

A real gyro and accelerometer low-pass and decimate: a sample is the mean over
its window. Point samples of the simulated acceleration would miss or double
the short spikes of footfalls, and since gait and sampling are periodic, that
would look like a constant acceleration (measured: over 1 degree of tilt
at 100 mm/s). Means come exactly from the change of velocity and orientation.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import compiled, made_once
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import FloatArray

_STATE = 13


class InertialWindows:
    """Means of angular velocity and specific force over successive windows.

    All windows of a frame are one call of a CasADi function, under 1 µs; the window
    that a frame leaves open goes on in the next.

    Attributes:
        values: (count, 6) angular velocity (rad/s) and specific force (m/s²) in
            the windows of the last frame, base frame; rewritten by every frame.
    """

    def __init__(self, mount: tuple[float, float, float], period: float, count: int) -> None:
        """Make room for `count` windows of `period` seconds for a sensor at `mount` (m, base frame)."""
        self._states = np.zeros((count + 1, _STATE))
        self._states[:, 3] = 1.0
        self.values = np.zeros((count, 6))
        self._function: Any = made_once(
            lambda: compiled(window_function(mount, period, count)), "windows", mount, period, count
        )
        buffer: Any
        buffer, self._run = self._function.buffer()
        buffer.set_arg(0, self._states.data)
        buffer.set_res(0, self.values.data)
        self._buffer = buffer

    def begin(self, pose: FloatArray, twist: FloatArray) -> None:
        """Open the first window of a frame at a state: see `mark`."""
        self.mark(-1, pose, twist)

    def mark(self, window: int, pose: FloatArray, twist: FloatArray) -> None:
        """Close a window and open the next.

        Args:
            window: number of the window in this frame, from 0.
            pose: (7,) MuJoCo's free joint: position in world, quaternion w, x, y, z.
            twist: (6,) linear velocity in world, angular velocity in base.
        """
        state = self._states[window + 1]
        state[:7] = pose
        state[7:] = twist

    def means(self, count: int) -> FloatArray:
        """Close a frame of `count` windows; gives their rows of `values`.

        The last closed window's end is where the next frame begins.
        """
        self._run()
        self._states[0] = self._states[count]
        return self.values[:count]


def window_function(mount: tuple[float, float, float], period: float, count: int) -> ca.Function:
    """Means over `count` windows from the 13 x (count + 1) states between them.

    Windows must be short against the motion: the frame of a mean is the base
    in the middle of its window.
    """
    states = ca.SX.sym("states", _STATE, count + 1)
    lever = ca.DM(list(mount))
    quaternions = [states[3:7, k] for k in range(count + 1)]
    velocities = [
        states[7:10, k] + _rotate(quaternions[k], ca.cross(states[10:13, k], lever)) for k in range(count + 1)
    ]
    gravity = ca.DM([0.0, 0.0, GRAVITY])
    columns = []
    for k in range(count):
        before, after = quaternions[k], quaternions[k + 1]
        # Both signs are the same orientation: take the one next to `before`.
        after = ca.if_else(ca.dot(before, after) >= 0.0, after, -after)
        middle = before + after
        middle = middle / ca.norm_2(middle)
        rate = (2.0 / period) * _product(_conjugate(before), after)[1:4]
        force = _rotate(_conjugate(middle), (velocities[k + 1] - velocities[k]) / period + gravity)
        columns.append(ca.vertcat(rate, force))
    return ca.Function("windows", [states], [ca.horzcat(*columns)])


def _conjugate(quaternion: ca.SX) -> ca.SX:
    return ca.vertcat(quaternion[0], -quaternion[1:4])


def _product(a: ca.SX, b: ca.SX) -> ca.SX:
    vector = a[0] * b[1:4] + b[0] * a[1:4] + ca.cross(a[1:4], b[1:4])
    return ca.vertcat(a[0] * b[0] - ca.dot(a[1:4], b[1:4]), vector)


def _rotate(quaternion: ca.SX, vector: ca.SX) -> ca.SX:
    turned = 2.0 * ca.cross(quaternion[1:4], vector)
    return vector + quaternion[0] * turned + ca.cross(quaternion[1:4], turned)
