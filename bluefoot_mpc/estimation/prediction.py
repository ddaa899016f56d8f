"""The filter carried over one frame, and what that frame's joints then show of the feet."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import made_once
from bluefoot_mpc.estimation import symbols
from bluefoot_mpc.estimation.config import ContactConfig, EstimatorConfig
from bluefoot_mpc.estimation.filter import SIZE, VALUES, FilterState, frame_noise, transition
from bluefoot_mpc.estimation.inertial import Motion
from bluefoot_mpc.estimation.workspace import Workspace, compile_function
from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.types import N_JOINTS, N_LEGS, FloatArray

_INPUTS = ("before", "carried", "dt", "rest", "start", "now", "loose")


class Prediction(NamedTuple):
    """The filter at a frame's time, before it sees that frame's feet.

    Its arrays, but for the covariance, are valid until the next prediction.

    Attributes:
        filter: carried state.
        points: (4, 3) m, foot points by the joints, base frame.
        from_imu: (12,) m, the same relative to the IMU, base axes.
        roll: (12,) m, way of the foot points over the ground by rolling, world axes.
        way: (3,) m, displacement of the IMU in the world.
        residual: (12,) m, measured feet minus estimated ones, world axes.
        noise: (12, 12) m², covariance of the measured feet, a block for each.
        moved: rad, largest change of a joint since it was last at rest.
    """

    filter: FilterState
    points: FloatArray
    from_imu: FloatArray
    roll: FloatArray
    way: FloatArray
    residual: FloatArray
    noise: FloatArray
    moved: float


class Predictor:
    """Workspace of the prediction; holds no memory of the motion.

    Args:
        geometry: legs of the robot.
        config: noise figures and the IMU's place.
    """

    def __init__(self, geometry: LegGeometry, config: EstimatorConfig) -> None:
        legs = (geometry.links, geometry.hips, geometry.foot_radius)
        self._work = Workspace(made_once(lambda: _prediction(geometry, config), "prediction", legs, config))
        self._half = np.zeros((SIZE + 3, SIZE))
        ahead, steps, self._diagonal, scene, noise, self._moved = self._work.outputs
        self._ahead, self._steps = ahead, steps.T
        self._transition, self._lever = steps[:SIZE], steps[SIZE:]
        self._measured = (
            scene[:12].reshape(N_LEGS, 3), scene[12:24], scene[24:36], scene[36:39], scene[39:], noise,
        )  # fmt: skip
        self._parts = (self._half[:SIZE], self._half[SIZE:])

    def advance(
        self, state: FilterState, motion: Motion, angles: tuple[FloatArray, ...], loose: list[bool], dt: float
    ) -> Prediction:
        """Carry estimate and covariance over one frame.

        Args:
            state: at the start.
            motion: of the IMU, from `inertial.Strapdown`.
            angles: (16,) rad each: at rest, at the start, at the end.
            loose: (4,) feet that may drag over the ground.
            dt: s.
        """
        estimate, moving, step, rest, start, now, slips = self._work.inputs
        estimate[:] = state.estimate
        moving[:] = motion.values
        step[0] = dt
        rest[:], start[:], now[:] = angles
        slips[:] = loose
        self._work.call()
        # F P F' + L L' in one product: (F L) times P F' over L', with the rate's lever L.
        carried, lever = self._parts
        np.dot(state.covariance, self._transition, carried)
        lever[:] = self._lever
        covariance = np.dot(self._steps, self._half)
        covariance.reshape(-1)[:: SIZE + 1] += self._diagonal
        return Prediction(FilterState(self._ahead, covariance), *self._measured, float(self._moved[0]))


def _prediction(geometry: LegGeometry, config: EstimatorConfig) -> Any:
    before, carried, dt = ca.SX.sym("before", VALUES), ca.SX.sym("carried", 23), ca.SX.sym("dt")
    rest, start, now = (ca.SX.sym(name, N_JOINTS) for name in ("rest", "start", "now"))
    loose = ca.SX.sym("loose", N_LEGS)
    velocity, feet = before[4:7], before[7:19]
    quaternion, velocity_after, way, turn, sums = ca.vertsplit(carried, [0, 4, 7, 10, 13, 23])
    rotation = symbols.rotation_matrix(quaternion)
    roll = symbols.rolling(geometry, rotation, turn, now, start)
    feet_after = feet + roll - ca.repmat(way, N_LEGS, 1)
    step, lever = transition(rotation, 0.5 * (velocity + velocity_after), feet, dt)
    rate, force = frame_noise(sums, config.imu)
    lever = ca.vertcat(dt * ca.sqrt(rate) * lever, ca.SX(SIZE - 18, 3))
    points, from_imu, noise = _measured_feet(geometry, config, rotation, now)
    seen = ca.vec(rotation @ ca.reshape(from_imu, 3, N_LEGS))
    return compile_function(
        "prediction",
        dict(zip(_INPUTS, (before, carried, dt, rest, start, now, loose), strict=True)),
        {
            "after": ca.vertcat(quaternion, velocity_after, feet_after, before[19:]),
            "step": ca.horzcat(step, lever),
            "diagonal": _growth(config, dt, force, loose),
            "scene": ca.vertcat(points, from_imu, roll, way, seen - feet_after),
            "noise": noise,
            "moved": ca.mmax(ca.fabs(now - rest)),
        },
    )


def _growth(config: EstimatorConfig, dt: Any, force: Any, loose: Any) -> Any:
    """26 variances that slip, drifts and the noise of the specific force add."""
    imu = config.imu
    slip = ca.vec(ca.repmat(ca.if_else(loose, config.contact.loose**2, config.contact.slip**2).T, 3, 1))
    drifts = ca.vertcat(*[imu.gyro_drift**2] * 3, *[imu.accel_drift**2] * 3)
    return ca.vertcat(ca.SX(3, 1), dt * dt * force, dt * slip, dt * drifts, ca.SX(2, 1))


def _measured_feet(
    geometry: LegGeometry, config: EstimatorConfig, rotation: Any, joints: Any
) -> tuple[Any, Any, Any]:
    """Foot points in the base, the same relative to the IMU, and the latter's covariance in world axes."""
    points, from_imu, noise = [], [], []
    for leg in range(N_LEGS):
        angles = joints[4 * leg : 4 * leg + 4]
        point = symbols.foot(geometry, leg, angles)
        points.append(point)
        from_imu.append(point - ca.DM(list(config.imu.mount)))
        noise.append(_foot_noise(rotation @ ca.jacobian(point, angles), config.contact))
    return ca.vertcat(*points), ca.vertcat(*from_imu), ca.diagcat(*noise)


def _foot_noise(lever: Any, config: ContactConfig) -> Any:
    """3 x 3 m², share of the joints' rounding by their 3 x 4 levers, and of the rest."""
    return config.joint_noise**2 * (lever @ lever.T) + config.foot_noise**2 * ca.SX.eye(3)
