"""The bus thread of a robot in real time, on an emulated robot whose clock is virtual."""

import time

import pytest

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.findings import NotArmedError
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.live import LiveRobot
from tests.io.servo_robot.test_arming_races import make, movers


@pytest.fixture
def live():
    on = make()
    robot = LiveRobot(on.robot._cycle._devices, on.robot._clock, DevicesConfig())
    robot.parts = on.parts
    yield robot
    robot.close()


def test_who_waits_for_a_bus_thread_that_has_failed_is_told_at_once(live):
    live.reset()

    def fails():
        raise RuntimeError("a bug")

    live._cycle.collect = fails
    begun = time.monotonic()
    while live._failure is None and time.monotonic() < begun + 5.0:
        time.sleep(0.001)
    with pytest.raises(DeviceError, match="the bus thread has ended: a bug"):
        live.preflight()
    live.disarm()
    assert time.monotonic() - begun < 10.0  # a job may take twice as long
    assert not any(servo.registers[24] for servo in live.parts.lines[0].all)


def test_a_stop_between_checks_and_arming_holds(live):
    live.reset()
    assert not [finding for finding in live.preflight() if finding.severity > 1]
    live.stop()
    moved = movers(live.parts.lines[0])
    with pytest.raises(NotArmedError, match="stopped the robot meanwhile"):
        live.arm(0.3)
    assert moved == []


def test_a_stop_while_it_is_armed_leaves_no_torque(live):
    live.reset()
    live.preflight()
    line = live.parts.lines[0]
    receive, count = line.receive, [0]

    def watched(data, when):
        receive(data, when)
        count[0] += 1
        if count[0] == 90:
            live._cycle.latch("red button")

    line.receive = watched
    with pytest.raises(NotArmedError):
        live.arm(0.3)
    live.stop()
    live.close()
    assert not any(servo.registers[24] for servo in line.all)
