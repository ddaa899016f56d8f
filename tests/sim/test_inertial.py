import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.sim.inertial import InertialWindows

MOUNT = (0.02, -0.01, 0.03)
DT = 0.005
STILL = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def state(time, rate, acceleration):
    """A base that turns at a constant rate (base frame) and accelerates steadily (world)."""
    rotation = Rotation.from_rotvec([0.3, -0.2, 0.5]) * Rotation.from_rotvec(np.multiply(rate, time))
    x, y, z, w = rotation.as_quat()
    pose = np.array([0.0, 0.0, 0.0, w, x, y, z])
    return rotation, pose, np.array([*np.multiply(acceleration, time), *rate])


@pytest.mark.parametrize("flip", [False, True])
def test_means_of_a_steady_motion(flip):
    rate, acceleration = np.array([0.8, -0.5, 1.1]), np.array([0.4, -1.2, 0.3])
    windows = InertialWindows(MOUNT, DT, 2)
    windows.begin(*state(0.0, rate, acceleration)[1:])
    for k in range(2):
        _, pose, twist = state((k + 1) * DT, rate, acceleration)
        if flip and k == 0:
            pose[3:] *= -1.0
        windows.mark(k, pose, twist)
    means = windows.means(2)
    centripetal = np.cross(rate, np.cross(rate, MOUNT))
    for k in range(2):
        middle, *_ = state((k + 0.5) * DT, rate, acceleration)
        force = middle.inv().apply(acceleration + np.array([0.0, 0.0, GRAVITY])) + centripetal
        np.testing.assert_allclose(means[k, :3], rate, rtol=1e-5)
        np.testing.assert_allclose(means[k, 3:], force, rtol=1e-4, atol=1e-4)


def test_a_spike_between_samples_is_not_lost():
    """A velocity jump inside the window shows as its mean acceleration, wherever it lies."""
    windows = InertialWindows(MOUNT, DT, 1)
    windows.begin(STILL, np.zeros(6))
    windows.mark(0, STILL, np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(windows.means(1), [[0, 0, 0, 20.0, 0, GRAVITY]], atol=1e-12)


def test_a_window_goes_on_in_the_next_frame():
    windows = InertialWindows(MOUNT, DT, 3)
    windows.begin(STILL, np.zeros(6))
    windows.mark(0, STILL, np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]))
    windows.means(1)
    windows.mark(0, STILL, np.array([0.1, 0.2, 0.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(windows.means(1), [[0, 0, 0, 0, 40.0, GRAVITY]], atol=1e-12)
