"""The trunk-levelling compensator: find the torque against a predicted disturbance, mix it into the goals.

Paper, section on the NARX compensator, with the sign of the training target
corrected (errata, item 10).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.leveling import schedule
from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.leveling.contact_force import contact_forces
from bluefoot_mpc.leveling.guard import Guard
from bluefoot_mpc.leveling.servo_torque import ServoTorque
from bluefoot_mpc.leveling.signals import LevelingInputs, network_inputs, velocity
from bluefoot_mpc.leveling.sources import NOTHING, Situation, Source, make_source
from bluefoot_mpc.leveling.trunk_dynamics import TrunkDynamics, disturbance, nominal_mass_matrix
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import N_LEGS, BodyState, FloatArray, LevelReport

_UNKNOWN: FloatArray = np.full(3, np.nan)
_ROUNDING = 1e-9
_LATE = 0.25
"""Share of a period by which a frame may be late and still end the period after the one before."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Leveled:
    """What one tick gives.

    Attributes:
        goals: (16,) rad, joint goals with the levelling in them.
        report: the compensator's account of the tick.
    """

    goals: FloatArray
    report: LevelReport


class Compensator:
    """Levels the trunk through the joint goals.

    Args:
        robot: the model.
        config: parts, gains, schedule and limits.
        gait_joints: (n, 16) rad, joints over whole cycles of a gait, over which
            the nominal mass matrix is averaged.

    Raises:
        ConfigurationError: the network's weights do not fit.
    """

    def __init__(self, robot: RobotModel, config: LevelingConfig, gait_joints: FloatArray) -> None:
        self._config = config
        self._servo = robot.parameters.servo
        self._dynamics = Dynamics(robot, rotor_inertia=True)
        self._nominal = TrunkDynamics.of(nominal_mass_matrix(self._dynamics, gait_joints))
        height = robot.parameters.stance.trunk_height
        self._neutral = np.concatenate([[0.0, 0.0, height], robot.stance_joints])
        self._made = ServoTorque(self._servo, config.delay_ticks)
        self._source: Source = make_source(config, self._dynamics)
        self._guard = Guard(config.limits)
        gains = config.gains
        tilt, tilt_rate = gains.in_force(config.mix)
        self._tilt_gain = np.array([tilt, tilt, gains.heading])
        self._rate_gain = np.array([tilt_rate, tilt_rate, gains.heading_rate])
        self.reset()

    @property
    def source(self) -> Source:
        """Where the disturbance comes from."""
        return self._source

    def reset(self) -> None:
        """Forget everything, what the network has learnt included: the state after ``__init__``."""
        self._made.reset()
        self._source.reset()
        self._guard.reset()
        self._share = 0.0
        self._began = math.nan
        self._time = math.nan
        self._before: FloatArray | None = None

    def step(self, inputs: LevelingInputs, dt: float) -> Leveled:
        """One tick.

        Args:
            inputs: estimate, goals and what was measured.
            dt: s, since the last tick.
        """
        estimate = inputs.estimate
        speed = velocity(inputs)
        q = np.concatenate([estimate.position, estimate.quaternion, estimate.joint_position])
        dynamics = self._mass(q, estimate)
        target = self._measured(dynamics, inputs, speed, dt)
        wanted = self._wanted(inputs)
        learning = inputs.walking and estimate.healthy
        learning &= schedule.may_learn(wanted or self._share > 0.0, self._config.schedule)
        situation = self._situation(inputs, q, speed, target, dynamics.from_force, learn=learning)
        predicted = self._source.step(situation, dt)
        if predicted is not None and not np.isfinite(predicted).all():
            predicted = None
        self._engage(inputs, wanted, predicted, dt)
        psi = self._bounded(dynamics, predicted)
        torque = self._torque(dynamics, inputs, psi)
        goals = self._mixed(inputs, torque, dt)
        self._made.send(goals)
        self._before = speed if np.isfinite(speed).all() else None
        self._time = estimate.time
        report = LevelReport(
            share=self._share, training=learning and target is not None and self._learns,
            stopped=self._guard.stopped, disturbance=psi,
            measured=_UNKNOWN if target is None else dynamics.from_force @ target,
            torque=torque, contact_force=situation.forces,
            mse=self._source.mse, rate=self._source.rate,
        )  # fmt: skip
        return Leveled(goals=goals, report=report)

    def _wanted(self, inputs: LevelingInputs) -> bool:
        """Whether the schedule asks it to act, and there is something to act on."""
        if math.isnan(self._began):
            self._began = inputs.estimate.time
        since = inputs.estimate.time - self._began
        return inputs.walking and self._source.ready and schedule.wants_on(since, self._config.schedule)

    @property
    def _learns(self) -> bool:
        return self._config.psi == "network" and not self._source.fault

    def _mass(self, q: FloatArray, estimate: BodyState) -> TrunkDynamics:
        """The nominal mass matrix, or the model's at this state."""
        if self._config.mass_matrix == "nominal" or not np.isfinite(q).all():
            return self._nominal
        return TrunkDynamics.of(self._dynamics.mass_matrix(q))

    def _measured(
        self, dynamics: TrunkDynamics, inputs: LevelingInputs, speed: FloatArray, dt: float
    ) -> FloatArray | None:
        """(22,) ψ of the period that just ended; None where a part of it is unknown."""
        estimate = inputs.estimate
        torque = self._made.torque(estimate.joint_position, inputs.joint_load, inputs.voltage, dt)
        # A period with a frame lost in it is longer: its mean acceleration would count twice.
        lost = not abs(estimate.time - self._time - dt) <= _LATE * dt
        if lost or torque is None or self._before is None or not np.isfinite(speed).all():
            return None
        target = disturbance(dynamics.mass, self._before, speed, torque, dt)
        return target if np.isfinite(target).all() else None

    def _situation(
        self,
        inputs: LevelingInputs,
        q: FloatArray,
        speed: FloatArray,
        target: FloatArray | None,
        turn: FloatArray,
        *,
        learn: bool,
    ) -> Situation:
        estimate = inputs.estimate
        rotation = rotation_from_quaternion(estimate.quaternion)
        forces = np.zeros((N_LEGS, 3))
        if inputs.specific_force is not None:
            forces = contact_forces(self._dynamics.mass, rotation @ inputs.specific_force, estimate.contact)
        return Situation(
            target=target, q=q, v=speed, forces=forces, turn=turn, learn=learn,
            inputs=network_inputs(inputs, rotation, self._neutral, speed, forces),
        )  # fmt: skip

    def _engage(self, inputs: LevelingInputs, wanted: bool, predicted: FloatArray | None, dt: float) -> None:
        """Let schedule (`wanted`), source and guard decide how far to act."""
        estimate, config = inputs.estimate, self._config.schedule
        tilt = math.hypot(*(estimate.rpy[:2] - inputs.tilt_reference).tolist())
        healthy = estimate.healthy and math.isfinite(tilt)
        if inputs.walking:
            self._guard.watch(tilt, self._source.fault, self._doubt(healthy, predicted), dt)
        acts = wanted and not self._guard.stopped
        self._share = schedule.faded(self._share, acts, dt, config)
        if not healthy or predicted is None:
            self._share = 0.0  # Nothing to act on, not even while it fades.

    def _doubt(self, healthy: bool, predicted: FloatArray | None) -> str:
        """Why not to act for now; empty without a reason."""
        if not healthy:
            return "the estimate is not to be trusted"
        if predicted is None and self._source.ready:
            return "nothing predicts the disturbance"
        return self._source.doubt

    def _bounded(self, dynamics: TrunkDynamics, predicted: FloatArray | None) -> FloatArray:
        """(3,) rad/s², angular acceleration Γ1 M̂⁻¹ ψ̂ of the trunk within its bound."""
        if predicted is None or predicted is NOTHING:
            return np.zeros(3)
        most = self._config.limits.disturbance
        turned: FloatArray = dynamics.from_force @ predicted
        return np.minimum(np.maximum(turned, -most), most)

    def _torque(self, dynamics: TrunkDynamics, inputs: LevelingInputs, psi: FloatArray) -> FloatArray:
        """(16,) N·m, levelling torque τ̂ = -[Γ1 M̂⁻¹ Γ2]† [Γ1 M̂⁻¹ ψ̂ + K_b θ + K_d dθ/dt]."""
        config, estimate = self._config, inputs.estimate
        unwanted = psi
        if config.form == "residual" and config.psi != "zero":
            # What the controller's goals do about ψ is not to be done twice. The torque that was measured
            # would be the consistent one; this share, which comes sooner and softens, levels better.
            ahead = inputs.goals - estimate.joint_position
            torque = self._servo.stiffness * ahead - self._servo.back_emf * estimate.joint_velocity
            unwanted = self._source.trust * (unwanted + dynamics.from_torque @ torque)
        if config.attitude:
            roll, pitch = (estimate.rpy[:2] - inputs.tilt_reference).tolist()
            tilt = np.array([roll, pitch, inputs.heading_error])
            unwanted = unwanted + self._tilt_gain * tilt + self._rate_gain * inputs.turn_rate
        return -(dynamics.to_torque @ unwanted)

    def _mixed(self, inputs: LevelingInputs, torque: FloatArray, dt: float) -> FloatArray:
        """(16,) rad, goals with the levelling mixed in: (1-α) q_r + α (q + τ̂/k_s), or q_r + α τ̂/k_s."""
        if self._share <= _ROUNDING:
            return inputs.goals
        share = self._config.mix * self._share
        ahead = torque * (self._servo.nominal_voltage / (self._servo.stiffness * inputs.voltage))
        if self._config.form == "mixed":
            ahead = ahead + inputs.estimate.joint_position - inputs.goals
        shift = share * ahead
        if not np.isfinite(shift).all():
            return inputs.goals
        return inputs.goals + self._guard.cut(shift, dt)
