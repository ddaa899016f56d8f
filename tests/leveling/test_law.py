"""The levelling law against a dense formula, what it does to the trunk, and how it enters the goals."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.leveling.config import AttitudeGains, ScheduleConfig
from bluefoot_mpc.leveling.trunk_dynamics import nominal_mass_matrix
from bluefoot_mpc.model.dynamics import Dynamics
from tests.leveling.bench import (
    DT,
    FRONT,
    INPUTS,
    LEFT,
    MOVED,
    PSI,
    REAR,
    RIGHT,
    ROBOT,
    SERVO,
    STANCE,
    SWINGING,
    WIDE,
    compensator,
    last,
    seen,
    state,
    told,
)

DYNAMICS = Dynamics(ROBOT, rotor_inertia=True)
TURNS, JOINTS = np.eye(22)[3:6], np.eye(22)[:, 6:]  # Γ1, Γ2
GAINS = AttitudeGains(tilt=900.0, tilt_rate=70.0, heading=50.0, heading_rate=6.0)
UNWANTED = np.array([900.0 * 0.02 + 70.0 * 0.2, 900.0 * -0.07 + 70.0 * -0.3, 50.0 * -0.08 + 6.0 * 0.1])
"""K_b θ + K_d dθ/dt of these inputs, 1/s²."""


def mass_of(estimate) -> np.ndarray:
    return DYNAMICS.mass_matrix(
        np.concatenate([estimate.position, estimate.quaternion, estimate.joint_position])
    )


def dense(mass, unwanted) -> np.ndarray:
    """-[Γ1 M̂⁻¹ Γ2]† (...) as it stands in the paper."""
    return -np.linalg.pinv(TURNS @ np.linalg.inv(mass) @ JOINTS) @ unwanted


def turned(mass, torque, psi) -> np.ndarray:
    """(3,) rad/s², what torques and a disturbance make of the trunk."""
    return np.linalg.solve(mass, JOINTS @ torque + psi)[3:6]


# The law.


def test_the_torque_is_the_papers_formula_with_the_nominal_matrix(monkeypatch):
    law, _ = told(monkeypatch, PSI, gains=GAINS, limits=WIDE)
    mass = nominal_mass_matrix(DYNAMICS, SWINGING)
    expected = dense(mass, TURNS @ np.linalg.inv(mass) @ PSI + UNWANTED)
    np.testing.assert_allclose(law.step(INPUTS, DT).report.torque, expected, rtol=1e-9, atol=1e-12)


def test_the_torque_is_the_papers_formula_with_pinocchios_matrix(monkeypatch):
    law, _ = told(monkeypatch, PSI, gains=GAINS, limits=WIDE, mass_matrix="model")
    mass = mass_of(MOVED)
    expected = dense(mass, TURNS @ np.linalg.inv(mass) @ PSI + UNWANTED)
    np.testing.assert_allclose(law.step(INPUTS, DT).report.torque, expected, rtol=1e-9, atol=1e-12)
    assert np.abs(mass - nominal_mass_matrix(DYNAMICS, SWINGING)).max() > 1e-4


def test_with_the_true_mass_matrix_the_trunk_gets_the_wanted_acceleration(monkeypatch):
    law, _ = told(monkeypatch, PSI, gains=GAINS, limits=WIDE, mass_matrix="model")
    report = law.step(INPUTS, DT).report
    mass = mass_of(MOVED)
    np.testing.assert_allclose(turned(mass, report.torque, PSI), -UNWANTED, rtol=1e-9)
    np.testing.assert_allclose(report.disturbance, turned(mass, np.zeros(16), PSI), rtol=1e-9)


def test_without_feedback_the_disturbance_alone_is_cancelled(monkeypatch):
    law, _ = told(monkeypatch, PSI, attitude=False, limits=WIDE, mass_matrix="model")
    torque = law.step(INPUTS, DT).report.torque
    assert np.abs(torque).max() > 0.01
    np.testing.assert_allclose(turned(mass_of(MOVED), torque, PSI), 0.0, atol=1e-9)


def test_no_torque_is_smaller_for_the_same_acceleration(monkeypatch):
    law, _ = told(monkeypatch, PSI, gains=GAINS, limits=WIDE, mass_matrix="model")
    torque = law.step(INPUTS, DT).report.torque
    reach = TURNS @ np.linalg.inv(mass_of(MOVED)) @ JOINTS
    _, _, rows = np.linalg.svd(reach)
    np.testing.assert_allclose(rows[3:] @ torque, 0.0, atol=1e-9)


def test_without_attitude_and_disturbance_there_is_no_torque():
    law = compensator(attitude=False, psi="zero")
    np.testing.assert_array_equal(law.step(INPUTS, DT).report.torque, 0.0)


def test_a_heading_without_gain_does_nothing():
    torques = [
        compensator(psi="zero")
        .step(seen(state(rate=(0.0, 0.0, rate)), heading_error=error), DT)
        .report.torque
        for error, rate in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.7))
    ]
    np.testing.assert_array_equal(torques[0], 0.0)
    np.testing.assert_allclose(torques[1], 0.0, atol=1e-12)
    np.testing.assert_allclose(torques[2], 0.0, atol=1e-12)


def test_a_heading_with_gain_is_turned_back():
    law = compensator(psi="zero", gains=replace(GAINS, tilt=0.0, tilt_rate=0.0), mass_matrix="model")
    inputs = seen(heading_error=0.3)
    np.testing.assert_allclose(
        turned(mass_of(inputs.estimate), law.step(inputs, DT).report.torque, np.zeros(22)),
        [0.0, 0.0, -50.0 * 0.3],
        atol=1e-9,
    )


def test_a_commanded_tilt_is_no_error():
    tilted = seen(state(rpy=(0.1, -0.05, 0.0)), tilt_reference=np.array([0.1, -0.05]))
    report = compensator(psi="zero").step(tilted, DT).report
    np.testing.assert_allclose(report.torque, 0.0, atol=1e-12)


def foot_heights(leveled, inputs) -> np.ndarray:
    """(4,) m, how much further the levelled goals press each foot down than the gait's own."""
    joints = (inputs.goals, leveled.goals)
    low = [DYNAMICS.foot_positions(np.concatenate([np.zeros(6), [1.0], q]))[:, 2] for q in joints]
    return low[0] - low[1]


