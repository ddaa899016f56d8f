"""Conversion to and from MuJoCo's state, against MuJoCo and Pinocchio themselves."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.sim.convert import (
    q_from_mujoco,
    q_to_mujoco,
    v_from_mujoco,
    v_to_mujoco,
    velocity_map,
    velocity_map_rate,
)
from bluefoot_mpc.sim.parity import mujoco_model, random_state


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return load_robot()


@pytest.mark.parametrize("seed", range(5))
def test_there_and_back_is_the_identity(robot: RobotModel, seed: int) -> None:
    q, v = random_state(robot, np.random.default_rng(seed))
    qpos = q_to_mujoco(q)
    np.testing.assert_array_equal(q_from_mujoco(qpos), q)
    np.testing.assert_allclose(v_from_mujoco(qpos, v_to_mujoco(q, v)), v, atol=1e-14)
    np.testing.assert_allclose(velocity_map(q) @ v, v_to_mujoco(q, v), atol=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_both_engines_integrate_the_same_velocity_alike(robot: RobotModel, seed: int) -> None:
    q, v = random_state(robot, np.random.default_rng(seed))
    model, h = mujoco_model(robot.urdf), 1e-5
    qpos = q_to_mujoco(q)
    mujoco.mj_integratePos(model, qpos, v_to_mujoco(q, v), h)
    # First order only: the engines turn the linear velocity along the step differently.
    np.testing.assert_allclose(q_from_mujoco(qpos), pin.integrate(robot.pin_model, q, h * v), atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
def test_rate_of_the_velocity_map_is_its_derivative(robot: RobotModel, seed: int) -> None:
    q, v = random_state(robot, np.random.default_rng(seed))
    h = 1e-6
    maps = [velocity_map(pin.integrate(robot.pin_model, q, s * h * v)) for s in (1.0, -1.0)]
    np.testing.assert_allclose(velocity_map_rate(q, v), (maps[0] - maps[1]) @ v / (2.0 * h), atol=1e-7)


def test_trunk_turned_left_and_moving_along_its_nose(robot: RobotModel) -> None:
    q = robot.default_stance()
    q[3:7] = [0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)]
    v = np.zeros(22)
    v[0], v[5] = 1.0, 2.0
    qpos, qvel = q_to_mujoco(q), v_to_mujoco(q, v)
    np.testing.assert_allclose(qpos[3:7], [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)])
    np.testing.assert_allclose(qvel[:6], [0, 1, 0, 0, 0, 2], atol=1e-15)


def test_results_do_not_alias_the_inputs(robot: RobotModel) -> None:
    q, v = random_state(robot, np.random.default_rng(0))
    kept = q.copy(), v.copy()
    for result in (q_to_mujoco(q), q_from_mujoco(q), v_to_mujoco(q, v), v_from_mujoco(q, v)):
        result[:] = 0.0
    np.testing.assert_array_equal(q, kept[0])
    np.testing.assert_array_equal(v, kept[1])
