import numpy as np
import pytest

from bluefoot_mpc.estimation.config import EstimatorConfig
from bluefoot_mpc.estimation.corrections import (
    correct,
    correct_scalar,
    distances,
    forget_velocity,
    plant_feet,
    shifted,
)
from bluefoot_mpc.estimation.filter import (
    ACCEL_BIAS,
    ATTITUDE,
    FEET,
    GYRO_BIAS,
    HARD_IRON,
    SIZE,
    VELOCITY,
    FilterState,
    Noise,
    frame_noise,
    initial_state,
    predict,
    transition,
)
from bluefoot_mpc.estimation.heading import heading_row
from bluefoot_mpc.estimation.inertial import Sample, integrate, quaternion_product, rotation_matrix
from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.model.parameters import GRAVITY

CONFIG = EstimatorConfig()
DT = 0.02


def random_state(seed: int) -> FilterState:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(SIZE, SIZE)) * 0.01
    return FilterState(
        quaternion=tuple(quaternion_from_rpy(rng.uniform(-0.3, 0.3, 3))),
        velocity=tuple(rng.normal(size=3) * 0.2),
        feet=rng.normal(size=(4, 3)) * 0.2,
        gyro_bias=tuple(rng.normal(size=3) * 0.01),
        accel_bias=tuple(rng.normal(size=3) * 0.02),
        hard_iron=tuple(rng.normal(size=2) * 0.02),
        covariance=root @ root.T + 1e-6 * np.eye(SIZE),
    )


def error_of(estimate: FilterState, truth: FilterState) -> np.ndarray:
    """Right-invariant error, first order, as `filter` defines it."""
    x, y, z, w = truth.quaternion
    turn = np.array(quaternion_product(estimate.quaternion, (-x, -y, -z, w)))
    turn *= np.sign(turn[3])
    error = np.zeros(SIZE)
    error[ATTITUDE] = 2.0 * turn[:3]
    rotation = rotation_matrix(tuple(turn))
    error[VELOCITY] = np.array(estimate.velocity) - rotation @ np.array(truth.velocity)
    error[FEET] = (estimate.feet - truth.feet @ rotation.T).ravel()
    error[GYRO_BIAS] = np.array(estimate.gyro_bias) - truth.gyro_bias
    error[ACCEL_BIAS] = np.array(estimate.accel_bias) - truth.accel_bias
    error[HARD_IRON] = np.array(estimate.hard_iron) - truth.hard_iron
    return error


def carried(state: FilterState, samples: list[Sample]) -> FilterState:
    motion = integrate(
        state.quaternion, state.velocity, samples, span=(0.0, DT),
        biases=(state.gyro_bias, state.accel_bias),
    )  # fmt: skip
    return state._replace(
        quaternion=motion.quaternion,
        velocity=motion.velocity,
        feet=state.feet - np.array(motion.displacement),
    )


def test_shifting_moves_the_error_by_the_correction():
    state = random_state(1)
    for component in range(SIZE):
        change = np.zeros(SIZE)
        change[component] = 1e-6
        np.testing.assert_allclose(
            error_of(shifted(state, change, state.covariance), state), change, atol=1e-11
        )


@pytest.mark.parametrize("seed", range(4))
def test_transition_by_finite_differences(seed):
    truth = random_state(seed)
    rng = np.random.default_rng(100 + seed)
    samples = [
        Sample(
            0.005 * (k + 1),
            tuple(rng.normal(size=3) * 0.2),
            tuple(rng.normal(size=3) * 0.5 + [0, 0, GRAVITY]),
        )
        for k in range(4)
    ]
    after = carried(truth, samples)
    numeric = np.zeros((SIZE, SIZE))
    for component in range(SIZE):
        change = np.zeros(SIZE)
        change[component] = 1e-5
        plus = error_of(carried(shifted(truth, change, truth.covariance), samples), after)
        minus = error_of(carried(shifted(truth, -change, truth.covariance), samples), after)
        numeric[:, component] = (plus - minus) / 2e-5
    velocity = 0.5 * (np.array(truth.velocity) + after.velocity)
    step, _ = transition(rotation_matrix(after.quaternion), velocity, truth.feet, DT)
    # One step over 20 ms: the turn during the frame is left out of the bias columns (largest 0.02).
    np.testing.assert_allclose(step, numeric, atol=2e-4)
    np.testing.assert_allclose(step[:18, :18], numeric[:18, :18], atol=1e-9)


def test_the_foot_measurement_does_not_depend_on_the_attitude_error():
    truth = random_state(7)
    points = truth.feet @ rotation_matrix(truth.quaternion)
    numeric = np.zeros((12, SIZE))
    for component in range(SIZE):
        change = np.zeros(SIZE)
        change[component] = 1e-5

        def residual(change: np.ndarray) -> np.ndarray:
            state = shifted(truth, change, truth.covariance)
            return (points @ rotation_matrix(state.quaternion).T - state.feet).ravel()

        numeric[:, component] = (residual(change) - residual(-change)) / 2e-5
    expected = np.zeros((12, SIZE))
    expected[:, FEET] = -np.eye(12)
    np.testing.assert_allclose(numeric, expected, atol=1e-9)


