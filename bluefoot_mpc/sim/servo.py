"""Sixteen AX-12A servos on one battery, advanced once per physics step.

The law is that of `bluefoot_mpc.model.servo`, as one CasADi function over all
joints that reads joint angles from MuJoCo's memory and writes motor torques
back: 2 to 4 µs a step, where numpy on sixteen numbers takes over 20.
MuJoCo integrates the back-EMF (as joint damping) and the friction (as friction
loss) implicitly; the function writes how much friction each joint has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.model import servo as law
from bluefoot_mpc.model.parameters import BatteryParameters, ServoParameters
from bluefoot_mpc.types import JOINTS, N_JOINTS, BoolArray, FloatArray, JointCommand


@dataclass(frozen=True, kw_only=True, slots=True)
class BankConfig:
    """What a bank of servos is made with, after randomisation."""

    servo: ServoParameters
    battery: BatteryParameters
    gain: FloatArray  # (16,) factor on the compliance slope's gain
    friction_scale: FloatArray  # (16,) factor on Coulomb and load friction
    open_voltage: float  # V
    standby_current: float  # A of each servo
    backlash: float  # rad in all
    load_friction_speed: float  # rad/s
    period: float  # s, physics step


@dataclass(frozen=True, slots=True)
class Plant:
    """Views into the simulator's memory that the servos read and write, (16,) each.

    Attributes:
        position: rad, joint angles.
        speed: rad/s, joint speeds.
        drive: N·m, motor torque without back-EMF.
        friction: N·m, dry friction of each joint.
        damping: N·m·s/rad, back-EMF and viscous friction.
    """

    position: FloatArray
    speed: FloatArray
    drive: FloatArray
    friction: FloatArray
    damping: FloatArray


class ServoBank:
    """All servos and their supply.

    Attributes:
        advance: one physics step: reads the joints, writes drive torque and
            friction. A bare callable, so that the hot loop pays for nothing else.
        duty: (16,) fraction of the supply voltage on each motor.
        torque: (16,) N·m, motor torque after back-EMF, before friction.
        temperature: (16,) °C.
        shut_down: (16,) True where a servo switched off by heat.
        average: means over the last frame, see `finish_frame`.
    """

    def __init__(self, config: BankConfig, plant: Plant) -> None:
        self.config = config
        self.plant = plant
        self.goal = np.zeros(N_JOINTS)
        self.speed_limit = np.zeros(N_JOINTS)
        self.torque_limit = np.zeros(N_JOINTS)
        self.profile = np.zeros(N_JOINTS)
        self.play = np.zeros(N_JOINTS)
        self.duty = np.zeros(N_JOINTS)
        self.torque = np.zeros(N_JOINTS)
        self.voltage = np.zeros(1)
        self.sums = np.zeros(2 * N_JOINTS + 2)
        self.temperature = np.zeros(N_JOINTS)
        self.shut_down: BoolArray = np.zeros(N_JOINTS, dtype=np.bool_)
        self._wanted_limit = np.zeros(N_JOINTS)
        self._function = servo_function(config)
        self._buffer, self.advance = self._connect()
        self.reset()

    def reset(self) -> None:
        """Cold servos, torque off, pack at rest."""
        for state in (self.goal, self.speed_limit, self.torque_limit, self.profile, self.play):
            state[:] = 0.0
        for state in (self.duty, self.torque, self.sums, self._wanted_limit):
            state[:] = 0.0
        self.shut_down[:] = False
        self.cool()
        self._apply_limits()

    def cool(self) -> None:
        """Servos at ambient temperature and an unloaded pack, everything else as it is."""
        self.temperature[:] = self.config.servo.ambient
        self.voltage[:] = self.config.open_voltage
        self.sums[:] = 0.0

    def hold(self, position: FloatArray) -> None:
        """Hold `position` (16, rad) with full torque, at once."""
        self.write(JointCommand(position=position, speed=np.zeros(N_JOINTS), torque_limit=np.ones(N_JOINTS)))
        self.profile[:] = self.goal

    def write(self, command: JointCommand) -> None:
        """Take goal, moving speed and torque limit as the registers would hold them."""
        servo = self.config.servo
        self.goal[:] = law.to_counts(servo, command.position)
        self.speed_limit[:] = law.quantise_speed_limit(command.speed) / servo.step_angle
        limit = np.clip(command.torque_limit, 0.0, 1.0)
        self._wanted_limit[:] = np.floor(limit * law.FULL_DUTY) / law.FULL_DUTY
        # A shut-down servo works again only when it has cooled and its limit is written anew.
        self.shut_down &= self.temperature >= law.SHUTDOWN_TEMPERATURE
        self._apply_limits()

    @property
    def overheated(self) -> tuple[str, ...]:
        """Names of the servos that switched off by heat."""
        return tuple(name for name, off in zip(JOINTS, self.shut_down, strict=True) if off)

    def finish_frame(self, steps: int) -> tuple[FloatArray, float, float]:
        """Close a frame of `steps` physics steps: heat the motors, clear the sums.

        Returns:
            (16,) mean duty, mean electrical power in W, mean voltage in V.
        """
        servo, mean = self.config.servo, self.sums / steps
        loss = law.winding_resistance(servo) * mean[:N_JOINTS]
        self.temperature[:] = law.heat(servo, self.temperature, loss, steps * self.config.period)
        if self.temperature.max() >= law.SHUTDOWN_TEMPERATURE:
            self.shut_down |= self.temperature >= law.SHUTDOWN_TEMPERATURE
            self._apply_limits()
        self.sums[:] = 0.0
        return mean[N_JOINTS : 2 * N_JOINTS], float(mean[-2]), float(mean[-1])

    def _apply_limits(self) -> None:
        servo = self.config.servo
        self.torque_limit[:] = np.where(self.shut_down, 0.0, self._wanted_limit)
        # An open bridge carries no current, so a limp servo does not brake.
        brake = np.where(self.torque_limit > 0.0, servo.back_emf, 0.0)
        self.plant.damping[:] = brake + servo.viscous_friction

    def _connect(self) -> tuple[Any, Callable[[], None]]:
        """Bind the function to memory. States are updated in place: see `servo_function`."""
        buffer: Any
        buffer, run = self._function.buffer()
        plant = self.plant
        states = (self.profile, self.play, self.voltage, self.sums)
        inputs = (plant.position, plant.speed, self.goal, self.speed_limit, self.torque_limit, *states)
        for index, array in enumerate(inputs):
            buffer.set_arg(index, array.data)
        for index, array in enumerate((plant.drive, plant.friction, self.duty, self.torque, *states)):
            buffer.set_res(index, array.data)
        return buffer, run


def servo_function(config: BankConfig) -> ca.Function:
    """One physics step of all servos, in counts, N·m and V.

    Inputs: position, speed, goal, speed limit (counts/s, 0 = none), torque
    limit, and the states profile, play, voltage, sums. Outputs: drive, friction,
    duty, torque, and the states anew. Every entry of a state depends on its own
    old value, so it is read before it is written and may be updated in place.
    """
    servo, n = config.servo, N_JOINTS
    q, qd, goal, speed, limit, profile, play = (
        ca.SX.sym(name, n) for name in ("q", "qd", "goal", "speed", "limit", "profile", "play")
    )
    voltage, sums = ca.SX.sym("voltage"), ca.SX.sym("sums", 2 * n + 2)
    present = ca.floor(q / servo.step_angle + 0.5)
    next_profile = _follow(profile, goal, speed * config.period)
    next_profile = ca.if_else(limit > 0.0, next_profile, present)
    duty = _duty(servo, next_profile - present, ca.DM(config.gain), limit)

    share = voltage / servo.nominal_voltage
    drive = servo.stall_torque * share * duty
    torque = ca.if_else(limit > 0.0, drive - servo.back_emf * qd, 0.0)
    next_play = play
    if config.backlash > 0.0:
        next_play, engaged = _backlash(config, play, share * duty, qd)
        # Between the flanks nothing is passed on: what joint damping takes is given back.
        torque = engaged * torque
        drive = torque + ca.if_else(limit > 0.0, servo.back_emf * qd, 0.0)
    fading = 1.0 / (1.0 + (qd / config.load_friction_speed) ** 2)
    friction = servo.coulomb_friction + servo.load_friction * fading * ca.fabs(torque)
    friction = ca.DM(config.friction_scale) * friction

    current = law.current_per_torque(servo) * torque
    supply = ca.sum1(ca.fmax(duty * current, 0.0)) + n * config.standby_current
    next_voltage = config.open_voltage - config.battery.resistance * supply
    next_sums = sums + ca.vertcat(current**2, duty, voltage * supply, voltage)
    return ca.Function(
        "servos",
        [q, qd, goal, speed, limit, profile, play, voltage, sums],
        [drive, friction, duty, torque, next_profile, next_play, next_voltage, next_sums],
    )


def _follow(profile: ca.SX, goal: ca.SX, step: ca.SX) -> ca.SX:
    """The goal ramp of the moving-speed limit; a step of zero means no limit."""
    ramp = profile + ca.fmin(ca.fmax(goal - profile, -step), step)
    return ca.if_else(step > 0.0, ramp, goal)


def _duty(servo: ServoParameters, error: ca.SX, gain: ca.DM, limit: ca.SX) -> ca.SX:
    """Symbolic twin of `bluefoot_mpc.model.servo.duty`, with a factor on the slope."""
    beyond = ca.fabs(error) - servo.compliance_margin
    ramp = servo.punch / law.FULL_DUTY + gain * beyond / servo.compliance_slope
    return ca.if_else(beyond > 0.0, ca.sign(error) * ca.fmin(ramp, limit), 0.0)


def _backlash(config: BankConfig, play: ca.SX, drive: ca.SX, qd: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Where the pinion lies between the gear's flanks (rad), and 1 where it pushes one.

    A rotor without load runs at the drive's no-load speed, so it crosses the gap
    at the difference to the output's speed.
    """
    half = 0.5 * config.backlash
    moved = play + config.period * (config.servo.no_load_speed * drive - qd)
    next_play = ca.fmin(ca.fmax(moved, -half), half)
    return next_play, ca.fabs(moved) >= half
