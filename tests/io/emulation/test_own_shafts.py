import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts, ShaftConfig, Supply, bench_servo
from bluefoot_mpc.io.emulation.shafts import COUNT, MIDDLE, ShaftDrive
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.servo import SPEED_UNIT, current_per_torque, duty, winding_resistance

STIFF = Supply(resistance=0.0)
ON = ShaftDrive(enabled=True)


def shafts_of(*configs, supply=STIFF):
    shafts = OwnShafts(configs, supply)
    shafts.advance(0.0)
    return shafts


def path(shafts, index=0, seconds=0.5, start=0.0, every=1e-3):
    """Angles over time."""
    angles = []
    for k in range(round(seconds / every)):
        shafts.advance(start + (k + 1) * every + 1e-9)
        angles.append(shafts.state(index).angle)
    return np.array(angles)


def test_the_bench_has_the_robots_servos():
    assert bench_servo() == load_parameters().servo


@pytest.mark.parametrize("goal", [512, 513, 514, 520, 544, 600, 500, 200])
def test_the_duty_is_the_models(goal):
    shafts = shafts_of(ShaftConfig())
    shafts.drive(0, replace(ON, goal=goal))
    shafts.advance(1e-3)
    expected = duty(bench_servo(), np.array(goal - MIDDLE), 1.0)
    assert shafts.state(0).load == pytest.approx(float(expected))


def test_a_joint_reaches_its_goal_within_margin_and_friction():
    shafts = shafts_of(ShaftConfig())
    shafts.drive(0, replace(ON, goal=600))
    angles = path(shafts)
    assert angles[-1] / COUNT == pytest.approx(88, abs=2)
    assert angles[-1] == angles[-50]
    assert shafts.state(0).speed == 0.0


def test_a_wheel_runs_at_the_speed_where_all_torque_is_lost():
    servo = bench_servo()
    shafts = shafts_of(ShaftConfig(), ShaftConfig())
    shafts.drive(0, replace(ON, is_wheel=True, speed=1023))
    shafts.drive(1, replace(ON, is_wheel=True, speed=1024 + 512, goal=0))
    shafts.advance(1.0)
    fading = 1.0 / (1.0 + (shafts.state(0).speed / 0.1) ** 2)
    friction = servo.coulomb_friction + servo.load_friction * fading * shafts.torque(0)
    expected = (servo.stall_torque - friction) / (servo.back_emf + servo.viscous_friction)
    assert shafts.state(0).speed == pytest.approx(expected, rel=1e-3)
    assert shafts.state(1).speed < -0.4 * expected
    assert shafts.state(1).load == pytest.approx(-512 / 1023)


def test_moving_speed_limits_the_way():
    shafts = shafts_of(ShaftConfig())
    shafts.drive(0, replace(ON, goal=800, speed=100))
    angles = path(shafts)
    assert (angles[-1] - angles[99]) / 0.4 == pytest.approx(100 * SPEED_UNIT, rel=0.03)


def test_a_limp_joint_swings_and_comes_to_rest_below():
    shafts = shafts_of(ShaftConfig(gravity=0.4, load_inertia=0.004, angle=1.0))
    angles = path(shafts, seconds=3.0)
    assert angles.min() < 0.0
    assert abs(angles[-1]) < math.asin(0.05 / 0.4) + 0.01
    assert angles[-1] == angles[-2]


def test_dry_friction_holds_a_weight_exactly():
    shafts = shafts_of(ShaftConfig(gravity=0.04, angle=1.5))
    shafts.advance(100.0)
    assert shafts.state(0).angle == 1.5


def test_a_held_weight_hangs_by_its_torque_over_the_stiffness():
    config = ShaftConfig(gravity=0.5, servo=replace(bench_servo(), coulomb_friction=0.0, load_friction=0.0))
    shafts = shafts_of(config)
    shafts.drive(0, replace(ON, goal=MIDDLE + 300, punch=0))
    shafts.advance(2.0)
    angle = shafts.state(0).angle
    error = 0.5 * math.sin(angle) / config.servo.stiffness + config.servo.compliance_margin * COUNT
    assert 300 * COUNT - angle == pytest.approx(error, abs=COUNT)


def test_latency_shifts_the_response_and_nothing_else():
    now, late = shafts_of(ShaftConfig()), shafts_of(ShaftConfig(latency=0.02))
    for shafts in (now, late):
        shafts.drive(0, replace(ON, goal=560))
    prompt, delayed = path(now, seconds=0.2), path(late, seconds=0.22)
    np.testing.assert_allclose(delayed[20:], prompt, atol=1e-12)
    assert not delayed[:20].any()


def test_parameters_are_each_joints_own():
    slow = replace(bench_servo(), armature=0.007)
    rough = replace(bench_servo(), coulomb_friction=0.3)
    shafts = shafts_of(
        ShaftConfig(), ShaftConfig(servo=slow), ShaftConfig(servo=rough), ShaftConfig(gain=0.5)
    )
    for index in range(4):
        shafts.drive(index, replace(ON, goal=552))
    shafts.advance(0.05)
    angles = [shafts.state(index).angle for index in range(4)]
    assert all(angle < 0.95 * angles[0] for angle in angles[1:])


