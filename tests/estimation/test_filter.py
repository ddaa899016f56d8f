import casadi as ca
import numpy as np
import pytest

from bluefoot_mpc.estimation.config import EstimatorConfig
from bluefoot_mpc.estimation.corrections import (
    FeetCorrection,
    Gate,
    Settler,
    correct,
    correct_scalar,
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
    frame_noise,
    initial_state,
    transition,
)
from bluefoot_mpc.estimation.heading import heading_row
from bluefoot_mpc.estimation.inertial import ZERO, Motion, Sample, integrate, rotation_matrix
from bluefoot_mpc.estimation.prediction import Prediction, Predictor
from bluefoot_mpc.estimation.symbols import quaternion_product
from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.model.legs import feet_in_base, foot_jacobians_in_base
from bluefoot_mpc.model.parameters import GRAVITY

from .synthetic_motion import geometry

CONFIG = EstimatorConfig()
DT = 0.02


def random_state(seed: int) -> FilterState:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(SIZE, SIZE)) * 0.01
    estimate = np.concatenate(
        (
            quaternion_from_rpy(rng.uniform(-0.3, 0.3, 3)),
            rng.normal(size=3) * 0.2,
            rng.normal(size=12) * 0.2,
            rng.normal(size=3) * 0.01,
            rng.normal(size=3) * 0.02,
            rng.normal(size=2) * 0.02,
        )
    )
    return FilterState(estimate, root @ root.T + 1e-6 * np.eye(SIZE))


def with_quaternion(state: FilterState, rpy: list[float]) -> FilterState:
    estimate = state.estimate.copy()
    estimate[:4] = quaternion_from_rpy(np.array(rpy))
    return state._replace(estimate=estimate)


def error_of(estimate: FilterState, truth: FilterState) -> np.ndarray:
    """Right-invariant error, first order, as `filter` defines it."""
    x, y, z, w = truth.quaternion
    turn = quaternion_product(ca.DM(estimate.quaternion), ca.DM([-x, -y, -z, w])).full().ravel()
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
    estimate = state.estimate.copy()
    estimate[:4], estimate[4:7] = motion.quaternion, motion.velocity
    estimate[7:19] -= np.tile(motion.displacement, 4)
    return state._replace(estimate=estimate)


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
    rotation = ca.DM(rotation_matrix(after.quaternion))
    step = ca.evalf(transition(rotation, ca.DM(velocity), ca.DM(truth.feet.ravel()), DT)[0]).full()
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
    truth = with_quaternion(random_state(9), [0.0, 0.0, 0.8])
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


@pytest.mark.parametrize("used", [(0,), (1, 2), (0, 1, 3), (0, 1, 2, 3)])
def test_correcting_by_feet_equals_the_general_correction(used):
    state = random_state(10)
    rng = np.random.default_rng(10)
    root = rng.normal(size=(4, 3, 3)) * 0.003
    noise = np.zeros((12, 12))
    for leg in range(4):
        part = slice(3 * leg, 3 * leg + 3)
        noise[part, part] = root[leg] @ root[leg].T + 1e-8 * np.eye(3)
    residual = rng.normal(size=12) * 0.01
    spread = state.covariance[6:18, 6:18] + noise
    change, covariance = FeetCorrection().reduce(state.covariance, spread, residual, used)
    rows = np.array([3 * leg + axis for leg in used for axis in range(3)])
    expected = correct(state, FEET[rows], residual[rows], noise[np.ix_(rows, rows)])
    np.testing.assert_allclose(covariance, expected.covariance, atol=1e-14)
    np.testing.assert_array_equal(covariance, covariance.T)
    after = shifted(state, change, covariance)
    np.testing.assert_allclose(after.estimate, expected.estimate, atol=1e-13)


def test_feet_are_left_out_of_an_indefinite_covariance():
    covariance = -np.eye(SIZE)
    change, kept = FeetCorrection().reduce(covariance, covariance[6:18, 6:18], np.ones(12), (0, 3))
    assert change is None
    assert kept is covariance


