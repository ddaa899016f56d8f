"""Leaders of every kind on their way: wheels' constraints, path, speed, what stops them."""

from __future__ import annotations

import functools
import math

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim.leader import LeaderConfig, add_leader
from bluefoot_mpc.sim.leader_path import figure_of_eight
from bluefoot_mpc.wheels.constraints import radius_matrix, rolling_matrix, sliding_matrix
from bluefoot_mpc.wheels.ready import READY
from tests.sim.leader_stage import PERIOD, Log, Stage

KINDS = tuple(READY)
RADIUS = 0.5
SETTLED = round(2.5 / PERIOD)


def speed_of(kind: str) -> float:
    """To balance takes time to compute: that one makes haste."""
    return 0.20 if kind == "balancing" else 0.12


@functools.cache
def eight(kind: str) -> Log:
    """A whole figure of eight, and a little more."""
    stage = Stage(kind=kind, speed=speed_of(kind), radius=RADIUS, seed=3)
    return stage.run((4.0 * math.pi * RADIUS + 0.15) / speed_of(kind))


@pytest.mark.parametrize("kind", KINDS)
def test_keeps_to_the_path_at_its_speed(kind: str) -> None:
    log, way = eight(kind), figure_of_eight(RADIUS)
    places = np.array([way.at(s)[:2] for s in np.linspace(0.0, way.length, 1500)])
    away = [np.hypot(*(places - pose[:2]).T).min() for pose in log.pose[::20]]
    assert max(away) < 0.05
    # All of it: each piece of the way has had the leader on it.
    for place in places[::25]:
        assert np.hypot(*(log.pose[:, :2] - place).T).min() < 0.06
    assert log.speed[SETTLED:].mean() == pytest.approx(speed_of(kind), rel=0.05)


@pytest.mark.parametrize("kind", KINDS)
def test_wheels_neither_slide_nor_slip_but_for_the_slip(kind: str) -> None:
    log, robot = eight(kind), READY[kind]()
    sliding, rolling = [], []
    for row in range(SETTLED, len(log.pose), 7):
        twist, steering = log.twist[row], log.steering[row]
        sliding.append(sliding_matrix(robot, steering) @ twist)
        rolling.append(rolling_matrix(robot, steering) @ twist - radius_matrix(robot) @ log.wheels[row])
    for errors, most in ((sliding, 0.02), (rolling, 0.03)):
        shares = np.abs(errors) / speed_of(kind)
        assert np.sqrt(np.mean(shares**2, axis=0)).max(initial=0.0) < most
        assert shares.max(initial=0.0) < 0.10


@pytest.mark.parametrize("kind", KINDS)
def test_heading_is_what_the_wheels_permit(kind: str) -> None:
    log, way = eight(kind), figure_of_eight(RADIUS)
    course = np.unwrap(np.arctan2(np.gradient(log.pose[:, 1]), np.gradient(log.pose[:, 0])))
    off = np.abs(course - log.pose[:, 2])[SETTLED:-SETTLED]
    if kind in {"omni", "mecanum"}:
        assert log.pose[-1, 2] > 0.5 * way.length  # it turned all the time
    elif kind in {"omni_steer", "two_steer"}:
        assert 0.4 < off.max() < 0.9
    else:
        assert off.max() < 0.2


@pytest.mark.parametrize("kind", ["differential", "two_steer", "balancing"])
def test_same_seed_same_way(kind: str) -> None:
    stage = Stage(kind=kind, seed=5)
    first = stage.run(3.0)
    quaternions = stage.model.body_quat.copy()
    stage.reset()
    again = stage.run(3.0)
    assert np.array_equal(first.pose, again.pose)
    assert np.array_equal(quaternions, stage.model.body_quat)
    other = Stage(kind=kind, seed=6).run(3.0)
    assert not np.array_equal(first.pose, other.pose)
    assert np.abs(first.pose - other.pose).max() < 0.03


