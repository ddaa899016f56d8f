"""Inverse kinematics of four legs: ours, the closed form in numpy, pink and mink."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import mink
import mujoco
import numpy as np
import pink
import pinocchio as pin

from bluefoot_mpc.model.legs import AnkleConfig, AnkleTable, LegGeometry, ankle_directions, inverse
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import LEGS

UP = np.array([0.0, 0.0, 1.0])
STEPS = 1
"""Steps of the differential solvers: what a control tick does."""


class NumpyIk:
    """The closed form for all legs at once, with numpy alone."""

    def __init__(self, geometry: LegGeometry) -> None:
        self._links = geometry.link_lengths
        self._hips = geometry.hip_position
        cosine, sine = np.cos(geometry.hip_azimuth), np.sin(geometry.hip_azimuth)
        self._turn = np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)

    def __call__(self, feet: np.ndarray, ankle: np.ndarray) -> np.ndarray:
        a1, a2, a3, a4 = self._links
        offset = feet - self._hips
        plane = np.einsum("lij,lj->li", self._turn, offset[:, :2])
        out = np.hypot(plane[:, 0], plane[:, 1]) - a1 - a4 * np.cos(ankle)
        up = offset[:, 2] - a4 * np.sin(ankle)
        square = np.clip(out * out + up * up, (a2 - a3) ** 2, (a2 + a3) ** 2)
        knee = -np.arccos(np.clip((square - a2 * a2 - a3 * a3) / (2.0 * a2 * a3), -1.0, 1.0))
        pitch = np.arctan2(up, out) - np.arctan2(a3 * np.sin(knee), a2 + a3 * np.cos(knee))
        yaw = np.arctan2(plane[:, 1], plane[:, 0])
        last = (ankle - pitch - knee + math.pi) % (2.0 * math.pi) - math.pi
        return np.stack([yaw, pitch, knee, last], axis=1).ravel()


class PinkIk:
    """Differential inverse kinematics on Pinocchio, feet as tasks, one step from the last answer."""

    def __init__(self, robot: RobotModel) -> None:
        model = pin.buildModelFromXML(robot.urdf)
        self._configuration = pink.Configuration(model, model.createData(), robot.default_stance()[7:])
        self._feet = [pink.tasks.FrameTask(f"{leg}_foot", 1.0, 0.0) for leg in LEGS]
        posture = pink.tasks.PostureTask(cost=1e-3)
        posture.set_target(robot.default_stance()[7:])
        self._tasks = [*self._feet, posture]

    def __call__(self, feet: np.ndarray) -> np.ndarray:
        for task, place in zip(self._feet, feet, strict=True):
            task.set_target(pin.SE3(np.eye(3), place))
        for _ in range(STEPS):
            velocity = pink.solve_ik(self._configuration, self._tasks, 0.02, solver="daqp")
            self._configuration.integrate_inplace(velocity, 0.02)
        return self._configuration.q


class MinkIk:
    """The same on MuJoCo."""

    def __init__(self, robot: RobotModel) -> None:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(robot.urdf, encoding="utf-8")
            spec = mujoco.MjSpec.from_file(str(file))
            spec.compiler.fusestatic = False
            spec.compiler.discardvisual = False
            model = spec.compile()
        self._configuration = mink.Configuration(model)
        self._configuration.update(robot.default_stance()[7:])
        self._feet = [mink.FrameTask(f"{leg}_foot", "body", 1.0, 0.0) for leg in LEGS]
        posture = mink.PostureTask(model, cost=1e-3)
        posture.set_target(robot.default_stance()[7:])
        self._tasks = [*self._feet, posture]

    def __call__(self, feet: np.ndarray) -> np.ndarray:
        for task, place in zip(self._feet, feet, strict=True):
            task.set_target(mink.SE3.from_translation(place))
        for _ in range(STEPS):
            velocity = mink.solve_ik(self._configuration, self._tasks, 0.02, solver="daqp")
            self._configuration.integrate_inplace(velocity, 0.02)
        return self._configuration.q


def directions(robot: RobotModel, feet: list[np.ndarray]) -> list[np.ndarray]:
    """(4,) rad, ankle direction of every leg as the controller chooses it."""
    table, config = AnkleTable(robot.geometry), AnkleConfig(policy="margin")
    return [ankle_directions(robot.geometry, config, points, UP, table=table) for points in feet]


def contestants(robot: RobotModel, feet: list[np.ndarray]) -> dict[str, object]:
    """Every inverse kinematics on these (4, 3) feet in the base frame (m)."""
    ankles, geometry, count = directions(robot, feet), robot.geometry, len(feet)
    table, config = AnkleTable(geometry), AnkleConfig(policy="margin")
    closed, pinks, minks = NumpyIk(geometry), PinkIk(robot), MinkIk(robot)
    _check(closed, robot, feet, ankles)

    def chosen(k):
        points = feet[k % count]
        gamma = ankle_directions(geometry, config, points, UP, table=table)
        return inverse(geometry, points, gamma)

    return {
        "numpy closed form": lambda k: closed(feet[k % count], ankles[k % count]),
        "pink": lambda k: pinks(feet[k % count]),
        "mink": lambda k: minks(feet[k % count]),
        "ours": lambda k: inverse(geometry, feet[k % count], ankles[k % count]),
        "ours, with the choice of the ankles": chosen,
    }


def _check(closed: NumpyIk, robot: RobotModel, feet: list[np.ndarray], ankles: list[np.ndarray]) -> None:
    for points, gamma in zip(feet[::50], ankles[::50], strict=True):
        ours = inverse(robot.geometry, points, gamma).joints
        if np.abs(closed(points, gamma) - ours).max() > 1e-9:
            raise SystemExit("the closed form in numpy is not ours: the comparison is void")
