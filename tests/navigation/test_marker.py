"""The marker in pictures: how exactly, before walls, behind obstacles, and what is not one."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.navigation.marker import MarkerConfig, MarkerFinder, Sighting
from bluefoot_mpc.types import CameraImage
from tests.navigation.pictures import MARKER, NEAR_MARKER, Shot, direction, drawn, expected


@pytest.fixture
def finder() -> MarkerFinder:
    return MarkerFinder(MarkerConfig())


def assert_measured(seen: Sighting | None, shot: Shot, centre: float = 1.0, radius: float = 0.03) -> None:
    assert seen is not None
    column, row, size = expected(shot)
    assert math.hypot(seen.column - column, seen.row - row) <= centre
    assert seen.radius == pytest.approx(size, rel=radius)


@pytest.mark.parametrize("bearing_deg", [-25.0, 0.0, 13.0, 26.0])
@pytest.mark.parametrize("distance", [0.3, 0.45, 0.6, 1.0, 2.0, 3.0, 4.0])
def test_centre_within_a_pixel_and_radius_within_three_percent(
    finder: MarkerFinder, distance: float, bearing_deg: float
) -> None:
    rng = np.random.default_rng(int(100 * distance) + int(bearing_deg) + 50)
    shot = Shot(
        ball=direction(distance, bearing_deg, up=float(rng.uniform(-0.03, 0.06))),
        exposure=float(rng.uniform(0.9, 1.1)),
    )
    seen = finder.find(drawn(shot, rng))
    assert_measured(seen, shot)
    assert finder.reason == ""


def test_a_ball_in_the_corner_has_the_same_radius(finder: MarkerFinder) -> None:
    # There its outline is an ellipse, a fifth longer than wide.
    shot = Shot(ball=(0.40, 0.28, 0.80))
    assert_measured(finder.find(drawn(shot, np.random.default_rng(0))), shot, radius=0.01)


@pytest.mark.parametrize("size", [(320, 240), (1280, 720), (160, 120), (641, 479)])
def test_pictures_of_another_size_have_another_focal_length(
    finder: MarkerFinder, size: tuple[int, int]
) -> None:
    shot = Shot(ball=(0.05, -0.02, 0.6), size=size)
    seen = finder.find(drawn(shot, np.random.default_rng(1)))
    assert_measured(seen, shot)
    assert seen is not None
    assert (seen.width, seen.height) == size


@pytest.mark.parametrize("colour", [NEAR_MARKER, (0.88, 0.12, 0.52), (0.75, 0.10, 0.45), (0.60, 0.07, 0.37)])
@pytest.mark.parametrize("kind", ["behind", "half behind", "beside"])
def test_a_wall_of_nearly_its_colour(
    finder: MarkerFinder, kind: str, colour: tuple[float, float, float]
) -> None:
    found = 0
    for k, distance in enumerate((0.45, 0.6, 1.0, 1.7)):
        rng = np.random.default_rng(k)
        shot = Shot(ball=direction(distance, float(rng.uniform(-15, 15))), light=(0.2, -0.9, -0.3))
        column, _, radius = expected(shot)
        box = {
            "behind": (0.0, 0.0, 640.0, 330.0),
            "half behind": (0.0, 0.0, column, 330.0),
            "beside": (column + 1.02 * radius, 0.0, 640.0, 330.0),
        }[kind]
        shot = replace(shot, behind=((box, colour),))
        seen = finder.find(drawn(shot, rng))
        if seen is not None:
            assert_measured(seen, shot, centre=2.0, radius=0.04)
            found += 1
    assert found >= 3


@pytest.mark.parametrize("side", ["left", "right", "lower"])
def test_an_obstacle_before_it(finder: MarkerFinder, side: str) -> None:
    found = 0
    for k, distance in enumerate((0.5, 0.8, 1.2, 2.0)):
        rng = np.random.default_rng(k)
        shot = Shot(ball=direction(distance, float(rng.uniform(-15, 15))))
        column, row, radius = expected(shot)
        cut = float(rng.uniform(-0.3, 0.3)) * radius
        box = {
            "left": (0.0, 0.0, column + cut, 480.0),
            "right": (column + cut, 0.0, 640.0, 480.0),
            "lower": (0.0, row + abs(cut), 640.0, 480.0),
        }[side]
        seen = finder.find(drawn(replace(shot, before=((box, (0.5, 0.5, 0.45)),)), rng))
        if seen is not None:
            assert_measured(seen, shot, centre=max(1.5, 0.04 * radius), radius=0.05)
            found += 1
    assert found >= 3


def test_a_ball_that_the_edge_of_the_picture_cuts(finder: MarkerFinder) -> None:
    found = 0
    for k, out in enumerate(np.linspace(-0.8, 0.8, 9)):  # radii by which its middle is outside
        rng = np.random.default_rng(k)
        distance = float(rng.uniform(0.4, 1.5))
        shot = Shot(ball=(0.0, 0.0, distance))
        radius = expected(shot)[2]
        right = (320.0 + out * radius) / 522.2 * distance
        shot = replace(shot, ball=(right, 0.02, distance))
        seen = finder.find(drawn(shot, rng))
        if seen is not None:
            assert_measured(seen, shot, centre=max(1.5, 0.06 * radius), radius=0.06)
            found += 1
        assert seen is not None or out > 0.0
    assert found >= 5


def test_where_it_is_expected_it_is_found_too(finder: MarkerFinder) -> None:
    shot = Shot(ball=(0.05, 0.0, 0.6), behind=(((0.0, 0.0, 640.0, 330.0), NEAR_MARKER),))
    column, row, radius = expected(shot)
    image = drawn(shot, np.random.default_rng(0))
    assert_measured(finder.find(image, (column + 6.0, row - 4.0, 1.08 * radius)), shot)
    # A wrong idea of where it is does no harm.
    for wrong in ((100.0, 100.0, 40.0), (math.nan, 0.0, 30.0), (1e9, -1e9, 50.0), (320.0, 240.0, 0.0)):
        assert_measured(finder.find(image, wrong), shot)


def test_nothing_is_seen_in_two_hundred_pictures_without_a_marker(finder: MarkerFinder) -> None:
    rng = np.random.default_rng(3)
    false = [k for k in range(200) if finder.find(_without_marker(rng, k)) is not None]
    assert false == []


@pytest.mark.parametrize("shape", ["square", "triangle", "stripe", "ellipse"])
@pytest.mark.parametrize("size", [8, 20, 60])
def test_other_shapes_of_its_colour_are_not_it(finder: MarkerFinder, shape: str, size: int) -> None:
    pixels = drawn(Shot(), np.random.default_rng(0)).pixels.copy()
    colour = [round(255 * value) for value in MARKER]
    middle = (300, 200)
    if shape == "square":
        cv2.rectangle(pixels, (300 - size, 200 - size), (300 + size, 200 + size), colour, -1)
    elif shape == "triangle":
        corners = np.array([[300, 200 - size], [300 - size, 200 + size], [300 + size, 200 + size]], np.int32)
        cv2.fillPoly(pixels, [corners], colour)
    elif shape == "stripe":
        cv2.rectangle(pixels, (300 - size // 4, 0), (300 + size // 4, 480), colour, -1)
    else:
        cv2.ellipse(pixels, middle, (size, size // 2), 20.0, 0.0, 360.0, colour, -1)
    assert finder.find(CameraImage(time=0.0, pixels=pixels, valid=True)) is None


@pytest.mark.parametrize(
    ("pixels", "reason"),
    [
        (np.zeros((0, 0, 3), np.uint8), "smaller"),
        (np.zeros((480, 0, 3), np.uint8), "smaller"),
        (np.zeros((10, 10, 3), np.uint8), "smaller"),
        (np.zeros((480, 640), np.uint8), "red, green and blue"),
        (np.zeros((480, 640, 1), np.uint8), "red, green and blue"),
        (np.zeros((480, 640, 4), np.uint8), "red, green and blue"),
        (np.zeros((480, 640, 3)), "bytes"),
        (np.full((480, 640, 3), np.nan, np.float32), "bytes"),
        ([[1, 2, 3]], "bytes"),
        (None, "bytes"),
    ],
)
def test_what_is_no_picture_is_not_seen_and_says_why(
    finder: MarkerFinder, pixels: object, reason: str
) -> None:
    image = CameraImage(time=0.0, pixels=pixels, valid=True)  # type: ignore[arg-type]
    assert finder.find(image) is None
    assert reason in finder.reason


def test_no_picture_an_invalid_one_and_one_without_time(finder: MarkerFinder) -> None:
    good = drawn(Shot(ball=(0.0, 0.0, 0.6)))
    assert finder.find(None) is None
    assert finder.reason == "no picture"
    assert finder.find(replace(good, valid=False)) is None
    assert "unusable" in finder.reason
    assert finder.find(replace(good, time=math.nan)) is None
    assert "time" in finder.reason
    assert finder.find(good) is not None
    assert finder.reason == ""


def test_pixels_that_do_not_lie_in_order(finder: MarkerFinder) -> None:
    shot = Shot(ball=(0.03, 0.0, 0.6))
    image = drawn(shot)
    turned = np.asfortranarray(image.pixels)
    assert_measured(finder.find(replace(image, pixels=turned)), shot)
    mirrored = finder.find(replace(image, pixels=image.pixels[:, ::-1]))
    assert mirrored is not None
    assert mirrored.column == pytest.approx(640.0 - expected(shot)[0], abs=0.5)


@settings(max_examples=40, deadline=None)
@given(
    arrays(
        np.uint8,
        st.tuples(st.integers(1, 60), st.integers(1, 60), st.just(3)),
        elements=st.sampled_from([0, 25, 140, 230, 255]),
    )
)
def test_no_picture_upsets_it(pixels: np.ndarray) -> None:
    MarkerFinder(MarkerConfig()).find(CameraImage(time=0.0, pixels=pixels, valid=True))


def test_pictures_of_grain_are_empty(finder: MarkerFinder) -> None:
    rng = np.random.default_rng(0)
    for spread in (1.0, 10.0, 60.0):
        values = 255.0 * np.array(MARKER) + rng.normal(0.0, spread, (240, 320, 3))
        pixels = np.clip(values, 0, 255).astype(np.uint8)
        assert finder.find(CameraImage(time=0.0, pixels=pixels, valid=True)) is None


def test_a_marker_of_another_colour() -> None:
    green = MarkerConfig(red=0.1, green=0.8, blue=0.2)
    red = MarkerConfig(red=0.9, green=0.08, blue=0.08)  # hues on both sides of zero
    for config in (green, red):
        shot = Shot(ball=(0.05, 0.0, 0.8), colour=(config.red, config.green, config.blue))
        assert_measured(MarkerFinder(config).find(drawn(shot, np.random.default_rng(0))), shot)
        assert MarkerFinder(config).find(drawn(replace(shot, colour=MARKER))) is None


@pytest.mark.parametrize(
    "wrong", [{"red": 1.5}, {"least_radius": 0.0}, {"rays": 3}, {"least_arc_deg": 10.0}, {"candidates": 0}]
)
def test_impossible_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        MarkerConfig(**wrong)  # type: ignore[arg-type]


def _without_marker(rng: np.random.Generator, k: int) -> CameraImage:
    """Walls, boxes and polygons, most of them nearly of the marker's colour; every fifth one of its own."""
    walls = []
    for _ in range(int(rng.integers(0, 4))):
        left, upper = rng.uniform(-100, 600), rng.uniform(-100, 400)
        tint = np.clip(np.array(MARKER) * rng.uniform(0.5, 1.1) + rng.normal(0.0, 0.07, 3), 0.0, 1.0)
        tint = np.array(MARKER) if k % 5 == 0 else tint
        box = (left, upper, left + rng.uniform(4, 500), upper + rng.uniform(4, 300))
        walls.append((box, tuple(tint.tolist())))
    things = []
    for _ in range(int(rng.integers(0, 4))):
        left, upper = rng.uniform(-50, 600), rng.uniform(-50, 400)
        box = (left, upper, left + rng.uniform(4, 200), upper + rng.uniform(4, 300))
        things.append((box, tuple(rng.uniform(0.0, 1.0, 3).tolist())))
    shot = Shot(behind=tuple(walls), before=tuple(things), exposure=float(rng.uniform(0.9, 1.1)))
    return drawn(shot, rng)
