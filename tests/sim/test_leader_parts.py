"""What a leader is made of: ways, tracking, configuration, body."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.leader_body import add_leader, wheel_body
from bluefoot_mpc.sim.leader_config import GREATEST_SPEED, PATHS, LeaderConfig
from bluefoot_mpc.sim.leader_path import Way, circle, figure_of_eight, line
from bluefoot_mpc.sim.leader_tracking import Tracker
from bluefoot_mpc.wheels.ready import READY
from bluefoot_mpc.wheels.wheel import axis_direction, rolling_direction
from tests.sim.leader_stage import Stage

WAYS = {"line": line(2.0), "circle": circle(0.8), "eight": figure_of_eight(0.7)}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_ways_are_smooth_and_as_long_as_they_say(way: Way) -> None:
    distances = np.linspace(-0.5, way.length + 0.5, 4000)
    points = np.array([way.at(s) for s in distances])
    steps = np.diff(points[:, :2], axis=0)
    assert np.hypot(*steps.T) == pytest.approx(np.diff(distances), rel=1e-4)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    middle = 0.5 * (points[1:, 2] + points[:-1, 2])
    assert np.abs(np.angle(np.exp(1j * (headings - middle)))).max() < 1e-3
    assert np.abs(np.diff(points[:, 2])).max() < 4e-3  # not wrapped
    assert way.at(0.0)[:3] == (0.0, 0.0, 0.0)


@given(st.floats(-20.0, 20.0))
def test_closed_ways_come_back(distance: float) -> None:
    for way in (WAYS["circle"], WAYS["eight"]):
        here, again = way.at(distance), way.at(distance + way.length)
        assert again[:2] == pytest.approx(here[:2], abs=1e-9)
    assert WAYS["eight"].at(distance + WAYS["eight"].length).heading == pytest.approx(
        WAYS["eight"].at(distance).heading
    )


def test_the_eight_goes_left_then_right_in_its_box() -> None:
    way = WAYS["eight"]
    points = np.array([way.at(s)[:2] for s in np.linspace(0.0, way.length, 2000)])
    assert np.abs(points[:, 0]).max() <= 0.7 + 1e-9
    assert np.abs(points[:, 1]).max() == pytest.approx(1.4, abs=1e-5)
    assert (points[1:1000, 1] > 0.0).all()
    assert (points[1001:-1, 1] < 0.0).all()


@pytest.mark.parametrize("manner", ["steering", "swinging", "turning"])
@pytest.mark.parametrize(("left", "yaw"), [(-0.1, 0.0), (0.1, 0.0), (0.0, 3.1), (0.1, -1.8)])
def test_tracking_comes_back_to_the_way(manner, left, yaw) -> None:
    tracker, x, y = Tracker(WAYS["eight"], manner), 0.0, left
    for _ in range(4000):
        ahead, aside, turn = tracker.twist(x, y, yaw, 0.1)
        x += 0.01 * (math.cos(yaw) * ahead - math.sin(yaw) * aside)
        y += 0.01 * (math.sin(yaw) * ahead + math.cos(yaw) * aside)
        yaw += 0.01 * turn
    near = WAYS["eight"].at(tracker.distance)
    assert math.hypot(x - near.x, y - near.y) < 0.01
    assert 2.0 < tracker.distance < 4.1


@pytest.mark.parametrize("manner", ["steering", "swinging", "turning"])
def test_at_no_speed_nothing_moves(manner) -> None:
    assert not any(Tracker(WAYS["circle"], manner).twist(0.0, 0.02, 0.3, 0.0))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"kind": "hovercraft"}, "differential"),
        ({"path": "spiral"}, "figure_of_eight, line"),
        ({"kind": "omni", "speed": GREATEST_SPEED + 0.01}, "0..0.3"),
        ({"speed": -0.1}, "0..0.3"),
        ({"speed": math.nan}, "0..0.3"),
        ({"distance": 0.2}, "distance"),
        ({"radius": 0.1}, "radius"),
        ({"slip": 0.5}, "slip"),
        ({"go": 0.0}, "go"),
        ({"pause": math.inf}, "pause"),
    ],
)
def test_what_cannot_be_is_refused_with_what_can(values, message) -> None:
    with pytest.raises(ConfigurationError, match=message):
        LeaderConfig(**values)


def test_unknown_names_come_with_the_valid_ones() -> None:
    with pytest.raises(UnknownNameError) as caught:
        LeaderConfig(kind="diferential")
    assert set(caught.value.valid) == set(READY)
    with pytest.raises(UnknownNameError) as caught:
        LeaderConfig(path="")
    assert set(caught.value.valid) == set(PATHS)


def test_it_needs_level_floor() -> None:
    for world in (WorldConfig(name="rough"), WorldConfig(name="steps"), WorldConfig(slope_deg=3.0)):
        with pytest.raises(ConfigurationError, match="level floor"):
            SimConfig(world=world, leader=LeaderConfig(kind="omni"))
        SimConfig(world=world)


def test_it_is_set_by_tables() -> None:
    config = build(SimConfig, {"leader": {"kind": "mecanum", "speed": 0.08}})
    assert config.leader == LeaderConfig(kind="mecanum", speed=0.08)


@pytest.mark.parametrize("kind", READY)
def test_wheels_are_where_the_kinematics_has_them_and_stand_on_the_floor(kind: str) -> None:
    stage = Stage(kind=kind)
    mujoco.mj_forward(stage.model, stage.data)
    assert stage.data.ncon == 0
    for index, wheel in enumerate(stage.leader.robot.wheels):
        body = stage.data.body(wheel_body(index))
        assert body.xpos - [0.9, 0.0, 0.0] == pytest.approx([*wheel.position, wheel.radius])
        assert body.xmat.reshape(3, 3)[:2, 0] == pytest.approx(axis_direction(wheel), abs=1e-9)
    for geom in range(stage.model.ngeom):
        if stage.model.geom(geom).name != "floor":
            assert stage.model.geom_group[geom] == 1


@pytest.mark.parametrize("kind", ["ackermann", "mecanum", "omni_steer", "two_steer"])
def test_wheels_are_shown_turned_and_rolling_the_right_way(kind: str) -> None:
    stage = Stage(kind=kind)
    stage.run(4.0)
    mujoco.mj_kinematics(stage.model, stage.data)
    yaw = stage.pose[2]
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    before = _frames(stage)
    state = stage.leader.state
    for frame, wheel, steering in zip(before, stage.leader.robot.wheels, state.steering, strict=True):
        assert frame[:2, 0] == pytest.approx(turn @ axis_direction(wheel, steering), abs=1e-9)
    angles = state.wheel_angle.copy()
    stage.run(0.04)
    mujoco.mj_kinematics(stage.model, stage.data)
    moved = stage.leader.state.wheel_angle - angles
    for index, wheel in enumerate(stage.leader.robot.wheels):
        if wheel.kind == "castor" or abs(moved[index]) < 0.02:
            continue
        # The wheel's highest point, as it was marked before, has moved in the rolling direction.
        mark = before[index].T @ [0.0, 0.0, 1.0]
        shift = (_frames(stage)[index] @ mark)[:2] @ turn @ rolling_direction(wheel, state.steering[index])
        assert shift == pytest.approx(math.sin(moved[index]), abs=0.02)


def test_rollers_hubs_and_spokes_are_for_pictures_alone() -> None:
    counts = []
    for visuals in (False, True):
        spec = mujoco.MjSpec()
        add_leader(spec, LeaderConfig(kind="mecanum"), visuals)
        counts.append(spec.compile().ngeom)
    assert counts[0] < 12
    assert counts[1] - counts[0] == 4 * 10  # nine rollers and a spoke of each wheel


def _frames(stage: Stage) -> list[np.ndarray]:
    count = len(stage.leader.robot.wheels)
    return [stage.data.body(wheel_body(i)).xmat.reshape(3, 3).copy() for i in range(count)]
