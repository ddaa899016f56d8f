"""What an inertial sensor integrates over one of its sampling windows.

A real gyro and accelerometer low-pass and decimate: a sample is the mean over
its window. Point samples of the simulated acceleration would miss or double
the short spikes of footfalls, and since gait and sampling are periodic, that
would look like a constant acceleration (measured: over 1 degree of tilt
at 100 mm/s). Means come exactly from the change of velocity and orientation.
"""

from __future__ import annotations

from typing import NamedTuple

from bluefoot_mpc.model.parameters import GRAVITY

Vector = tuple[float, float, float]


class Motion(NamedTuple):
    """Orientation of the base (w, x, y, z) and velocity of the sensor at one instant, world axes."""

    quaternion: tuple[float, float, float, float]
    velocity: Vector  # m/s


def sensor_motion(pose: list[float], twist: list[float], mount: Vector) -> Motion:
    """State of a sensor from MuJoCo's free joint.

    Args:
        pose: 7 entries of qpos: position, quaternion w, x, y, z.
        twist: 6 entries of qvel: linear velocity in world, angular velocity in base.
        mount: sensor in the base frame, m.
    """
    w, x, y, z = pose[3:7]
    p, q, r = twist[3:6]
    a, b, c = mount
    lever = (q * c - r * b, r * a - p * c, p * b - q * a)
    turned = _rotate((w, x, y, z), lever)
    return Motion((w, x, y, z), (twist[0] + turned[0], twist[1] + turned[1], twist[2] + turned[2]))


def window_means(before: Motion, after: Motion, dt: float) -> tuple[float, float, float, float, float, float]:
    """Mean angular velocity (rad/s) and specific force (m/s²) over a window, base frame.

    Args:
        before: state at the window's start.
        after: state at its end.
        dt: length of the window, s; short against the motion, so that the
            frame of the result is the window's middle.
    """
    w, x, y, z = before.quaternion
    s, u, v, t = after.quaternion
    # conj(before) * after is the turn during the window.
    scale = 2.0 / dt if w * s + x * u + y * v + z * t >= 0.0 else -2.0 / dt
    rate = (
        scale * (w * u - x * s - y * t + z * v),
        scale * (w * v + x * t - y * s - z * u),
        scale * (w * t - x * v + y * u - z * s),
    )
    if scale < 0.0:
        s, u, v, t = -s, -u, -v, -t
    size = ((w + s) ** 2 + (x + u) ** 2 + (y + v) ** 2 + (z + t) ** 2) ** 0.5
    middle_conjugate = ((w + s) / size, -(x + u) / size, -(y + v) / size, -(z + t) / size)
    change = tuple((b - a) / dt for a, b in zip(before.velocity, after.velocity, strict=True))
    force = _rotate(middle_conjugate, (change[0], change[1], change[2] + GRAVITY))
    return (*rate, *force)


def _rotate(quaternion: tuple[float, float, float, float], vector: Vector) -> Vector:
    w, x, y, z = quaternion
    a, b, c = vector
    # v + 2 w (q x v) + 2 q x (q x v)
    i, j, k = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return (a + w * i + y * k - z * j, b + w * j + z * i - x * k, c + w * k + x * j - y * i)
