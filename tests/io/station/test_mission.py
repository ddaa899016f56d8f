"""Waypoints on their way to the robot: pymavlink at the other end, and lines that lose messages."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.ground_end import GroundEnd
from bluefoot_mpc.io.station.mission import PER_METRE
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.io.station.upload import MissionUpload
from bluefoot_mpc.types import Guide, GuideTask, Mode, MotionCommand

from .made_up import Peer, sent, snapshot

POINTS = np.array([[1.0, 0.5], [2.0, 0.0], [-0.3, 1.25]])
OLD = np.array([[9.0, 9.0]])
LIST = mavlink.MAV_MISSION_TYPE_MISSION


class Line:
    """A robot, and a peer of pymavlink only that says what it is told and hears everything."""

    def __init__(self, config=None):
        self.robot, self.peer, self.now = RobotEnd(config or StationConfig(), 0.0), Peer(), 0.0
        self.robot.inbox.load(OLD)
        self.texts = []
        self.robot.say = lambda severity, text: self.texts.append(text)

    def tell(self, *messages, peer=None):
        """Say messages; gives the robot's answers of the protocol."""
        for message in messages:
            self.robot.receive((peer or self.peer).pack(message), self.now)
        return self.hear(0.02)

    def hear(self, seconds):
        heard = []
        for _ in range(round(seconds / 0.02)):
            heard += [m for m in Peer().parse(sent(self.robot, self.now)) if "MISSION" in m.get_type()]
            self.now += 0.02
        return [m for m in heard if m.get_type() != "MISSION_CURRENT"]

    @property
    def points(self):
        return self.robot.inbox.tasks.points


@pytest.fixture
def line():
    return Line()


def count(number, kind=LIST):
    return mavlink.MAVLink_mission_count_message(1, 1, number, kind)


def item(number, point=(1.0, 2.0), **fields):
    values = {
        "frame": mavlink.MAV_FRAME_LOCAL_FLU, "command": mavlink.MAV_CMD_NAV_WAYPOINT, "current": 0,
        "autocontinue": 1, "param1": 0.0, "param2": 0.0, "param3": 0.0, "param4": math.nan,
        "x": round(PER_METRE * point[0]), "y": round(PER_METRE * point[1]), "z": 0.0, "mission_type": LIST,
    }  # fmt: skip
    return mavlink.MAVLink_mission_item_int_message(1, 1, number, *(values | fields).values())


SAYS = {
    "MISSION_REQUEST_INT": ("request", "seq"),
    "MISSION_ACK": ("ack", "type"),
    "MISSION_COUNT": ("count", "count"),
}


def summary(messages):
    words = [SAYS[message.get_type()] for message in messages]
    return [(name, getattr(message, field)) for (name, field), message in zip(words, messages, strict=True)]


def test_a_list_is_asked_for_item_by_item_and_then_holds(line):
    assert summary(line.tell(count(3))) == [("request", 0)]
    assert summary(line.tell(item(0, POINTS[0]))) == [("request", 1)]
    assert summary(line.tell(item(1, POINTS[1]))) == [("request", 2)]
    assert line.points.tolist() == OLD.tolist()
    assert summary(line.tell(item(2, POINTS[2]))) == [("ack", mavlink.MAV_MISSION_ACCEPTED)]
    assert line.points == pytest.approx(POINTS)


def test_a_list_can_be_read_back(line):
    for message in (count(3), *(item(k, point) for k, point in enumerate(POINTS))):
        line.tell(message)
    assert summary(line.tell(mavlink.MAVLink_mission_request_list_message(1, 1, LIST))) == [("count", 3)]
    for kind in (mavlink.MAVLink_mission_request_int_message, mavlink.MAVLink_mission_request_message):
        for number, point in enumerate(POINTS):
            (given,) = line.tell(kind(1, 1, number, LIST))
            assert (given.seq, given.frame) == (number, mavlink.MAV_FRAME_LOCAL_FLU)
            assert [given.x / 1e4, given.y / 1e4] == pytest.approx(point)
    beyond = line.tell(mavlink.MAVLink_mission_request_int_message(1, 1, 3, LIST))
    assert summary(beyond) == [("ack", mavlink.MAV_MISSION_INVALID_SEQUENCE)]


def test_a_silent_station_is_asked_again_and_then_given_up(line):
    line.tell(count(2))
    line.tell(item(0))
    heard = summary(line.hear(10.0))
    assert heard[:-1] == [("request", 1)] * 5
    assert heard[-1] == ("ack", mavlink.MAV_MISSION_OPERATION_CANCELLED)
    assert line.points.tolist() == OLD.tolist()
    assert "broke off after 1 of 2" in line.texts[0]


def test_an_upload_that_begins_again_begins_anew(line):
    line.tell(count(2))
    line.tell(item(0))
    assert summary(line.tell(count(1))) == [("request", 0)]
    line.tell(item(0, (5.0, 6.0)))
    assert line.points == pytest.approx(np.array([[5.0, 6.0]]))