def test_an_indefinite_covariance_leaves_the_measurement_out():
    state = random_state(4)
    state.covariance[:] = -np.eye(SIZE)
    assert correct(state, VELOCITY, np.ones(3), 0.1 * np.eye(3)) is state


def test_planted_and_forgotten_parts_are_uncorrelated():
    state = random_state(5)
    noise = 2e-6 * np.eye(12)
    covariance = state.covariance.copy()
    plant_feet(covariance, [1, 3], noise)
    assert not np.delete(covariance[9:12], np.arange(9, 12), axis=1).any()
    assert not np.delete(covariance[:, 9:12], np.arange(9, 12), axis=0).any()
    np.testing.assert_array_equal(covariance[9:12, 9:12], noise[3:6, 3:6])
    kept = np.setdiff1d(np.arange(SIZE), [9, 10, 11, 15, 16, 17])
    np.testing.assert_array_equal(covariance[np.ix_(kept, kept)], state.covariance[np.ix_(kept, kept)])
    free = forget_velocity(state, 0.5)
    np.testing.assert_array_equal(free.covariance[3:6, 3:6], 0.25 * np.eye(3))
    assert not free.covariance[3:6, 6:].any()
    assert free.velocity == ZERO
    assert state.velocity != ZERO


def test_distances_are_mahalanobis():
    state = random_state(6)
    residual = np.random.default_rng(0).normal(size=(4, 3)) * 0.01
    spread = state.covariance[6:18, 6:18] + 1e-6 * np.eye(12)
    for leg, value in enumerate(Gate().distances(spread, residual.ravel())):
        block = spread[3 * leg : 3 * leg + 3, 3 * leg : 3 * leg + 3]
        assert value == pytest.approx(residual[leg] @ np.linalg.solve(block, residual[leg]), rel=1e-9)


def moved(state: FilterState, samples: list[Sample]) -> Motion:
    biases = (state.gyro_bias, state.accel_bias)
    return integrate(state.quaternion, state.velocity, samples, span=(0.0, DT), biases=biases)


def predicted(
    state: FilterState, samples: list[Sample], angles: np.ndarray, *, loose=(False,) * 4
) -> Prediction:
    before = angles - 0.01
    predictor = Predictor(geometry(), CONFIG)
    return predictor.advance(state, moved(state, samples), (angles + 0.03, before, angles), list(loose), DT)


def test_prediction_keeps_the_covariance_symmetric_and_grows_it():
    state = initial_state((0.0, 0.0, 0.0, 1.0), 0.05, CONFIG)
    sample = Sample(0.005, (0.0, 0.0, 0.1), (0.0, 0.0, GRAVITY))
    after = predicted(state, [sample], np.zeros(16)).filter
    np.testing.assert_allclose(after.covariance, after.covariance.T, atol=1e-15)
    assert np.linalg.eigvalsh(after.covariance).min() > 0.0
    assert np.trace(after.covariance[:3, :3]) > np.trace(state.covariance[:3, :3])


