"""The marker in the odometry frame: range, late pictures, smoothing, prediction."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy
from bluefoot_mpc.navigation.marker import Sighting
from bluefoot_mpc.navigation.target import Target, TargetConfig, ball_range, direction_in_base
from bluefoot_mpc.types import BodyState
from tests.navigation.bench import MOUNTS

FOCAL = MOUNTS.focal_length(640)
BALL = 0.06


def state(
    time: float, x: float = 0.0, y: float = 0.0, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0
) -> BodyState:
    rpy = np.array([roll, pitch, yaw])
    return BodyState(
        time=time, position=np.array([x, y, 0.12]), quaternion=quaternion_from_rpy(rpy), rpy=rpy,
        linear_velocity=np.zeros(3), angular_velocity=np.zeros(3), joint_position=np.zeros(16),
        joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool), foot_position_in_base=np.zeros((4, 3)),
        height=0.12,
    )  # fmt: skip


def sighting(pose: BodyState, marker: np.ndarray, time: float | None = None) -> Sighting:
    """What a pinhole sees of a ball at (3,) `marker` m from this pose."""
    rotation = rotation_from_rpy(pose.rpy)
    x, y, z = rotation.T @ (marker - pose.position) - np.array(MOUNTS.camera)
    radius = FOCAL * math.tan(math.asin(BALL / math.hypot(x, y, z)))
    return Sighting(
        time=pose.time if time is None else time, column=320.0 - FOCAL * y / x, row=240.0 - FOCAL * z / x,
        radius=radius, width=640, height=480, focal=FOCAL, arc=1.0, support=1.0,
    )  # fmt: skip


@pytest.fixture
def target() -> Target:
    return Target(TargetConfig(), MOUNTS)


@pytest.mark.parametrize("distance", [0.1, 0.3, 0.6, 2.0, 6.0])
def test_range_is_exact_for_a_ball_where_the_plain_rule_is_short(distance: float) -> None:
    radius = FOCAL * math.tan(math.asin(BALL / distance))
    assert ball_range(radius, FOCAL, BALL) == pytest.approx(distance, rel=1e-12)
    assert FOCAL * BALL / radius == pytest.approx(math.sqrt(distance**2 - BALL**2), rel=1e-12)


def test_direction_is_forward_left_up() -> None:
    seen = sighting(state(0.0), np.array([2.0, 0.5, 0.4]))
    x, y, z = direction_in_base(seen)
    assert y / x == pytest.approx(0.5 / (2.0 - MOUNTS.camera[0]))
    assert z / x == pytest.approx((0.4 - 0.12 - MOUNTS.camera[2]) / (2.0 - MOUNTS.camera[0]))


@pytest.mark.parametrize("yaw", [0.0, 1.0, -3.0])
def test_one_sighting_gives_the_place(target: Target, yaw: float) -> None:
    pose = state(1.0, 0.3, -0.2, yaw, pitch=0.05, roll=-0.04)
    marker = np.array([0.3 + 1.5 * math.cos(yaw + 0.2), -0.2 + 1.5 * math.sin(yaw + 0.2), 0.2])
    target.remember(pose)
    assert target.see(sighting(pose, marker))
    assert target.position_at(1.0) == pytest.approx(marker, abs=1e-9)
    relative = target.relative(pose)
    assert relative is not None
    camera = pose.position + rotation_from_rpy(pose.rpy) @ np.array(MOUNTS.camera)
    assert relative.distance == pytest.approx(math.hypot(*(marker - camera)[:2]), abs=1e-9)


def test_late_pictures_are_placed_with_the_pose_of_their_exposure(target: Target) -> None:
    marker = np.array([1.5, 0.4, 0.2])
    poses = [state(0.02 * k, 0.004 * k, 0.0, 0.012 * k) for k in range(12)]
    for pose in poses:
        target.remember(pose)
    exposed = poses[6]
    assert target.see(sighting(exposed, marker))
    assert target.position_at(poses[-1].time) == pytest.approx(marker, abs=1e-9)
    late = target.pose_at(exposed.time)
    assert late is not None
    assert late.position == pytest.approx(exposed.position, abs=1e-12)
    between = target.pose_at(0.13)
    assert between is not None
    assert between.position[0] == pytest.approx(0.026, abs=1e-9)


def test_a_picture_from_before_the_kept_poses_is_not_believed(target: Target) -> None:
    for k in range(100):
        target.remember(state(0.02 * k))
    assert not target.see(sighting(state(0.5), np.array([1.0, 0.0, 0.2])))
    assert not target.known


def test_where_it_is_expected_is_where_it_is(target: Target) -> None:
    pose, marker = state(0.0, yaw=0.1, pitch=0.03), np.array([1.2, 0.3, 0.2])
    target.remember(pose)
    assert target.expected(0.0, FOCAL, (640, 480)) is None
    seen = sighting(pose, marker)
    target.see(seen)
    found = target.expected(0.0, FOCAL, (640, 480))
    assert found == pytest.approx((seen.column, seen.row, seen.radius), abs=1e-6)
    target.remember(state(0.02, yaw=3.0))
    assert target.expected(0.02, FOCAL, (640, 480)) is None  # behind the camera


def _track(target: Target, seconds: float, start: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Errors of place and velocity while a leader drives a circle of 0.8 m at 0.12 m/s."""
    rng = np.random.default_rng(0)
    places, speeds = [], []
    for k in range(int(start * 50), int((start + seconds) * 50)):
        t = k * 0.02
        angle = 0.15 * t
        marker = np.array([1.0 + 0.8 * math.sin(angle), 0.8 * (1.0 - math.cos(angle)), 0.2])
        velocity = 0.12 * np.array([math.cos(angle), math.sin(angle)])
        pose = state(t, 0.05 * t, 0.0, 0.05 * math.sin(t))
        target.remember(pose)
        if k % 5 == 0:
            seen = sighting(pose, marker)
            noisy = replace(
                seen, radius=seen.radius + rng.normal(0.0, 0.1), column=seen.column + rng.normal(0.0, 2.0)
            )
            assert target.see(noisy)
        places.append(target.position_at(t)[:2] - marker[:2])
        speeds.append(target.velocity - velocity)
    return np.array(places), np.array(speeds)


