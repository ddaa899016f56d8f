"""The station page's state and text."""

import numpy as np
import orjson

from bluefoot_mpc.io.station.ground import LinkQuality
from bluefoot_mpc.io.station.picture import RobotPicture, Way
from bluefoot_mpc.viz.station_view import StationView, station_page

from .html_check import PageReader

GOOD = LinkQuality(age=0.1, loss_down=0.0, loss_up=0.01, bad=2, bytes_down=2400.0, bytes_up=600.0)
NEVER = LinkQuality(age=float("inf"), loss_down=0.0, loss_up=0.0, bad=0, bytes_down=0.0, bytes_up=0.0)


def test_before_the_first_message_the_robot_stands_and_nothing_is_invented(robot):
    state = StationView(robot).state(RobotPicture(), NEVER)
    for key in ("time", "voltage", "load"):
        assert state[key] is None
    assert state["joints"] == state["temperatures"] == [None] * 16
    assert state["link"]["age"] is None
    np.testing.assert_allclose(state["q"], robot.default_stance())
    orjson.dumps(state, option=orjson.OPT_SERIALIZE_NUMPY)


def test_feet_follow_from_joints_and_attitude(robot):
    picture = RobotPicture()
    stance = robot.default_stance()
    picture.position, picture.rpy, picture.joints = stance[:3], np.zeros(3), stance[7:]
    picture.contact = np.array([True, False, True, True])
    state = StationView(robot).state(picture, GOOD)
    feet = np.array(state["feet"]).reshape(4, 3)
    # The default stance rests on z = 0.
    np.testing.assert_allclose(feet[:, 2], 0.0, atol=1e-9)
    assert feet[0, 0] > 0.1 > -0.1 > feet[3, 0]
    assert state["states"] == 0b1101_1101


def test_traffic_is_shown_as_a_share_of_the_radio(robot):
    link = StationView(robot).state(RobotPicture(), GOOD)["link"]
    assert round(link["down"], 3) == 0.417
    assert round(link["up"], 3) == 0.104


def test_texts_are_numbered_and_newest_last(robot):
    picture = RobotPicture()
    for number in range(30):
        picture.tell(f"line {number}", 6, 1.0 + number)
    texts = StationView(robot).state(picture, GOOD)["texts"]
    assert [text["text"] for text in texts] == [f"line {number}" for number in range(10, 30)]
    assert texts[-1]["number"] == 30


def test_how_the_robot_finds_its_way_is_shown_while_it_does(robot):
    picture, view = RobotPicture(), StationView(robot)
    assert view.state(picture, GOOD)["way"]["task"] == ""
    far = Way(
        lead="search", waypoints_left=0, clearance=np.inf, marker_age=3.0, marker=np.array([1.0, np.nan])
    )
    picture.task, picture.way, picture.why = "follow", far, "looking around"
    way = view.state(picture, GOOD)["way"]
    assert (way["task"], way["lead"], way["why"]) == ("follow", "search", "looking around")
    assert (way["clearance"], way["markerAge"], way["marker"]) == (None, 3.0, [1.0, None])
    picture.task = ""
    assert view.state(picture, GOOD)["way"]["lead"] == ""


def test_the_page_is_complete_in_itself(robot):
    text = station_page(robot)
    page = PageReader(text)
    assert not page.open
    assert len(page.ids) == len(set(page.ids))
    assert page.references == []
    for order in ("arm", "stand", "walk", "sit", "stop", "emergency"):
        assert f'data-order="{order}"' in text
    facts = orjson.loads(page.texts["facts"])
    assert [leg["name"] for leg in facts["legs"]] == ["FL", "FR", "RL", "RR"]
    assert len(facts["lower"]) == len(facts["upper"]) == 16