def test_an_answer_that_was_lost_is_given_again(line):
    line.tell(count(1))
    line.tell(item(0))
    assert summary(line.tell(item(0))) == [("ack", mavlink.MAV_MISSION_ACCEPTED)]
    line.hear(6.0)
    assert summary(line.tell(item(0))) == [("ack", mavlink.MAV_MISSION_INVALID_SEQUENCE)]


def test_an_item_that_comes_twice_counts_once(line):
    line.tell(count(2))
    line.tell(item(0, (1.0, 1.0)))
    assert line.tell(item(0, (7.0, 7.0))) == []
    line.tell(item(1, (2.0, 2.0)))
    assert line.points == pytest.approx(np.array([[1.0, 1.0], [2.0, 2.0]]))


REFUSED = [
    ({"frame": mavlink.MAV_FRAME_GLOBAL_INT}, "UNSUPPORTED_FRAME"),
    ({"frame": mavlink.MAV_FRAME_LOCAL_NED}, "UNSUPPORTED_FRAME"),
    ({"command": mavlink.MAV_CMD_NAV_LAND}, "UNSUPPORTED"),
    ({"mission_type": mavlink.MAV_MISSION_TYPE_FENCE}, "UNSUPPORTED"),
    ({"param1": math.nan}, "INVALID_PARAM1"),
    ({"param1": 3.0}, "INVALID_PARAM1"),
    ({"param2": math.nan}, "INVALID_PARAM2"),
    ({"param3": math.inf}, "INVALID_PARAM3"),
    ({"param4": 90.0}, "INVALID_PARAM4"),
    ({"x": 0x7FFFFFFF}, "INVALID_PARAM5_X"),
    ({"y": -0x80000000}, "INVALID_PARAM6_Y"),
    ({"z": math.nan}, "INVALID_PARAM7"),
    ({"z": 1.0}, "INVALID_PARAM7"),
    ({"autocontinue": 0}, "INVALID"),
]


@pytest.mark.parametrize(("fields", "result"), REFUSED, ids=[f"{k}" for k, _ in REFUSED])
def test_what_is_no_waypoint_is_refused_by_its_own_name(line, fields, result):
    line.tell(count(2))
    line.tell(item(0))
    refused = line.tell(item(1, **fields))
    assert summary(refused) == [("ack", getattr(mavlink, f"MAV_MISSION_{result}"))]
    assert line.points.tolist() == OLD.tolist()
    assert "waypoint 2 refused" in line.texts[0]
    # The upload is over.
    assert line.hear(3.0) == []


def test_items_of_the_old_form_are_refused(line):
    line.tell(count(1))
    old = mavlink.MAVLink_mission_item_message(
        1, 1, 0, mavlink.MAV_FRAME_LOCAL_FLU, 16, 0, 1, 0, 0, 0, 0, 1, 2, 0
    )
    assert summary(line.tell(old)) == [("ack", mavlink.MAV_MISSION_UNSUPPORTED)]
    assert line.points.tolist() == OLD.tolist()
    assert line.tell(old) == []


@pytest.mark.parametrize("number", [2, 7])
def test_an_item_that_was_not_asked_for_ends_the_upload(line, number):
    line.tell(count(3))
    line.tell(item(0))
    assert summary(line.tell(item(number))) == [("ack", mavlink.MAV_MISSION_INVALID_SEQUENCE)]
    assert line.points.tolist() == OLD.tolist()


def test_more_than_there_is_room_for_is_refused(line):
    assert summary(line.tell(count(51))) == [("ack", mavlink.MAV_MISSION_NO_SPACE)]
    assert summary(line.tell(count(50))) == [("request", 0)]
    assert "51 are too many, at most 50" in line.texts[0]


def test_fences_and_rally_points_are_unsupported(line):
    kind = mavlink.MAV_MISSION_TYPE_FENCE
    (refused,) = line.tell(count(2, kind))
    assert (refused.type, refused.mission_type) == (mavlink.MAV_MISSION_UNSUPPORTED, kind)
    assert summary(line.tell(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))) == [
        ("ack", mavlink.MAV_MISSION_UNSUPPORTED)
    ]
    assert line.points.tolist() == OLD.tolist()


@pytest.mark.parametrize(
    "message", [count(0), mavlink.MAVLink_mission_clear_all_message(1, 1, LIST),
                mavlink.MAVLink_mission_clear_all_message(1, 1, mavlink.MAV_MISSION_TYPE_ALL)]
)  # fmt: skip
def test_a_list_can_be_emptied(line, message):
    assert summary(line.tell(message)) == [("ack", mavlink.MAV_MISSION_ACCEPTED)]
    assert len(line.points) == 0


