"""One servo on the bench, many times side by side: every recorded step is a hinge of its own in MuJoCo.

The law is that of `bluefoot_mpc.model.servo`, as in `bluefoot_mpc.sim.servo`; rotor,
damping and dry friction are the joint's armature, damping and friction loss, which
is how the simulator has them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bluefoot_mpc.io.commissioning.steps import StepRecord
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import FULL_DUTY
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_range
from bluefoot_mpc.types import FloatArray

PERIOD = 1e-3
"""s, physics step, that of the simulator."""
_MIDDLE = 512
_STIFF = (0.004, 1.0)
"""Time constant (s) and damping ratio of dry friction: sticks within a few steps, as gears do."""
_LIMP = 1e-9
"""kg·m², least inertia of a body."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Bench:
    """What is known about the bench and not fitted."""

    servo: ServoParameters  # stall torque, back-EMF and load friction are taken from here
    load_inertia: float = 0.0  # kg·m² on the shaft besides the rotor
    load_moment: float = 0.0  # N·m, a weight's mass times gravity times lever
    load_angle: float = 0.0  # rad from the servo's middle, at which the weight hangs straight down
    load_friction_speed: float = 0.5  # rad/s above which load-dependent friction fades

    def __post_init__(self) -> None:
        require_nonnegative(load_inertia=self.load_inertia, load_moment=self.load_moment)
        require_finite(load_angle=self.load_angle)
        require_range(1e-3, 100.0, load_friction_speed=self.load_friction_speed)


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoFit:
    """What is fitted, in the units of the parameter file.

    Attributes:
        stiffness: N·m/rad at nominal voltage and the slope that was set.
        coulomb_friction: N·m.
        viscous_friction: N·m·s/rad, without back-EMF.
        armature: kg·m², the rotor behind the gear.
        latency: s from sending a goal to the motor's acting on it.
    """

    stiffness: float
    coulomb_friction: float
    viscous_friction: float
    armature: float
    latency: float


class StepBench:
    """Simulates all records at once.

    Args:
        records: steps of one servo.
        bench: what is known.
    """

    def __init__(self, records: Sequence[StepRecord], bench: Bench) -> None:
        self.records = tuple(records)
        self.bench = bench
        self.duration = max(float(record.time[-1]) for record in records)
        self._model = _hinges(len(records), bench.load_inertia)
        self._data: Any = mujoco.MjData(self._model)
        servo = bench.servo
        self._start = np.array([(r.start - _MIDDLE) * servo.step_angle for r in records])
        self._goal = np.array([float(r.goal - _MIDDLE) for r in records])
        self._limit = np.array([math.floor(r.torque_limit * FULL_DUTY) / FULL_DUTY for r in records])
        self._margin = np.array([r.margin for r in records])
        self._punch = np.array([r.punch / FULL_DUTY for r in records])
        voltage = np.array([r.voltage for r in records])
        self._stall = servo.stall_torque * voltage / servo.nominal_voltage

    def simulate(self, fit: ServoFit) -> FloatArray:
        """(steps + 1, records) rad, angles every `PERIOD` from the moment at which the motor acts."""
        model, data, servo = self._model, self._data, self.bench.servo
        model.dof_armature[:] = fit.armature
        model.dof_damping[:] = servo.back_emf + fit.viscous_friction
        mujoco.mj_setConst(model, data)
        mujoco.mj_resetData(model, data)
        data.qpos[:] = self._start
        # Full duty belongs to the stall torque, so a stiffness is a slope of the duty per count.
        slope = fit.stiffness * servo.step_angle / servo.stall_torque
        steps = math.ceil(self.duration / PERIOD) + 1
        angles = np.empty((steps + 1, len(self.records)))
        for step in range(steps):
            angles[step] = data.qpos
            self._act(slope, fit.coulomb_friction)
            mujoco.mj_step(model, data)
        angles[steps] = data.qpos
        return angles

    def at_readings(self, fit: ServoFit) -> list[FloatArray]:
        """Simulated positions at the times of the readings, counts, one (n,) array a record."""
        counts = self.simulate(fit) / self.bench.servo.step_angle + _MIDDLE
        # A step that starts from rest is the same later on: latency only shifts it.
        times = np.arange(len(counts)) * PERIOD + fit.latency
        return [np.interp(record.time, times, counts[:, k]) for k, record in enumerate(self.records)]

    def _act(self, slope: float, coulomb: float) -> None:
        """Torque and friction of this physics step."""
        data, servo, bench = self._data, self.bench.servo, self.bench
        q, qd = data.qpos, data.qvel
        # The servo rounds its angle to counts. Where in a count it stands is not known; the mean is smooth.
        error = self._goal - q * (1.0 / servo.step_angle)
        beyond = np.abs(error) - self._margin
        duty = np.minimum(self._punch + slope * beyond, self._limit)
        drive = np.where(beyond > 0.0, np.copysign(duty, error), 0.0) * self._stall
        fading = 1.0 / (1.0 + (qd / bench.load_friction_speed) ** 2)
        passed_on = np.abs(drive - servo.back_emf * qd)
        self._model.dof_frictionloss[:] = coulomb + servo.load_friction * fading * passed_on
        data.qfrc_applied[:] = drive - bench.load_moment * np.sin(q - bench.load_angle)


def _hinges(count: int, load_inertia: float) -> Any:
    """A MuJoCo model of `count` hinges that do not touch each other."""
    spec = mujoco.MjSpec()
    spec.option.timestep = PERIOD
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0.0, 0.0, 0.0]
    for index in range(count):
        body = spec.worldbody.add_body(name=f"shaft{index}")
        body.explicitinertial = True
        body.mass = 1e-3
        body.inertia = [max(load_inertia, _LIMP)] * 3
        joint = body.add_joint(name=f"hinge{index}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        joint.frictionloss = 1e-3
        joint.armature = 1e-3
        joint.solref_friction = list(_STIFF)
    return spec.compile()
