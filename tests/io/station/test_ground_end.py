"""The station's end: sticks, orders until they are answered, and what it knows of the link."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground_end import GroundEnd
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.types import Mode, MotionCommand

from .made_up import OFF, SIT, STAND, WALK, Peer, sent


@pytest.fixture
def ground():
    return GroundEnd(StationConfig(), 0.0)


def commands(ground, start, seconds, step=0.02):
    """(time, COMMAND_LONG) that leave in a while."""
    peer, found = Peer(), []
    for tick in range(round(seconds / step)):
        now = start + step * tick
        messages = peer.parse(sent(ground, now))
        found += [(now, message) for message in messages if message.get_type() == "COMMAND_LONG"]
    return found


def sticks(ground, now):
    (message,) = [m for m in Peer().parse(sent(ground, now)) if m.get_type() == "MANUAL_CONTROL"][-1:]
    return message


ROBOT = Peer(1, 1)


def ack(number, result=mavlink.MAV_RESULT_ACCEPTED):
    return ROBOT.pack(mavlink.MAVLink_command_ack_message(number, result))


def test_a_station_that_only_looks_asks_for_nothing(ground):
    assert commands(ground, 0.0, 5.0) == []
    ground.steer(MotionCommand(), 5.0)
    assert commands(ground, 5.0, 1.0) == []


def test_sticks_leave_as_they_are_held_and_are_centred_when_nobody_holds_them(ground):
    ground.steer(MotionCommand(mode=Mode.WALK, velocity=np.array([0.05, 0.0])), 0.0)
    assert sticks(ground, 0.1).x == 500
    assert sticks(ground, 0.45).x == 500
    assert sticks(ground, 0.6).x == 0


@pytest.mark.parametrize(
    ("mode", "number"), [(Mode.STAND, STAND), (Mode.WALK, WALK), (Mode.SIT, SIT), (Mode.OFF, OFF)]
)
def test_another_mode_or_gait_is_asked_for_once(ground, mode, number):
    ground.steer(MotionCommand(mode=mode, gait="walk"), 0.0)
    ((_, message),) = commands(ground, 0.0, 0.3)
    assert message.command == mavlink.MAV_CMD_DO_SET_MODE
    assert (message.param1, message.param2, message.param3) == (1.0, number, 2.0)
    ground.receive(ack(message.command), 0.3)
    ground.steer(MotionCommand(mode=mode, gait="walk"), 0.3)
    assert commands(ground, 0.3, 2.0) == []
    assert ground.orders[-1].result == "accepted"


def test_orders_are_repeated_until_they_are_answered(ground):
    ground.ask(Order.STOP, 0.0)
    tries = commands(ground, 0.0, 1.3)
    assert [round(time, 1) for time, _ in tries] == [0.0, 0.4, 0.8, 1.2]
    assert [message.confirmation for _, message in tries] == [0, 1, 2, 3]
    ground.receive(ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM), 1.3)
    assert commands(ground, 1.3, 2.0) == []


def test_an_order_that_is_never_answered_says_so(ground):
    ground.ask(Order.SIT, 0.0)
    assert len(commands(ground, 0.0, 10.0)) == 8
    assert ground.orders[-1].result == "no answer"


def test_arming_may_take_its_time(ground):
    ground.ask(Order.ARM, 0.0)
    commands(ground, 0.0, 0.1)
    ground.receive(ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_IN_PROGRESS), 0.1)
    assert commands(ground, 0.1, 5.0) == []
    assert ground.orders[-1].result == ""
    ground.receive(ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_RESULT_FAILED), 5.1)
    assert ground.orders[-1].result == "failed"


def test_a_stop_is_never_given_up_for_anything_but_arming(ground):
    ground.ask(Order.WALK, 0.0)
    ground.ask(Order.STOP, 0.0)
    ground.ask(Order.STAND, 0.1)
    assert [pending.result for pending in ground.orders] == ["replaced", "", ""]
    numbers = {message.command for _, message in commands(ground, 0.1, 0.3)}
    assert mavlink.MAV_CMD_COMPONENT_ARM_DISARM in numbers
    ground.ask(Order.ARM, 0.5)
    assert ground.orders[1].result == "replaced"


def test_after_a_stop_sticks_ask_for_nothing(ground):
    ground.ask(Order.STOP, 0.0)
    ground.receive(ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM), 0.0)
    commands(ground, 0.0, 0.1)
    ground.receive(ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM), 0.1)
    ground.steer(MotionCommand(mode=Mode.WALK), 0.2)
    assert commands(ground, 0.2, 1.0) == []
    ground.ask(Order.ARM, 1.2)
    commands(ground, 1.2, 0.1)
    ground.steer(MotionCommand(mode=Mode.WALK), 1.4)
    assert [message.param2 for _, message in commands(ground, 1.4, 0.1)][-1:] == [WALK]


def test_an_emergency_stop_carries_the_magic_number(ground):
    ground.ask(Order.EMERGENCY, 0.0)
    ((_, message),) = commands(ground, 0.0, 0.1)
    assert (message.param1, message.param2) == (0.0, 21196.0)


def test_lost_messages_are_counted(ground):
    robot = Peer(1, 1)
    frames = [robot.pack(mavlink.MAVLink_statustext_message(6, b"hello")) for _ in range(20)]
    for frame in frames[:5] + frames[10:]:
        ground.receive(frame, 0.0)
    assert (ground.guard.taken, ground.guard.lost) == (15, 5)
    assert ground.guard.loss == 0.25


def test_only_the_robot_is_listened_to(ground):
    assert ground.receive(Peer(7, 1).heartbeat(), 0.0) == 0
    assert ground.picture.arrived == {}