def test_two_stations_do_not_mix_their_lists(line):
    other = Peer(255, 7)
    line.tell(count(2))
    assert summary(line.tell(count(1), peer=other)) == [("ack", mavlink.MAV_MISSION_DENIED)]
    assert summary(line.tell(item(0, (8.0, 8.0)), peer=other)) == [("ack", mavlink.MAV_MISSION_DENIED)]
    line.tell(item(0, (1.0, 0.0)))
    line.tell(item(1, (2.0, 0.0)))
    assert line.points[:, 0].tolist() == [1.0, 2.0]


def test_an_upload_can_be_called_off(line):
    line.tell(count(2))
    line.tell(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED, LIST))
    assert line.hear(5.0) == []
    assert line.points.tolist() == OLD.tolist()


def run(robot, ground, lose, guide):
    """Both ends, 50 times a second, on a line that loses frames, until the order has come to an end."""
    motion = MotionCommand(mode=Mode.WALK, guide=guide)
    for tick in range(3000):
        now = 0.02 * tick
        ground.steer(motion, now)
        robot.offer(snapshot(now))
        for end, other in ((robot, ground), (ground, robot)):
            while data := end.produce(now):
                if not lose():
                    other.receive(data, now)
        if ground.orders[-1].result:
            return
    raise AssertionError("an order must come to an end")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.6])
def test_on_a_lossy_line_a_list_arrives_whole_or_not_at_all(share):
    """At 10 % lost every upload arrives; at more it may fail, and then the robot has what it had."""
    rng = np.random.default_rng(11)
    came = 0
    for _ in range(20):
        robot, ground = RobotEnd(StationConfig(), 0.0), GroundEnd(StationConfig(), 0.0)
        robot.inbox.load(OLD)
        points = np.round(rng.uniform(-5.0, 5.0, (int(rng.integers(1, 12)), 2)), 4)
        guide = Guide(task=GuideTask.GOTO, waypoints=points, speed=0.12)
        run(robot, ground, lambda: rng.random() < share, guide)
        board, result = robot.inbox.tasks, ground.orders[-1].result
        if result == "accepted":
            came += 1
            assert board.points == pytest.approx(points)
            assert board.guide.waypoints == pytest.approx(points)
            assert board.guide.speed == pytest.approx(0.12)
        else:
            assert result in ("no answer", "operation cancelled", "invalid sequence")
            assert len(board.points) in (len(OLD), len(points))
            assert board.points == pytest.approx(points) or board.points.tolist() == OLD.tolist()
    assert came == 20 or share > 0.1


def test_a_refused_list_is_told_to_the_operator():
    robot, ground = RobotEnd(StationConfig(), 0.0), GroundEnd(StationConfig(), 0.0)
    many = Guide(task=GuideTask.GOTO, waypoints=np.zeros((51, 2)))
    run(robot, ground, lambda: False, many)
    assert (ground.orders[-1].order, ground.orders[-1].result) == (Order.GOTO, "no space")
    assert robot.inbox.tasks.guide is None


def test_on_a_noisy_line_a_list_is_true_or_does_not_arrive():
    """One byte in a hundred is wrong, so four frames in ten of an upload are."""
    rng = np.random.default_rng(12)
    came = 0
    for _ in range(10):
        robot, ground = RobotEnd(StationConfig(), 0.0), GroundEnd(StationConfig(), 0.0)
        robot.inbox.load(OLD)
        points = np.round(rng.uniform(-5.0, 5.0, (5, 2)), 4)
        motion = MotionCommand(mode=Mode.WALK, guide=Guide(task=GuideTask.GOTO, waypoints=points))
        for tick in range(3000):
            now = 0.02 * tick
            ground.steer(motion, now)
            robot.offer(snapshot(now))
            for end, other in ((robot, ground), (ground, robot)):
                data = np.frombuffer(sent(end, now), np.uint8).copy()
                hit = rng.random(data.size) < 0.01
                data[hit] = rng.integers(0, 256, int(hit.sum()))
                other.receive(data.tobytes(), now)
            if ground.orders[-1].result:
                break
        came += ground.orders[-1].result == "accepted"
        assert robot.inbox.tasks.points.shape in ((1, 2), (5, 2))
        assert robot.inbox.tasks.points == pytest.approx(
            points if len(robot.inbox.tasks.points) == 5 else OLD
        )
    assert came >= 8


def test_an_answer_to_the_list_before_is_no_answer_to_this_one():
    upload = MissionUpload(StationConfig(), POINTS, 0.0)
    ack = mavlink.MAVLink_mission_ack_message(255, 190, mavlink.MAV_MISSION_ACCEPTED, LIST)
    assert upload.due(0.0).count == 3
    upload.take(ack, 0.1)
    assert upload.result == ""
    for number in range(3):
        upload.take(mavlink.MAVLink_mission_request_int_message(255, 190, number, LIST), 0.2)
        assert upload.due(0.2).seq == number
    upload.take(ack, 0.3)
    assert upload.result == "accepted"