@pytest.mark.parametrize("form", ["mixed", "residual"])
@pytest.mark.parametrize(
    ("rpy", "rate", "down", "up"),
    [
        ((0.03, 0.0, 0.0), (0.0, 0.0, 0.0), RIGHT, LEFT),
        ((-0.03, 0.0, 0.0), (0.0, 0.0, 0.0), LEFT, RIGHT),
        ((0.0, 0.03, 0.0), (0.0, 0.0, 0.0), FRONT, REAR),
        ((0.0, -0.03, 0.0), (0.0, 0.0, 0.0), REAR, FRONT),
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), RIGHT, LEFT),
        ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), FRONT, REAR),
    ],
)
def test_the_legs_on_the_side_that_sinks_are_extended(form, rpy, rate, down, up):
    inputs = seen(state(rpy=rpy, rate=rate), goals=STANCE)
    law = compensator(psi="zero", form=form)
    leveled = law.step(inputs, DT)
    extended = foot_heights(leveled, inputs)
    assert extended[down].min() > 1e-4
    assert extended[up].max() < -1e-4
    turn = turned(mass_of(inputs.estimate), leveled.report.torque, np.zeros(22))
    assert turn @ (np.array(rpy) + np.array(rate)) < 0.0  # against it


# Into the goals.


def test_the_goals_are_mixed_as_the_paper_mixes():
    law = compensator(psi="zero", gains=GAINS, limits=WIDE, mix=0.35)
    leveled = law.step(INPUTS, DT)
    wanted = MOVED.joint_position + leveled.report.torque / SERVO.stiffness
    np.testing.assert_allclose(leveled.goals, 0.65 * INPUTS.goals + 0.35 * wanted, atol=1e-14)
    assert leveled.report.share == 1.0


def test_plain_mixing_makes_the_servos_softer():
    law = compensator(psi="zero", attitude=False, limits=WIDE, mix=0.25)
    leveled = law.step(INPUTS, DT)
    np.testing.assert_allclose(leveled.goals, 0.75 * INPUTS.goals + 0.25 * MOVED.joint_position, atol=1e-14)


def test_a_residual_is_added_to_the_goals():
    law = compensator(psi="zero", form="residual", gains=GAINS, limits=WIDE, mix=0.25)
    leveled = law.step(INPUTS, DT)
    np.testing.assert_allclose(
        leveled.goals - INPUTS.goals, 0.25 * leveled.report.torque / SERVO.stiffness, atol=1e-14
    )


def test_a_residual_does_not_repeat_what_the_goals_do_already(monkeypatch):
    law, _ = told(monkeypatch, PSI, form="residual", attitude=False, limits=WIDE, mass_matrix="model")
    torque = law.step(INPUTS, DT).report.torque
    made = SERVO.stiffness * (INPUTS.goals - MOVED.joint_position) - SERVO.back_emf * MOVED.joint_velocity
    np.testing.assert_allclose(turned(mass_of(MOVED), torque + made, PSI), 0.0, atol=1e-9)


@pytest.mark.parametrize("trust", [0.0, 0.4])
def test_a_residual_acts_on_the_share_of_a_prediction_that_is_trusted(monkeypatch, trust):
    law, source = told(monkeypatch, PSI, form="residual", gains=GAINS, limits=WIDE, mass_matrix="model")
    source.trust = trust
    torque = law.step(INPUTS, DT).report.torque
    made = SERVO.stiffness * (INPUTS.goals - MOVED.joint_position) - SERVO.back_emf * MOVED.joint_velocity
    mass = mass_of(MOVED)
    expected = -UNWANTED - trust * turned(mass, made, PSI)
    np.testing.assert_allclose(turned(mass, torque, np.zeros(22)), expected, rtol=1e-9, atol=1e-9)


