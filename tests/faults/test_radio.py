"""A robot that trots by radio while the radio goes wrong: MAVLink byte by byte."""

from types import SimpleNamespace

import numpy as np
import pytest

from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.io.station.signing import Signer
from bluefoot_mpc.io.station.source import LinkSource
from bluefoot_mpc.types import Mode
from tests.faults.rig import SPEED, Plan, Rig
from tests.faults.table import AT
from tests.io.station.made_up import WALK
from tests.io.station.test_signing import KEY, WALL, signing_peer

pytestmark = pytest.mark.slow

STICKS, BEATS = 0.04, 1.0
"""s between two messages of the sticks, and between two heartbeats."""


class Radio:
    """The operator's end and the line up, on the robot's clock.

    Args:
        silent: s from which nothing is sent.
        hands_off: s from which only heartbeats are sent.
        replay: s from which signed frames of the second before are sent again and again.
        corrupt: share of the bytes that are changed.
        jump: s by which the robot's wall clock is set, at `AT`.
    """

    def __init__(self, silent=np.inf, hands_off=np.inf, replay=np.inf, corrupt=0.0, jump=0.0):
        self.silent, self.hands_off, self.replay, self.corrupt = silent, hands_off, replay, corrupt
        self.peer, self.random = signing_peer(), np.random.default_rng(1)
        self.now = 0.0
        wall = lambda: WALL + self.now + jump * (self.now >= AT)  # noqa: E731
        self.end = RobotEnd(StationConfig(), 0.0, Signer(KEY, wall))
        self.source = None
        self.beat_at = self.stick_at = 0.0
        self.recorded, self.asked = [], False

    def __call__(self, time):
        self.now = time
        for data in self._sent(time):
            self.end.receive(self._damaged(data), time)
        if self.source is None:
            clock = SimpleNamespace(now=lambda: self.now)
            link = SimpleNamespace(command=self.end.inbox.command, say=lambda text, *, fault: None)
            self.source = LinkSource(link, clock=clock)
        return self.source(time)

    def _sent(self, time):
        if time >= self.silent:
            return
        if time >= self.replay:
            yield self.recorded[int(time / 0.02) % len(self.recorded)]
            return
        if time >= self.beat_at:
            self.beat_at = time + BEATS
            yield self.peer.heartbeat()
            # An operator presses again until the robot walks.
            yield self._keep(self.peer.mode(WALK), time)
        if self.stick_at <= time < self.hands_off:
            self.stick_at = time + STICKS
            yield self._keep(self.peer.manual(x=600), time)

    def _keep(self, data, time):
        if time > AT - 1.0:
            self.recorded.append(data)
        return data

    def _damaged(self, data):
        bytes_ = np.frombuffer(data, dtype=np.uint8)
        hit = self.random.random(len(bytes_)) < self.corrupt
        return np.where(hit, self.random.integers(0, 256, len(bytes_)), bytes_).astype(np.uint8).tobytes()


def drive(radio, tmp_path, end):
    return Rig(Plan(command=radio, end=end), tmp_path).run()


def check_unhurt(rig):
    assert not rig.fell
    check_line(rig)


def check_line(rig):
    assert rig.parts.report()["torque_on"] == []
    assert rig.parts.report()["protocol_violations"] == {}


@pytest.mark.parametrize("jump", [0.0, 3600.0, -3600.0])
def test_a_wall_clock_that_jumps_changes_nothing(jump, tmp_path):
    rig = drive(Radio(jump=jump), tmp_path, 5.5)
    assert set(rig.modes(AT, 5.5)) == {Mode.WALK}
    assert rig.way(AT, 5.5) > 0.7 * SPEED * 2.0
    check_unhurt(rig)


@pytest.mark.parametrize(
    "fault",
    [{"silent": AT}, {"replay": AT}, {"hands_off": AT}],
    ids=["silent", "replayed", "heartbeats go on"],
)
def test_commands_that_stop_make_the_robot_stand_then_sit(fault, tmp_path):
    rig = drive(Radio(**fault), tmp_path, AT + 8.0)
    assert set(rig.modes(2.5, AT + 1.0)) == {Mode.WALK}
    slow = rig.way(AT + 0.7, AT + 1.0) / 0.3
    assert slow < 0.5 * SPEED  # no velocity after 0.3 s
    assert AT + 1.0 < rig.first(Mode.STAND, after=AT) < AT + 2.5
    assert rig.first(Mode.SIT, after=AT) == pytest.approx(AT + 5.0, abs=0.1)
    assert rig.height(AT + 7.9) < rig.height(AT) - 0.02
    check_unhurt(rig)


@pytest.mark.parametrize(("share", "way"), [(0.002, 0.075), (0.1, -0.01)], ids=["frames", "bytes"])
def test_a_tenth_of_corrupt_frames_or_bytes(share, way, tmp_path):
    rig = drive(Radio(corrupt=share), tmp_path, 6.0)  # a signed frame of the sticks has 54 bytes
    assert set(rig.modes(AT, 6.0)) <= {Mode.WALK, Mode.STAND, Mode.SIT}
    assert way < rig.way(AT, 6.0) < 1.1 * SPEED * 2.5
    check_unhurt(rig)


@pytest.mark.slow
def test_a_radio_that_stays_silent_switches_the_torque_off(tmp_path):
    rig = drive(Radio(silent=AT), tmp_path, AT + 34.0)
    assert rig.first(Mode.OFF, after=AT) == pytest.approx(AT + 30.0, abs=0.1)
    assert rig.shafts.limp_at() < AT + 34.0
    check_line(rig)
