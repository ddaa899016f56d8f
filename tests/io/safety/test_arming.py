from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.io.robot import PoweredRobot, Robot
from bluefoot_mpc.io.safety import ArmingInterruptedError, SafetyConfig, SafetyState, Watched
from tests.io.safety.scripted import SIT, FakePoweredRobot, FakeRobot, goal, play, refusal, supervise


@pytest.fixture
def fake():
    return FakePoweredRobot()


@pytest.fixture
def supervisor(fake):
    return supervise(fake)


def test_the_fakes_are_what_they_stand_for(fake):
    assert isinstance(fake, PoweredRobot)
    assert isinstance(fake, Watched)
    assert isinstance(FakeRobot(), Robot)
    assert not isinstance(FakeRobot(), PoweredRobot)


def test_a_robot_without_power_of_its_own_is_not_armed():
    fake = FakeRobot()
    supervisor = supervise(fake)
    supervisor.reset()
    assert supervisor.state is SafetyState.ACTIVE
    assert fake.sent == []
    assert fake.stops == 0


def test_arming_goes_in_order_and_holds_what_it_found(supervisor, fake):
    assert supervisor.state is SafetyState.DISARMED
    frame = supervisor.reset()
    assert fake.log == ["reset", "preflight", "arm"]
    assert fake.armed_with == SafetyConfig().arming_torque
    assert supervisor.state is SafetyState.ACTIVE
    for command in fake.sent:
        np.testing.assert_array_equal(command.position, 0.3)
    torque = np.array([command.torque_limit for command in fake.sent])
    assert (torque == torque[:, :1]).all()
    np.testing.assert_allclose(torque[0], 0.3, atol=0.02)
    assert np.all(np.diff(torque[:, 0]) > 0.0)
    assert len(fake.sent) * fake.period == pytest.approx(1.0, abs=0.05)
    assert frame.time == pytest.approx(fake.time)


def test_a_joint_that_lies_beyond_its_limit_is_held_at_it(supervisor, fake):
    fake.position = np.where(np.arange(16) == 3, 1.05, 0.3)
    supervisor.reset()
    for command in fake.sent:
        np.testing.assert_array_equal(command.position, np.where(np.arange(16) == 3, 1.0, 0.3))
    assert supervisor.warnings == ()


def test_refusals_keep_the_torque_off_and_are_all_told(supervisor, fake):
    warning = Finding(part="port", text="no latency timer", severity=Severity.WARNING)
    fake.findings = (refusal("no reply"), warning, replace(refusal("model is 18"), part="servo 9"))
    with pytest.raises(NotArmedError) as caught:
        supervisor.reset()
    assert "servo 7 (FR_knee): no reply" in str(caught.value)
    assert "servo 9: model is 18" in str(caught.value)
    assert "arm" not in fake.log
    assert fake.log[-1] == "stop"
    assert fake.sent == []
    assert supervisor.state is SafetyState.DISARMED


def test_warnings_are_kept_and_do_not_refuse(supervisor, fake):
    fake.findings = (
        Finding(part="port", text="no latency timer", mend="Nothing to do", severity=Severity.WARNING),
        Finding(part="servo 1", text="firmware 24", severity=Severity.NOTE),
    )
    supervisor.reset()
    assert supervisor.warnings == ("port: no latency timer. Nothing to do",)
    assert supervisor.request.reasons == ()


def test_a_servo_that_refuses_to_be_armed_leaves_no_torque(supervisor, fake):
    def refuse():
        raise NotArmedError([refusal("goal was not taken")])

    fake.at_arm = refuse
    with pytest.raises(NotArmedError, match="goal was not taken"):
        supervisor.reset()
    assert fake.log[-1] == "stop"
    assert supervisor.state is SafetyState.DISARMED


def test_a_joint_that_is_nowhere_is_not_held(supervisor, fake):
    fake.changes = {"joint_position": np.where(np.arange(16) == 3, np.nan, 0.3)}
    with pytest.raises(NotArmedError, match="position of a servo is not known"):
        supervisor.reset()
    assert fake.sent == []
    assert fake.latched


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"voltage": 10.0}, "battery low"),
        ({"joint_temperature": np.full(16, 66.0)}, "hot"),
        ({"joint_valid": lambda time: np.full(16, time < 0.1)}, "lost joint readings"),
    ],
)
def test_a_fault_while_the_torque_rises_takes_it_away(supervisor, fake, changes, told):
    fake.changes = changes
    with pytest.raises(NotArmedError, match=told):
        supervisor.reset()
    assert fake.latched
    assert fake.log[-1] == "stop"
    assert supervisor.state is SafetyState.DISARMED
    sent = len(fake.moved)
    play(supervisor, 0.2)
    assert len(fake.moved) == sent


def test_a_signal_while_the_torque_rises_takes_it_away_within_a_step(supervisor, fake):
    def signal():
        if len(fake.sent) == 20:
            supervisor.interrupt()

    fake.at_step = signal
    with pytest.raises(ArmingInterruptedError, match="somebody ended the arming"):
        supervisor.reset()
    assert len(fake.sent) == 20
    assert fake.latched


@pytest.mark.parametrize("hook", ["at_arm", "at_step"])
def test_an_emergency_stop_while_arming(supervisor, fake, hook):
    setattr(fake, hook, lambda: supervisor.emergency("red button"))
    with pytest.raises(ArmingInterruptedError, match="red button"):
        supervisor.reset()
    assert supervisor.state is SafetyState.EMERGENCY
    assert fake.latched
    assert len(fake.sent) <= 1


def test_an_emergency_stop_before_arming_is_not_overheard(supervisor, fake):
    fake_reset = fake.reset

    def reset():
        supervisor.emergency("red button")
        return fake_reset()

    fake.reset = reset
    with pytest.raises(ArmingInterruptedError, match="red button"):
        supervisor.reset()
    assert "arm" not in fake.log


@pytest.mark.parametrize("error", [KeyboardInterrupt, LinkLostError])
def test_whatever_ends_the_arming_takes_the_torque_off(supervisor, fake, error):
    def fail():
        if len(fake.sent) == 10:
            raise error("gone")

    fake.at_step = fail
    with pytest.raises(error):
        supervisor.reset()
    assert fake.latched
    assert supervisor.state is SafetyState.DISARMED


def test_it_is_armed_anew_only_when_asked(supervisor, fake):
    supervisor.reset()
    supervisor.emergency("red button")
    play(supervisor, 1.0)
    assert fake.latched
    supervisor.arm()
    assert supervisor.state is SafetyState.ACTIVE
    assert fake.log == ["reset", "preflight", "arm", "stop", "preflight", "arm"]
    assert supervisor.request.reasons == ()
    play(supervisor, 0.1)
    assert len(fake.moved) > 5


def test_a_robot_under_torque_is_not_armed_a_second_time(supervisor, fake):
    supervisor.reset()
    with pytest.raises(DeviceError, match="armed already"):
        supervisor.arm()
    assert not fake.latched


def test_arming_a_simulated_robot_anew_resets_it():
    supervisor = supervise(FakeRobot())
    supervisor.stop()
    supervisor.arm()
    assert supervisor.state is SafetyState.ACTIVE


def test_goals_start_from_where_the_joints_are(supervisor, fake):
    supervisor.reset()
    supervisor.step(goal(0.9))
    np.testing.assert_allclose(fake.sent[-1].position, 0.3 + 12.0 * 0.02)


def test_the_sitting_posture_reaches_the_robot(supervisor, fake):
    supervisor.watch_over(SIT)
    np.testing.assert_array_equal(fake.sit, SIT)
