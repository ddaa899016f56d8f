import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.pendulum import GRAVITY, DoublePendulum, WheeledPendulum
from bluefoot_mpc.wheels.regulator import lqr


def advanced(body, state, torque, dt):
    k1 = body.derivative(state, torque)
    k2 = body.derivative(state + 0.5 * dt * k1, torque)
    k3 = body.derivative(state + 0.5 * dt * k2, torque)
    k4 = body.derivative(state + dt * k3, torque)
    return state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


@pytest.mark.parametrize("body", [WheeledPendulum(), WheeledPendulum(friction=0.05), DoublePendulum()])
def test_linear_model_is_the_derivative_at_rest(body):
    a, b = body.linear()
    n, h = len(a), 1e-6
    columns = [(body.derivative(h * e, 0.0) - body.derivative(-h * e, 0.0)) / (2 * h) for e in np.eye(n)]
    np.testing.assert_allclose(a, np.column_stack(columns), atol=1e-6)
    by_input = (body.derivative(np.zeros(n), h) - body.derivative(np.zeros(n), -h)) / (2 * h)
    np.testing.assert_allclose(b[:, 0], by_input, atol=1e-6)


@pytest.mark.parametrize(
    ("body", "start"),
    [
        (WheeledPendulum(friction=0.0), [0.0, 0.1, 0.3, -0.2]),
        (DoublePendulum(), [0.0, 0.3, -0.2, 0.1, 0.4, -0.6]),
    ],
)
def test_energy_stays_what_it_is_without_motor_and_friction(body, start):
    state = np.array(start)
    before = body.energy(state)
    for _ in range(5000):
        state = advanced(body, state, 0.0, 2e-4)
    assert np.abs(state[1:3]).max() > 0.5  # it has fallen well away from where it began
    assert body.energy(state) == pytest.approx(before, abs=1e-8)


def test_one_step_of_the_wheeled_body_is_runge_and_kuttas():
    body, state = WheeledPendulum(), np.array([0.1, 0.3, 0.4, -0.8])
    np.testing.assert_allclose(body.advanced(state, 0.1, 0.01), advanced(body, state, 0.1, 0.01), atol=1e-15)


def test_a_motors_work_is_the_energys_gain():
    body, state, work = WheeledPendulum(friction=0.0), np.array([0.0, 0.2, 0.1, 0.0]), 0.0
    before, torque, dt = body.energy(np.array([0.0, 0.2, 0.1, 0.0])), 0.05, 1e-4
    for _ in range(1000):
        turned = -(state[0] / body.wheel_radius - state[2])
        state = advanced(body, state, torque, dt)
        work += torque * (turned + state[0] / body.wheel_radius - state[2])
    assert body.energy(state) - before == pytest.approx(work, abs=1e-9)


def test_a_tilted_body_falls_and_the_wheels_run_away_from_under_it():
    push, turn = WheeledPendulum().accelerations(0.0, 0.1, 0.0, 0.0)
    assert turn > 0.0
    assert push < 0.0


def test_with_endless_wheels_it_is_a_plain_pendulum():
    body = WheeledPendulum(wheel_mass=1e9)
    _, turn = body.accelerations(0.0, 0.2, 0.0, 0.0)
    moment = body.body_mass * body.body_height
    assert turn == pytest.approx(moment * GRAVITY * np.sin(0.2) / body.tilting_inertia, rel=1e-6)


def test_double_pendulum_stretched_has_the_inertia_of_one_rod():
    """Two equal rods in line that turn together have the inertia of one rod of both lengths."""
    rod = 0.3
    pendulum = DoublePendulum(
        cart_mass=1e9, masses=(0.5, 0.5), lengths=(rod, rod), centres=(rod / 2, rod / 2),
        inertias=(0.5 * rod**2 / 12, 0.5 * rod**2 / 12),
    )  # fmt: skip
    together = pendulum.mass_matrix(np.full(2, np.pi))[1:, 1:].sum()
    assert together == pytest.approx(1.0 * (2 * rod) ** 2 / 3)


def test_regulator_holds_both_rods_upright():
    pendulum = DoublePendulum()
    gain = lqr(*pendulum.linear(), np.diag([1.0, 10.0, 10.0, 1.0, 1.0, 1.0]), np.array([[0.1]]))[0]
    state = np.array([0.2, 0.1, -0.05, 0.0, 0.0, 0.0])
    for _ in range(5000):
        state = advanced(pendulum, state, float(-gain @ state), 2e-3)
    np.testing.assert_allclose(state, 0.0, atol=1e-3)
    fallen = np.array([0.2, 0.1, -0.05, 0.0, 0.0, 0.0])
    for _ in range(1000):
        fallen = advanced(pendulum, fallen, 0.0, 1e-3)
    assert np.abs(fallen[1:3]).max() > 1.0


@pytest.mark.parametrize(
    ("make", "changes"),
    [
        (WheeledPendulum, {"body_mass": 0.0}),
        (WheeledPendulum, {"friction": -0.1}),
        (DoublePendulum, {"masses": (0.5, 0.0)}),
        (DoublePendulum, {"inertias": (float("nan"), 0.0)}),
    ],
)
def test_impossible_bodies_are_refused(make, changes):
    with pytest.raises(ConfigurationError):
        make(**changes)
