from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.runtime import pictures
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.pictures import PictureBook, shrink
from bluefoot_mpc.types import CameraImage, Guided, MotionCommand, NavigationReport, SensorFrame, Telemetry

from . import made_up_run

TICKS_PER_PICTURE = 5


def report(marker: float = np.nan, guided: Guided = Guided.SEARCH, age: float = np.inf) -> NavigationReport:
    return NavigationReport(
        guided=guided, velocity=np.zeros(2), yaw_rate=0.0, pitch=0.0, field=np.zeros(2), potential=0.0,
        mixing=0.0, marker=np.array([marker, 240.0, 30.0]), marker_position=np.zeros(3), marker_age=age,
        clearance=1.0,
    )  # fmt: skip


class Run:
    """Ticks of 20 ms; every fifth has a picture whose brightness tells its number."""

    def __init__(self) -> None:
        rng = np.random.default_rng(0)
        self.book = PictureBook()
        self.ticks = 0
        self._frame = dataclasses.replace(made_up_run.frame(rng, 0.0, 4, False), lidar=None, camera=None)
        self._telemetry = made_up_run.telemetry(rng, 0.0, MotionCommand())

    def tick(self, navigation: NavigationReport | None = None) -> None:
        frame, telemetry = self.next(navigation)
        self.book.keep(frame, telemetry)

    def next(self, navigation: NavigationReport | None) -> tuple[SensorFrame, Telemetry]:
        time, number = 0.02 * self.ticks, self.ticks // TICKS_PER_PICTURE
        camera = None
        if self.ticks % TICKS_PER_PICTURE == 0:
            camera = CameraImage(time=time, pixels=np.full((480, 640, 3), number % 256, np.uint8), valid=True)
        self.ticks += 1
        return (
            dataclasses.replace(self._frame, time=time, camera=camera),
            dataclasses.replace(self._telemetry, time=time, navigation=navigation),
        )


def test_one_picture_every_two_seconds() -> None:
    run = Run()
    for _ in range(500):
        run.tick()
    kept = run.book.pictures()
    assert [picture.time for picture in kept] == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0])
    assert [int(picture.pixels[0, 0, 0]) for picture in kept] == [0, 20, 40, 60, 80]
    assert all(picture.shrunk == 2 and picture.pixels.shape == (240, 320, 3) for picture in kept)


def test_a_long_run_keeps_few_that_are_spread_over_all_of_it() -> None:
    run = Run()
    for _ in range(30000):  # ten minutes
        run.tick()
    times = np.array([picture.time for picture in run.book.pictures()])
    assert pictures.MOST // 2 <= len(times) <= pictures.MOST
    assert times[0] == 0.0
    assert times[-1] > 560.0
    assert np.ptp(np.diff(times)) < 0.2


def test_what_happens_to_the_marker_is_kept_with_its_picture() -> None:
    run = Run()
    for k in range(400):
        seen = 107 <= k < 203 or k >= 300
        age = 0.0 if seen else 0.02 * (k - 202) if k >= 203 else np.inf
        guided = Guided.ARRIVED if k >= 352 else Guided.MARKER if seen else Guided.SEARCH
        run.tick(report(100.0 + k if seen else np.nan, guided, age))
    events = {picture.event: picture for picture in run.book.pictures() if picture.event}
    assert set(events) == {
        pictures.FIRST_SEEN, pictures.MARKER_LOST, pictures.SEEN_AGAIN, pictures.ARRIVED
    }  # fmt: skip
    assert events[pictures.FIRST_SEEN].time == pytest.approx(107 * 0.02)
    assert events[pictures.MARKER_LOST].time == pytest.approx(253 * 0.02)
    assert events[pictures.SEEN_AGAIN].time == pytest.approx(300 * 0.02)
    assert events[pictures.SEEN_AGAIN].marker[0] == 400.0
    # The newest picture stands for an event between two of them, with what was found in that one.
    assert int(events[pictures.ARRIVED].pixels[0, 0, 0]) == 352 // TICKS_PER_PICTURE
    assert events[pictures.ARRIVED].marker[0] == 100.0 + 350


def test_a_marker_that_flickers_does_not_fill_the_memory() -> None:
    run = Run()
    for k in range(6000):
        seen = (k // 100) % 2 == 0
        run.tick(report(300.0 if seen else np.nan, age=0.0 if seen else 0.02 * (k % 100 + 1)))
    again = [picture for picture in run.book.pictures() if pictures.SEEN_AGAIN in picture.event]
    assert len(again) == pictures.PER_EVENT
    assert again[0].time == pytest.approx(4.0)
    assert again[-1].time == pytest.approx(116.0)
    assert len(run.book) <= pictures.MOST + 2 * pictures.PER_EVENT + 1


def test_invalid_pictures_and_runs_without_any_keep_nothing() -> None:
    run = Run()
    frame, telemetry = run.next(report(300.0))
    assert frame.camera is not None
    run.book.keep(
        dataclasses.replace(frame, camera=dataclasses.replace(frame.camera, valid=False)), telemetry
    )
    run.book.keep(dataclasses.replace(frame, camera=None), telemetry)
    assert run.book.pictures() == ()


@pytest.mark.parametrize(
    "pixels",
    [
        np.zeros((480, 640), np.uint8),
        np.zeros((480, 640, 4), np.uint8),
        np.zeros((480, 640, 3), np.float64),
        np.zeros((0, 0, 3), np.uint8),
        None,
    ],
)
def test_what_is_no_picture_is_not_kept(pixels: object) -> None:
    run = Run()
    frame, telemetry = run.next(report(300.0))
    run.book.keep(
        dataclasses.replace(frame, camera=CameraImage(time=0.0, pixels=pixels, valid=True)), telemetry
    )  # type: ignore[arg-type]
    assert len(run.book) == 0


@pytest.mark.parametrize("shape", [(1, 1, 3), (3, 5000, 3), (17, 8000, 3), (1080, 1920, 3)])
def test_pictures_of_any_size_shrink(shape: tuple[int, int, int]) -> None:
    small, side = shrink(np.full(shape, 77, np.uint8))
    assert (small == 77).all()
    assert small.shape == (shape[0] // side, shape[1] // side, 3)


def test_a_run_keeps_pictures() -> None:
    data, run = RunData(), Run()
    data.keep_picture(*run.next(report(300.0)))
    (picture,) = data.pictures.pictures()
    assert picture.event == pictures.FIRST_SEEN
    assert data == RunData(versions=data.versions)


def test_shrinking_gives_the_mean_of_squares() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (481, 641, 3), dtype=np.uint8)
    small, side = shrink(pixels)
    assert side == 2
    assert small.shape == (240, 320, 3)
    assert abs(int(small[5, 7, 1]) - pixels[10:12, 14:16, 1].mean()) < 1.0
    same, side = shrink(pixels[:120, :160])
    assert side == 1
    assert np.array_equal(same, pixels[:120, :160])
