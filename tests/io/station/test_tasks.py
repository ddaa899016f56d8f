"""Tasks that a station gives: what begins and ends them, how far they have come, a link that falls silent."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.safety import CommandWatchdog
from bluefoot_mpc.io.station.commands import CommandInbox
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground_end import GroundEnd
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.protocol import ACCEPTED, DENIED, FAILED, TASKS
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.types import Guide, Guided, GuideTask, Mode, MotionCommand, NavigationReport

from .made_up import SIT, STAND, WALK, Peer, sent, snapshot

MODE, TASK = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_USER_1
START, SPEED = mavlink.MAV_CMD_MISSION_START, mavlink.MAV_CMD_DO_CHANGE_SPEED
PAUSE, ARM = mavlink.MAV_CMD_DO_PAUSE_CONTINUE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
POINTS = np.array([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
WANDER, APPROACH, FOLLOW, GOTO = (TASKS.index(task) for task in ("wander", "approach", "follow", "goto"))


@pytest.fixture
def inbox():
    made = CommandInbox(config=StationConfig(), start=0.0)
    made.load(POINTS)
    return made


def order(inbox, number, *parameters):
    values = [*map(float, parameters), *([0.0] * (7 - len(parameters)))]
    return inbox.execute(mavlink.MAVLink_command_long_message(1, 1, number, 0, *values))


def hold(inbox, start, seconds=0.4, **axes):
    """Sticks held for a while, with heartbeats; gives the time after it and what was remarked."""
    remarks, ticks = [], round(seconds / 0.04)
    for tick in range(ticks):
        now = start + 0.04 * tick
        inbox.heartbeat(now)
        values = {"x": 0, "y": 0, "r": 0} | axes
        remarks.append(
            inbox.manual(
                mavlink.MAVLink_manual_control_message(
                    1, values.pop("x"), values.pop("y"), 0, values.pop("r"), 0, **values
                ),
                now,
            )
        )
    return start + 0.04 * ticks, [remark for remark in remarks if remark]


def motion(inbox, now=0.0):
    return inbox.command(now)[0]


def report(left, guided=Guided.WAYPOINT, reason=""):
    return NavigationReport(
        guided=guided, velocity=np.zeros(2), yaw_rate=0.0, pitch=0.0, field=np.zeros(2), potential=0.0,
        mixing=0.0, marker=np.full(3, np.nan), marker_position=np.array([1.5, -0.5, 0.2]), marker_age=2.0,
        clearance=0.4, waypoints_left=left, reason=reason,
    )  # fmt: skip


def tick(wanted, left, at=(0.0, 0.0), guided=Guided.WAYPOINT, **more):
    """Telemetry of a robot that does what it is told, and has some waypoints left."""
    told = snapshot(mode=Mode.WALK, position=np.array([*at, 0.1])).telemetry
    return replace(told, motion=wanted, navigation=report(left, guided, **more))


@pytest.mark.parametrize("number", [WANDER, APPROACH, FOLLOW])
def test_a_task_is_a_walk_with_a_guide(inbox, number):
    assert order(inbox, TASK, number, 0.1, 0.8) == ACCEPTED
    wanted = motion(inbox)
    assert wanted.mode is Mode.WALK
    assert (wanted.guide.task, wanted.guide.speed, wanted.guide.distance) == (TASKS[number], 0.1, 0.8)
    assert not wanted.velocity.any()
    # The same order again, because its answer was lost, changes nothing.
    assert order(inbox, TASK, number, 0.1, 0.8) == ACCEPTED
    assert motion(inbox).guide is wanted.guide


def test_speed_and_distance_have_defaults(inbox):
    order(inbox, TASK, FOLLOW)
    guide = motion(inbox).guide
    assert (guide.speed, guide.distance) == (0.15, 0.6)


@pytest.mark.parametrize(
    "parameters",
    [
        (0,), (GOTO,), (5,), (1.5,), (-1,), (math.nan,), (WANDER, -0.1), (WANDER, 1.1), (WANDER, math.nan),
        (FOLLOW, 0.1, 6.0), (FOLLOW, 0.1, math.nan), (FOLLOW, 0.1, 0.6, 1.0),
        (FOLLOW, 0.1, 0.05), (APPROACH, 0.0, 0.39),
    ],
)  # fmt: skip
def test_tasks_that_mean_nothing_are_denied(inbox, parameters):
    assert order(inbox, TASK, *parameters) == DENIED
    assert motion(inbox).mode is Mode.STAND


def test_a_distance_that_is_too_small_is_denied_with_the_cause(inbox):
    order(inbox, TASK, FOLLOW, 0.1, 0.39)
    assert inbox.tasks.refusal == "follow: at least 0.4 m from the marker, not 0.39 m"
    assert order(inbox, TASK, FOLLOW, 0.1, np.float32(0.4)) == ACCEPTED
    assert inbox.tasks.refusal == ""
    # Wandering keeps no distance to a marker.
    assert order(inbox, TASK, WANDER, 0.1, 0.05) == ACCEPTED


def test_the_list_is_gone_through_at_the_speed_that_was_asked_for(inbox):
    assert order(inbox, SPEED, 1, 0.08, -1) == ACCEPTED
    assert order(inbox, START) == ACCEPTED
    guide = motion(inbox).guide
    assert (guide.task, guide.speed) == (GuideTask.GOTO, 0.08)
    assert guide.waypoints.tolist() == POINTS.tolist()
    assert order(inbox, START) == ACCEPTED
    assert motion(inbox).guide is guide
    # From another one on, it begins anew.
    assert order(inbox, START, 1) == ACCEPTED
    assert motion(inbox).guide.waypoints.tolist() == POINTS[1:].tolist()


@pytest.mark.parametrize("parameters", [(3,), (-1,), (0.5,), (math.nan,), (0, 1), (0, 0, 1), (0, math.nan)])
def test_a_start_that_means_nothing_is_denied(inbox, parameters):
    assert order(inbox, START, *parameters) == DENIED
    assert motion(inbox).guide is None


def test_without_a_list_there_is_nothing_to_start(inbox):
    inbox.load(np.zeros((0, 2)))
    assert order(inbox, START) == FAILED
    assert motion(inbox).mode is Mode.STAND


@pytest.mark.parametrize(
    "parameters", [(0, 0.1), (1, 0.0), (1, 1.1), (1, math.nan), (1, -1), (1, 0.1, 50), (1, 0.1, 0, 1)]
)
def test_speeds_that_mean_nothing_are_denied(inbox, parameters):
    assert order(inbox, SPEED, *parameters) == DENIED
    assert inbox.tasks.speed == 0.15


def test_sticks_moved_by_hand_end_a_task_at_once(inbox):
    order(inbox, TASK, WANDER)
    now, remarks = hold(inbox, 0.0)
    assert motion(inbox, now).guide is not None
    assert remarks == []
    now, remarks = hold(inbox, now, 0.12, x=300)
    wanted = motion(inbox, now)
    assert (wanted.mode, wanted.guide) == (Mode.WALK, None)
    assert wanted.velocity[0] == pytest.approx(0.03)
    assert "by hand" in remarks[0]
    now, _ = hold(inbox, now)
    assert motion(inbox, now).guide is None


@pytest.mark.parametrize("axes", [{"x": 40}, {"r": -40}, {"enabled_extensions": 15, "s": 900, "t": -900}])
def test_a_stick_that_trembles_and_the_trunk_end_nothing(inbox, axes):
    order(inbox, TASK, WANDER)
    now, _ = hold(inbox, 0.0, 0.4, **axes)
    wanted = motion(inbox, now)
    assert wanted.guide is not None
    assert not wanted.velocity.any()


def test_one_wild_value_ends_nothing(inbox):
    order(inbox, TASK, WANDER)
    now, _ = hold(inbox, 0.0)
    now, _ = hold(inbox, now, 0.04, x=1000)
    assert motion(inbox, now).guide is not None


@pytest.mark.parametrize(
    ("number", "parameters", "mode"),
    [(MODE, (1, STAND), Mode.STAND), (MODE, (1, SIT), Mode.SIT), (MODE, (1, WALK), Mode.WALK),
     (PAUSE, (0,), Mode.STAND), (ARM, (0,), Mode.OFF), (ARM, (0, 21196), Mode.OFF), (ARM, (1,), Mode.STAND)],
)  # fmt: skip
def test_orders_end_a_task(inbox, number, parameters, mode):
    order(inbox, START)
    order(inbox, number, *parameters)
    assert (motion(inbox).mode, motion(inbox).guide) == (mode, None)


@pytest.mark.parametrize("parameters", [(0,), (0, 21196)])
def test_after_a_stop_tasks_are_denied_until_it_is_armed(inbox, parameters):
    order(inbox, ARM, *parameters)
    assert [order(inbox, TASK, WANDER), order(inbox, START), order(inbox, PAUSE, 1)] == [DENIED] * 3
    assert motion(inbox).mode is Mode.OFF
    order(inbox, ARM, 1)
    assert order(inbox, TASK, WANDER) == ACCEPTED


def test_progress_is_told_once_and_the_end_is_to_stand(inbox):
    order(inbox, START)
    wanted = motion(inbox)
    assert inbox.progress(tick(wanted, 3)) == []
    assert inbox.progress(tick(wanted, 2, at=(0.95, 0.0))) == [0]
    assert inbox.progress(tick(wanted, 2, at=(0.95, 0.0))) == []
    assert inbox.tasks.current() == (1, 3, mavlink.MISSION_STATE_ACTIVE)
    # What is told of another list, or of a robot that sees nothing, says nothing.
    other = replace(wanted, guide=replace(wanted.guide, waypoints=POINTS[:1]))
    assert inbox.progress(tick(other, 0, guided=Guided.ARRIVED)) == []
    assert inbox.progress(tick(wanted, 0, guided=Guided.BLIND)) == []
    assert inbox.progress(tick(wanted, 0)) == []
    assert motion(inbox).guide is wanted.guide
    # The second was given up on the way, the third is reached.
    assert inbox.progress(tick(wanted, 0, at=(3.05, 0.0), guided=Guided.ARRIVED)) == [2]
    assert inbox.tasks.missed == [1]
    assert (motion(inbox).mode, motion(inbox).guide) == (Mode.STAND, None)
    assert inbox.tasks.current() == (2, 3, mavlink.MISSION_STATE_COMPLETE)
    # It may begin again.
    assert order(inbox, START) == ACCEPTED
    assert inbox.tasks.current() == (0, 3, mavlink.MISSION_STATE_ACTIVE)


def test_a_task_that_was_interrupted_goes_on_where_it_was(inbox):
    assert order(inbox, PAUSE, 1) == DENIED
    order(inbox, START)
    inbox.progress(tick(motion(inbox), 2, at=(1.0, 0.0)))
    order(inbox, PAUSE, 0)
    assert inbox.tasks.current() == (1, 3, mavlink.MISSION_STATE_PAUSED)
    assert order(inbox, PAUSE, 1) == ACCEPTED
    wanted = motion(inbox)
    assert wanted.guide.waypoints.tolist() == POINTS[1:].tolist()
    assert inbox.progress(tick(wanted, 1, at=(2.0, 0.0))) == [1]
    assert inbox.tasks.current()[0] == 2


def test_another_list_ends_the_way_along_the_old_one(inbox):
    order(inbox, START)
    inbox.load(POINTS[:1])
    assert (motion(inbox).mode, motion(inbox).guide) == (Mode.STAND, None)
    assert order(inbox, PAUSE, 1) == DENIED
    order(inbox, TASK, WANDER)
    inbox.load(POINTS)
    assert motion(inbox).guide.task is GuideTask.WANDER


def test_a_silent_link_ends_a_task_by_the_ladder(inbox):
    order(inbox, START)
    now, _ = hold(inbox, 0.0)
    watchdog = CommandWatchdog()
    seen = {}
    for silence in (0.2, 0.5, 2.0, 8.0, 31.0):
        command = watchdog.step(*inbox.command(now - 0.04 + silence))
        seen[silence] = (command.mode, command.guide is not None, bool(command.velocity.any()))
    assert seen == {
        0.2: (Mode.WALK, True, False), 0.5: (Mode.WALK, False, False), 2.0: (Mode.STAND, False, False),
        8.0: (Mode.SIT, False, False), 31.0: (Mode.OFF, False, False),
    }  # fmt: skip


def test_after_a_short_gap_the_way_goes_on_from_the_next_waypoint(inbox):
    order(inbox, START)
    now, _ = hold(inbox, 0.0)
    inbox.progress(tick(motion(inbox), 2, at=(1.0, 0.0)))
    now, remarks = hold(inbox, now + 0.5)
    assert remarks == []
    assert motion(inbox, now).guide.waypoints.tolist() == POINTS[1:].tolist()


def test_after_a_long_silence_the_task_has_to_be_asked_for_anew(inbox):
    order(inbox, START)
    now, _ = hold(inbox, 0.0)
    now, remarks = hold(inbox, now + 1.5)
    assert "ask to walk again" in remarks[0]
    assert (motion(inbox, now).mode, motion(inbox, now).guide) == (Mode.STAND, None)
    assert order(inbox, PAUSE, 1) == ACCEPTED
    assert motion(inbox, now).guide is not None


def sticks_alone(inbox, start, seconds):
    """Centred sticks for a while, no heartbeat; gives the time after it."""
    for tick in range(round(seconds / 0.04)):
        inbox.manual(mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0), start + 0.04 * tick)
    return start + seconds


def test_when_heartbeats_alone_were_missing_the_way_goes_on_from_the_next_waypoint(inbox):
    order(inbox, START)
    now, _ = hold(inbox, 0.0)
    inbox.progress(tick(motion(inbox), 2, at=(1.0, 0.0)))
    now = sticks_alone(inbox, now, 2.92)
    # The robot has let go of its task.
    assert CommandWatchdog().step(*inbox.command(now)).guide is None
    assert inbox.heartbeat(now) == ""
    assert motion(inbox, now).guide.waypoints.tolist() == POINTS[1:].tolist()


def test_when_heartbeats_alone_were_missing_for_long_the_robot_stands(inbox):
    order(inbox, START)
    now, _ = hold(inbox, 0.0)
    now = sticks_alone(inbox, now, 4.0)
    assert "ask to walk again" in inbox.heartbeat(now)
    assert (motion(inbox, now).mode, motion(inbox, now).guide) == (Mode.STAND, None)
    assert order(inbox, PAUSE, 1) == ACCEPTED
    assert motion(inbox, now).guide is not None


class Pair:
    """Both ends on a line without loss; the robot does at once what it is told."""

    def __init__(self):
        self.robot, self.ground = RobotEnd(StationConfig(), 0.0), GroundEnd(StationConfig(), 0.0)
        self.now, self.left, self.guided, self.at, self.reason = 0.0, 0, Guided.WAYPOINT, (0.0, 0.0), ""

    def run(self, seconds, wish=None):
        for _ in range(round(seconds / 0.02)):
            wanted = self.robot.inbox.command(self.now)[0]
            told = snapshot(self.now, mode=wanted.mode, position=np.array([*self.at, 0.1]))
            way = None if wanted.guide is None else report(self.left, self.guided, self.reason)
            telemetry = replace(told.telemetry, motion=wanted, navigation=way)
            self.robot.offer(replace(told, telemetry=telemetry))
            if wish is not None:
                self.ground.steer(wish, self.now)
            self.ground.receive(sent(self.robot, self.now), self.now)
            self.robot.receive(sent(self.ground, self.now), self.now)
            self.now += 0.02
        return self.robot.inbox.command(self.now)[0]

    @property
    def texts(self):
        return [text.text for text in self.ground.picture.texts]


def walk_with(task, **fields):
    return MotionCommand(mode=Mode.WALK, guide=Guide(task=task, **fields))


def test_the_station_asks_for_a_task_and_sees_how_it_goes():
    pair = Pair()
    pair.left = 2
    wish = walk_with(GuideTask.GOTO, waypoints=POINTS[:2], speed=0.12)
    wanted = pair.run(1.0, wish)
    assert (wanted.guide.task, wanted.guide.speed) == (GuideTask.GOTO, 0.12)
    assert wanted.guide.waypoints == pytest.approx(POINTS[:2])
    assert pair.ground.orders[-1].result == "accepted"
    picture = pair.ground.picture
    pair.run(1.0, wish)
    assert (picture.task, picture.way.lead, picture.way.waypoints_left) == ("goto", "waypoint", 2)
    assert picture.way.clearance == pytest.approx(0.4)
    assert picture.way.marker == pytest.approx([1.5, -0.5])
    assert (picture.mission.reached, picture.mission.total) == (0, 2)
    pair.left, pair.at = 1, (1.0, 0.0)
    pair.run(0.2, wish)
    assert picture.mission.reached == 1
    pair.left, pair.at, pair.guided = 0, (2.0, 0.0), Guided.ARRIVED
    pair.run(0.3, wish)
    assert picture.mission.complete
    assert (picture.task, picture.mode) == ("", "stand")
    # What holds still is not asked for again: a robot that has arrived stays there.
    assert pair.run(3.0, wish).mode is Mode.STAND
    assert len(pair.ground.orders) == 1


def test_a_waypoint_without_a_way_to_it_is_told():
    pair = Pair()
    pair.left = 2
    wish = walk_with(GuideTask.GOTO, waypoints=POINTS[:2])
    pair.run(1.0, wish)
    pair.left, pair.guided, pair.reason = 0, Guided.ARRIVED, "waypoint 1 given up: no way to it"
    pair.run(2.0, wish)
    assert "waypoint 2 given up: no way to it" in pair.texts
    assert pair.ground.picture.mission.complete


def test_a_distance_that_is_too_small_is_told():
    pair = Pair()
    assert pair.run(1.0, walk_with(GuideTask.FOLLOW, distance=0.1)).guide is None
    assert pair.ground.orders[-1].result == "denied"
    assert "follow: at least 0.4 m from the marker, not 0.1 m" in pair.texts


def test_the_station_ends_a_task_with_a_stick_or_a_mode():
    for wish in (
        MotionCommand(mode=Mode.WALK, velocity=np.array([0.05, 0.0])),
        MotionCommand(),
        MotionCommand(mode=Mode.SIT),
    ):
        pair = Pair()
        assert pair.run(1.0, walk_with(GuideTask.WANDER)).guide.task is GuideTask.WANDER
        wanted = pair.run(0.5, wish)
        assert (wanted.mode, wanted.guide) == (wish.mode, None)
        assert wanted.velocity == pytest.approx(wish.velocity)


def test_one_task_after_the_other():
    pair = Pair()
    for task in (GuideTask.WANDER, GuideTask.FOLLOW, GuideTask.APPROACH, GuideTask.GOTO, GuideTask.WANDER):
        points = POINTS if task is GuideTask.GOTO else np.zeros((0, 2))
        assert pair.run(1.0, walk_with(task, waypoints=points, distance=0.7)).guide.task is task
        assert pair.ground.picture.task == task


def test_an_operators_program_that_hangs_ends_a_task():
    """Its thread for the line still runs: heartbeats go on, the robot stops all the same."""
    pair = Pair()
    pair.run(1.0, walk_with(GuideTask.WANDER))
    watchdog = CommandWatchdog()
    pair.run(0.5)
    pair.run(0.5)
    command = watchdog.step(*pair.robot.inbox.command(pair.now))
    assert command.guide is None
    pair.run(1.0)
    assert watchdog.step(*pair.robot.inbox.command(pair.now)).mode is Mode.STAND


def test_the_list_can_be_cleared_while_something_else_is_asked_for():
    pair = Pair()
    pair.run(1.0, walk_with(GuideTask.GOTO, waypoints=POINTS))
    pair.ground.ask(Order.CLEAR, pair.now)
    wanted = pair.run(1.0, MotionCommand())
    assert (wanted.mode, wanted.guide) == (Mode.STAND, None)
    assert len(pair.robot.inbox.tasks.points) == 0
    assert {(str(pending.order), pending.result) for pending in pair.ground.orders} == {
        ("goto", "accepted"), ("clear", "accepted"), ("stand", "accepted")
    }  # fmt: skip
    pair.run(1.0, MotionCommand())
    assert pair.ground.picture.mission.total == 0


def test_what_leads_is_told_when_it_changes_and_not_for_every_number():
    pair = Pair()
    wish = walk_with(GuideTask.WANDER)
    pair.guided = Guided.FIELD
    pair.run(1.0, wish)
    pair.guided = Guided.BLIND
    for tenth in range(30):
        pair.reason = f"no usable sweep of the LIDAR for {0.1 * tenth:.1f} s"
        pair.run(0.1, wish)
    told = [text for text in pair.texts if text.startswith("navigation")]
    assert told[0] == "navigation: field"
    assert len(told) == 2
    assert "no usable sweep" in pair.ground.picture.why
    assert pair.ground.picture.way.lead == "blind"


def test_the_radio_has_room_for_a_task():
    pair = Pair()
    wish = walk_with(GuideTask.GOTO, waypoints=POINTS)
    pair.left = 3
    pair.run(2.0, wish)
    before = [sum(count.bytes for count in end.writer.counts.values()) for end in (pair.robot, pair.ground)]
    flips = (Guided.WAYPOINT, Guided.ESCAPE)
    for second in range(20):
        pair.guided = flips[second % 2]
        pair.run(1.0, wish)
    after = [sum(count.bytes for count in end.writer.counts.values()) for end in (pair.robot, pair.ground)]
    assert sum(after) - sum(before) <= 0.6 * 5760.0 * 20.0


def test_a_robot_guided_by_its_own_script_tells_so():
    robot = RobotEnd(StationConfig(), 0.0)
    told = snapshot(1.0, mode=Mode.WALK)
    wanted = MotionCommand(mode=Mode.WALK, guide=Guide(task=GuideTask.FOLLOW))
    robot.offer(
        replace(told, telemetry=replace(told.telemetry, motion=wanted, navigation=report(0, Guided.SEARCH)))
    )
    messages = Peer().parse(b"".join(sent(robot, 0.1 * tenth) for tenth in range(20)))
    beat = next(message for message in messages if message.get_type() == "HEARTBEAT")
    assert beat.custom_mode >> 24 == FOLLOW
    assert beat.base_mode & mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    nav = next(
        message for message in messages if message.get_type() == "DEBUG_FLOAT_ARRAY" and message.name == "nav"
    )
    assert tuple(Guided)[int(nav.data[0])] is Guided.SEARCH
