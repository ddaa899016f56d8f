"""Both ends on a virtual line: how much of it they use, and what damage on it does."""

import itertools

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.commands import Wishes
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground_end import GroundEnd
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.io.station.signing import Signer
from bluefoot_mpc.types import Mode, MotionCommand, TrunkPose

from .made_up import WALK, Peer, sent, snapshot

BYTES = 5760.0
"""bytes/s of 57.6 kbps."""
RATES = {
    "HEARTBEAT": 1.0, "ATTITUDE": 25.0, "ACTUATOR_OUTPUT_STATUS": 10.0, "LOCAL_POSITION_NED": 5.0,
    "SYS_STATUS": 2.0, "BATTERY_STATUS": 2.0, "DEBUG_FLOAT_ARRAY": 1.0,
}  # fmt: skip
KEY = bytes(range(32))


def walking_robot(time):
    rng = np.random.default_rng(round(1e3 * time))
    return snapshot(time, mode=Mode.WALK, joint_position=rng.normal(size=16), rpy=0.1 * rng.normal(size=3))


def talk(robot, ground, seconds, damage=None):
    """Both ends for a while at 50 Hz; gives the bytes down and up."""
    down = up = b""
    for tick in range(round(seconds / 0.02)):
        now = 0.02 * tick
        robot.offer(walking_robot(now))
        wish = MotionCommand(mode=Mode.WALK, velocity=np.array([0.06, 0.01]), yaw_rate=0.1)
        ground.steer(wish, now)
        data = sent(robot, now)
        down += data
        ground.receive(data if damage is None else damage(data), now)
        data = sent(ground, now)
        up += data
        robot.receive(data if damage is None else damage(data), now)
    return down, up


def ends(key=None):
    signers = [None, None] if key is None else [Signer(key, lambda: 1.8e9), Signer(key, lambda: 1.8e9)]
    return RobotEnd(StationConfig(), 0.0, signers[0]), GroundEnd(StationConfig(), 0.0, signers[1])


def test_the_radio_is_used_as_specified():
    robot, ground = ends()
    down, up = talk(robot, ground, 20.0)
    # pymavlink counts, not we.
    kinds = [message.get_type() for message in Peer().parse(down)]
    for kind, rate in RATES.items():
        assert kinds.count(kind) / 20.0 == pytest.approx(rate, rel=0.06), kind
    raised = [message.get_type() for message in Peer().parse(up)]
    assert raised.count("MANUAL_CONTROL") / 20.0 == pytest.approx(25.0, rel=0.03)
    assert raised.count("HEARTBEAT") / 20.0 == pytest.approx(1.0, rel=0.06)
    share_down, share_up = len(down) / 20.0 / BYTES, len(up) / 20.0 / BYTES
    assert share_down == pytest.approx(0.41, abs=0.02)
    assert share_up == pytest.approx(0.105, abs=0.01)
    assert share_down + share_up <= 0.6


def test_with_signatures_and_a_tilted_trunk_the_line_still_has_room():
    robot, ground = ends(KEY)
    tilted = MotionCommand(
        mode=Mode.WALK, velocity=np.array([0.06, 0.01]), yaw_rate=0.1,
        trunk=TrunkPose(position=np.array([0, 0, 0.01]), rpy=np.full(3, 0.1)),
    )  # fmt: skip
    steer = ground.steer
    ground.steer = lambda motion, now: steer(tilted, now)
    down, up = talk(robot, ground, 20.0)
    assert (len(down) + len(up)) / 20.0 / BYTES <= 0.6
    kinds = [message.get_type() for message in Peer().parse(down)]
    # What does not fit is taken from all streams, not from the last of them.
    for kind, rate in RATES.items():
        assert 0.65 * rate <= kinds.count(kind) / 20.0 <= 1.06 * rate, kind


