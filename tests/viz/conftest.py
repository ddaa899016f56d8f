from __future__ import annotations

import pytest

from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.runtime.data import RunData

from .navigating_run import navigating_run
from .synthetic_run import make_run


@pytest.fixture(scope="session")
def robot() -> RobotModel:
    return load_robot()


@pytest.fixture(scope="session")
def run(robot: RobotModel) -> RunData:
    return make_run(robot)


@pytest.fixture(scope="session")
def hardware_run(robot: RobotModel) -> RunData:
    return make_run(robot, truth=False)


@pytest.fixture(scope="session")
def guided_run(robot: RobotModel) -> RunData:
    return navigating_run(robot)
