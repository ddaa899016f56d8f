"""Tasks from a Python program: a robot in a thread that walks straight to its waypoints, over UDP."""

import contextlib
import socket
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.station.client import RemoteRobot
from bluefoot_mpc.io.station.link import StationLink
from bluefoot_mpc.io.station.source import LinkSource
from bluefoot_mpc.types import Guided, GuideTask, Mode, MotionCommand

from .made_up import snapshot
from .test_tasks import report

pytestmark = pytest.mark.slow


class Walker:
    """A robot behind a link: as fast as a train, and blind to walls; `gives_up`: never gets anywhere."""

    def __init__(self, address, gives_up=False):
        self.link, self.gives_up = StationLink(address), gives_up
        self.source = LinkSource(self.link, clock=MonotonicClock())
        self.at, self.seen, self.ending = np.zeros(2), [], threading.Event()
        self.thread = threading.Thread(target=self.live, daemon=True)
        self.thread.start()

    def live(self):
        start, guide, done = time.monotonic(), None, 0
        while not self.ending.wait(0.02):
            motion = self.source(0.0)
            if motion.guide is not guide:
                guide, done = motion.guide, 0
            self.seen.append(None if guide is None else guide.task)
            left = 0 if guide is None else len(guide.waypoints) - done
            if left:
                way = guide.waypoints[done] - self.at
                far = float(np.hypot(*way))
                done += 1 if far < 0.05 or self.gives_up else 0
                self.at = self.at if self.gives_up else self.at + way * min(1.0, 0.06 / max(far, 1e-9))
                left = len(guide.waypoints) - done
            told = snapshot(time.monotonic() - start, mode=motion.mode, position=np.array([*self.at, 0.1]))
            arrived = guide is not None and guide.task is GuideTask.GOTO and not left
            way = None if guide is None else report(left, Guided.ARRIVED if arrived else Guided.WAYPOINT)
            self.link.publish(replace(told.telemetry, motion=motion, navigation=way), told.frame, "active")

    def close(self):
        self.ending.set()
        self.thread.join()
        self.link.close()


@contextlib.contextmanager
def walker(**options):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    behind = Walker(f"udp:127.0.0.1:{port}", **options)
    try:
        with RemoteRobot(f"udpin:127.0.0.1:{port}", timeout=20.0) as robot:
            yield robot, behind
    finally:
        behind.close()


def stands(robot):
    end = time.monotonic() + 10.0
    while robot.picture().mode != Mode.STAND or robot.picture().task:
        assert time.monotonic() < end, "it did not stand in time"
        robot.command(MotionCommand())
        time.sleep(0.04)
    return True


def test_the_robot_goes_there_and_says_so():
    with walker() as (robot, behind):
        assert robot.goto([(1.0, 0.5), (0.0, 1.0)], seconds=30.0)
        assert behind.at == pytest.approx([0.0, 1.0], abs=0.06)
        assert stands(robot)
        # Again, and what is left of the first time does not count.
        assert robot.goto([(1.0, 0.0), (0.5, 0.0)], seconds=30.0)
        assert behind.at == pytest.approx([0.5, 0.0], abs=0.06)


def test_a_robot_that_finds_no_way_has_not_arrived():
    with walker(gives_up=True) as (robot, _):
        assert not robot.goto([(1.0, 0.5), (2.0, 0.0)], seconds=30.0)
        end = time.monotonic() + 10.0
        while not robot.link.look(lambda picture: any("given up" in text.text for text in picture.texts)):
            assert time.monotonic() < end, "it was not told in time"
            time.sleep(0.04)


def test_time_that_is_up_ends_the_way():
    with walker() as (robot, _):
        assert not robot.goto([(900.0, 0.0)], seconds=1.5)
        assert stands(robot)


def test_other_tasks_last_as_long_as_they_are_asked_for():
    with walker() as (robot, behind):
        robot.wander(1.0)
        robot.follow(1.0, distance=0.8)
        assert stands(robot)
        assert {GuideTask.WANDER, GuideTask.FOLLOW} <= set(behind.seen)
        assert behind.seen[-1] is None


def test_what_cannot_be_is_refused():
    with walker() as (robot, _):
        with pytest.raises(ConfigurationError, match="point"):
            robot.goto([])
        with pytest.raises(DeviceError, match="no space"):
            robot.goto([(1.0, 0.0)] * 51)
