"""The thesis' laws with their errata, and what stops at a distance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.navigation import servoing
from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.servoing import Relative, Servo, ServoingConfig

CONFIG = ServoingConfig()
STOP = 50.0


def test_speed_is_the_printed_law_up_to_the_stop_size() -> None:
    for radius in np.linspace(1.0, STOP, 30):
        printed = 0.2 * (1.0 - math.exp(-CONFIG.speed_decay * (radius - STOP) ** 2))
        assert servoing.camera_speed(float(radius), STOP, 0.2, CONFIG) == pytest.approx(printed, abs=1e-15)


def test_erratum_nearer_than_the_stop_size_the_robot_does_not_speed_up_again() -> None:
    printed = 0.2 * (1.0 - math.exp(-CONFIG.speed_decay * (80.0 - STOP) ** 2))
    assert printed > 0.15
    assert servoing.camera_speed(80.0, STOP, 0.2, CONFIG) == 0.0


@pytest.mark.parametrize("unseen", [0.0, -1.0, math.nan])
def test_erratum_an_unseen_marker_has_no_share_and_no_speed(unseen: float) -> None:
    printed = math.exp(-2e-3 * (0.0 - CONFIG.mix_radius) ** 2)
    assert printed > 0.1  # what r = 0 would give with a wide mixing
    assert servoing.mixing(unseen, ServoingConfig(mix_decay=2e-3)) == 0.0
    assert servoing.camera_speed(unseen, STOP, 0.2, CONFIG) == 0.0


def test_mixing_is_the_printed_law_and_full_from_its_size_on() -> None:
    for radius in (5.0, 15.0, 25.0):
        printed = math.exp(-CONFIG.mix_decay * (radius - CONFIG.mix_radius) ** 2)
        assert servoing.mixing(radius, CONFIG) == pytest.approx(printed, abs=1e-15)
    assert servoing.mixing(CONFIG.mix_radius, CONFIG) == 1.0
    assert servoing.mixing(200.0, CONFIG) == 1.0
    camera, lidar = Motion(0.2, 0.0, 0.1), Motion(0.0, 0.1, -0.3)
    assert servoing.mixed(camera, lidar, 0.25) == pytest.approx((0.05, 0.075, -0.2))
    assert servoing.mixed(camera, lidar, 0.0) == pytest.approx(lidar)
    assert servoing.mixed(camera, lidar, 1.0) == pytest.approx(camera)


def test_yaw_rate_turns_left_to_a_marker_on_the_left() -> None:
    assert servoing.camera_yaw_rate(0.0, 640, CONFIG) == CONFIG.greatest_yaw_rate
    assert servoing.camera_yaw_rate(320.0, 640, CONFIG) == 0.0
    assert servoing.camera_yaw_rate(480.0, 640, CONFIG) == pytest.approx(-0.5 * CONFIG.greatest_yaw_rate)
    assert servoing.camera_yaw_rate(9e9, 640, CONFIG) == -CONFIG.greatest_yaw_rate
    assert servoing.camera_yaw_rate(math.nan, 640, CONFIG) == 0.0


def test_pitch_is_nose_down_for_a_marker_low_in_the_picture_and_small() -> None:
    assert servoing.camera_pitch(480.0, 480, CONFIG) == CONFIG.greatest_pitch
    assert servoing.camera_pitch(240.0, 480, CONFIG) == 0.0
    assert servoing.camera_pitch(120.0, 480, CONFIG) == pytest.approx(-0.5 * CONFIG.greatest_pitch)
    assert servoing.camera_pitch(math.nan, 480, CONFIG) == 0.0
    assert math.degrees(CONFIG.greatest_pitch) <= 4.0


def test_pitch_follows_slowly_and_arrives() -> None:
    servo = Servo()
    for k in range(200):
        before, servo = servo.pitch, servoing.pitched(servo, 0.05, 0.02, CONFIG)
        assert 0.0 <= servo.pitch - before < 0.002, k
    assert servo.pitch == pytest.approx(0.05, abs=1e-3)


def test_printed_motion_puts_the_laws_together() -> None:
    motion = servoing.printed_motion((160.0, 200.0, 20.0), (640, 480), STOP, 0.2, CONFIG)
    assert motion.x == servoing.camera_speed(20.0, STOP, 0.2, CONFIG)
    assert motion.yaw_rate == servoing.camera_yaw_rate(160.0, 640, CONFIG)


def test_the_printed_speed_does_not_arrive_and_ours_does() -> None:
    """Ideal robots that do what the laws say, 2 m from the marker, with 0.6 m wanted.

    The printed speed falls with the square of what is left to go, so what is left falls with one over
    time: after five minutes some millimetres are still missing, and the robot never stops.
    """
    ball, focal, dt = 0.06, 522.0, 0.02
    stop = focal * ball / 0.6
    printed, ours, servo = 2.0, 2.0, Servo()
    arrived = math.inf
    for k in range(15_000):
        printed -= dt * servoing.camera_speed(focal * ball / printed, stop, 0.2, CONFIG)
        servo, motion = servoing.approach(servo, Relative(ours, 0.0), 0.6, 0.2, CONFIG)
        ours -= dt * motion.x
        if servo.standing:
            arrived = min(arrived, k * dt)
        assert ours >= 0.6 - 1e-9
    assert servoing.camera_speed(focal * ball / printed, stop, 0.2, CONFIG) > 0.0
    assert printed - 0.6 > 1e-3
    assert arrived < 20.0
    assert abs(ours - 0.6) <= CONFIG.near


@pytest.mark.parametrize("lag", [0.3, 0.6])
@pytest.mark.parametrize("start", [3.0, 1.0, 0.66, 0.45])
def test_approach_stops_in_place_with_a_robot_that_lags(start: float, lag: float) -> None:
    distance, speed, servo, nearest = start, 0.0, Servo(), start
    for _ in range(2000):
        servo, motion = servoing.approach(servo, Relative(distance, 0.0), 0.6, 0.2, CONFIG)
        speed += 0.02 / lag * (motion.x - speed)
        distance -= 0.02 * speed
        nearest = min(nearest, distance)
    assert servo.standing
    assert abs(distance - 0.6) <= 0.03
    assert nearest >= min(start, 0.57)


def test_closing_speed_brakes_steadily_and_backs_off_slowly() -> None:
    errors = np.linspace(0.0, 3.0, 200)
    speeds = [servoing.closing_speed(float(error), 0.2, CONFIG) for error in errors]
    assert all(np.diff(speeds) >= 0.0)
    assert min(speeds) == CONFIG.slowest
    assert max(speeds) == 0.2
    back = [servoing.closing_speed(-float(error), 0.2, CONFIG) for error in errors[1:]]
    assert max(back) <= -CONFIG.slowest
    assert min(back) == -CONFIG.back
    assert servoing.closing_speed(1.0, 0.01, CONFIG) == 0.01


def test_turning_to_the_marker_comes_before_speed() -> None:
    ahead = [servoing.ahead_share(math.radians(b), CONFIG) for b in (0.0, 5.0, 15.0, 25.0, -25.0, 180.0)]
    assert ahead[:2] == [1.0, 1.0]
    assert 0.0 < ahead[2] < 1.0
    assert ahead[3:] == [0.0, 0.0, 0.0]
    servo, motion = servoing.follow(Servo(), Relative(1.5, math.radians(28.0)), 0.6, 0.2, CONFIG)
    assert motion.x == 0.0
    assert motion.yaw_rate > 0.3
    assert not servo.standing


def _followed(
    leader_speed: float, radius: float, seconds: float, stop_at: float = math.inf
) -> list[Relative]:
    """An ideal leader on a circle (or straight: infinite radius), a robot with a lag behind it."""
    x, y, yaw, speed, turn = 0.0, 0.0, 0.0, 0.0, 0.0
    lx, ly, heading, servo, seen = 0.7, 0.0, 0.0, Servo(), []
    for k in range(int(seconds / 0.02)):
        pace = leader_speed if k * 0.02 < stop_at else 0.0
        lx, ly = lx + 0.02 * pace * math.cos(heading), ly + 0.02 * pace * math.sin(heading)
        heading += 0.02 * pace / radius
        dx, dy = lx - x, ly - y
        sight = math.atan2(dy, dx)
        relative = Relative(
            math.hypot(dx, dy), math.remainder(sight - yaw, 2.0 * math.pi),
            pace * math.cos(heading - sight), pace * math.sin(heading - sight),
        )  # fmt: skip
        seen.append(relative)
        servo, motion = servoing.follow(servo, relative, 0.6, 0.2, CONFIG)
        speed += 0.02 / 0.4 * (motion.x - speed)
        turn += 0.02 / 0.3 * (motion.yaw_rate - turn)
        x, y, yaw = x + 0.02 * speed * math.cos(yaw), y + 0.02 * speed * math.sin(yaw), yaw + 0.02 * turn
    return seen


@pytest.mark.parametrize("radius", [math.inf, 1.0, -0.6])
def test_following_keeps_distance_and_view(radius: float) -> None:
    seen = _followed(0.12, radius, 60.0)[1000:]
    assert max(abs(r.distance - 0.6) for r in seen) < 0.06
    assert max(abs(math.degrees(r.bearing)) for r in seen) < 15.0


def test_feed_forward_is_what_keeps_the_distance() -> None:
    seen = _followed(0.12, math.inf, 40.0)
    # Without it the error would be speed over gain: 0.17 m.
    assert abs(seen[-1].distance - 0.6) < 0.01


def test_a_leader_that_stops_is_stood_behind() -> None:
    seen = _followed(0.10, math.inf, 60.0, stop_at=30.0)
    assert seen[-1].distance == seen[-250].distance  # five seconds without a step
    assert abs(seen[-1].distance - 0.6) < CONFIG.follow_off


def test_a_robot_that_stands_waits_until_it_matters() -> None:
    standing = Servo(standing=True)
    for relative in (Relative(0.65, 0.0), Relative(0.6, math.radians(8.0)), Relative(0.6, 0.0, 0.04)):
        servo, motion = servoing.follow(standing, relative, 0.6, 0.2, CONFIG)
        assert servo.standing
        assert motion == Motion()
    for relative in (Relative(0.75, 0.0), Relative(0.6, math.radians(15.0)), Relative(0.6, 0.0, 0.08)):
        assert not servoing.follow(standing, relative, 0.6, 0.2, CONFIG)[0].standing


def test_a_leader_that_comes_nearer_is_backed_off_from_slowly() -> None:
    _, motion = servoing.follow(Servo(), Relative(0.45, 0.0, away=-0.1), 0.6, 0.2, CONFIG)
    assert motion.x == -CONFIG.back


def test_a_leader_that_backs_up_does_not_reach_the_robot() -> None:
    seen = _followed(-0.05, math.inf, 30.0)
    assert min(r.distance for r in seen) > 0.5


@pytest.mark.parametrize(
    "wrong",
    [{"off": 0.001}, {"moving": 0.001}, {"gain": 0.0}, {"turn_bearing_deg": 2.0}, {"greatest_pitch": 1.0}],
)
def test_impossible_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        ServoingConfig(**wrong)
