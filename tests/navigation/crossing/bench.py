"""A robot that does what it is told, on ground that a formula gives."""

import math

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.navigation.crossing import crosser
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.navigation.crossing.crosser import Crosser, FeetState
from bluefoot_mpc.navigation.crossing.follower import FollowerConfig
from bluefoot_mpc.navigation.crossing.sweeper import SweepStep
from bluefoot_mpc.types import BodyState, Guide, GuideTask, ImuBatch, SensorFrame

DT = 0.1
FEET = np.array([[0.158, 0.157], [0.158, -0.157], [-0.158, 0.157], [-0.158, -0.157]])
ROBOT = load_parameters(None)
QUICK = FollowerConfig(smoothing=0.1)


class SeesAll:
    """Stands for a sweep: on one tick it sees all ground between 0.4 and 1.3 m ahead."""

    world = staticmethod(lambda x, y: np.zeros_like(x))
    reason = ""

    def __init__(self, config, mounts, cloud, legs):
        self.begun = False

    def reset(self):
        self.begun = False

    def begin(self, time, ahead=None):
        self.begun = True

    def step(self, frame, estimate, dt):
        if not self.begun:
            return SweepStep(pitch=0.0, done=True)
        x, y = np.meshgrid(np.arange(0.4, 1.3, 0.006), np.arange(-0.7, 0.7, 0.006))
        c, s = math.cos(estimate.rpy[2]), math.sin(estimate.rpy[2])
        x, y = c * x - s * y + estimate.position[0], s * x + c * y + estimate.position[1]
        points = np.column_stack((x.ravel(), y.ravel(), self.world(x, y).ravel() - 0.008))
        points = points[np.isfinite(points).all(axis=1)]
        return SweepStep(pitch=0.0, points=points, level=0, done=True, reason=self.reason)


def frame(time):
    none, sixteen, four = np.zeros(0), np.zeros(16), np.zeros(4)
    imu = ImuBatch(
        time=none, gyro=np.zeros((0, 3)), accel=np.zeros((0, 3)), magnetometer=np.zeros((0, 3)),
        valid=none.astype(bool),
    )  # fmt: skip
    return SensorFrame(
        time=time, joint_position=sixteen, joint_speed=sixteen, joint_load=sixteen,
        joint_temperature=sixteen, joint_time=sixteen, joint_valid=sixteen == 0.0, voltage=12.0,
        voltage_valid=True, imu=imu, contact=four == 0.0, contact_time=four, contact_valid=four == 0.0,
    )  # fmt: skip


def estimate(time, pose, tilt=(0.0, 0.0)):
    x, y, yaw = pose
    rpy = np.array([*tilt, yaw])
    feet = np.column_stack((FEET, np.full(4, -0.11)))
    return BodyState(
        time=time, position=np.array([x, y, 0.11]), rpy=rpy,
        quaternion=quaternion_from_rpy(rpy), linear_velocity=np.zeros(3),
        angular_velocity=np.zeros(3), joint_position=np.zeros(16), joint_velocity=np.zeros(16),
        contact=np.ones(4, dtype=bool), foot_position_in_base=feet, height=0.11,
    )  # fmt: skip


class Bench:
    """Runs a crosser; `world` gives heights (NaN: nothing comes back)."""

    def __init__(self, monkeypatch, world=None, reason="", **changes):
        sweeper = type(
            "Sees", (SeesAll,), {"reason": reason, **({"world": staticmethod(world)} if world else {})}
        )
        monkeypatch.setattr(crosser, "Sweeper", sweeper)
        self.crosser = Crosser(CrossingConfig(think_ticks=1, follower=QUICK, **changes), ROBOT)
        self.pose, self.time, self.reports = np.zeros(3), 0.0, []
        self.tilt = (0.0, 0.0)  # rad, roll and pitch

    def run(self, seconds, goal=(1.5, 0.0), task=GuideTask.CROSS, speed=0.05, waiting=""):
        guide = Guide(task=task, speed=speed, waypoints=np.array([goal]))
        for _ in range(round(seconds / DT)):
            state = FeetState(resting=True, waiting=waiting)
            found = self.crosser.step(
                guide, frame(self.time), estimate(self.time, self.pose, self.tilt), state, DT
            )
            self.reports.append(found.report)
            c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
            x, y = found.velocity
            self.pose = self.pose + DT * np.array([c * x - s * y, s * x + c * y, found.yaw_rate])
            self.time += DT
        return self.reports[-1]