def test_a_wall_stops_it() -> None:
    stage = Stage(kind="ackermann", wall_at=1.6, path="line", length=3.0)
    log = stage.run(12.0)
    nose = 0.9 + log.pose[:, 0] + 0.23
    assert nose[-1] == pytest.approx(1.6, abs=0.005)
    assert nose.max() < 1.605
    assert np.abs(log.speed[-200:]).max() < 1e-3
    assert 1.0 < np.hypot(*log.force[-1, :2]) < 6.1  # it goes on pushing, with what its wheels hold
    assert np.hypot(log.force[:, 0], log.force[:, 1]).max() < 6.1


def test_a_push_moves_it_and_it_comes_back() -> None:
    stage = Stage(kind="differential", path="line", length=3.0)
    stage.run(3.0)
    body = stage.model.body("leader").id
    stage.data.xfrc_applied[body, 1] = 12.0
    stage.run(0.3)
    stage.data.xfrc_applied[body, 1] = 0.0
    assert stage.pose[1] > 0.05
    log = stage.run(12.0)
    assert abs(log.pose[-1, 1]) < 0.01


def test_stop_and_go() -> None:
    log = Stage(kind="mecanum", path="stop_and_go", go=4.0, pause=3.0).run(20.0)
    time = PERIOD * (1.0 + np.arange(len(log.speed)))
    phase = time % 7.0
    assert log.speed[(phase > 5.0) & (phase < 7.0)].max() < 1e-3
    assert np.ptp(log.pose[(time > 5.0) & (time < 7.0)], axis=0).max() < 1e-3
    assert log.speed[(phase > 1.5) & (phase < 4.0)].min() > 0.09


@pytest.mark.parametrize("kind", ["tricycle", "omni", "balancing"])
def test_a_line_ends(kind: str) -> None:
    log = Stage(kind=kind, path="line", length=0.8).run(14.0)
    assert log.pose[-1, 0] == pytest.approx(0.8, abs=0.03)
    assert abs(log.pose[-1, 1]) < 0.02
    assert np.ptp(log.pose[-400:, 0]) < 0.01


def test_it_waits_for_the_robot_on_its_course() -> None:
    robot = np.array([2.2, 0.0, 0.12])
    stage = Stage(kind="omni", path="line", length=3.0, gap=0.35, other=robot)
    log = stage.run(12.0)
    assert log.speed[-200:].max() < 1e-3
    assert 0.35 < 2.2 - 0.9 - log.pose[-1, 0] < 0.95
    robot[1] = 1.0  # beside the course
    assert stage.run(2.0).speed[-1] > 0.09
    robot[:2] = 0.0  # behind it
    assert stage.run(2.0).speed[-1] > 0.09


def test_it_stands_until_it_starts() -> None:
    stage = Stage(kind="differential", delay=1.5)
    assert stage.run(1.4).speed.max() < 1e-6
    assert stage.run(2.0).speed[-1] == pytest.approx(0.10, rel=0.05)
    still = Stage(kind="differential", speed=0.0).run(1.0)
    assert not still.pose.any()


def test_the_balancing_leader_tilts_what_it_carries() -> None:
    stage = Stage(kind="balancing")
    log = stage.run(0.6)
    assert np.degrees(np.abs(log.tilt).max()) > 0.5
    mujoco.mj_kinematics(stage.model, stage.data)
    ball = stage.data.geom("marker").xpos
    tilt, yaw = log.tilt[-1], stage.pose[2]
    ahead = (ball[0] - 0.9 - stage.pose[0]) * math.cos(yaw) + (ball[1] - stage.pose[1]) * math.sin(yaw)
    assert ahead == pytest.approx(0.16 * math.sin(tilt), abs=1e-4)
    assert ball[2] == pytest.approx(0.04 + 0.16 * math.cos(tilt))


def test_no_second_marker() -> None:
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(name="marker", size=[0.06, 0.0, 0.0])
    with pytest.raises(ConfigurationError, match="marker of its own"):
        add_leader(spec, LeaderConfig(kind="omni"))


def test_without_a_kind_there_is_none() -> None:
    spec = mujoco.MjSpec()
    add_leader(spec, LeaderConfig())
    assert spec.compile().nbody == 1
