"""Linear-quadratic regulator and Kalman filter, as a balancing robot needs them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_continuous_are, solve_discrete_are

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray


def lqr(a: FloatArray, b: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    """(m, n) gain K of u = -K x that minimises the integral of xᵀ q x + uᵀ r u for dx/dt = a x + b u.

    Raises:
        ConfigurationError: no such gain exists, or a number is not finite.
    """
    try:
        cost = solve_continuous_are(a, b, q, r)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise _no_gain(error) from error
    return np.asarray(np.linalg.solve(r, b.T @ cost))


def discrete_lqr(a: FloatArray, b: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    """(m, n) gain K of u = -K x that minimises the sum of xᵀ q x + uᵀ r u for x' = a x + b u.

    Raises:
        ConfigurationError: no such gain exists, or a number is not finite.
    """
    try:
        cost = solve_discrete_are(a, b, q, r)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise _no_gain(error) from error
    return np.asarray(np.linalg.solve(r + b.T @ cost @ b, b.T @ cost @ a))


def discretised(a: FloatArray, b: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Matrices of x' = A x + B u over `dt` (s) with u held, from dx/dt = a x + b u; exact."""
    require_positive(dt=dt)
    n, m = b.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = a, b
    whole = expm(dt * block)
    return whole[:n, :n], whole[:n, n:]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class LinearModel:
    """x' = transition x + control u + noise, z = measurement x + direct u + noise.

    Attributes:
        transition: (n, n).
        control: (n, m).
        measurement: (k, n).
        direct: (k, m).
        process_noise: (n, n) covariance per step.
        sensor_noise: (k, k) covariance.
    """

    transition: FloatArray
    control: FloatArray
    measurement: FloatArray
    direct: FloatArray
    process_noise: FloatArray
    sensor_noise: FloatArray

    def __post_init__(self) -> None:
        for name in ("transition", "control", "measurement", "direct", "process_noise", "sensor_noise"):
            if not np.isfinite(getattr(self, name)).all():
                raise ConfigurationError(
                    f"{name} of the Kalman filter's model has a number that is not finite"
                )


class KalmanFilter:
    """Linear Kalman filter: predict with the input held, correct with what was measured.

    Attributes:
        model: what it believes in.
        state: (n,) estimate.
        covariance: (n, n) of its error.
    """

    def __init__(self, model: LinearModel, state: FloatArray, covariance: FloatArray) -> None:
        self.model = model
        self._start = state.copy(), covariance.copy()
        self.reset()

    def reset(self) -> None:
        """Back to the estimate that it was made with."""
        self.state, self.covariance = (part.copy() for part in self._start)

    def predict(self, control: FloatArray) -> None:
        """One period on, with (m,) the input that was held."""
        model = self.model
        self.state = model.transition @ self.state + model.control @ control
        self.covariance = model.transition @ self.covariance @ model.transition.T + model.process_noise

    def correct(self, measured: FloatArray, control: FloatArray) -> FloatArray:
        """Take in (k,) measurements made while (m,) `control` acts.

        Returns:
            (k,) innovation: measured less expected. Measurements that are not finite are left out,
            and have an innovation of 0.
        """
        model = self.model
        innovation = measured - model.measurement @ self.state - model.direct @ control
        seen = np.isfinite(innovation)
        innovation[~seen] = 0.0
        rows, noise = model.measurement[seen], model.sensor_noise[np.ix_(seen, seen)]
        spread = rows @ self.covariance @ rows.T + noise
        gain = np.linalg.solve(spread, rows @ self.covariance).T
        self.state = self.state + gain @ innovation[seen]
        rest = np.eye(len(self.state)) - gain @ rows
        # Joseph's form: stays symmetric and positive whatever is rounded.
        self.covariance = rest @ self.covariance @ rest.T + gain @ noise @ gain.T
        return np.asarray(innovation)


def _no_gain(error: Exception) -> ConfigurationError:
    return ConfigurationError(
        f"no regulator exists for this model and these weights ({error}): every unstable state must be "
        "reached by an input and seen by the weights, input weights must be positive, and all numbers finite"
    )
