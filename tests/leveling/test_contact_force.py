"""Weight and acceleration of the robot, shared by the feet that touch."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.leveling.contact_force import contact_forces, specific_force
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.types import ImuBatch
from tests.leveling.bench import DT, ROBOT, compensator, seen, state

CONTACTS = [np.array(mu) for mu in itertools.product([False, True], repeat=4)]


def batch(accel, valid=None) -> ImuBatch:
    accel = np.array(accel, dtype=float).reshape(-1, 3)
    count = len(accel)
    return ImuBatch(
        time=np.arange(count) * 0.005, gyro=np.zeros((count, 3)), accel=accel,
        magnetometer=np.full((count, 3), np.nan),
        valid=np.ones(count, dtype=bool) if valid is None else np.array(valid),
    )  # fmt: skip


@pytest.mark.parametrize("contact", CONTACTS)
def test_the_feet_that_touch_carry_all_of_it(contact):
    force = np.array([1.0, -2.0, 9.5])
    shared = contact_forces(1.9, force, contact)
    assert shared.shape == (4, 3)
    np.testing.assert_array_equal(shared[~contact], 0.0)
    if contact.any():
        np.testing.assert_allclose(shared.sum(axis=0), 1.9 * force)
        np.testing.assert_allclose(shared[contact], np.tile(1.9 * force / contact.sum(), (contact.sum(), 1)))
    else:
        np.testing.assert_array_equal(shared, 0.0)


@given(
    mass=st.floats(0.1, 10.0),
    force=st.lists(st.floats(-50.0, 50.0), min_size=3, max_size=3),
    contact=st.lists(st.booleans(), min_size=4, max_size=4),
)
def test_they_add_up_whatever_they_are(mass, force, contact):
    shared = contact_forces(mass, np.array(force), np.array(contact))
    wanted = mass * np.array(force) if any(contact) else np.zeros(3)
    np.testing.assert_allclose(shared.sum(axis=0), wanted, atol=1e-9)


def test_the_specific_force_is_the_mean_of_the_usable_samples():
    imu = batch([[0.0, 0.0, 9.0], [100.0, 0.0, 0.0], [0.0, 2.0, 10.0]], valid=[True, False, True])
    np.testing.assert_allclose(specific_force(imu), [0.0, 1.0, 9.5])


@pytest.mark.parametrize(
    "imu",
    [
        batch([]),
        batch([[0.0, 0.0, 9.8], [0.0, 0.0, 9.8]], valid=[False, False]),
        batch([[np.nan, 0.0, 9.8]]),
        batch([[0.0, 0.0, 9.8], [np.inf, 0.0, 9.8]]),
    ],
)
def test_without_usable_samples_it_is_unknown(imu):
    assert specific_force(imu) is None


def test_the_compensator_has_them_in_world_axes():
    tilted = state(rpy=(0.2, -0.1, 0.5), contact=np.array([True, False, True, False]))
    at_rest = rotation_from_quaternion(tilted.quaternion).T @ np.array([0.0, 0.0, 9.81])
    forces = compensator(psi="zero").step(seen(tilted, specific_force=at_rest), DT).report.contact_force
    weight = Dynamics(ROBOT).mass * 9.81
    np.testing.assert_allclose(forces[[0, 2]], [[0.0, 0.0, weight / 2]] * 2, atol=1e-9)
    np.testing.assert_array_equal(forces[[1, 3]], 0.0)


def test_without_an_accelerometer_the_compensator_has_none():
    forces = compensator(psi="zero").step(seen(specific_force=None), DT).report.contact_force
    np.testing.assert_array_equal(forces, 0.0)