def test_a_leader_on_a_circle_is_followed_with_its_velocity(target: Target) -> None:
    place, velocity = _track(target, 12.0)
    settled = slice(200, None)
    assert np.hypot(*place[settled].T).max() < 0.03
    assert np.hypot(*velocity[settled].T).max() < 0.04


def test_a_hidden_leader_is_predicted_for_two_seconds(target: Target) -> None:
    _track(target, 8.0)
    for ahead in (0.5, 1.0, 2.0):
        t = 7.98 + ahead
        angle = 0.15 * t
        marker = np.array([1.0 + 0.8 * math.sin(angle), 0.8 * (1.0 - math.cos(angle))])
        assert math.dist(target.position_at(t)[:2], marker) < 0.04 + 0.06 * ahead
        assert target.trusted(t - 0.1)
    assert not target.trusted(10.5)
    assert target.known
    assert target.age(10.0) == pytest.approx(10.0 - 7.9)


def test_a_prediction_does_not_run_away(target: Target) -> None:
    _track(target, 8.0)
    near, far = target.position_at(20.0), target.position_at(2000.0)
    assert math.dist(near[:2], far[:2]) < 0.1
    assert math.dist(target.position_at(8.0)[:2], far[:2]) < 0.12 * 4.0 + 0.1


def test_a_marker_that_stands_has_no_velocity(target: Target) -> None:
    rng = np.random.default_rng(1)
    marker = np.array([2.0, 0.2, 0.2])
    for k in range(200):
        pose = state(0.1 * k, 0.005 * k)
        target.remember(pose)
        seen = sighting(pose, marker)
        target.see(replace(seen, radius=seen.radius + rng.normal(0.0, 0.2)), moves=False)
    assert target.velocity.tolist() == [0.0, 0.0]
    assert math.dist(target.position_at(60.0)[:2], marker[:2]) < 0.05


def test_a_stray_sighting_is_not_believed_but_four_in_a_row_are(target: Target) -> None:
    marker, other = np.array([1.5, 0.0, 0.2]), np.array([1.5, 1.2, 0.2])
    for k in range(20):
        target.remember(state(0.1 * k))
        target.see(sighting(state(0.1 * k), marker))
    target.remember(state(2.0))
    assert not target.see(sighting(state(2.0), other))
    assert target.position_at(2.0) == pytest.approx(marker, abs=1e-3)
    for k in range(21, 24):
        target.remember(state(0.1 * k))
        taken = target.see(sighting(state(0.1 * k), other))
    assert taken
    assert target.position_at(2.3) == pytest.approx(other, abs=1e-3)


def test_a_marker_in_the_sky_or_under_the_floor_is_not_believed(target: Target) -> None:
    pose = state(0.0)
    target.remember(pose)
    assert not target.see(sighting(pose, np.array([1.5, 0.0, 2.4])))
    assert not target.see(sighting(pose, np.array([1.5, 0.0, -0.6])))
    assert not target.known


def test_before_the_first_sighting_nothing_is_known(target: Target) -> None:
    assert not target.known
    assert target.age(5.0) == math.inf
    assert np.isnan(target.position_at(0.0)).all()
    assert target.relative(state(0.0)) is None


def test_reset_and_forget(target: Target) -> None:
    pose = state(1.0)
    target.remember(pose)
    target.see(sighting(pose, np.array([1.0, 0.0, 0.2])))
    target.forget()
    assert not target.known
    assert target.pose_at(1.0) is not None
    target.reset()
    assert target.pose_at(1.0) is None


@pytest.mark.parametrize("wrong", [{"marker_radius": 0.0}, {"strays": 0}, {"highest": -1.0}, {"trust": -2.0}])
def test_impossible_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        TargetConfig(**wrong)  # type: ignore[arg-type]
