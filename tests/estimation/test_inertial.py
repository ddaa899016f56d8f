import math

import casadi as ca
import numpy as np
import pytest

from bluefoot_mpc.estimation.inertial import (
    Sample,
    integrate,
    level_quaternion,
    rotated,
    rotation_matrix,
    usable_samples,
)
from bluefoot_mpc.estimation.symbols import quaternion_product, small_quaternion
from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_quaternion, rotation_from_rpy
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import ImuBatch

LEVEL = (0.0, 0.0, 0.0, 1.0)


def batch(time: list[float], gyro: np.ndarray | None = None, accel: np.ndarray | None = None) -> ImuBatch:
    n = len(time)
    rng = np.random.default_rng(5)
    return ImuBatch(
        time=np.array(time),
        gyro=rng.normal(size=(n, 3)) if gyro is None else gyro,
        accel=rng.normal(size=(n, 3)) if accel is None else accel,
        magnetometer=np.full((n, 3), np.nan),
        valid=np.ones(n, dtype=bool),
    )


def test_quaternions_agree_with_the_shared_geometry():
    rng = np.random.default_rng(1)
    first, second = (quaternion_from_rpy(rng.uniform(-1, 1, 3)) for _ in range(2))
    a, b = tuple(first.tolist()), tuple(second.tolist())
    product = rotation_matrix(tuple(quaternion_product(ca.DM(a), ca.DM(b)).full().ravel()))
    np.testing.assert_allclose(
        product, rotation_from_quaternion(first) @ rotation_from_quaternion(second), atol=1e-14
    )
    x = rng.normal(size=3)
    np.testing.assert_allclose(rotated(a, *x), rotation_matrix(a) @ x, atol=1e-14)


def test_small_rotation_is_smooth_across_its_series():
    for angle in (0.0, 1e-9, 0.999e-3, 1.001e-3, 0.5, 3.0):
        x, y, z, w = small_quaternion(ca.DM([0.0, angle, 0.0])).full().ravel()
        assert (x, z) == (0.0, 0.0)
        assert y == pytest.approx(math.sin(angle / 2), abs=1e-15)
        assert w == pytest.approx(math.cos(angle / 2), abs=1e-15)


def test_integration_of_a_constant_turn_and_acceleration_is_exact():
    # Constant rate about z and a force that turns with the trunk: constant in the world.
    rate, force = 1.5, np.array([0.4, -0.2, GRAVITY + 0.3])
    samples = [
        Sample(
            t, (0.0, 0.0, rate), tuple(rotation_from_rpy(np.array([0.0, 0.0, rate * (t - 0.0025)])).T @ force)
        )
        for t in (0.005, 0.01, 0.015, 0.02)
    ]
    motion = integrate(
        LEVEL, (0.1, 0.0, 0.0), samples, span=(0.0, 0.02),
        biases=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    )  # fmt: skip
    yaw = 2 * math.atan2(motion.quaternion[2], motion.quaternion[3])
    assert yaw == pytest.approx(rate * 0.02, abs=1e-12)
    np.testing.assert_allclose(motion.velocity, [0.1 + 0.4 * 0.02, -0.2 * 0.02, 0.3 * 0.02], atol=1e-14)
    np.testing.assert_allclose(motion.displacement, [0.00208, -0.00004, 0.00006], atol=1e-7)
    np.testing.assert_allclose(motion.turn, [0.0, 0.0, 0.03], atol=1e-15)


def test_biases_are_taken_off_and_the_last_sample_fills_the_frame():
    sample = Sample(0.005, (0.02, 0.0, 0.1), (0.1, 0.0, GRAVITY))
    motion = integrate(
        LEVEL, (0.0, 0.0, 0.0), [sample], span=(0.0, 0.02),
        biases=((0.02, 0.0, 0.0), (0.1, 0.0, 0.0)),
    )  # fmt: skip
    np.testing.assert_allclose(motion.turn, [0.0, 0.0, 0.002], atol=1e-15)
    np.testing.assert_allclose(motion.velocity, np.zeros(3), atol=1e-12)


def test_without_samples_the_robot_goes_on_straight():
    motion = integrate(
        LEVEL, (0.1, 0.2, 0.0), [], span=(1.0, 1.02),
        biases=((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    )  # fmt: skip
    np.testing.assert_array_equal(motion.quaternion, LEVEL)
    np.testing.assert_allclose(motion.displacement, [0.002, 0.004, 0.0], atol=1e-15)


def test_screening_leaves_out_what_must_not_be_used():
    times = [0.985, 1.005, 1.010, 1.015, 1.020, 1.5]
    samples = batch(times)
    samples.gyro[2, 1] = np.nan
    samples.valid[3] = False
    used = usable_samples(samples, 1.0, 1.02, None)
    assert [s.time for s in used] == [1.005, 1.020]


def test_screening_leaves_out_a_frozen_sensor():
    value = np.tile([0.1, 0.2, 0.3], (4, 1))
    frozen = batch([0.005, 0.01, 0.015, 0.02], value, value)
    used = usable_samples(frozen, 0.0, 0.02, None)
    assert len(used) == 1
    later = batch([0.025, 0.03, 0.035, 0.04], value, value)
    assert usable_samples(later, 0.02, 0.04, used[-1]) == []


def test_attitude_from_gravity():
    rpy = np.array([0.1, -0.2, 0.0])
    force = rotation_from_rpy(rpy).T @ np.array([0.0, 0.0, GRAVITY])
    quaternion = level_quaternion([Sample(0.0, (0.0, 0.0, 0.0), tuple(force))])
    np.testing.assert_allclose(rotation_matrix(quaternion), rotation_from_rpy(rpy), atol=1e-14)
    assert level_quaternion([]) == LEVEL


def test_any_number_of_samples_can_be_integrated():
    # Twelve samples take several rounds, with rows to spare in the last one.
    rng = np.random.default_rng(3)
    samples = [
        Sample(0.002 * (k + 1), tuple(rng.normal(size=3)), tuple(rng.normal(size=3))) for k in range(12)
    ]
    biases = ((0.01, 0.02, 0.03), (0.1, 0.2, 0.3))
    whole = integrate(LEVEL, (0.1, 0.2, 0.3), samples, span=(0.0, 0.03), biases=biases)
    first = integrate(LEVEL, (0.1, 0.2, 0.3), samples[:7], span=(0.0, 0.014), biases=biases)
    start = tuple(first.quaternion), tuple(first.velocity)
    rest = integrate(*start, samples[7:], span=(0.014, 0.03), biases=biases)
    np.testing.assert_allclose(whole.quaternion, rest.quaternion, atol=1e-15)
    np.testing.assert_allclose(whole.velocity, rest.velocity, atol=1e-15)
    np.testing.assert_allclose(whole.displacement, first.displacement + rest.displacement, atol=1e-15)
    np.testing.assert_allclose(whole.sums, first.sums + rest.sums, atol=1e-12)
    rates = np.array([sample.rate for sample in samples])
    np.testing.assert_allclose(whole.sums[:4], [12.0, *rates.sum(axis=0)], atol=1e-14)
