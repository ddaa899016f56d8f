import numpy as np
import pytest

from bluefoot_mpc.model import servo as law

from .servo_bench import Bench, parameters

NO_FRICTION = {"coulomb_friction": 0.0, "viscous_friction": 0.0, "load_friction": 0.0}


def test_stall_torque_follows_the_voltage():
    for voltage in (12.0, 10.8):
        bench = Bench(voltage=voltage, locked=True)
        bench.command(1.0)
        bench.run(0.005)
        assert bench.bank.torque == pytest.approx(np.full(16, 1.5 * voltage / 12.0))
        assert bench.data.ctrl == pytest.approx(bench.bank.torque)


def test_torque_limit_clamps_the_duty():
    bench = Bench(locked=True)
    bench.command(1.0, limit=0.4)
    bench.run(0.002)
    assert bench.bank.duty == pytest.approx(np.full(16, 0.4), abs=1 / 1023)


def test_no_load_speed_is_59_rpm():
    bench = Bench(parameters(**NO_FRICTION))
    bench.data.qpos[:] = -2.5
    bench.command(2.5)
    speed = bench.run(0.3)[-1, 1]
    assert speed * 60 / (2 * np.pi) == pytest.approx(59.0, rel=0.005)
    # All of the voltage goes into back-EMF: no torque is left, and no current.
    assert bench.bank.duty[0] == 1.0
    assert bench.bank.torque[0] == pytest.approx(0.0, abs=0.01)


def test_friction_costs_a_few_percent_of_the_no_load_speed():
    bench = Bench()
    bench.data.qpos[:] = -2.5
    bench.command(2.5)
    speed = bench.run(0.5)[:, 1].max()
    servo = parameters()
    # Load friction fades with speed and is left out of this estimate.
    expected = (1.5 - servo.coulomb_friction) / (servo.back_emf + servo.viscous_friction)
    assert speed == pytest.approx(expected, rel=0.01)


def test_step_response_settles_within_the_dead_band():
    bench = Bench(inertia=2e-3)
    bench.command(0.5)
    angle = bench.run(1.0)[:, 0]
    step = parameters().step_angle
    # Margin, quantisation and what Coulomb friction holds of the punch.
    assert abs(angle[-1] - 0.5) < 3.5 * step
    assert np.ptp(angle[-500:]) < 1e-4
    # A damping ratio of 0.55 (back-EMF against 5.5e-3 kg·m² and 9.2 N·m/rad) overshoots by 13 % of the
    # part that is not clamped, half a radian's last third.
    assert angle.max() < 0.5 + 0.13 * 0.32
    reached = np.argmax(angle > 0.9 * 0.5)
    # 0.45 rad at 6 rad/s take 75 ms; the last third slows down with k_e/k_s = 26 ms.
    assert 80 < reached < 160


def test_small_step_follows_the_first_order_lag():
    bench = Bench(parameters(**NO_FRICTION, compliance_margin=0.0, punch=0.0, armature=1e-5), inertia=1e-6)
    bench.command(0.1)
    angle = bench.run(0.2)[:, 0]
    lag = parameters().back_emf / parameters().stiffness
    assert angle[round(1000 * lag)] == pytest.approx(0.1 * (1 - np.exp(-1)), abs=0.006)


@pytest.mark.parametrize("load", [-0.6, -0.3, 0.3, 0.6])
def test_droop_is_load_over_stiffness(load):
    servo = parameters(**NO_FRICTION)
    bench = Bench(servo)
    bench.command(0.0)
    droop = bench.run(1.0, load=load)[-1, 0]
    assert droop == pytest.approx(load / servo.stiffness, abs=1.1 * servo.step_angle)


def test_no_reaction_inside_the_margin():
    bench = Bench()
    step = parameters().step_angle
    bench.command(step)
    bench.run(0.05)
    assert not bench.bank.duty.any()
    bench.command(2 * step)
    bench.run(0.001)
    assert bench.bank.duty == pytest.approx(np.full(16, 32 / 1023 + 1 / 32))


def test_moving_speed_limits_the_speed():
    bench = Bench()
    bench.command(1.0, speed=1.0)
    angle = bench.run(0.9)[:, 0]
    assert (angle[800] - angle[300]) / 0.5 == pytest.approx(1.0, rel=0.02)


def test_waking_servo_starts_its_ramp_where_it_stands():
    bench = Bench()
    bench.command(0.0, limit=0.0)
    bench.data.qpos[:] = -0.5
    bench.run(0.01)
    bench.command(0.5, speed=0.5)
    angle = bench.run(0.3)[:, 0]
    assert np.diff(angle).max() < 0.0012
    assert angle[-1] == pytest.approx(-0.5 + 0.5 * 0.3, abs=0.03)


