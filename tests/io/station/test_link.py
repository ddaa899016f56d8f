"""The robot's link on real ports: pymavlink on the other end, and lines that nobody reads."""

import contextlib
import os
import pty
import socket
import threading
import time
import tty

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.link import LinkError
from bluefoot_mpc.io.safety import CommandWatchdog
from bluefoot_mpc.io.station.ground import GroundLink, OperatorLog
from bluefoot_mpc.io.station.link import StationLink
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.source import LinkSource
from bluefoot_mpc.io.station.transport import Address
from bluefoot_mpc.types import Mode, MotionCommand

from .made_up import WALK, Peer, snapshot

pytestmark = pytest.mark.slow


def wait_for(condition, timeout=10.0):
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


class Station:
    """A UDP port with pymavlink behind it."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(5.0)
        self.address = f"udp:127.0.0.1:{self.socket.getsockname()[1]}"
        self.peer, self.robot = Peer(), None

    def hear(self, kind):
        while True:
            data, self.robot = self.socket.recvfrom(2048)
            for message in self.peer.parse(data):
                if message.get_type() == kind:
                    return message

    def tell(self, data):
        self.socket.sendto(data, self.robot)


@pytest.fixture
def station():
    made = Station()
    yield made
    made.socket.close()


def publish(link, time_=1.0, **fields):
    told = snapshot(time_, **fields)
    link.publish(told.telemetry, told.frame, "active")


def test_telemetry_and_commands_cross_udp(station):
    with StationLink(station.address) as link:
        publish(link, 2.0, rpy=np.array([0.1, 0.0, 0.0]))
        assert station.hear("ATTITUDE").roll == pytest.approx(0.1)
        assert not link.station_seen
        station.tell(station.peer.mode(WALK, 2))
        for _ in range(4):
            station.tell(station.peer.manual(x=500))
        wait_for(lambda: link.command(time.monotonic())[0].velocity[0] > 0.0)
        motion, age = link.command(time.monotonic())
        assert (motion.mode, motion.gait) == (Mode.WALK, "walk")
        assert motion.velocity[0] == pytest.approx(0.05)
        assert age < 2.0
        assert link.station_seen


def test_arming_is_answered_by_the_robots_owner(station):
    with StationLink(station.address) as link:
        station.hear("HEARTBEAT")
        station.tell(station.peer.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0))
        assert station.hear("COMMAND_ACK").result == mavlink.MAV_RESULT_IN_PROGRESS
        wait_for(lambda: link.arm_requested)
        link.arm_done("servo 3 (FL_knee) is hot")
        assert station.hear("COMMAND_ACK").result == mavlink.MAV_RESULT_FAILED
        assert not link.arm_requested


def test_an_emergency_is_passed_on_from_the_links_own_thread(station):
    heard = []
    with StationLink(station.address) as link:
        link.on_emergency(lambda reason: heard.append((reason, threading.current_thread().name)))
        station.hear("HEARTBEAT")
        station.tell(station.peer.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0))
        wait_for(lambda: heard)
        assert heard == [("asked for by the ground station", "station link")]
        assert link.emergency_requested


def test_an_emergency_that_fails_does_not_end_the_link(station):
    with StationLink(station.address) as link:
        link.on_emergency(lambda reason: 1 / 0)
        station.hear("HEARTBEAT")
        station.tell(station.peer.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, 21196.0))
        wait_for(lambda: link.emergency_requested)
        publish(link, 5.0)
        assert station.hear("ATTITUDE").time_boot_ms == 5000


def test_commands_from_elsewhere_than_the_station_do_nothing(station):
    with StationLink(station.address) as link, Station().socket as other:
        station.hear("HEARTBEAT")
        other.sendto(Peer().command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), station.robot)
        time.sleep(0.2)
        assert not link.arm_requested


def test_a_silent_radio_stops_the_robot_by_the_ladder(station):
    with StationLink(station.address) as link:
        clock = MonotonicClock()
        station.hear("HEARTBEAT")
        station.tell(station.peer.mode(WALK))
        for _ in range(4):
            station.tell(station.peer.manual(x=500))
        wait_for(lambda: link.command(clock.now())[0].velocity[0] > 0.0)
        ahead = 0.0

        class Later:
            def now(self):
                return clock.now() + ahead

            def sleep_until(self, when):
                raise NotImplementedError

        source = LinkSource(link, CommandWatchdog(), Later())
        # Heartbeats go on, commands do not; the watchdog sees the age grow.
        wanted = {
            0.5: (Mode.WALK, False),
            2.0: (Mode.STAND, False),
            8.0: (Mode.SIT, False),
            31.0: (Mode.OFF, False),
        }
        for ahead, (mode, moves) in wanted.items():  # noqa: B007 - read by the clock
            station.tell(station.peer.heartbeat())
            motion = source(0.0)
            assert (motion.mode, bool(motion.velocity.any())) == (mode, moves)
        told = {station.hear("STATUSTEXT").text for _ in range(4)}
        assert "no command for 5 s: sit" in told


@contextlib.contextmanager
def unread_line(full=False):
    """A pseudo-terminal whose other end nobody reads; `full`: it takes nothing more."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    if full:
        os.set_blocking(slave, False)
        with contextlib.suppress(BlockingIOError):
            while os.write(slave, bytes(100)):
                pass
    try:
        yield f"serial:{os.ttyname(slave)}:57600", master
    finally:
        os.close(master)
        os.close(slave)


