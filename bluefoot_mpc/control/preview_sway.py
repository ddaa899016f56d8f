"""The trunk's sway by ZMP preview: the planned centre of mass, and the trunk that puts it there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import ContactSchedule, FloatArray
from bluefoot_mpc.zmp.preview import ComPlan, PreviewConfig, PreviewController, PreviewInputs

ComplexArray = npt.NDArray[np.complex128]
Schedule = Callable[[float, float], ContactSchedule]


class PreviewSway:
    """Plans the centre of mass over the supports ahead and moves the trunk so that it is there.

    Attributes:
        offset: (2,) m, the plan's share of the trunk's place in b'.
        plan: the plan of the last tick; None before the first.

    Args:
        masses: the robot's centre of mass by its joints.
        config: the preview.
        joints_in_stance: (16,) rad, joints for a (6,) commanded pose over the nominal stance.
        schedule: contacts ahead, by horizon (s) and time between samples (s).
        rough: m, support margin and depth over rough ground; None for the configured ones.
    """

    def __init__(
        self,
        masses: LegMasses,
        config: PreviewConfig,
        joints_in_stance: Callable[[FloatArray], FloatArray],
        schedule: Schedule,
        rough: tuple[float, float] | None = None,
    ) -> None:
        self._masses = masses
        self._config = config
        self._joints_in_stance = joints_in_stance
        self._schedule = schedule
        self._rough = rough
        self._preview = PreviewController(config)
        self._ahead = np.arange(1, config.samples + 1) * config.interval
        self.reset()

    def reset(self) -> None:
        """Forget the plan and the commanded pose."""
        self.forget()
        self.follow(np.zeros(6))

    def forget(self) -> None:
        """Forget the plan: the next one starts from rest at the neutral place."""
        self.offset = np.zeros(2)
        self.plan: ComPlan | None = None
        self._preview.reset()

    def follow(self, pose: FloatArray) -> None:
        """Take note of a change of the commanded pose, (6,) m and rad."""
        self._masses.turn(pose[3:])
        self._place = pose[:2].copy()
        self._com_in_stance = self._masses.com(self._joints_in_stance(pose))

    def step(self, gait: GaitOutput, joints: FloatArray, trunk: FloatArray, dt: float) -> FloatArray:
        """Advance the plan; gives the (2,) planned ZMP, m in b'.

        Args:
            gait: feet in b' and the gait's motion.
            joints: (16,) rad, as planned.
            trunk: (3,) m, wanted trunk origin in b'.
            dt: s.
        """
        neutral = trunk[:2] - self.offset
        com = self._masses.com(joints)
        nominal, velocity, heading = self._path(gait, neutral + self._com_in_stance[:2])
        schedule = self._schedule(self._config.samples * self._config.interval, self._config.interval)
        inputs = PreviewInputs(
            schedule=schedule, nominal=nominal, velocity=velocity, heading=heading,
            height=float(trunk[2] + com[2]), pose=gait.virtual_pose,
            margin=self._rough if gait.rough else None,
        )  # fmt: skip
        self.plan = plan = self._preview.step(inputs, dt)
        place, _, acceleration = plan.start
        self.offset = place - com[:2] - neutral
        return np.asarray(place - float(trunk[2] + com[2]) / GRAVITY * acceleration)

    def _path(self, gait: GaitOutput, place: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n, 2) m and (n, 2) m/s, a point of b' carried along by the commanded twist; (n,) rad of turn."""
        time, rate = self._ahead, gait.yaw_rate
        velocity = complex(*gait.velocity.tolist())
        turn = np.exp(1j * rate * time)
        # Mean direction over the time passed: the chord of the arc, without its pole at zero rate.
        chord = np.exp(0.5j * rate * time) * np.sinc(rate * time / (2.0 * np.pi))
        point = complex(*place.tolist())
        path = velocity * time * chord + point * turn
        speed = (velocity + 1j * rate * point) * turn
        return _planar(path), _planar(speed), np.asarray(rate * time, dtype=float)


def _planar(points: ComplexArray) -> FloatArray:
    """(n, 2) of n complex numbers."""
    return np.column_stack([points.real, points.imag])
