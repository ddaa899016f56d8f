"""Errors and Jacobians of the tasks, against finite differences of Pinocchio's kinematics."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.wbc.layout import parameter_layout
from bluefoot_mpc.wbc.problem import force_unit, reduced_dynamics
from bluefoot_mpc.wbc.samples import sample_inputs
from bluefoot_mpc.wbc.tasks import com_task, foot_task, momentum_task, posture_target, trunk_task
from bluefoot_mpc.wbc.tasks.trunk import orientation_error
from tests.wbc.states import bluefoot, com_of, foot_points

STEP = 1e-6  # s


class Case:
    """A random state, random unknowns, and what the problem's expressions say of them."""

    def __init__(self, seed: int) -> None:
        self.model = model = bluefoot()
        rng = np.random.default_rng(seed)
        self.inputs = sample_inputs(model, rng)
        self.layout = parameter_layout(model)
        vector, self.given = self.layout.symbols()
        self.dynamics = reduced_dynamics(model, self.given)
        self.vector = vector
        self.x = np.concatenate([rng.normal(size=16) * 20.0, rng.normal(size=12)])
        self.numbers = np.abs(rng.normal(size=self.layout.size))
        cut = self.layout.cut(self.numbers)
        cut.q[:], cut.v[:], cut.ground[:] = self.inputs.q, self.inputs.v, self.inputs.ground
        cut.contact[:] = [1, 0, 1, 0]
        linear, angular = self.value(self.dynamics.linear), self.value(self.dynamics.angular)
        linear = linear + np.cross(self.number(self.dynamics.tree.com), angular)
        into = rotation_from_quaternion(self.inputs.q[3:7]).T
        self.acceleration = np.concatenate([into @ linear, into @ angular, self.x[:16]])

    def number(self, *expressions):
        function = ca.Function("f", [self.vector], [ca.densify(ca.SX(e)) for e in expressions])
        values = [np.array(v).squeeze() for v in function.call([self.numbers])]
        return values[0] if len(values) == 1 else values

    def value(self, rows) -> np.ndarray:
        """Rows at x."""
        matrix, constant = self.number(rows.matrix, rows.constant)
        return matrix @ self.x + constant

    def moved(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """State after dt under the acceleration that x means."""
        v = self.inputs.v + dt * self.acceleration
        middle = self.inputs.v + 0.5 * dt * self.acceleration
        return np.array(pin.integrate(self.model.pin_model, self.inputs.q, middle * dt)), v

    def rate(self, quantity) -> np.ndarray:
        """Central difference of a function of q and v along the motion."""
        return (quantity(*self.moved(STEP)) - quantity(*self.moved(-STEP))) / (2.0 * STEP)


@pytest.fixture(scope="module", params=[0, 1])
def case(request: pytest.FixtureRequest) -> Case:
    return Case(request.param)


def com_velocity(q, v):
    model = bluefoot().pin_model
    data = model.createData()
    pin.centerOfMass(model, data, q, v)
    return np.array(data.vcom[0])


def foot_velocities(q, v):
    model = bluefoot().pin_model
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    frames = bluefoot().frames
    return np.array(
        [pin.getFrameVelocity(model, data, f, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED).linear for f in frames]
    )


def angular_velocity(q, v):
    return rotation_from_quaternion(q[3:7]) @ v[3:6]


def angular_momentum(q, v):
    model = bluefoot().pin_model
    return np.array(pin.computeCentroidalMomentum(model, model.createData(), q, v).angular)


def test_com(case: Case) -> None:
    task = com_task(case.dynamics, case.given)
    np.testing.assert_allclose(case.value(task.rows), case.rate(com_velocity), rtol=1e-5, atol=1e-5)
    given = case.layout.cut(case.numbers)
    wanted = given.com_acceleration + given.com_gain[0] * (given.com - com_of(case.model, given.q))
    wanted = wanted + given.com_gain[1] * (given.com_velocity - com_velocity(given.q, given.v))
    np.testing.assert_allclose(case.number(task.target), wanted, rtol=1e-10)


def test_trunk(case: Case) -> None:
    task = trunk_task(case.dynamics, case.given)
    np.testing.assert_allclose(case.value(task.rows), case.rate(angular_velocity), rtol=1e-5, atol=1e-4)


def test_orientation_error_turns_towards_the_reference() -> None:
    rng = np.random.default_rng(5)
    for angle in (1e-3, 0.3, 2.5, 3.1):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        start = rng.normal(size=4)
        start /= np.linalg.norm(start)
        half = np.concatenate([axis * np.sin(angle / 2), [np.cos(angle / 2)]])
        goal = (pin.Quaternion(half) * pin.Quaternion(start)).coeffs() * rng.choice([-1.0, 1.0])
        error = np.array(orientation_error(ca.DM(start), ca.DM(goal))).ravel()
        np.testing.assert_allclose(error, 2.0 * np.sin(angle / 2) * axis, atol=1e-12)


def test_orientation_error_falls_at_the_rate_of_turning() -> None:
    """The Jacobian of the error is minus the angular velocity's, near the reference."""
    model, rng = bluefoot().pin_model, np.random.default_rng(6)
    q = bluefoot().posture.copy()
    goal = np.array(pin.integrate(model, q, np.concatenate([rng.normal(size=6) * 1e-4, np.zeros(16)])))[3:7]
    v = np.concatenate([np.zeros(3), rng.normal(size=3), np.zeros(16)])
    after = [np.array(pin.integrate(model, q, v * dt)) for dt in (STEP, -STEP)]
    errors = [np.array(orientation_error(ca.DM(x[3:7]), ca.DM(goal))).ravel() for x in after]
    rate = (errors[0] - errors[1]) / (2.0 * STEP)
    np.testing.assert_allclose(rate, -angular_velocity(q, v), atol=1e-3)


def test_feet(case: Case) -> None:
    rates = case.rate(foot_velocities)
    given = case.layout.cut(case.numbers)
    points, speeds = foot_points(case.model, given.q), foot_velocities(given.q, given.v)
    for index in range(4):
        task = foot_task(case.dynamics, index, case.given)
        np.testing.assert_allclose(case.value(task.rows), rates[index], rtol=1e-5, atol=1e-4)
        place = slice(3 * index, 3 * index + 3)
        if given.contact[index]:
            wanted, weight = -given.contact_gain * speeds[index], given.contact_weight[0]
        else:
            wanted = given.foot_acceleration[place] + given.swing_gain[0] * (
                given.foot[place] - points[index]
            )
            wanted = wanted + given.swing_gain[1] * (given.foot_velocity[place] - speeds[index])
            weight = given.swing_weight[0]
        np.testing.assert_allclose(case.number(task.target), wanted, rtol=1e-10)
        np.testing.assert_allclose(case.number(task.weight), weight, rtol=1e-10)


def test_momentum(case: Case) -> None:
    inertia = 0.02
    task = momentum_task(case.dynamics, inertia, case.given)
    rate = case.rate(angular_momentum) / inertia
    np.testing.assert_allclose(case.value(task.rows), rate, rtol=1e-4, atol=1e-3)
    given = case.layout.cut(case.numbers)
    wanted = -given.momentum_gain / inertia * angular_momentum(given.q, given.v)
    np.testing.assert_allclose(case.number(task.target), wanted, rtol=1e-9)


def test_posture(case: Case) -> None:
    given = case.layout.cut(case.numbers)
    wanted = given.posture_acceleration + given.posture_gain[0] * (given.posture - given.q[7:])
    wanted = wanted + given.posture_gain[1] * (given.posture_velocity - given.v[6:])
    np.testing.assert_allclose(case.number(posture_target(case.given)), wanted, rtol=1e-12)


def test_weighted_rows_are_the_cost(case: Case) -> None:
    case.layout.cut(case.numbers).com_weight[:] = [1.0, 4.0, 9.0]
    task = com_task(case.dynamics, case.given)
    matrix, side = case.number(*task.weighted())
    error = case.value(task.rows) - case.number(task.target)
    np.testing.assert_allclose(matrix @ case.x - side, error * [1.0, 2.0, 3.0], rtol=1e-9, atol=1e-9)


def test_forces_have_the_problems_unit_and_the_grounds_axes(case: Case) -> None:
    axes = case.number(case.dynamics.axes) / force_unit(case.model)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(axes[:, 2], case.inputs.ground, atol=1e-12)
    assert axes[0, 0] > 0.9
    assert np.linalg.det(axes) > 0.0


def test_layout_names_every_piece_once() -> None:
    layout = parameter_layout(bluefoot())
    pieces = layout.cut(np.arange(layout.size))
    assert isinstance(pieces, SimpleNamespace)
    joined = np.concatenate(list(vars(pieces).values()))
    np.testing.assert_array_equal(joined, np.arange(layout.size))