def test_texts_do_not_crowd_out_telemetry():
    robot, ground = ends()
    for tick in range(1000):
        robot.say(4, f"the {tick}th complaint about something that goes wrong all the time")
        robot.offer(walking_robot(0.02 * tick))
        ground.receive(sent(robot, 0.02 * tick), 0.02 * tick)
    used = sum(count.bytes for count in robot.writer.counts.values()) / 20.0 / BYTES
    assert used <= 0.45
    assert robot.writer.counts["ATTITUDE"].messages / 20.0 > 18.0
    assert len(ground.picture.texts) > 20


def test_a_blocked_line_keeps_only_the_newest():
    robot, ground = ends()
    robot.offer(walking_robot(0.0))
    sent(robot, 0.0)
    for tick in range(1, 500):
        robot.offer(walking_robot(0.02 * tick))
    ground.receive(sent(robot, 10.0), 10.0)
    assert ground.picture.time == pytest.approx(0.02 * 499, abs=1e-3)
    attitudes = robot.writer.counts["ATTITUDE"].messages
    assert attitudes <= 3


def test_a_robot_that_hangs_is_not_told_anew():
    robot, _ = ends()
    robot.offer(walking_robot(0.0))
    for tick in range(500):
        sent(robot, 0.02 * tick)
    assert robot.writer.counts["ATTITUDE"].messages == 1
    assert robot.writer.counts["HEARTBEAT"].messages == pytest.approx(10, abs=2)


def corrupted(rng, share):
    def damage(data):
        values = np.frombuffer(data, np.uint8).copy()
        hit = rng.random(values.size) < share
        values[hit] = rng.integers(0, 256, int(hit.sum()))
        return values.tobytes()

    return damage


def test_on_a_noisy_line_no_wrong_command_is_executed():
    """10 % of the bytes are wrong: what is executed is what was sent, or nothing."""
    rng = np.random.default_rng(5)
    robot, peer, damage = RobotEnd(StationConfig(), 0.0), Peer(), corrupted(rng, 0.1)
    wanted = {(0.0, 0.0, 0.0)}
    executed = 0
    robot.receive(peer.mode(WALK, 1), 0.0)
    for tick in range(20_000):
        now = 0.04 * tick
        x, y, r = (int(v) for v in rng.integers(-100, 101, 3))
        wanted.add((x, -y, r))
        parts = [peer.heartbeat(), peer.manual(x=x, y=y, r=r)]
        if tick % 10 == 0:
            parts.append(peer.mode(WALK, 1))
        executed += robot.receive(damage(b"".join(parts)), now)
        motion, _ = robot.inbox.command(now)
        assert motion.mode in (Mode.WALK, Mode.STAND)
        assert robot.inbox.wishes == Wishes()
        # Every axis is one that was sent: the greatest of them is 100 of 1000.
        assert np.abs(motion.velocity / [1e-4, 4e-5]).max() <= 100.001
        assert abs(motion.yaw_rate / 3e-4) <= 100.001
    assert executed > 2000
    assert robot.reader.bad > 10_000


def test_on_a_noisy_line_orders_still_get_through():
    rng = np.random.default_rng(6)
    robot, ground = ends()
    damage = corrupted(rng, 0.02)
    for tick in range(400):
        now = 0.02 * tick
        if tick == 50:
            ground.ask(Order.STOP, now)
        ground.receive(damage(sent(robot, now)), now)
        robot.receive(damage(sent(ground, now)), now)
    assert robot.inbox.wishes.stop
    assert ground.orders[-1].result == "accepted"


def test_repeated_frames_are_executed_once():
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer()
    arm = peer.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert robot.receive(arm + arm, 0.0) == 1
    robot.inbox.wishes.arm = False
    later = [peer.manual(x=5) for _ in range(10)]
    assert sum(robot.receive(frame, 0.04 * k) for k, frame in enumerate(later)) == 10
    assert robot.receive(arm, 0.4) == 0
    assert not robot.inbox.wishes.arm
    assert robot.guards[0].rejected == 2


