"""What a station's sticks and orders make the robot want."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.commands import CommandInbox, Wishes
from bluefoot_mpc.io.station.config import StationConfig, StickScale
from bluefoot_mpc.io.station.protocol import ACCEPTED, DENIED, UNSUPPORTED
from bluefoot_mpc.io.station.sticks import read_sticks, write_sticks
from bluefoot_mpc.types import Mode, MotionCommand, TrunkPose

from .made_up import OFF, SAFE, SIT, STAND, WALK

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
MODE = mavlink.MAV_CMD_DO_SET_MODE


@pytest.fixture
def inbox():
    return CommandInbox(config=StationConfig(), start=0.0)


def command(number, *parameters):
    return mavlink.MAVLink_command_long_message(
        1, 1, number, 0, *parameters, *([0.0] * (7 - len(parameters)))
    )


def sticks(x=0, y=0, r=0, **more):
    return mavlink.MAVLink_manual_control_message(1, x, y, 500, r, 0, **more)


def hold(inbox, start, seconds, **axes):
    """Sticks held for a while, with heartbeats; gives the time of the last."""
    for tick in range(round(seconds / 0.04)):
        now = start + 0.04 * tick
        inbox.heartbeat(now)
        inbox.manual(sticks(**axes), now)
    return now


def walking(inbox, **axes):
    assert inbox.execute(command(MODE, 1.0, WALK, 1.0)) == ACCEPTED
    return hold(inbox, 0.0, 0.4, **axes)


def test_sticks_are_shares_of_what_is_allowed(inbox):
    now = walking(inbox, x=600, y=-500, r=250)
    motion, age = inbox.command(now)
    assert (motion.mode, motion.gait, age) == (Mode.WALK, "trot", 0.0)
    # y is to the right in MAVLink, r counter-clockwise.
    assert motion.velocity == pytest.approx([0.06, 0.02])
    assert motion.yaw_rate == pytest.approx(0.075)


def test_thrust_means_nothing(inbox):
    now = walking(inbox)
    motion, _ = inbox.command(now)
    assert not motion.velocity.any()
    assert motion.trunk.position[2] == 0.0


@pytest.mark.parametrize("mode", [Mode.STAND, Mode.SIT])
def test_sticks_move_only_a_walking_robot(inbox, mode):
    now = walking(inbox, x=600)
    inbox.execute(command(MODE, 1.0, STAND if mode is Mode.STAND else SIT))
    now = hold(inbox, now + 0.04, 0.4, x=600)
    motion, _ = inbox.command(now)
    assert motion.mode is mode
    assert not motion.velocity.any()


def test_the_trunk_follows_the_further_axes(inbox):
    now = hold(inbox, 0.0, 0.4, enabled_extensions=15, s=-500, t=250, aux1=-1000, aux2=100)
    motion, _ = inbox.command(now)
    tilt = math.radians(10.0)
    # s is nose up in MAVLink; ours is nose down.
    assert motion.trunk.rpy == pytest.approx([0.25 * tilt, 0.5 * tilt, 0.1 * tilt])
    assert motion.trunk.position[2] == pytest.approx(-0.02)


def test_axes_that_are_not_enabled_do_nothing(inbox):
    now = hold(inbox, 0.0, 0.4, enabled_extensions=0, s=-500, t=250, aux1=-1000)
    assert not inbox.command(now)[0].trunk.rpy.any()


def test_one_wild_value_between_true_ones_moves_nothing(inbox):
    now = walking(inbox, x=100)
    inbox.manual(sticks(x=-1000, r=1000), now + 0.04)
    motion, _ = inbox.command(now + 0.04)
    assert motion.velocity[0] == pytest.approx(0.01)
    assert motion.yaw_rate == 0.0


def test_centred_sticks_count_at_once(inbox):
    now = walking(inbox, x=1000)
    inbox.manual(sticks(), now + 0.04)
    assert not inbox.command(now + 0.04)[0].velocity.any()
    # And to start again it takes two that agree.
    inbox.manual(sticks(x=1000), now + 0.08)
    assert not inbox.command(now + 0.08)[0].velocity.any()
    inbox.manual(sticks(x=1000), now + 0.12)
    assert inbox.command(now + 0.12)[0].velocity[0] == pytest.approx(0.1)


@pytest.mark.parametrize("axes", [{"x": 1001}, {"y": -1001}, {"r": 32767}])
def test_axes_beyond_their_travel_are_refused(axes):
    assert read_sticks(sticks(**axes)) is None


def test_sticks_go_there_and_back():
    rng = np.random.default_rng(3)
    scale = StickScale()
    for _ in range(200):
        wanted = rng.uniform(-1.0, 1.0, 7)
        forward, left, turn, roll, pitch, yaw, height = wanted
        motion = MotionCommand(
            velocity=np.array([forward * scale.forward, left * scale.left]),
            yaw_rate=turn * scale.turn,
            trunk=TrunkPose(
                position=np.array([0.0, 0.0, height * scale.height]),
                rpy=np.array([roll, pitch, yaw]) * scale.tilt,
            ),
        )
        assert read_sticks(write_sticks(motion, scale, 1)) == pytest.approx(wanted, abs=6e-4)


def test_what_is_beyond_full_travel_is_cut_off():
    motion = MotionCommand(velocity=np.array([7.0, math.nan]), yaw_rate=-9.0)
    assert read_sticks(write_sticks(motion, StickScale(), 1))[:3] == (1.0, 0.0, -1.0)


def test_age_counts_from_the_last_sticks(inbox):
    now = walking(inbox, x=500)
    inbox.heartbeat(now + 3.0)
    assert inbox.command(now + 3.0)[1] == pytest.approx(3.0)


def test_a_link_that_never_heard_anything_is_as_old_as_itself(inbox):
    assert inbox.command(6.0)[1] == pytest.approx(6.0)


def test_a_lost_heartbeat_ages_commands_that_still_come(inbox):
    inbox.heartbeat(0.0)
    for tick in range(200):
        inbox.manual(sticks(x=500), 0.04 * tick)
    now = 0.04 * 199
    assert inbox.command(now)[1] == pytest.approx(now - StationConfig().heartbeat_timeout)


def test_after_a_silence_walking_must_be_asked_for_anew(inbox):
    now = walking(inbox, x=500)
    remark = inbox.manual(sticks(x=500), now + 1.5)
    assert "ask to walk again" in remark
    motion, age = inbox.command(now + 1.5)
    assert (motion.mode, age) == (Mode.STAND, 0.0)


def test_a_short_gap_changes_nothing(inbox):
    now = walking(inbox, x=500)
    assert inbox.manual(sticks(x=500), now + 0.6) == ""
    assert inbox.command(now + 0.6)[0].mode is Mode.WALK


@pytest.mark.parametrize(("number", "mode"), [(OFF, "off"), (STAND, "stand"), (WALK, "walk"), (SIT, "sit")])
def test_modes_and_gaits(inbox, number, mode):
    assert inbox.execute(command(MODE, 1.0, number, 2.0)) == ACCEPTED
    motion, _ = inbox.command(0.0)
    assert (str(motion.mode), motion.gait) == (mode, "walk")
    # 0 leaves the gait as it is.
    inbox.execute(command(MODE, 1.0, number, 0.0))
    assert inbox.command(0.0)[0].gait == "walk"


@pytest.mark.parametrize(
    "parameters",
    [
        (1.0, SAFE),
        (1.0, 5.0),
        (1.0, 1.5),
        (1.0, math.nan),
        (1.0, -1.0),
        (1.0, 2.0, 3.0),
        (1.0, 2.0, 1.0, 1e-3),
    ],
)  # fmt: skip
def test_modes_that_mean_nothing_are_denied(inbox, parameters):
    assert inbox.execute(command(MODE, *parameters)) == DENIED
    assert inbox.mode is Mode.STAND


def test_arming_waits_for_the_owner_of_the_robot(inbox):
    assert inbox.execute(command(ARM, 1.0)) is None
    assert inbox.wishes.arm


def test_disarming_is_a_controlled_stop(inbox):
    walking(inbox, x=500)
    assert inbox.execute(command(ARM, 0.0)) == ACCEPTED
    assert (inbox.wishes.stop, inbox.wishes.emergency) == (True, False)
    assert inbox.command(0.4)[0].mode is Mode.OFF
    # Only arming takes it back.
    inbox.execute(command(MODE, 1.0, WALK))
    assert inbox.wishes.stop
    inbox.execute(command(ARM, 1.0))
    assert not inbox.wishes.stop
    assert inbox.command(0.4)[0].mode is Mode.STAND


@pytest.mark.parametrize(
    "order", [command(ARM, 0.0, 21196.0), command(mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1.0)]
)
def test_an_emergency_is_passed_on_at_once(inbox, order):
    heard = []
    inbox.on_emergency = heard.append
    assert inbox.execute(order) == ACCEPTED
    assert inbox.wishes.emergency
    assert heard == ["asked for by the ground station"]


@pytest.mark.parametrize(
    "parameters", [(1.0, 21196.0), (2.0,), (0.5,), (math.nan,), (1.0, 1.0), (0.0, 0.0, 0.0, 0.0, 4.0)]
)
def test_arming_has_no_short_cut_and_no_near_miss(inbox, parameters):
    assert inbox.execute(command(ARM, *parameters)) == DENIED
    assert inbox.wishes == Wishes()


def test_pause_stands_still(inbox):
    walking(inbox, x=500)
    assert inbox.execute(command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0.0)) == ACCEPTED
    motion, _ = inbox.command(0.4)
    assert motion.mode is Mode.STAND
    assert inbox.execute(command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 1.0)) == DENIED


def test_other_commands_are_unsupported(inbox):
    assert inbox.execute(command(mavlink.MAV_CMD_NAV_TAKEOFF, 1.0)) == UNSUPPORTED
