import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.sim.inertial import sensor_motion, window_means

MOUNT = (0.02, -0.01, 0.03)


def state(time, rate, acceleration):
    """A base that turns at a constant rate (base frame) and accelerates steadily (world)."""
    rotation = Rotation.from_rotvec([0.3, -0.2, 0.5]) * Rotation.from_rotvec(np.multiply(rate, time))
    x, y, z, w = rotation.as_quat()
    pose = [0.0, 0.0, 0.0, w, x, y, z]
    return rotation, sensor_motion(pose, [*(np.multiply(acceleration, time)), *rate], MOUNT)


@pytest.mark.parametrize("flip", [False, True])
def test_means_of_a_steady_motion(flip):
    rate, acceleration, dt = np.array([0.8, -0.5, 1.1]), np.array([0.4, -1.2, 0.3]), 0.005
    _, before = state(0.0, rate, acceleration)
    middle, _ = state(0.5 * dt, rate, acceleration)
    _, after = state(dt, rate, acceleration)
    if flip:
        after = after._replace(quaternion=tuple(-c for c in after.quaternion))
    means = np.array(window_means(before, after, dt))
    np.testing.assert_allclose(means[:3], rate, rtol=1e-5)
    centripetal = np.cross(rate, np.cross(rate, MOUNT))
    force = middle.inv().apply(acceleration + [0.0, 0.0, GRAVITY]) + centripetal
    np.testing.assert_allclose(means[3:], force, rtol=1e-4, atol=1e-4)


def test_a_spike_between_samples_is_not_lost():
    """A velocity jump inside the window shows as its mean acceleration, wherever it lies."""
    pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    before = sensor_motion(pose, [0.0] * 6, MOUNT)
    after = sensor_motion(pose, [0.1, 0.0, 0.0, 0.0, 0.0, 0.0], MOUNT)
    np.testing.assert_allclose(window_means(before, after, 0.005), [0, 0, 0, 20.0, 0, GRAVITY], atol=1e-12)