def test_heading_row_by_finite_differences():
    strength, angle = 0.46, 0.3
    truth = random_state(9)._replace(quaternion=tuple(quaternion_from_rpy(np.array([0.0, 0.0, 0.8]))))
    field = np.array([strength * np.cos(angle), strength * np.sin(angle), -0.88])
    iron = np.array([*truth.hard_iron, 0.0])
    measured = rotation_matrix(truth.quaternion).T @ field + iron
    reference = field[:2] + iron[:2]
    size = float(np.hypot(*reference))
    direction = tuple(reference / size)

    def residual(state: FilterState) -> float:
        x, y, _ = rotation_matrix(state.quaternion) @ measured
        seen = np.arctan2(direction[0] * y - direction[1] * x, direction[0] * x + direction[1] * y)
        return float(seen) - heading_row(state, direction, size)[1]

    assert residual(truth) == pytest.approx(0.0, abs=2e-3)
    row, _ = heading_row(truth, direction, size)
    for component in (2, 24, 25):
        change = np.zeros(SIZE)
        change[component] = 1e-5
        slope = residual(shifted(truth, change, truth.covariance)) - residual(
            shifted(truth, -change, truth.covariance)
        )
        assert slope / 2e-5 == pytest.approx(row[component], abs=2e-3)


def test_correction_equals_joseph_form():
    state = random_state(3)
    index, noise = FEET[:6], np.diag(np.linspace(1e-5, 1e-4, 6))
    design = np.zeros((6, SIZE))
    design[np.arange(6), index] = -1.0
    p = state.covariance
    gain = p @ design.T @ np.linalg.inv(design @ p @ design.T + noise)
    keep = np.eye(SIZE) - gain @ design
    residual = np.linspace(-0.01, 0.02, 6)
    after = correct(state, index, residual, noise)
    np.testing.assert_allclose(after.covariance, keep @ p @ keep.T + gain @ noise @ gain.T, atol=1e-12)
    np.testing.assert_array_equal(after.covariance, after.covariance.T)
    np.testing.assert_allclose(error_of(after, state)[GYRO_BIAS], -(gain @ residual)[GYRO_BIAS], atol=1e-12)


def test_scalar_correction_equals_the_block_one():
    state = random_state(4)
    row = np.zeros(SIZE)
    row[3] = -1.0
    one = correct_scalar(state, row, 0.02, 1e-4)
    other = correct(state, np.array([3]), np.array([0.02]), np.array([[1e-4]]))
    np.testing.assert_allclose(one.covariance, other.covariance, atol=1e-15)
    np.testing.assert_allclose(one.velocity, other.velocity, atol=1e-15)


def test_an_indefinite_covariance_leaves_the_measurement_out():
    state = random_state(4)
    state.covariance[:] = -np.eye(SIZE)
    assert correct(state, VELOCITY, np.ones(3), 0.1 * np.eye(3)) is state


def test_planted_and_forgotten_parts_are_uncorrelated():
    state = random_state(5)
    points = np.arange(12.0).reshape(4, 3)
    noise = np.tile(2e-6 * np.eye(3), (4, 1, 1))
    after = plant_feet(state, [1, 3], points, noise)
    np.testing.assert_array_equal(after.feet[[1, 3]], points[[1, 3]])
    np.testing.assert_array_equal(after.feet[[0, 2]], state.feet[[0, 2]])
    assert not np.delete(after.covariance[9:12], np.arange(9, 12), axis=1).any()
    np.testing.assert_array_equal(after.covariance[9:12, 9:12], noise[1])
    free = forget_velocity(state, 0.5)
    np.testing.assert_array_equal(free.covariance[3:6, 3:6], 0.25 * np.eye(3))
    assert not free.covariance[3:6, 6:].any()


def test_distances_are_mahalanobis():
    state = random_state(6)
    residual = np.random.default_rng(0).normal(size=(4, 3)) * 0.01
    noise = np.tile(1e-6 * np.eye(3), (4, 1, 1))
    for leg, value in enumerate(distances(state, residual, noise)):
        block = state.covariance[6 + 3 * leg : 9 + 3 * leg, 6 + 3 * leg : 9 + 3 * leg] + noise[leg]
        assert value == pytest.approx(residual[leg] @ np.linalg.solve(block, residual[leg]), rel=1e-9)


def test_prediction_keeps_the_covariance_symmetric_and_grows_it():
    state = initial_state((0.0, 0.0, 0.0, 1.0), 0.05, CONFIG)
    sample = Sample(0.005, (0.0, 0.0, 0.1), (0.0, 0.0, GRAVITY))
    motion = integrate(
        state.quaternion, state.velocity, [sample], span=(0.0, DT),
        biases=(state.gyro_bias, state.accel_bias),
    )  # fmt: skip
    after = predict(
        state, motion, np.zeros((4, 3)), Noise(1e-4, (1e-2, 1e-2)), rotation=np.eye(3), dt=DT, config=CONFIG
    )
    np.testing.assert_allclose(after.covariance, after.covariance.T, atol=1e-15)
    assert np.linalg.eigvalsh(after.covariance).min() > 0.0
    assert np.trace(after.covariance[:3, :3]) > np.trace(state.covariance[:3, :3])


def test_shaking_counts_as_noise():
    calm = [Sample(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8))] * 4
    shaken = [Sample(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8 + 5.0 * (-1) ** k)) for k in range(4)]
    assert frame_noise(shaken, CONFIG.imu).force[1] > 50.0 * frame_noise(calm, CONFIG.imu).force[1]
    assert frame_noise(shaken, CONFIG.imu).force[0] == frame_noise(calm, CONFIG.imu).force[0]
    assert frame_noise([], CONFIG.imu).rate == CONFIG.imu.lost_rate**2
