"""Approaching and following with drawn pictures, a gliding robot and late exposures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from bluefoot_mpc.geometry import rotation_from_rpy, wrap_angle
from bluefoot_mpc.navigation import route
from bluefoot_mpc.navigation.marker_task import MarkerTask, MarkerTaskConfig, MarkerWish
from bluefoot_mpc.types import BodyState, CameraImage, Guide, Guided, GuideTask, SensorFrame
from tests.navigation.bench import MOUNTS, sensor_frame
from tests.navigation.pictures import Shot, drawn
from tests.navigation.test_target import state

APPROACH = Guide(task=GuideTask.APPROACH, speed=0.2, distance=0.6)
FOLLOW = Guide(task=GuideTask.FOLLOW, speed=0.2, distance=0.6)
Path = Callable[[float], tuple[float, float]]


@dataclass
class Stage:
    """A robot that glides as it is told, with a lag, and pictures that come 0.1 s late."""

    marker: Path
    yaw: float = 0.0
    x: float = 0.0
    hidden: Callable[[float], bool] = lambda _: False
    time: float = 0.0
    y: float = 0.0
    speed: float = 0.0
    turn: float = 0.0
    waiting: list[tuple[float, CameraImage]] = field(default_factory=list)

    def run(self, task: MarkerTask, guide: Guide, seconds: float) -> list[MarkerWish]:
        wishes = []
        for k in range(int(seconds / 0.02)):
            pose = state(self.time, self.x, self.y, self.yaw)
            if k % 5 == 0:
                self.waiting.append((self.time + 0.1, self.picture(pose)))
            image = self.waiting.pop(0)[1] if self.waiting[0][0] <= self.time + 1e-9 else None
            wish = task.step(guide, replace(sensor_frame(self.time), camera=image), pose, 0.02)
            wishes.append(wish)
            self.move(wish, guide)
        return wishes

    def picture(self, pose: BodyState) -> CameraImage:
        there = np.array([*self.marker(self.time), 0.2]) - pose.position
        x, y, z = rotation_from_rpy(pose.rpy).T @ there - np.array(MOUNTS.camera)
        ball = None if x < 0.1 or self.hidden(self.time) else (-y, -z, x)
        return drawn(Shot(ball=ball, size=(160, 120)), None, self.time)

    def move(self, wish: MarkerWish, guide: Guide) -> None:
        forward, turn = wish.motion.x, wish.motion.yaw_rate
        if wish.share < 1.0 and wish.goal is not None:
            dx, dy = wish.goal[0] - self.x, wish.goal[1] - self.y
            bearing = wrap_angle(math.atan2(dy, dx) - self.yaw)
            lidar = route.turning_to(bearing, guide.speed, route.RouteConfig())
            forward = wish.share * forward + (1.0 - wish.share) * lidar.x
            turn = wish.share * turn + (1.0 - wish.share) * lidar.yaw_rate
        self.speed += 0.02 / 0.3 * (forward - self.speed)
        self.turn += 0.02 / 0.2 * (turn - self.turn)
        self.x += 0.02 * self.speed * math.cos(self.yaw)
        self.y += 0.02 * self.speed * math.sin(self.yaw)
        self.yaw = wrap_angle(self.yaw + 0.02 * self.turn)
        self.time += 0.02

    def distance(self) -> float:
        """m from the camera to the marker."""
        ahead = MOUNTS.camera[0]
        mx, my = self.marker(self.time)
        return math.hypot(mx - self.x - ahead * math.cos(self.yaw), my - self.y - ahead * math.sin(self.yaw))


@pytest.fixture
def task() -> MarkerTask:
    return MarkerTask(MarkerTaskConfig(), MOUNTS)


def standing_at(x: float, y: float) -> Path:
    return lambda _: (x, y)


@pytest.mark.parametrize(("x", "y"), [(2.5, 0.4), (0.9, 0.0), (0.5, 0.1)])
def test_approach_stops_at_the_distance(task: MarkerTask, x: float, y: float) -> None:
    stage = Stage(marker=standing_at(x, y))
    wishes = stage.run(task, APPROACH, 30.0)
    assert wishes[-1].guided is Guided.ARRIVED
    assert abs(stage.distance() - 0.6) < 0.03
    assert wishes[-1].motion == (0.0, 0.0, 0.0)
    assert wishes[-1].position == pytest.approx([x, y, 0.2], abs=0.03)


def test_a_marker_behind_is_found_by_looking_around(task: MarkerTask) -> None:
    stage = Stage(marker=standing_at(-1.5, 0.2))
    wishes = stage.run(task, APPROACH, 35.0)
    assert wishes[0].guided is Guided.SEARCH
    assert wishes[-1].guided is Guided.ARRIVED
    assert abs(stage.distance() - 0.6) < 0.03


def test_a_marker_that_stands_is_gone_to_while_it_is_hidden(task: MarkerTask) -> None:
    stage = Stage(marker=standing_at(2.3, 0.4), hidden=lambda t: 1.0 < t < 8.0)
    wishes = stage.run(task, APPROACH, 6.0)
    unseen = wishes[200:300]
    assert all(w.guided is Guided.MARKER and w.mixing == 0.0 and w.share == 0.0 for w in unseen)
    assert all(math.isnan(w.marker[2]) and w.goal is not None for w in unseen)
    assert stage.x > 0.5


def _circle(time: float) -> tuple[float, float]:
    angle = 0.12 * time
    return 0.8 + math.sin(angle), 1.0 - math.cos(angle)


def test_follow_keeps_the_leader_in_view_and_at_its_distance(task: MarkerTask) -> None:
    stage = Stage(marker=_circle)
    wishes = stage.run(task, FOLLOW, 40.0)
    seen = [not math.isnan(w.marker[2]) for w in wishes]
    assert np.mean(seen) > 0.98
    assert abs(stage.distance() - 0.6) < 0.04


def test_a_leader_that_stops_is_stood_behind(task: MarkerTask) -> None:
    stage = Stage(marker=lambda t: (0.8 + 0.1 * min(t, 10.0), 0.0))
    wishes = stage.run(task, FOLLOW, 30.0)
    assert all(w.guided is Guided.ARRIVED and w.motion == (0.0, 0.0, 0.0) for w in wishes[-300:])
    assert abs(stage.distance() - 0.6) < 0.09


def test_a_leader_hidden_for_a_moment_is_not_lost(task: MarkerTask) -> None:
    stage = Stage(marker=_circle, hidden=lambda t: 10.0 < t < 11.5)
    wishes = stage.run(task, FOLLOW, 25.0)
    assert all(w.guided is Guided.MARKER for w in wishes[500:580])
    assert all(w.mixing == 0.0 for w in wishes[520:570])
    assert wishes[-1].guided is Guided.MARKER
    assert abs(stage.distance() - 0.6) < 0.06


def test_a_leader_that_is_gone_is_looked_for(task: MarkerTask) -> None:
    stage = Stage(marker=standing_at(1.2, 0.0), hidden=lambda t: t > 3.0)
    wishes = stage.run(task, FOLLOW, 40.0)
    assert wishes[-1].guided is Guided.SEARCH
    reasons = {w.reason for w in wishes if w.guided is Guided.SEARCH}
    assert {"looking around", "going to where the marker was lost"} <= reasons
    assert wishes[-1].reason == "wandering"
    assert np.isnan(wishes[-1].position).all()  # there it is not


@pytest.mark.parametrize(
    "image",
    [
        CameraImage(time=0.0, pixels=np.zeros((480, 640), np.uint8), valid=True),
        CameraImage(time=0.0, pixels=np.zeros((0, 0, 3), np.uint8), valid=True),
        CameraImage(time=math.nan, pixels=np.zeros((480, 640, 3), np.uint8), valid=True),
        CameraImage(time=0.0, pixels=np.zeros((480, 640, 3), np.uint8), valid=False),
        CameraImage(time=0.0, pixels=None, valid=True),  # type: ignore[arg-type]
    ],
)
def test_bad_pictures_make_the_robot_search(task: MarkerTask, image: CameraImage) -> None:
    frame: SensorFrame = replace(sensor_frame(0.0), camera=image)
    wish = task.step(APPROACH, frame, state(0.0), 0.02)
    assert wish.guided is Guided.SEARCH
    assert np.isnan(wish.marker).all()
    assert wish.age == math.inf


def test_reset_gives_the_same_run_again(task: MarkerTask) -> None:
    def motions() -> list[tuple[float, float, float]]:
        stage = Stage(marker=standing_at(1.2, 0.2))
        return [tuple(w.motion) for w in stage.run(task, APPROACH, 4.0)]

    first = motions()
    task.reset()
    assert motions() == first