def test_a_low_battery_takes_further_goals_for_the_same_torque():
    full = compensator(psi="zero", gains=GAINS, limits=WIDE, form="residual").step(INPUTS, DT)
    low = compensator(psi="zero", gains=GAINS, limits=WIDE, form="residual")
    low = low.step(replace(INPUTS, voltage=10.0), DT)
    np.testing.assert_array_equal(low.report.torque, full.report.torque)
    shift = low.goals - INPUTS.goals
    np.testing.assert_allclose(shift, (full.goals - INPUTS.goals) * SERVO.nominal_voltage / 10.0, rtol=1e-9)


def test_it_fades_in_and_out_over_the_stated_time():
    schedule = ScheduleConfig(fade=0.1)
    law = compensator(psi="zero", schedule=schedule)
    shares = [law.step(INPUTS, DT).report.share for _ in range(7)]
    np.testing.assert_allclose(shares, [0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 1.0])
    shares = [law.step(replace(INPUTS, walking=False), DT).report.share for _ in range(6)]
    np.testing.assert_allclose(shares, [0.8, 0.6, 0.4, 0.2, 0.0, 0.0], atol=1e-12)


def test_while_it_fades_it_acts_in_proportion():
    law = compensator(psi="zero", gains=GAINS, limits=WIDE, schedule=ScheduleConfig(fade=0.1))
    shift = [law.step(INPUTS, DT).goals - INPUTS.goals for _ in range(5)]
    for k in range(4):
        np.testing.assert_allclose(shift[k], 0.2 * (k + 1) * shift[4], atol=1e-14)


@pytest.mark.parametrize("psi", ["zero", "persistence", "model", "network"])
def test_without_walking_the_goals_are_those_of_the_gait(psi):
    law = compensator(psi=psi)
    for _ in range(5):
        leveled = law.step(replace(INPUTS, walking=False), DT)
        np.testing.assert_array_equal(leveled.goals, INPUTS.goals)
        assert leveled.report.share == 0.0


@pytest.mark.parametrize(
    ("learn", "walking", "acting", "training"),
    [
        ("off", True, False, True), ("off", True, True, False), ("off", False, False, False),
        ("always", True, True, True), ("always", True, False, True), ("always", False, False, False),
        ("never", True, False, False), ("never", True, True, False),
    ],
)  # fmt: skip
def test_the_network_learns_of_a_walk_in_the_windows_it_may(learn, walking, acting, training):
    schedule = ScheduleConfig(fade=0.02, learn_time=0.0, learn=learn, off=0.0 if acting else 100.0)
    law = compensator(psi="network", schedule=schedule)
    source = law.source
    source._narx._power = 1e9  # not to be doubted
    last(law, replace(INPUTS, walking=walking), 4)
    before = source.weights.layers[2]
    report = law.step(replace(INPUTS, walking=walking), DT).report
    assert (report.share > 0.0) == acting
    assert report.training == training
    assert np.any(source.weights.layers[2] != before) == training


# The measured target, seen from outside.


def test_the_target_of_a_period_is_known_one_tick_after_its_goals_were(monkeypatch):
    law, source = told(monkeypatch, PSI, delay_ticks=1)
    last(law, INPUTS, 4)
    assert [situation.target is None for situation in source.seen] == [True, True, False, False]


def test_the_target_is_that_of_the_servo_law_on_the_goals_that_were_sent(monkeypatch):
    law, source = told(monkeypatch, PSI, delay_ticks=0, mass_matrix="model", mix=0.25, limits=WIDE)
    first = law.step(seen(state(), walking=False, goals=STANCE + 0.05), DT)
    after = state(velocity=(0.02, 0.0, -0.01), rate=(0.1, 0.0, 0.0), joints=STANCE + 0.01, speed=0.5)
    report = law.step(seen(after, walking=False), DT).report
    error = first.goals - (STANCE + 0.005)
    beyond = np.abs(error) / SERVO.step_angle - SERVO.compliance_margin
    duty = SERVO.punch / 1023.0 + beyond / SERVO.compliance_slope
    torque = np.sign(error) * np.minimum(duty, 1.0) * SERVO.stall_torque - SERVO.back_emf * 0.5
    change = np.concatenate([after.linear_velocity, after.angular_velocity, after.joint_velocity])
    expected = mass_of(after) @ change / DT - JOINTS @ torque
    np.testing.assert_allclose(source.seen[-1].target, expected, rtol=1e-9)
    np.testing.assert_allclose(report.measured, TURNS @ np.linalg.solve(mass_of(after), expected), rtol=1e-9)
