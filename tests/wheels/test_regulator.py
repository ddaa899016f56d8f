import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.regulator import KalmanFilter, LinearModel, discrete_lqr, discretised, lqr

A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])


def test_gain_of_the_double_integrator_is_the_textbooks():
    np.testing.assert_allclose(lqr(A, B, np.eye(2), np.eye(1)), [[1.0, np.sqrt(3.0)]], atol=1e-12)


def test_discrete_gain_solves_bellmans_equation():
    a, b = discretised(A, B, 0.05)
    q, r = np.diag([2.0, 0.1]), np.array([[0.3]])
    cost = np.zeros((2, 2))
    for _ in range(3000):
        gain = np.linalg.solve(r + b.T @ cost @ b, b.T @ cost @ a)
        cost = q + a.T @ cost @ (a - b @ gain)
    np.testing.assert_allclose(discrete_lqr(a, b, q, r), gain, atol=1e-9)
    assert np.abs(np.linalg.eigvals(a - b @ gain)).max() < 1.0


def test_discretised_is_exact_for_the_double_integrator():
    a, b = discretised(A, B, 0.2)
    np.testing.assert_allclose(a, [[1.0, 0.2], [0.0, 1.0]], atol=1e-15)
    np.testing.assert_allclose(b, [[0.02], [0.2]], atol=1e-15)


def test_what_cannot_be_regulated_is_refused():
    unreachable = np.diag([1.0, -1.0]), np.array([[0.0], [1.0]])
    with pytest.raises(ConfigurationError, match="no regulator exists"):
        lqr(*unreachable, np.eye(2), np.eye(1))
    with pytest.raises(ConfigurationError, match="no regulator exists"):
        discrete_lqr(np.diag([2.0, 0.5]), unreachable[1], np.eye(2), np.eye(1))
    with pytest.raises(ConfigurationError, match="finite"):
        lqr(A * np.nan, B, np.eye(2), np.eye(1))


def model(**changes):
    a, b = discretised(A, B, 0.1)
    parts = {
        "transition": a, "control": b, "measurement": np.array([[1.0, 0.0]]), "direct": np.zeros((1, 1)),
        "process_noise": 1e-4 * np.eye(2), "sensor_noise": np.array([[0.04]]),
    }  # fmt: skip
    return LinearModel(**(parts | changes))


def test_filter_is_consistent_with_its_own_covariance():
    rng, m = np.random.default_rng(1), model()
    start = np.diag([0.1, 0.1])
    squares = []
    for _ in range(100):
        truth = rng.multivariate_normal(np.zeros(2), start)
        filter_ = KalmanFilter(m, np.zeros(2), start)
        for _ in range(30):
            truth = (
                m.transition @ truth
                + m.control[:, 0] * 0.2
                + rng.multivariate_normal(np.zeros(2), m.process_noise)
            )
            filter_.predict(np.array([0.2]))
            filter_.correct(truth[:1] + rng.normal(0.0, 0.2, 1), np.array([0.2]))
        error = truth - filter_.state
        squares.append(error @ np.linalg.solve(filter_.covariance, error))
    assert np.mean(squares) == pytest.approx(2.0, abs=0.5)  # chi square of two states


def test_missing_measurements_are_left_out():
    m = model(measurement=np.eye(2), direct=np.zeros((2, 1)), sensor_noise=0.04 * np.eye(2))
    both, one = (KalmanFilter(m, np.ones(2), np.eye(2)) for _ in range(2))
    single = KalmanFilter(model(), np.ones(2), np.eye(2))
    innovation = one.correct(np.array([0.3, np.nan]), np.zeros(1))
    single.correct(np.array([0.3]), np.zeros(1))
    both.correct(np.array([np.nan, np.nan]), np.zeros(1))
    np.testing.assert_allclose(one.state, single.state)
    np.testing.assert_allclose(one.covariance, single.covariance)
    np.testing.assert_allclose(both.state, 1.0)
    assert innovation[1] == 0.0


def test_reset_and_bad_models():
    filter_ = KalmanFilter(model(), np.ones(2), np.eye(2))
    filter_.predict(np.zeros(1))
    filter_.reset()
    np.testing.assert_array_equal(filter_.state, 1.0)
    np.testing.assert_array_equal(filter_.covariance, np.eye(2))
    with pytest.raises(ConfigurationError, match="sensor_noise"):
        model(sensor_noise=np.array([[np.nan]]))