def test_a_line_that_nobody_reads_delays_nothing():
    """The writer is stuck for good; publishing and asking take no longer than on a free line."""
    with unread_line(full=True) as (address, _), StationLink(address) as link:
        told = [snapshot(0.02 * tick) for tick in range(2000)]
        worst = 0.0
        end = time.monotonic() + 3.0
        count = 0
        while time.monotonic() < end:
            item = told[count % len(told)]
            before = time.monotonic()
            link.publish(item.telemetry, item.frame, "active", ("battery low",))
            link.command(time.monotonic())
            worst = max(worst, time.monotonic() - before)
            count += 1
            time.sleep(0.002)
        # A write that waited would wait for ever; machines under load take their time.
        assert worst < 1.0
        assert count > 300


def test_a_line_that_is_read_again_brings_the_newest():
    # Full to the brim, as with a radio that holds its clear-to-send back.
    with unread_line(full=True) as (address, master), StationLink(address) as link:
        for tick in range(300):
            publish(link, 0.02 * tick)
            time.sleep(0.004)
        publish(link, 777.0)
        os.set_blocking(master, False)
        peer, times = Peer(), []
        end = time.monotonic() + 3.0
        while time.monotonic() < end and 777000 not in times:
            with contextlib.suppress(BlockingIOError):
                times += [
                    m.time_boot_ms for m in peer.parse(os.read(master, 4096)) if m.get_type() == "ATTITUDE"
                ]
            time.sleep(0.005)
        assert times[-1] == 777000


def test_a_serial_line_carries_both_ways():
    with unread_line() as (address, master), StationLink(address) as link:
        peer = Peer()
        os.write(master, peer.heartbeat() + peer.mode(WALK) + b"".join(peer.manual(x=700) for _ in range(4)))
        wait_for(lambda: link.command(time.monotonic())[0].velocity[0] > 0.0)
        assert link.command(time.monotonic())[0].velocity[0] == pytest.approx(0.07)


def test_a_serial_line_that_hangs_up_ages_and_closes_cleanly():
    master, slave = pty.openpty()
    tty.setraw(slave)
    with StationLink(f"serial:{os.ttyname(slave)}:57600") as link:
        os.close(master)
        os.close(slave)
        time.sleep(0.3)
        publish(link)
        assert link.command(time.monotonic() + 10.0)[1] > 10.0


