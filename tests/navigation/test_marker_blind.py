"""Tasks with a marker when the camera tells nothing, or what cannot be."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from bluefoot_mpc.navigation.marker_task import MarkerTask, MarkerTaskConfig, MarkerWish
from bluefoot_mpc.types import CameraImage, Guide, Guided, GuideTask
from tests.navigation.bench import MOUNTS, sensor_frame
from tests.navigation.pictures import Shot, drawn
from tests.navigation.test_target import state

FOLLOW = Guide(task=GuideTask.FOLLOW, speed=0.2, distance=0.6)


def picture(time: float) -> CameraImage:
    """The ball 1.2 m straight ahead."""
    return drawn(Shot(ball=(0.0, 0.0, 1.2), size=(160, 120)), None, time)


def run(task: MarkerTask, start: float, seconds: float, image: CameraImage | None) -> list[MarkerWish]:
    """Tick for a while; the picture, if any, comes ten times a second with the time of its tick."""
    wishes = []
    for tick in range(round(seconds / 0.02)):
        time = start + 0.02 * tick
        new = replace(image, time=time) if image is not None and tick % 5 == 0 else None
        pose = state(time, 0.0, 0.0, 0.0)
        wishes.append(task.step(FOLLOW, replace(sensor_frame(time), camera=new), pose, 0.02))
    return wishes


@pytest.fixture
def task() -> MarkerTask:
    return MarkerTask(MarkerTaskConfig(), MOUNTS)


def test_a_camera_that_dies_shows_nothing_after_half_a_second_and_the_robot_stands_after_two(
    task: MarkerTask,
) -> None:
    assert run(task, 0.0, 1.0, picture(0.0))[-1].guided is Guided.MARKER
    wishes = run(task, 1.0, 4.0, None)
    assert not math.isnan(wishes[5].marker[2])
    assert all(math.isnan(wish.marker[2]) for wish in wishes[30:])
    assert wishes[-1].guided is Guided.BLIND
    assert not any(wishes[-1].motion)
    assert "no picture of the camera for 4 s" in wishes[-1].reason
    assert run(task, 5.0, 1.0, picture(0.0))[-1].guided is Guided.MARKER


def test_without_any_camera_the_robot_soon_stands_and_says_why(task: MarkerTask) -> None:
    wishes = run(task, 0.0, 4.0, None)
    assert wishes[0].guided is Guided.SEARCH
    assert wishes[-1].guided is Guided.BLIND
    assert "no picture" in wishes[-1].reason


def test_invalid_pictures_are_none(task: MarkerTask) -> None:
    assert run(task, 0.0, 4.0, replace(picture(0.0), valid=False))[-1].guided is Guided.BLIND


def test_a_picture_of_the_future_is_not_believed(task: MarkerTask) -> None:
    pose = state(0.0, 0.0, 0.0, 0.0)
    task.step(FOLLOW, replace(sensor_frame(0.0), camera=picture(20.0)), pose, 0.02)
    wish = run(task, 0.02, 0.5, None)[-1]
    assert wish.guided is Guided.SEARCH
    assert math.isnan(wish.marker[2])
    assert run(task, 0.6, 1.0, picture(0.0))[-1].guided is Guided.MARKER
