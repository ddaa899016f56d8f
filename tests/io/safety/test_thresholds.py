"""Every threshold of the supervisor, from below and from above."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity
from bluefoot_mpc.io.safety import GuardState, Health, SafetyConfig, SafetyState
from bluefoot_mpc.types import SafetyLevel
from tests.io.safety.scripted import (
    PERIOD,
    FakePoweredRobot,
    FakeRobot,
    goal,
    make_frame,
    make_imu,
    play,
    supervise,
)


@pytest.fixture
def fake():
    return FakePoweredRobot()


@pytest.fixture
def supervisor(fake):
    made = supervise(fake)
    made.reset()
    return made


def seconds_until(supervisor, happened, longest=20.0):
    for k in range(round(longest / PERIOD)):
        if happened():
            return k * PERIOD
        supervisor.step(goal(0.3))
    return np.inf


def told(supervisor):
    return " | ".join((*supervisor.request.reasons, *supervisor.warnings))


# -- supply -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("volt", "level", "words"),
    [(10.85, 0, ""), (10.75, 0, "getting low"), (10.25, 0, "getting low"), (10.15, 2, "battery low"),
     (9.65, 2, "battery low"), (9.55, 3, "battery empty"), (9.05, 3, "battery empty")],
)  # fmt: skip
def test_a_steady_voltage(supervisor, fake, volt, level, words):
    fake.changes = {"voltage": volt}
    play(supervisor, 5.9)  # long enough for the filter, too short for the supervisor's patience
    assert supervisor.request.level == level
    assert words in told(supervisor)
    assert bool(words) == bool(told(supervisor))


def test_a_voltage_step_counts_after_the_filter(supervisor, fake):
    fake.changes = {"voltage": 9.0}
    # 12 - 3 (1 - exp(-t)) passes 10.8, 10.2 and 9.6 V after 0.51, 0.92 and 1.61 s.
    assert seconds_until(supervisor, lambda: supervisor.warnings) == pytest.approx(0.51, abs=0.04)
    assert seconds_until(supervisor, lambda: supervisor.state == "sitting") == pytest.approx(0.41, abs=0.06)
    assert seconds_until(supervisor, lambda: supervisor.state == "stopping") == pytest.approx(0.69, abs=0.06)


def test_a_voltage_ramp_warns_then_sits_then_stops_once_each(supervisor, fake):
    start = fake.time
    fake.changes = {"voltage": lambda time: 12.0 - 0.2 * (time - start)}
    order = []
    for _ in range(700):
        supervisor.step(goal(0.3))
        order += [text for text in (*supervisor.warnings, *supervisor.request.reasons) if text not in order]
    assert [text.split(" (")[0] for text in order] == ["battery getting low", "battery low", "battery empty"]


@pytest.mark.parametrize(("seconds", "state"), [(0.18, SafetyState.ACTIVE), (0.2, SafetyState.EMERGENCY)])
def test_a_supply_that_breaks_down_is_cut_at_once(supervisor, fake, seconds, state):
    fake.changes = {"voltage": 8.9}
    play(supervisor, seconds)
    fake.changes = {}
    play(supervisor, 0.1)
    assert supervisor.state is state
    assert fake.latched == (state is SafetyState.EMERGENCY)


def test_short_dips_do_not_add_up(supervisor, fake):
    for _ in range(20):
        fake.changes = {"voltage": 8.9}
        play(supervisor, 0.1)
        fake.changes = {}
        play(supervisor, 0.5)
    assert supervisor.state is not SafetyState.EMERGENCY


@pytest.mark.parametrize("missing", [{"voltage_valid": False}, {"voltage": np.nan}])
def test_an_unknown_voltage_holds_then_sits(supervisor, fake, missing):
    fake.changes = missing
    assert seconds_until(supervisor, lambda: supervisor.state == "hold") == pytest.approx(1.0, abs=0.05)
    fake.changes = {}
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.ACTIVE
    fake.changes = missing
    assert seconds_until(supervisor, lambda: supervisor.state == "sitting") == pytest.approx(5.0, abs=0.05)
    fake.changes = {}
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.SITTING


def test_a_late_frame_counts_for_its_time(supervisor, fake):
    fake.changes = {"voltage": 9.7}
    fake.time += 0.4
    supervisor.step(goal(0.3))
    assert not supervisor.warnings  # 12 - 0.42 * 2.3 = 11.0
    fake.time += 0.4
    supervisor.step(goal(0.3))
    assert "getting low" in told(supervisor)


# -- heat ---------------------------------------------------------------------------------------------------


def heat(degrees, joint=6):
    return {"joint_temperature": np.where(np.arange(16) == joint, degrees, 30.0)}


@pytest.mark.parametrize(
    ("degrees", "level", "words"),
    [(59.9, 0, ""), (60.0, 0, "warm"), (64.9, 0, "warm"), (65.0, 2, "hot"), (67.9, 2, "hot"),
     (68.0, 3, "leg FR is switched off")],
)  # fmt: skip
def test_heat(supervisor, fake, degrees, level, words):
    fake.changes = heat(degrees)
    play(supervisor, 0.1)
    assert supervisor.request.level == level
    assert words in told(supervisor)
    assert not words or "FR_knee" in told(supervisor)


@pytest.mark.parametrize(
    ("degrees", "limit"), [(59.9, 1.0), (60.0, 1.0), (62.5, 0.85), (65.0, 0.7), (67.0, 0.7)]
)
def test_a_warm_servo_gets_less_torque_and_the_others_all(supervisor, fake, degrees, limit):
    fake.changes = heat(degrees)
    play(supervisor, 0.1)
    expected = np.where(np.arange(16) == 6, limit, 1.0)
    np.testing.assert_allclose(fake.sent[-1].torque_limit, expected)
    fake.changes = heat(50.0)
    play(supervisor, 0.1)
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, 1.0)


def test_the_leg_of_a_servo_that_is_too_hot_stays_off(supervisor, fake):
    fake.changes = heat(68.0)
    play(supervisor, 0.1)
    off = np.repeat([False, True, False, False], 4)
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, np.where(off, 0.0, 1.0))
    fake.changes = heat(40.0)
    play(supervisor, 1.0)
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, np.where(off, 0.0, 1.0))
    assert supervisor.state is SafetyState.STOPPING


def test_two_legs_may_be_too_hot(supervisor, fake):
    fake.changes = {"joint_temperature": np.where(np.isin(np.arange(16), (0, 15)), [70.0], 30.0)}
    play(supervisor, 0.1)
    assert "leg FL" in told(supervisor)
    assert "leg RR" in told(supervisor)
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, np.repeat([0.0, 1.0, 1.0, 0.0], 4))


def test_an_unknown_temperature_holds_then_sits(supervisor, fake):
    fake.changes = heat(np.nan)
    assert seconds_until(supervisor, lambda: supervisor.state == "hold") == pytest.approx(1.0, abs=0.05)
    assert "FR_knee" in told(supervisor)
    assert seconds_until(supervisor, lambda: supervisor.state == "sitting") == pytest.approx(4.0, abs=0.05)


# -- replies ------------------------------------------------------------------------------------------------


HALF = np.arange(16) < 8


@pytest.mark.parametrize(("age", "level"), [(0.06, SafetyLevel.NONE), (0.12, SafetyLevel.SIT)])
def test_servos_that_a_slow_adapter_left_no_time_for_are_not_lost_until_they_are_old(
    supervisor, fake, age, level
):
    fake.account = Health(power_on=True, put_off=tuple(range(8)))
    fake.changes = {"joint_valid": ~HALF, "joint_time": lambda time: np.where(HALF, time - age, time)}
    play(supervisor, 1.0)
    assert supervisor.request.level == level
    fake.account = Health(power_on=True)
    play(supervisor, 1.0)
    assert supervisor.request.level == SafetyLevel.SIT


@pytest.mark.parametrize(("age", "is_armed"), [(0.06, True), (0.12, False)])
def test_a_position_that_was_read_a_moment_ago_is_enough_to_arm(fake, age, is_armed):
    fake.account = Health(power_on=True, put_off=tuple(range(8)))
    fake.changes = {"joint_valid": ~HALF, "joint_time": lambda time: np.where(HALF, time - age, time)}
    made = supervise(fake)
    if is_armed:
        made.reset()
        np.testing.assert_array_equal(fake.moved[0].position, np.full(16, 0.3))
        assert fake.moved[0].torque_limit.all()
    else:
        with pytest.raises(NotArmedError, match="position of a servo is not known"):
            made.reset()


def losses(share, seed=0):
    generator = np.random.default_rng(seed)
    return lambda time: generator.random(16) >= share


def test_ten_percent_of_loss_changes_nothing(supervisor, fake):
    fake.changes = {"joint_valid": losses(0.1)}
    play(supervisor, 20.0)
    assert supervisor.state is SafetyState.ACTIVE
    assert told(supervisor) == ""


def test_thirty_percent_of_loss_makes_it_sit_and_is_forgiven(supervisor, fake):
    fake.changes = {"joint_valid": losses(0.3)}
    assert seconds_until(supervisor, lambda: supervisor.state == "sitting") < 0.6
    assert "lost joint readings" in told(supervisor)
    fake.changes = {}
    assert seconds_until(supervisor, lambda: supervisor.state == "active") <= 0.5


@pytest.mark.parametrize(("ticks", "state"), [(5, SafetyState.ACTIVE), (6, SafetyState.SITTING)])
def test_more_than_a_fifth_of_the_window(supervisor, fake, ticks, state):
    fake.changes = {"joint_valid": np.zeros(16, dtype=bool)}
    play(supervisor, ticks * PERIOD)
    fake.changes = {}
    play(supervisor, 0.1)
    assert supervisor.state is state  # 5 of 25 frames are a fifth, and not more


def test_old_readings_count_as_lost(supervisor, fake):
    fake.changes = {"joint_time": lambda time: np.full(16, time - 0.09)}
    play(supervisor, 1.0)
    assert supervisor.state is SafetyState.ACTIVE
    fake.changes = {"joint_time": lambda time: np.full(16, time - 0.11)}
    play(supervisor, 0.2)
    assert supervisor.state is SafetyState.SITTING


def test_a_single_servo_that_stays_silent_makes_it_sit_for_good(supervisor, fake):
    fake.changes = {"joint_valid": np.arange(16) != 9}
    assert seconds_until(supervisor, lambda: supervisor.state == "sitting") == pytest.approx(0.5, abs=0.05)
    assert "RL_hip_pitch" in told(supervisor)
    fake.changes = {}
    play(supervisor, 2.0)
    assert supervisor.state is SafetyState.SITTING


def test_a_bus_that_was_away_for_a_while_is_forgiven(supervisor, fake):
    fake.changes = {"joint_valid": np.zeros(16, dtype=bool)}
    play(supervisor, 0.7)  # s that a USB adapter takes to come back
    assert supervisor.state is SafetyState.SITTING
    fake.changes = {}
    assert seconds_until(supervisor, lambda: supervisor.state == "active") <= 0.5


# -- inertial samples and frames ----------------------------------------------------------------------------


FROZEN = replace(make_imu(1.0), gyro=np.full((4, 3), 0.01), accel=np.full((4, 3), 5.0))
BAD_IMU = {
    "silent": lambda time: make_imu(time, 0),
    "frozen": lambda time: replace(FROZEN, time=make_imu(time).time),
    "not finite": lambda time: replace(make_imu(time), gyro=np.full((4, 3), np.nan)),
    "invalid": lambda time: replace(make_imu(time), valid=np.zeros(4, dtype=bool)),
    "of yesterday": lambda time: make_imu(time - 5.0),
    "of tomorrow": lambda time: make_imu(time + 5.0),
}


@pytest.mark.parametrize("imu", BAD_IMU.values(), ids=BAD_IMU)
def test_inertial_samples_that_cannot_be_used_hold_then_sit(supervisor, fake, imu):
    fake.changes = {"imu": imu}
    assert seconds_until(supervisor, lambda: supervisor.state == "hold") == pytest.approx(
        0.13, abs=0.02
    )  # frozen ones are new once
    fake.changes = {}
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.ACTIVE
    fake.changes = {"imu": imu}
    assert seconds_until(supervisor, lambda: supervisor.state == "sitting") == pytest.approx(1.02, abs=0.03)
    assert supervisor.request.level is SafetyLevel.SIT


def test_a_robot_without_inertial_samples_may_be_simulated():
    supervisor = supervise(FakeRobot())
    supervisor.reset()
    play(supervisor, 3.0)
    assert supervisor.request.level is SafetyLevel.NONE


def test_frames_whose_time_stands_still_stop_the_robot(supervisor, fake):
    time = fake.time
    fake.changes = {"time": time, "imu": lambda now: make_imu(time)}
    play(supervisor, 0.2)
    assert supervisor.state is SafetyState.STOPPING
    assert "does not go on" in told(supervisor)


# -- the robot's own account --------------------------------------------------------------------------------


def test_power_switched_off_by_the_board_is_an_emergency(supervisor, fake):
    fake.account = Health(power_on=False)
    supervisor.step(goal(0.3))
    assert supervisor.state is SafetyState.EMERGENCY
    assert fake.latched  # servos that come back with the power must stay without torque
    assert "power board" in told(supervisor)


@pytest.mark.parametrize(("late", "armed"), [(0.4, True), (0.6, False)])
def test_the_board_may_take_a_moment_to_say_that_power_is_on(late, armed):
    fake = FakePoweredRobot()
    supervisor = supervise(fake)
    fake.account = Health(power_on=False)

    def switch_on():
        if fake.time > late:
            fake.account = Health(power_on=True)

    fake.at_step = switch_on
    if armed:
        supervisor.reset()
        assert supervisor.state is SafetyState.ACTIVE
    else:
        with pytest.raises(NotArmedError, match="power board"):
            supervisor.reset()
        assert fake.latched


@pytest.mark.parametrize("field", ["shut_down", "restarted"])
def test_a_servo_without_torque_is_never_silently_enabled_again(supervisor, fake, field):
    fake.account = Health(power_on=True, **{field: (6,)})
    supervisor.step(goal(0.3))
    fake.account = Health(power_on=True)
    play(supervisor, 1.0)
    assert supervisor.state is SafetyState.STOPPING
    assert "FR_knee" in told(supervisor)
    for command in fake.sent[-49:]:
        np.testing.assert_array_equal(command.torque_limit > 0.0, np.arange(16) != 6)


def test_many_servos_are_told_of_at_once(supervisor, fake):
    fake.account = Health(silent=tuple(range(16)))
    fake.changes = {"joint_valid": np.zeros(16, dtype=bool)}
    play(supervisor, 1.0)
    assert len(supervisor.warnings) == 1
    assert "lost joint readings (now: all servos)" in told(supervisor)
    fake.changes = {}
    fake.account = Health(restarted=tuple(range(16)))
    play(supervisor, 1.0)
    assert "16 of 16 servos are back" in told(supervisor)
    assert len(supervisor.request.reasons) <= 3
    assert supervisor.state is SafetyState.STOPPED  # there is no torque left to end the gait with
    assert fake.log[-1] == "disarm"


def test_a_guard_that_had_to_step_in_is_believed(supervisor, fake):
    fake.account = Health(guard=GuardState.HOLD)
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.ACTIVE
    fake.account = Health(guard=GuardState.SINK)
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.STOPPING
    fake.account = Health(guard=GuardState.OFF)
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.EMERGENCY


def test_the_rest_of_the_account(supervisor, fake):
    fake.account = Health(
        silent=(3,),
        findings=(
            Finding(part="port", text="latency timer 16 ms", mend="Set it to 1", severity=Severity.WARNING),
            Finding(part="port", text="fine", severity=Severity.NOTE),
        ),
    )
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.ACTIVE
    assert len(supervisor.warnings) == 2
    assert "FL_ankle" in told(supervisor)
    assert "Set it to 1" in told(supervisor)
    fake.account = Health(findings=(Finding(part="port", text="gone", severity=Severity.REFUSAL),))
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.SITTING


def test_a_watchdog_process_that_is_gone_makes_it_sit(supervisor, fake):
    fake.account = Health(watched=False)
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.SITTING


# -- commands -----------------------------------------------------------------------------------------------


def test_a_goal_that_jumps_by_500_counts_moves_slowly_and_is_told_once(supervisor, fake):
    before = fake.sent[-1].position
    for _ in range(3):
        supervisor.step(goal(0.3 - np.radians(500 * 0.293)))
    steps = np.diff([before, *(command.position for command in fake.sent[-3:])], axis=0)
    np.testing.assert_allclose(steps, -0.24)
    assert len(supervisor.warnings) == 1
    assert "jumped by 2.56 rad" in supervisor.warnings[0]


def test_goals_outside_the_limits_stop_there_and_are_told_once(supervisor, fake):
    for value in np.arange(0.3, 1.4, 0.2):
        supervisor.step(goal(value))
    assert fake.sent[-1].position.max() == 1.0
    assert len(supervisor.warnings) == 1
    assert "outside its limits" in supervisor.warnings[0]


# -- telling ------------------------------------------------------------------------------------------------


def test_each_thing_is_logged_once(supervisor, fake, caplog):
    fake.changes = {**heat(66.0), "voltage": 10.0}
    play(supervisor, 3.0)
    assert sum("FR_knee" in message for message in caplog.messages) == 1
    assert sum("battery low" in message for message in caplog.messages) == 1


def test_every_message_tells_a_way_out(supervisor, fake):
    fake.changes = {
        **heat(70.0), "voltage": 9.4, "joint_valid": np.arange(16) < 8, "imu": lambda time: make_imu(time, 0),
    }  # fmt: skip
    fake.account = Health(shut_down=(1,), restarted=(2,), silent=(3,), guard=GuardState.SINK, watched=False)
    play(supervisor, 3.0)
    texts = (*supervisor.request.reasons, *supervisor.warnings)
    assert len(texts) >= 9
    for text in texts:
        assert any(way in text for way in ("Check", "Charge", "Let it", "Sit the", "Look for")), text


@pytest.mark.parametrize(
    "bad",
    [
        {"voltage_warn": 10.0}, {"voltage_stop": 8.0}, {"temperature_warn": 66.0}, {"imu_sit": 0.05},
        {"unknown_sit": 0.5}, {"arming_torque": 0.0}, {"arming_torque": 1.5}, {"derated_torque": -0.1},
    ],
)  # fmt: skip
def test_thresholds_out_of_order_are_refused(bad):
    with pytest.raises(ConfigurationError):
        SafetyConfig(**bad)


def test_the_thresholds_of_the_specification():
    config = SafetyConfig()
    assert (config.voltage_warn, config.voltage_sit, config.voltage_stop) == (10.8, 10.2, 9.6)
    assert (config.voltage_cut, config.voltage_cut_time, config.voltage_time_constant) == (9.0, 0.2, 1.0)
    assert (config.temperature_warn, config.temperature_sit, config.temperature_stop) == (60.0, 65.0, 68.0)
    assert (config.max_silent_share, config.silence_window) == (0.2, 0.5)
    assert make_frame().voltage > config.voltage_warn
