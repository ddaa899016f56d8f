"""The robot's model as one object, and the root exports."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bluefoot_mpc
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.parameters import GRAVITY, load_parameters
from bluefoot_mpc.model.resources import models_folder
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.types import JOINTS

ROBOTS = ["bluefoot", "bluefoot_large"]


def edited(folder: Path, **values: str) -> Path:
    """BlueFoot's parameter file with some ``key = value`` lines changed."""
    text = (models_folder() / "bluefoot.toml").read_text(encoding="utf-8")
    for key, value in values.items():
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        assert count == 1
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ROBOTS)
def test_model_has_the_house_order_sizes_and_gravity(name: str) -> None:
    robot = load_robot(name)
    assert robot.joint_names == JOINTS
    assert (robot.pin_model.nq, robot.pin_model.nv) == (23, 22)
    frames = [robot.pin_model.frames[i].name for i in robot.foot_frame_ids]
    assert frames == ["FL_foot", "FR_foot", "RL_foot", "RR_foot"]
    np.testing.assert_array_equal(robot.pin_model.gravity.linear, [0, 0, -GRAVITY])
    lower, upper = robot.parameters.legs.physical_limits_deg.radians()
    np.testing.assert_allclose(robot.pin_model.lowerPositionLimit[7:], np.tile(lower, 4))
    np.testing.assert_allclose(robot.pin_model.upperPositionLimit[7:], np.tile(upper, 4))
    assert np.all(robot.lower >= robot.pin_model.lowerPositionLimit[7:])


def test_imposed_limits_are_the_documents() -> None:
    robot = load_robot()
    np.testing.assert_allclose(np.degrees(robot.upper[:4]), [45, 90, 90, 90])
    np.testing.assert_array_equal(robot.lower, -robot.upper)


@pytest.mark.parametrize("name", ROBOTS)
def test_default_stance_rests_on_the_floor(name: str) -> None:
    robot = load_robot(name)
    q = robot.default_stance()
    stance, legs = robot.parameters.stance, robot.parameters.legs
    feet = Dynamics(robot).foot_positions(q)
    np.testing.assert_allclose(feet[:, 2], legs.foot_radius, atol=1e-14)
    np.testing.assert_allclose(feet[:, :2], stance.foot_position[:, :2], atol=1e-14)
    np.testing.assert_array_equal(q[:2], 0.0)
    np.testing.assert_array_equal(q[3:7], [0, 0, 0, 1])
    assert np.all((q[7:] > robot.lower) & (q[7:] < robot.upper))
    directions = q[7:].reshape(4, 4)[:, 1:].sum(axis=1)
    np.testing.assert_allclose(np.degrees(directions), stance.ankle_direction_deg)


def test_default_stance_is_a_new_array_each_time() -> None:
    robot = load_robot()
    robot.default_stance()[:] = 0.0
    assert robot.default_stance()[2] > 0.0
    with pytest.raises(ValueError, match="read-only"):
        robot.stance_joints[0] = 1.0


def test_mass_lies_in_the_documents_range() -> None:
    assert 1.85 <= Dynamics(load_robot()).mass <= 1.98


def test_large_robot_is_a_fifth_larger_in_every_length() -> None:
    small, large = (load_robot(name).parameters for name in ROBOTS)
    for field in ("link_lengths", "hip_offset", "foot_radius"):
        ratio = np.divide(getattr(large.legs, field), getattr(small.legs, field))
        np.testing.assert_allclose(ratio, 1.2)
    for field in ("foot_x", "foot_y", "trunk_height"):
        assert getattr(large.stance, field) == pytest.approx(1.2 * getattr(small.stance, field))
    structure = {"chassis", "head", "bracket1", "bracket2", "bracket3", "shank", "foot"}
    for little, big in zip(small.parts, large.parts, strict=True):
        assert little.name == big.name
        grown = little.name in structure
        assert big.mass == pytest.approx(little.mass * (1.44 if grown else 1.0))
        np.testing.assert_allclose(big.size, np.array(little.size) * (1.2 if grown else 1.0))
    assert large.total_mass < 1.35 * small.total_mass
    assert large.servo == small.servo


def test_large_robot_stands_on_two_feet_with_torque_to_spare() -> None:
    robot = load_robot("bluefoot_large")
    dynamics = Dynamics(robot)
    q = robot.default_stance()
    weight = dynamics.mass * GRAVITY
    forces = np.zeros((4, 3))
    forces[[0, 3], 2] = 0.5 * weight
    torque = dynamics.gravity(q) - np.einsum("lij,li->j", dynamics.foot_jacobians(q), forces)
    assert np.abs(torque[6:]).max() < 0.6 * robot.parameters.servo.stall_torque


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"foot_x": "0.4"}, [r"foot_x = 0\.4", "FL foot target", "RR foot target", "out of reach"]),
        ({"trunk_height": "0.3"}, [r"trunk_height = 0\.3", r"RR foot target is \d+\.\d mm out of reach$"]),
        ({"ankle_direction_deg": "-90.0"}, ["FL knee", r"limit of -90\.0°", r"by 1\.\d°"]),
        ({"foot_y": "0.05"}, [r"foot_y = 0\.05", "FL hip_yaw", r"and \d more$"]),
    ],
)
def test_impossible_stance_names_file_value_leg_and_limit(
    tmp_path: Path, values: dict[str, str], expected: list[str]
) -> None:
    path = edited(tmp_path, **values)
    with pytest.raises(ConfigurationError) as error:
        load_robot(path)
    for pattern in ["mine.toml", r"\[stance\]", *expected]:
        assert re.search(pattern, str(error.value)), pattern
    assert "\n" not in str(error.value)


def test_other_link_lengths_make_another_robot(tmp_path: Path) -> None:
    robot = load_robot(edited(tmp_path, link_lengths="[0.060, 0.070, 0.070, 0.060]", hip_offset="0.1"))
    np.testing.assert_allclose(robot.geometry.link_lengths, [0.06, 0.07, 0.07, 0.06])
    feet = Dynamics(robot).foot_positions(robot.default_stance())
    np.testing.assert_allclose(feet[:, 2], robot.parameters.legs.foot_radius, atol=1e-14)


def test_model_from_parameters_without_a_file() -> None:
    parameters = dataclasses.replace(load_parameters(), name="renamed")
    assert RobotModel(parameters).pin_model.name == "renamed"


def test_root_exports() -> None:
    assert bluefoot_mpc.load_robot is load_robot
    assert set(dir(bluefoot_mpc)) >= {"load_robot", "run", "Scenario"}
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        bluefoot_mpc.nothing  # noqa: B018


BLOCKED = ("mujoco", "matplotlib", "plotly", "meshcat", "serial")
LIGHT = (
    "control",
    "estimation",
    "gait",
    "leveling",
    "navigation",
    "terrain",
    "wbc",
    "wheels",
    "zmp",
    "model",
    "runtime",
)


def test_controllers_load_without_simulator_viewers_and_serial_port() -> None:
    """Every module of the light packages is imported in a process where the heavy ones cannot be."""
    script = f"""
import importlib, pkgutil, sys
for name in {BLOCKED}:
    sys.modules[name] = None
import bluefoot_mpc
for package in {LIGHT}:
    try:
        found = importlib.import_module("bluefoot_mpc." + package)
    except ModuleNotFoundError as error:
        if error.name == "bluefoot_mpc." + package:
            continue
        raise
    for module in pkgutil.walk_packages(found.__path__, found.__name__ + "."):
        importlib.import_module(module.name)
bluefoot_mpc.load_robot()
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