@pytest.mark.parametrize(
    "text",
    ["", "udp", "udp:127.0.0.1", "tcp:127.0.0.1:14550", "udp:127.0.0.1:99999", "udp:127.0.0.1:0",
     "serial:/dev/ttyUSB0", "udp::14550", "udp:127.0.0.1:14550,key=", "udp:127.0.0.1:14550,speed=5"],
)  # fmt: skip
def test_wrong_addresses_are_refused_with_the_valid_forms(text):
    with pytest.raises(ConfigurationError, match=r"udpin:HOST:PORT|must lie in"):
        Address.parse(text)


def test_addresses_say_what_they_mean(tmp_path):
    assert Address.parse("serial:/dev/ttyUSB1:57600").number == 57600
    address = Address.parse(f"udpin:0.0.0.0:14550,key={tmp_path}/key")
    assert (address.kind, address.place, address.number) == ("udpin", "0.0.0.0", 14550)
    assert address.key == tmp_path / "key"


def test_ports_that_are_not_there_or_in_use_are_named(station):
    with pytest.raises(LinkError, match=r"/dev/nowhere.*dialout"):
        StationLink("serial:/dev/nowhere:57600")
    with pytest.raises(LinkError, match="another station"):
        GroundLink(station.address.replace("udp:", "udpin:"))
    with pytest.raises(LinkError, match="host is not known"):
        StationLink("udp:no.such.host.invalid:14550")


def test_closing_twice_is_fine_and_ends_the_thread(station):
    link = StationLink(station.address)
    link.close()
    link.close()
    assert not [thread for thread in threading.enumerate() if thread.name == "station link"]


def test_a_robot_that_ends_says_goodbye(station):
    with StationLink(station.address) as link:
        publish(link)
        # The first heartbeat may have left before there was anything to tell.
        flag = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        assert any(station.hear("HEARTBEAT").base_mode & flag for _ in range(3))
    assert station.hear("STATUSTEXT").text == "the robot's program ends"
    last = station.hear("HEARTBEAT")
    assert not last.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert last.system_status == mavlink.MAV_STATE_POWEROFF


@pytest.fixture
def both(tmp_path):
    """A station and a robot that hear each other."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    key = tmp_path / "station.key"
    key.write_bytes(os.urandom(32))
    log = OperatorLog(tmp_path / "log" / "operator.jsonl")
    with (
        GroundLink(f"udpin:127.0.0.1:{port},key={key}", log=log) as ground,
        StationLink(f"udp:127.0.0.1:{port},key={key}") as robot,
    ):
        publish(robot)
        wait_for(lambda: ground.look(lambda picture: picture.mode))
        yield ground, robot, log


def test_both_ends_understand_each_other_with_a_key(both):
    ground, robot, log = both
    ground.steer(MotionCommand(mode=Mode.WALK, velocity=np.array([0.06, 0.01]), gait="walk"))
    wait_for(lambda: robot.command(time.monotonic())[0].mode is Mode.WALK)
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        ground.steer(MotionCommand(mode=Mode.WALK, velocity=np.array([0.06, 0.01]), gait="walk"))
        time.sleep(0.02)
    motion, age = robot.command(time.monotonic())
    assert motion.velocity == pytest.approx([0.06, 0.01])
    assert motion.gait == "walk"
    assert age < 1.0
    assert ground.result() == ("walk", "accepted")
    # Nobody holds the sticks any more.
    wait_for(lambda: not robot.command(time.monotonic())[0].velocity.any())
    ground.ask(Order.STOP)
    wait_for(lambda: robot.stop_requested)
    ground.close()
    lines = log.path.read_text().splitlines()
    assert len(lines) == log.lines
    for kind in ("HEARTBEAT", "ATTITUDE", "MANUAL_CONTROL", "COMMAND_LONG", "COMMAND_ACK", "REMARK"):
        assert any(f'"kind":"{kind}"' in line for line in lines), kind