def test_margin_and_slope_differ_by_side():
    shafts = shafts_of(ShaftConfig(), ShaftConfig())
    for index, goal in enumerate((MIDDLE + 10, MIDDLE - 10)):
        shafts.drive(index, replace(ON, goal=goal, margin=(1, 5), slope=(128, 16), punch=0))
    shafts.advance(1e-3)
    assert shafts.state(0).load == pytest.approx(5 / 16)
    assert shafts.state(1).load == pytest.approx(-9 / 128)


def test_a_torque_limit_bounds_the_duty_and_off_is_limp():
    shafts = shafts_of(ShaftConfig())
    shafts.drive(0, replace(ON, goal=800, torque_limit=300))
    shafts.advance(2e-3)
    assert shafts.state(0).load == pytest.approx(300 / 1023)
    shafts.drive(0, replace(ON, goal=800, enabled=False))
    shafts.advance(4e-3)
    assert shafts.state(0).load == 0.0
    assert shafts.torque(0) == 0.0


def test_play_leaves_a_gap_between_the_ways():
    stops = []
    for backlash in (0.0, 4.0):
        servo = replace(bench_servo(), backlash_deg=backlash, coulomb_friction=0.0, load_friction=0.0)
        config = ShaftConfig(servo=servo, gravity=0.2, gravity_angle=0.3)
        shafts = shafts_of(config)
        shafts.drive(0, replace(ON, goal=MIDDLE + 100))
        angles = path(shafts, seconds=1.0)
        stops.append(np.ptp(angles[-200:]))
    assert stops[1] > stops[0]  # it rattles in its play


def test_a_stalled_motor_warms_by_its_winding_loss():
    servo = replace(bench_servo(), coulomb_friction=10.0)
    shafts = shafts_of(ShaftConfig(servo=servo))
    shafts.drive(0, replace(ON, goal=800))
    shafts.advance(30.0)
    loss = winding_resistance(servo) * (current_per_torque(servo) * servo.stall_torque) ** 2
    warmer = servo.thermal_resistance * loss * (1.0 - math.exp(-30.0 / servo.thermal_time_constant))
    assert shafts.state(0).temperature == pytest.approx(servo.ambient + warmer, rel=1e-3)


def test_the_supply_sags_under_current():
    shafts = shafts_of(
        ShaftConfig(servo=replace(bench_servo(), coulomb_friction=10.0)),
        supply=Supply(voltage=12.0, resistance=1.0, standby_current=0.1),
    )
    assert shafts.state(0).voltage == pytest.approx(12.0)
    shafts.drive(0, replace(ON, goal=800))
    shafts.advance(0.1)
    # Stall draws V / R of the winding in series with the supply.
    winding = winding_resistance(bench_servo())
    expected = 12.0 * winding / (winding + 1.0)
    assert shafts.state(0).voltage == pytest.approx(expected, abs=0.15)
    shafts.set_supply(6.0)
    shafts.advance(0.2)
    assert shafts.state(0).voltage < 6.0


def test_one_long_wait_is_many_short_ones():
    ends = []
    for steps in (1, 7, 900):
        shafts = shafts_of(ShaftConfig(gravity=0.3), ShaftConfig(latency=0.05), supply=Supply())
        for goal in (600, 450):
            shafts.drive(0, replace(ON, goal=goal, speed=200))
            shafts.drive(1, replace(ON, goal=goal))
            begin = 0.0 if goal == 600 else 2.0
            for k in range(steps):
                shafts.advance(begin + 2.0 * (k + 1) / steps)
        ends.append([(shafts.state(i).angle, shafts.state(i).temperature) for i in range(2)])
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-6)
    np.testing.assert_allclose(ends[2], ends[0], rtol=1e-6)


def test_time_may_begin_anywhere_and_never_goes_back():
    shafts = OwnShafts(1)
    shafts.advance(1e6)
    shafts.drive(0, replace(ON, goal=600))
    shafts.advance(1e6 + 0.5)
    angle = shafts.state(0).angle
    assert angle > 0.4
    shafts.advance(0.0)
    assert shafts.state(0).angle == angle


def test_a_joint_can_be_turned_by_hand():
    shafts = shafts_of(ShaftConfig())
    shafts.turn(0, 0.7)
    shafts.advance(1.0)
    assert shafts.state(0).angle == 0.7


@pytest.mark.parametrize(
    "make",
    [
        lambda: OwnShafts(0),
        lambda: ShaftConfig(gain=0.0),
        lambda: ShaftConfig(latency=-1.0),
        lambda: Supply(voltage=0.0),
        lambda: OwnShafts(1).set_supply(-1.0),
        lambda: OwnShafts(1).turn(0, math.nan),
    ],
)
def test_the_impossible_is_refused(make):
    with pytest.raises(ConfigurationError):
        make()
