"""What network and law see: the trunk over its feet, the newest gyro sample, scales."""

import numpy as np
import pytest

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.leveling.signals import (
    INPUT_SCALE,
    INPUTS,
    OUTPUT_SCALE,
    OUTPUTS,
    network_inputs,
    newest_rate,
    velocity,
)
from bluefoot_mpc.types import ImuBatch
from tests.leveling.bench import STANCE, seen, state
from tests.leveling.trot import trot

NEUTRAL = np.concatenate([[0.0, 0.0, 0.115], STANCE])


def inputs_of(estimate, forces=None, **changes):
    speed = np.arange(22.0)
    rotation = rotation_from_quaternion(estimate.quaternion)
    shared = np.zeros((4, 3)) if forces is None else forces
    return network_inputs(seen(estimate, **changes), rotation, NEUTRAL, speed, shared)


def gyro(*rows, valid=None) -> ImuBatch:
    rates = np.array(rows, dtype=float).reshape(-1, 3)
    count = len(rates)
    usable = np.ones(count, dtype=bool) if valid is None else np.array(valid)
    return ImuBatch(
        time=np.arange(count) * 0.005, gyro=rates, accel=np.zeros((count, 3)),
        magnetometer=np.zeros((count, 3)), valid=usable,
    )  # fmt: skip


def test_standing_in_the_neutral_place_counts_as_zero():
    u = inputs_of(state())
    assert u.shape == (INPUTS,) == INPUT_SCALE.shape
    np.testing.assert_allclose(u[:22], 0.0, atol=1e-9)


def test_every_input_has_its_place():
    forces = np.arange(12.0).reshape(4, 3)
    moved = state(rpy=(0.1, -0.2, 0.3), joints=STANCE + 0.05)
    u = inputs_of(moved, forces, heading_error=0.07)
    np.testing.assert_allclose(u[3:6], [0.1, -0.2, 0.07])
    np.testing.assert_allclose(u[6:22], 0.05)
    np.testing.assert_array_equal(u[22:44], np.arange(22.0))
    np.testing.assert_array_equal(u[44:], np.arange(12.0))


def test_the_trunk_counts_from_the_feet_and_not_from_where_the_walk_began():
    near, far = state(), state(position=np.array([12.0, -7.0, 0.115]))
    np.testing.assert_array_equal(inputs_of(near)[:3], inputs_of(far)[:3])


def test_a_trunk_that_is_lower_over_its_feet_is_seen():
    feet = state().foot_position_in_base + np.array([0.01, -0.02, 0.03])
    np.testing.assert_allclose(
        inputs_of(state(foot_position_in_base=feet))[:3], [-0.01, 0.02, -0.03], atol=1e-9
    )


def test_velocities_are_those_of_trunk_and_joints():
    moving = seen(state(velocity=(1.0, 2.0, 3.0), speed=0.5), turn_rate=np.array([4.0, 5.0, 6.0]))
    np.testing.assert_array_equal(velocity(moving), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, *[0.5] * 16])


def test_the_turn_rate_is_that_of_the_newest_sample_less_the_bias():
    bias = np.array([0.3, -0.1, 0.2])
    imu = gyro([1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [6.0, 0.0, 3.0])
    mean = np.array([3.0, 0.0, 1.0]) - bias
    np.testing.assert_allclose(newest_rate(imu, mean), np.array([6.0, 0.0, 3.0]) - bias)


def test_samples_that_must_not_be_used_are_not():
    imu = gyro([1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [np.nan] * 3, valid=[True, True, False])
    np.testing.assert_allclose(newest_rate(imu, np.array([2.0, 0.0, 0.0])), [3.0, 0.0, 0.0])


@pytest.mark.parametrize("imu", [gyro(), gyro([1.0, 2.0, 3.0], valid=[False])])
def test_without_samples_the_turn_rate_is_the_estimated_one(imu):
    mean = np.array([0.1, 0.2, 0.3])
    np.testing.assert_array_equal(newest_rate(imu, mean), mean)


@pytest.mark.slow
def test_the_newest_sample_is_nearer_to_the_true_rate_than_the_mean():
    rows = [row for row in trot() if row[2].time > 2.5]
    true = np.array([truth.v[3:6] for _, _, truth in rows])
    mean = np.array([output.telemetry.estimate.angular_velocity for _, output, _ in rows])
    newest = np.array([newest_rate(frame.imu, w) for (frame, _, _), w in zip(rows, mean, strict=True)])
    error = np.sqrt(((newest - true) ** 2).mean(axis=0))
    assert np.all(error[:2] < 0.6 * np.sqrt(((mean - true) ** 2).mean(axis=0))[:2])


def test_scales_are_sizes():
    assert OUTPUT_SCALE.shape == (OUTPUTS,)
    assert INPUT_SCALE.min() > 0.0
    assert OUTPUT_SCALE.min() > 0.0
