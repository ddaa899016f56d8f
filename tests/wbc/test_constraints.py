"""Limits: joint bounds that stay feasible, force ramps, friction, torque envelope."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from bluefoot_mpc.model import servo as servo_laws
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.wbc.constraints.dynamics import ground_axes
from bluefoot_mpc.wbc.constraints.friction import friction_rows, onto_pyramid
from bluefoot_mpc.wbc.constraints.joints import acceleration_bounds
from bluefoot_mpc.wbc.constraints.torque import torque_bounds
from bluefoot_mpc.wbc.constraints.unilateral import force_caps

DT = 0.02
LIMITS = SimpleNamespace(lower=-0.8, upper=0.5, speed=6.0, braking=100.0)


def bounds_function(limits: SimpleNamespace = LIMITS) -> ca.Function:
    q, v = ca.SX.sym("q"), ca.SX.sym("v")
    return ca.Function("bounds", [q, v], list(acceleration_bounds(q, v, limits, DT)))


@pytest.mark.parametrize("policy", ["highest", "lowest", "random"])
def test_joints_never_pass_their_limits(policy: str) -> None:
    """Whatever is chosen inside the bounds, tick after tick, position and speed stay inside theirs."""
    bounds, rng = bounds_function(), np.random.default_rng(1)
    for _ in range(40):
        q, v = rng.uniform(-0.7, 0.4), 0.0
        for _ in range(60):
            low, high = (float(b) for b in bounds(q, v))
            assert low <= high
            assert low >= -100.0
            assert high <= 100.0
            a = {"highest": high, "lowest": low, "random": rng.uniform(low, high)}[policy]
            q, v = q + v * DT + 0.5 * a * DT * DT, v + a * DT
            assert -0.8 - 1e-9 <= q <= 0.5 + 1e-9
            assert abs(v) <= 6.0 + 1e-9


def test_limits_of_one_tick_alone_would_be_passed() -> None:
    """Why the bounds look further than a tick: the plain bound lets the joint through its stop."""
    q, v = 0.0, 0.0
    for _ in range(60):
        a = np.clip(2.0 * (0.5 - q - DT * v) / DT**2, -100.0, 100.0)
        a = min(a, (6.0 - v) / DT)
        q, v = q + v * DT + 0.5 * a * DT * DT, v + a * DT
    assert q > 0.5 or v < -1.0


def test_outside_the_limits_the_joint_is_sent_back() -> None:
    bounds = bounds_function()
    low, high = (float(b) for b in bounds(0.7, 0.0))
    assert low <= high < 0.0
    low, high = (float(b) for b in bounds(0.499, 6.0))
    assert low == high == -100.0
    low, high = (float(b) for b in bounds(-0.799, -6.0))
    assert low == high == 100.0


def test_unlimited_joints_have_finite_bounds() -> None:
    low, high = bounds_function(SimpleNamespace(lower=-1e9, upper=1e9, speed=1e9, braking=300.0))(3.0, 7.0)
    assert float(low) == -300.0
    assert float(high) == 300.0


class Ramp:
    """Caps over time, as the assembly keeps their state."""

    def __init__(self, ramp: float = 0.1) -> None:
        names = {"contact": 4, "loaded": 4, "remaining": 4}
        symbols = {name: ca.SX.sym(name, size) for name, size in names.items()}
        given = SimpleNamespace(**symbols, dt=DT, ramp=ramp, force_limit=40.0)
        self.function = ca.Function("ramp", list(symbols.values()), list(force_caps(given, 20.0)))
        self.loaded = np.ones(4)

    def step(self, contact: list[int], remaining: list[float] | None = None) -> np.ndarray:
        remaining = [1e3] * 4 if remaining is None else remaining
        caps, self.loaded = (np.array(x).ravel() for x in self.function(contact, self.loaded, remaining))
        return caps


def test_a_foot_takes_its_load_gradually() -> None:
    ramp = Ramp()
    np.testing.assert_allclose(ramp.step([1, 1, 1, 1]), 40.0)
    np.testing.assert_allclose(ramp.step([1, 1, 1, 0]), [40.0, 40.0, 40.0, 0.0])
    caps = [ramp.step([1, 1, 1, 1])[3] for _ in range(6)]
    np.testing.assert_allclose(caps, [8.0, 16.0, 24.0, 32.0, 40.0, 40.0])


def test_a_foot_gives_up_its_load_before_lift_off() -> None:
    ramp = Ramp()
    caps = [ramp.step([1, 1, 1, 1], [1e3, 1e3, 1e3, left])[3] for left in (0.2, 0.1, 0.05, 0.0)]
    np.testing.assert_allclose(caps, [40.0, 40.0, 20.0, 0.04], rtol=1e-9)


def test_caps_always_carry_the_robot() -> None:
    """Two pairs that change at once: all caps are small, and are raised in proportion."""
    ramp = Ramp()
    ramp.step([1, 0, 0, 1])
    caps = ramp.step([1, 1, 1, 1], [0.01, 1e3, 1e3, 0.01])
    assert caps.sum() == pytest.approx(30.0)
    np.testing.assert_allclose(caps, [5.0, 10.0, 10.0, 5.0])
    np.testing.assert_array_equal(ramp.step([0, 0, 0, 0]), 0.0)


def test_without_a_ramp_caps_are_full_at_once() -> None:
    ramp = Ramp(ramp=1e-6)
    ramp.step([0, 1, 1, 1])
    np.testing.assert_allclose(ramp.step([1, 1, 1, 1]), 40.0)


def test_friction_rows_are_the_pyramid() -> None:
    rng = np.random.default_rng(2)
    rows = friction_rows(3, 2, 0.4)
    assert rows.shape == (8, 9)
    assert not rows[:, :3].any()
    for _ in range(200):
        x = rng.normal(size=9)
        forces = x[3:].reshape(2, 3)
        inside = np.abs(forces[:, :2]).max(axis=1) <= 0.4 * forces[:, 2]
        assert (rows @ x <= 0.0).all() == inside.all()


def test_projection_lands_in_pyramid_and_cap() -> None:
    rng = np.random.default_rng(3)
    forces = rng.normal(size=(50, 3)) * 10.0
    moved = onto_pyramid(forces, 0.5, np.full(50, 6.0))
    assert (moved[:, 2] >= 0.0).all()
    assert (moved[:, 2] <= 6.0).all()
    assert (np.abs(moved[:, :2]).max(axis=1) <= 0.5 * moved[:, 2] + 1e-12).all()
    np.testing.assert_array_equal(onto_pyramid(moved, 0.5, np.full(50, 6.0)), moved)


def test_torque_envelope_is_the_servos() -> None:
    servo = load_robot().parameters.servo
    speed = np.linspace(-7.0, 7.0, 16)
    found = torque_bounds(servo.stall_torque, 10.8 / servo.nominal_voltage, servo.back_emf, speed)
    for mine, law in zip(found, servo_laws.torque_envelope(servo, speed, 10.8), strict=True):
        np.testing.assert_allclose(mine, law, rtol=1e-12)


def test_ground_axes_follow_any_slope() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        normal = np.array([*rng.normal(size=2) * 0.3, 1.0]) * rng.uniform(0.5, 2.0)
        axes = np.array(ground_axes(ca.DM(normal)))
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(axes[:, 2], normal / np.linalg.norm(normal), atol=1e-12)
    np.testing.assert_allclose(np.array(ground_axes(ca.DM([0.0, 0.0, 1.0]))), np.eye(3), atol=0)