def test_back_emf_brakes_a_live_servo_and_not_a_limp_one():
    live, limp = Bench(parameters(**NO_FRICTION)), Bench(parameters(**NO_FRICTION))
    live.command(0.0)
    limp.command(0.0, limit=0.0)
    for bench in (live, limp):
        bench.data.qvel[:] = 1.0
    assert limp.run(0.05)[-1, 1] == pytest.approx(1.0)
    assert not limp.bank.torque.any()
    # Inside the margin (0.005 rad here) only the back-EMF acts: tau = J/k_e = 15 ms.
    assert live.run(0.002)[-1, 1] == pytest.approx(np.exp(-0.002 * 0.2428 / 0.0036), abs=0.01)


def test_voltage_sags_with_the_current():
    bench = Bench(locked=True, resistance=0.06)
    bench.command(1.0)
    bench.run(0.05)
    voltage = float(bench.bank.voltage[0])
    current = 16 * (1.5 * voltage / 12.0 + 0.05)
    assert voltage == pytest.approx(12.0 - 0.06 * current, abs=1e-6)
    power, mean_voltage = bench.bank.finish_frame(50)
    assert power == pytest.approx(voltage * current, rel=0.05)
    assert mean_voltage == pytest.approx(voltage, abs=0.05)


def test_stalled_servo_heats_up_switches_off_and_comes_back():
    bench = Bench(locked=True)
    bench.command(1.0)
    elapsed = 0.0
    while not bench.bank.overheated:
        bench.run(0.001)
        # One millisecond stands for a second: the law is exact for constant loss.
        bench.bank._sums[:] *= 1000.0
        bench.bank.finish_frame(1000)
        elapsed += 1.0
    # 18 W through 8 K/W heads for 169 °C; 70 °C is passed on the way.
    assert elapsed == pytest.approx(-300.0 * np.log(1 - 45.0 / 144.0), abs=2.0)
    assert len(bench.bank.overheated) == 16
    bench.command(1.0)
    bench.run(0.001)
    assert not bench.bank.torque.any()
    bench.bank.temperature[:] = 60.0
    bench.run(0.001)
    assert not bench.bank.torque.any()
    bench.command(1.0)
    bench.run(0.001)
    assert bench.bank.torque == pytest.approx(np.full(16, 1.5))
    assert not bench.bank.overheated


def test_backlash_lets_the_output_move_freely():
    gap = np.radians(0.4)
    slack, tight = Bench(backlash=gap), Bench()
    moved = []
    for bench in (slack, tight):
        bench.command(0.0)
        bench.run(0.5, load=0.4)
        one_way = bench.data.qpos[0]
        bench.run(0.5, load=-0.4)
        moved.append(one_way - bench.data.qpos[0])
        assert abs(bench.data.qvel[0]) < 0.2
    # The position sensor sits on the output: the servo works the gap away but for friction.
    assert moved[0] == pytest.approx(moved[1], abs=1.5 * gap)
    assert slack.bank.play.min() >= -gap / 2
    assert slack.bank.play.max() <= gap / 2
    assert slack.bank.play.any()


def test_states_updated_in_place_equal_those_of_the_function():
    bench = Bench(resistance=0.06, backlash=0.01)
    bank, rng = bench.bank, np.random.default_rng(3)
    for _ in range(20):
        bench.data.qpos[:] = rng.normal(0.0, 0.3, 16)
        bench.data.qvel[:] = rng.normal(0.0, 2.0, 16)
        bench.command(
            rng.normal(0.0, 0.3, 16), speed=float(rng.integers(0, 3)), limit=float(rng.integers(0, 2))
        )
        before = [bank.profile.copy(), bank.play.copy(), bank.voltage.copy(), bank._sums.copy()]
        expected = bank._function(
            bench.data.qpos, bench.data.qvel, bank.goal, bank._ramp, bank._limit, bank._live,
            bank._slope, bank._friction_scale, bank._open_voltage, *before,
        )  # fmt: skip
        bank.advance()
        found = (bench.data.ctrl, bench.model.dof_frictionloss, bank.duty, bank.torque)
        for want, got in zip(
            expected, (*found, bank.profile, bank.play, bank.voltage, bank._sums), strict=True
        ):
            assert np.array_equal(np.asarray(want).ravel(), got)


def test_symbolic_duty_equals_the_shared_law():
    bench = Bench(locked=True)
    servo, rng = parameters(), np.random.default_rng(5)
    for _ in range(20):
        bench.data.qpos[:] = rng.normal(0.0, 0.05, 16)
        goal = rng.normal(0.0, 0.05, 16)
        bench.command(goal, limit=0.7)
        bench.run(0.001)
        error = law.to_counts(servo, goal) - law.to_counts(servo, bench.data.qpos)
        assert bench.bank.duty == pytest.approx(law.duty(servo, error, np.floor(0.7 * 1023) / 1023))