def test_frames_out_of_order_are_not_executed():
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer()
    first, second, third = (peer.manual(x=100 * k) for k in (1, 2, 3))
    assert [robot.receive(frame, 0.0) for frame in (first, third, second)] == [1, 1, 0]


def test_a_station_that_starts_anew_is_heard_after_a_second():
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer()
    for tick in range(100):
        robot.receive(peer.manual(), 0.04 * tick)
    fresh = Peer()
    heard = [robot.receive(fresh.manual(x=1), 4.0 + 0.04 * tick) for tick in range(50)]
    assert not any(heard[:20])
    assert all(heard[30:])


def test_with_a_key_a_recorded_session_does_nothing():
    robot, ground = ends(KEY)
    _, up = talk(robot, ground, 5.0)
    ground.ask(Order.ARM, 5.0)
    arm = sent(ground, 5.0)
    assert robot.receive(arm, 5.0) > 0
    assert robot.inbox.wishes.arm
    robot.inbox.wishes.arm = False
    refused = robot.refused
    assert robot.receive(up + arm, 60.0) == 0
    assert not robot.inbox.wishes.arm
    assert robot.refused > refused + 100


def test_with_a_key_unsigned_commands_do_nothing():
    robot, _ = ends(KEY)
    assert robot.receive(Peer().command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), 0.0) == 0
    assert not robot.inbox.wishes.arm


@pytest.mark.parametrize(
    ("system", "target"), [(255, 2), (254, 1), (1, 1)], ids=["other robot", "other station", "echo"]
)
def test_messages_of_others_do_nothing(system, target):
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer(system)
    robot.receive(peer.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, target=target), 0.0)
    robot.receive(peer.manual(x=500, target=target), 0.0)
    assert not robot.inbox.wishes.arm
    assert robot.inbox.command(1.0)[1] == pytest.approx(1.0)


def test_answers_go_before_everything_and_say_what_came_of_it():
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer()
    robot.offer(walking_robot(0.0))
    robot.receive(peer.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), 0.0)
    first = peer.parse(sent(robot, 0.0))[0]
    assert (first.get_type(), first.result) == ("COMMAND_ACK", mavlink.MAV_RESULT_IN_PROGRESS)
    robot.armed("servo 7 (FR_knee) is hot")
    told = [
        message
        for tick in range(50)
        for message in peer.parse(sent(robot, 0.02 * tick))
        if message.get_type() in ("COMMAND_ACK", "STATUSTEXT")
    ]
    assert told[0].result == mavlink.MAV_RESULT_FAILED
    assert "servo 7 (FR_knee) is hot" in told[1].text


def test_a_change_of_mode_is_told_at_once():
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer()
    seen = []
    for tick in range(200):
        now = 0.02 * tick
        robot.offer(snapshot(now, mode=Mode.WALK if now >= 2.31 else Mode.STAND))
        beats = [m for m in peer.parse(sent(robot, now)) if m.get_type() == "HEARTBEAT"]
        seen += [(now, beat.custom_mode & 0xFF) for beat in beats]
    first = next(now for now, mode in seen if mode == WALK)
    assert first - 2.31 < 0.05


def test_the_same_text_is_told_once_in_a_while():
    robot, peer = RobotEnd(StationConfig(), 0.0), Peer()
    told = 0
    for tick in range(1000):
        robot.say(4, "velocity command is not finite: taken as zero")
        told += sum(m.get_type() == "STATUSTEXT" for m in peer.parse(sent(robot, 0.02 * tick)))
    assert told == pytest.approx(20.0 / 5.0, abs=1)


def test_nothing_ever_sleeps_past_its_time():
    robot, ground = ends()
    for tick, end in itertools.product(range(200), (robot, ground)):
        sent(end, 0.01 * tick)
        assert 0.0 <= end.wait(0.01 * tick) <= 0.3