def test_predicted_covariance_is_the_transition_and_the_noise():
    state = random_state(8)
    samples = [Sample(0.01 * (k + 1), (0.1, 0.2, 0.1 * k), (0.5 - k, 0.2, 9.6 + k)) for k in range(2)]
    motion = moved(state, samples)
    rate, force = (ca.evalf(value).full().ravel() for value in frame_noise(ca.DM(motion.sums), CONFIG.imu))
    velocity = 0.5 * (np.array(state.velocity) + motion.velocity)
    step, lever = transition(
        ca.DM(rotation_matrix(motion.quaternion)), ca.DM(velocity), ca.DM(state.feet.ravel()), DT
    )
    step, lever = ca.evalf(step).full(), ca.evalf(lever).full()
    expected = step @ state.covariance @ step.T
    expected[:18, :18] += float(rate[0]) * DT**2 * lever @ lever.T
    diagonal = np.zeros(SIZE)
    diagonal[VELOCITY] = DT**2 * force
    diagonal[FEET] = DT * CONFIG.contact.slip**2
    diagonal[GYRO_BIAS] = DT * CONFIG.imu.gyro_drift**2
    diagonal[ACCEL_BIAS] = DT * CONFIG.imu.accel_drift**2
    after = predicted(state, samples, np.zeros(16)).filter
    np.testing.assert_allclose(after.covariance, expected + np.diag(diagonal), rtol=0.0, atol=1e-16)
    diagonal[9:12] = DT * CONFIG.contact.loose**2
    after = predicted(state, samples, np.zeros(16), loose=(False, True, False, False)).filter
    np.testing.assert_allclose(after.covariance, expected + np.diag(diagonal), rtol=0.0, atol=1e-16)


def test_measured_feet_are_those_of_the_kinematics():
    state, angles = random_state(2), np.random.default_rng(2).uniform(-1.0, 1.0, 16)
    ahead = predicted(state, [], angles)
    points, mount = feet_in_base(geometry(), angles), np.array(CONFIG.imu.mount)
    rotation = rotation_matrix(ahead.filter.quaternion)
    np.testing.assert_allclose(ahead.points, points, atol=1e-15)
    np.testing.assert_allclose(ahead.from_imu.reshape(4, 3), points - mount, atol=1e-15)
    seen = (points - mount) @ rotation.T - ahead.filter.feet
    np.testing.assert_allclose(ahead.residual.reshape(4, 3), seen, atol=1e-14)
    expected = np.zeros((12, 12))
    for leg, jacobian in enumerate(foot_jacobians_in_base(geometry(), angles)):
        block = CONFIG.contact.joint_noise**2 * rotation @ jacobian @ jacobian.T @ rotation.T
        part = slice(3 * leg, 3 * leg + 3)
        expected[part, part] = block + CONFIG.contact.foot_noise**2 * np.eye(3)
    np.testing.assert_allclose(ahead.noise, expected, atol=1e-18)
    assert ahead.moved == pytest.approx(0.03)


def test_feet_taken_up_anew_lie_where_the_joints_show_them():
    state, points = random_state(5), np.arange(12.0)
    change = np.linspace(-0.02, 0.02, SIZE)
    after = FilterState(Settler().settle(state.estimate, change, points, [1, 3]), state.covariance)
    plain = shifted(state, change, state.covariance)
    seen = points.reshape(4, 3) @ rotation_matrix(plain.quaternion).T
    np.testing.assert_allclose(after.feet[[1, 3]], seen[[1, 3]], atol=1e-14)
    np.testing.assert_array_equal(after.feet[[0, 2]], plain.feet[[0, 2]])


def test_shaking_counts_as_noise():
    def noise(*vertical: float) -> np.ndarray:
        samples = [Sample(0.005 * k, ZERO, (0.0, 0.0, force)) for k, force in enumerate(vertical)]
        sums = moved(random_state(0), samples).sums
        rate, force = frame_noise(ca.DM(sums), CONFIG.imu)
        return np.concatenate((ca.evalf(rate).full(), ca.evalf(force).full())).ravel()

    calm, shaken = noise(*[9.8] * 4), noise(4.8, 14.8, 4.8, 14.8)
    assert shaken[3] > 50.0 * calm[3]
    assert shaken[1] == calm[1]
    # Variance 25 within the frame, its share of each of four samples, and their own noise.
    assert shaken[3] == pytest.approx((CONFIG.imu.shake * 25.0 + CONFIG.imu.accel_noise**2) / 4.0)
    assert noise()[0] == CONFIG.imu.lost_rate**2
    np.testing.assert_array_equal(noise()[1:], CONFIG.imu.lost_accel**2)
