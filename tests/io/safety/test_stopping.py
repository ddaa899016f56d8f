"""Controlled stops: by the controller, by the supervisor in its place, and their ends."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.io.safety import SafetyConfig, SafetyState
from bluefoot_mpc.io.safety.sink import Sink, SinkConfig, advance
from tests.io.safety.scripted import PERIOD, SIT, FakePoweredRobot, FakeRobot, goal, play, supervise


@pytest.fixture
def fake():
    return FakePoweredRobot()


@pytest.fixture
def supervisor(fake):
    made = supervise(fake)
    made.watch_over(SIT)
    made.reset()
    fake.sent.clear()
    return made


def expect_lowered(fake, sit=SIT):
    """Goals moved slowly to `sit`, under all torque; torque faded there; then the robot was disarmed."""
    goals = np.array([command.position for command in fake.sent])
    torque = np.array([command.torque_limit.max() for command in fake.sent])
    fading = int(np.flatnonzero(torque < 1.0)[0])
    assert np.abs(np.diff(goals, axis=0)).max() <= SinkConfig().speed * PERIOD + 1e-9
    np.testing.assert_allclose(goals[fading:], np.broadcast_to(sit, goals[fading:].shape), atol=1e-9)
    assert np.all(np.diff(torque[fading:]) <= 0.0)
    assert torque[-1] == 0.0
    assert (torque[fading:] > 0.0).sum() * PERIOD == pytest.approx(SinkConfig().limp_time, abs=0.05)


def test_a_controlled_stop_lowers_the_robot_and_switches_it_off(supervisor, fake):
    supervisor.controlled_stop("the run is over")
    expect_lowered(fake)
    assert fake.log[-1] == "disarm"
    assert supervisor.state is SafetyState.STOPPED
    assert supervisor.request.reasons == ("the run is over",)
    assert fake.time < 5.0
    supervisor.controlled_stop("again")
    assert fake.log.count("disarm") == 1


def test_a_limp_robot_is_not_moved_by_a_controlled_stop(supervisor, fake):
    supervisor.step(goal(0.3, torque=0.0))
    supervisor.controlled_stop("the run is over")
    assert fake.time - 1.0 < 0.5
    assert all(not command.torque_limit.any() for command in fake.sent)
    assert fake.log[-1] == "disarm"


def test_afterwards_the_latch_holds_until_armed_anew(supervisor, fake):
    supervisor.controlled_stop("the run is over")
    moved = len(fake.moved)
    play(supervisor, 0.5, goal(0.9))
    assert len(fake.moved) == moved
    assert not fake.sent[-1].torque_limit.any()
    supervisor.arm()
    assert supervisor.state is SafetyState.ACTIVE


def test_a_robot_that_was_switched_off_is_not_called_broken(supervisor, fake):
    supervisor.controlled_stop("the run is over")
    fake.changes = {"voltage": 0.0, "joint_valid": np.zeros(16, dtype=bool)}
    fake.account = replace(fake.account, power_on=False)
    play(supervisor, 3.0)
    assert supervisor.request.reasons == ("the run is over",)
    assert supervisor.state is SafetyState.STOPPED


def test_without_a_sitting_posture_it_sinks_where_it_stands(fake):
    supervisor = supervise(fake)
    supervisor.reset()
    fake.sent.clear()
    supervisor.controlled_stop("the run is over")
    for command in fake.sent:
        np.testing.assert_array_equal(command.position, 0.3)
    torque = [command.torque_limit.max() for command in fake.sent]
    assert sum(0.0 < value < 1.0 for value in torque) * PERIOD == pytest.approx(1.0, abs=0.05)
    assert fake.log[-1] == "disarm"


def test_a_simulated_robot_is_lowered_as_well():
    fake = FakeRobot()
    supervisor = supervise(fake)
    supervisor.watch_over(SIT)
    supervisor.reset()
    play(supervisor, 0.1, goal(0.1))
    supervisor.controlled_stop("the run is over")
    assert supervisor.state is SafetyState.STOPPED
    np.testing.assert_allclose(fake.sent[-1].position, SIT)
    assert not fake.sent[-1].torque_limit.any()


def test_a_leg_that_is_off_stays_off_while_the_robot_is_lowered(supervisor, fake):
    fake.changes = {"joint_temperature": np.where(np.arange(16) == 6, 69.0, 30.0)}
    play(supervisor, 0.1)
    fake.sent.clear()
    supervisor.controlled_stop("hot")
    for command in fake.sent:
        np.testing.assert_array_equal(command.torque_limit[4:8], 0.0)


def test_a_robot_that_is_lost_on_the_way_is_stopped_at_once(supervisor, fake):
    def lose():
        if len(fake.sent) > 30:
            raise LinkLostError("unplugged")

    fake.at_step = lose
    supervisor.controlled_stop("the run is over")
    assert fake.log[-1] == "stop"
    assert supervisor.state is SafetyState.EMERGENCY


def test_the_controller_may_do_it_itself(supervisor, fake):
    supervisor.step(goal(np.nan))
    assert supervisor.state is SafetyState.STOPPING
    play(supervisor, 2.0, goal(0.2))
    np.testing.assert_allclose(fake.sent[-1].position, 0.2)
    play(supervisor, 0.2, goal(0.2, torque=0.0))
    assert supervisor.state is SafetyState.STOPPED
    assert fake.log[-1] == "disarm"


def test_a_controller_that_does_not_stop_is_relieved(supervisor, fake):
    fake.changes = {"joint_temperature": np.where(np.arange(16) == 6, 69.0, 30.0)}
    play(supervisor, 5.9, goal(0.1))
    np.testing.assert_allclose(fake.sent[-1].position, 0.1)
    fake.sent.clear()
    play(supervisor, 4.0, goal(0.1))
    assert fake.log[-1] == "disarm"
    np.testing.assert_allclose(fake.sent[-1].position, SIT)


def test_a_controller_that_gives_nothing_usable_is_held_then_relieved(supervisor, fake):
    play(supervisor, 0.48, goal(np.nan))
    for command in fake.sent:
        np.testing.assert_array_equal(command.position, 0.3)
        np.testing.assert_array_equal(command.torque_limit, 1.0)
    fake.sent.clear()
    play(supervisor, 4.0, goal(np.nan))
    expect_lowered(fake)
    assert fake.log[-1] == "disarm"


def test_once_relieved_the_controller_does_not_come_back(supervisor, fake):
    play(supervisor, 0.6, goal(np.nan))
    fake.sent.clear()
    play(supervisor, 4.0, goal(0.9))
    expect_lowered(fake)


def test_a_controller_that_asks_for_no_torque_ends_the_session(supervisor, fake):
    play(supervisor, 0.08, goal(0.3, torque=0.0))
    assert supervisor.state is SafetyState.ACTIVE
    play(supervisor, 0.1, goal(0.3, torque=0.0))
    assert supervisor.state is SafetyState.STOPPED
    assert fake.log[-1] == "disarm"
    play(supervisor, 0.2, goal(0.3))
    assert not fake.sent[-1].torque_limit.any()  # standing up again takes arming again


def test_a_run_may_end_when_the_robot_is_limp_not_when_the_controller_says_so(supervisor, fake):
    assert not supervisor.limp
    play(supervisor, 0.6, goal(np.nan))
    play(supervisor, 0.1, goal(0.3, torque=0.0))
    assert not supervisor.limp  # the supervisor is lowering it
    play(supervisor, 4.0, goal(0.3, torque=0.0))
    assert supervisor.limp
    simulated = supervise(FakeRobot())
    simulated.reset()
    for torque in (1.0, 0.0, 1.0):
        simulated.step(goal(0.0, torque=torque))
        assert simulated.limp == (torque == 0.0)


def test_a_simulated_robot_may_be_limp_and_stand_up_again():
    fake = FakeRobot()
    supervisor = supervise(fake)
    supervisor.reset()
    play(supervisor, 1.0, goal(0.1, torque=0.0))
    play(supervisor, 0.1, goal(0.1))
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, 1.0)


def test_stop_is_the_end_in_any_case(supervisor, fake):
    supervisor.stop()
    assert fake.latched
    assert supervisor.state is SafetyState.STOPPED
    supervisor.close()
    assert fake.latched


def test_sinking_brings_all_joints_home_together():
    config, start = SinkConfig(), np.linspace(1.0, -1.0, 16)
    lower, ways = Sink(goal=start, torque=np.ones(16)), []
    while lower.share == 1.0:
        ways.append(SIT - lower.goal)
        lower = advance(lower, SIT, PERIOD, config)
    ways = np.array(ways)[:-1]
    np.testing.assert_allclose(ways / ways[:, :1], np.broadcast_to(ways[0] / ways[0, 0], ways.shape))
    assert len(ways) * PERIOD == pytest.approx(1.4 / config.speed, abs=0.05)


@pytest.mark.parametrize("bad", [{"speed": 0.0}, {"limp_time": -1.0}, {"blind_time": float("nan")}])
def test_sinking_needs_positive_figures(bad):
    with pytest.raises(ConfigurationError):
        SafetyConfig(sink=SinkConfig(**bad))
