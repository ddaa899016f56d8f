"""Sixteen AX-12A servos on one battery, advanced once per physics step.

The law is that of `bluefoot_mpc.model.servo`, as one CasADi function over all
joints that reads joint angles from MuJoCo's memory and writes motor torques
back: under 1 µs a step as generated C, where numpy on sixteen numbers takes
over 20. What randomisation changes is an input, so that all runs share one build.
MuJoCo integrates the back-EMF (as joint damping) and the friction (as friction
loss) implicitly; the function writes how much friction each joint has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import compiled, made_once
from bluefoot_mpc.io.emulation.shafts import COUNT, MIDDLE, ShaftDrive
from bluefoot_mpc.model import servo as law
from bluefoot_mpc.model.parameters import BatteryParameters, ServoParameters
from bluefoot_mpc.types import JOINTS, N_JOINTS, BoolArray, FloatArray, JointCommand

_NO_RAMP = 1e6
"""Counts a step: a goal ramp that never holds back."""
_FOR_EVER = 1e6
"""Counts: a goal that a wheel never reaches."""
_CLOCKWISE = 1 << 10
"""Bit of the moving-speed register that turns a wheel clockwise."""


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
        goal: (16,) counts, goal registers.
        profile: (16,) counts, where the moving-speed ramp has come to.
        play: (16,) rad, where the pinions lie between the gears' flanks.
        duty: (16,) fraction of the supply voltage on each motor.
        torque: (16,) N·m, motor torque after back-EMF, before friction.
        voltage: (1,) V at the servos.
        temperature: (16,) °C.
    """

    def __init__(self, config: BankConfig, plant: Plant) -> None:
        self.config = config
        self.plant = plant
        self.goal = np.zeros(N_JOINTS)
        self.profile = np.zeros(N_JOINTS)
        self.play = np.zeros(N_JOINTS)
        self.duty = np.zeros(N_JOINTS)
        self.torque = np.zeros(N_JOINTS)
        self.voltage = np.zeros(1)
        self.temperature = np.zeros(N_JOINTS)
        self._ramp = np.zeros(N_JOINTS)
        self._limit = np.zeros(N_JOINTS)
        self._live = np.zeros(N_JOINTS)
        self._wanted_limit = np.zeros(N_JOINTS)
        self._asked_limit: list[float] = []
        self._shut_down: BoolArray = np.zeros(N_JOINTS, dtype=np.bool_)
        self._sums = np.zeros(N_JOINTS + 2)
        # Mean power and voltage of a frame, highest temperature at its end.
        self._summary = np.zeros(3)
        self._frame_steps = 0
        # What the randomisation of a run scales: slope of the duty, friction, open voltage.
        self._slope = config.gain / config.servo.compliance_slope
        self._friction_scale = np.array(config.friction_scale, dtype=np.float64)
        self._open_voltage = np.array([config.open_voltage])
        self._function = servo_function(config)
        self._buffer, self.advance = self._connect()
        self.reset()

    def reset(self) -> None:
        """Cold servos, torque off, pack at rest."""
        for state in (self.goal, self.profile, self.play, self.duty, self.torque, self._wanted_limit):
            state[:] = 0.0
        self._ramp[:] = _NO_RAMP
        self._slope[:] = self.config.gain / self.config.servo.compliance_slope
        self._open_voltage[0] = self.config.open_voltage
        self._live[:] = 0.0
        self._shut_down[:] = False
        self._asked_limit = [0.0] * N_JOINTS
        self.cool()
        self._apply_limits()

    def cool(self) -> None:
        """Servos at ambient temperature and an unloaded pack, everything else as it is."""
        self.temperature[:] = self.config.servo.ambient
        self.voltage[:] = self.config.open_voltage
        self._sums[:] = 0.0

    def hold(self, position: FloatArray) -> None:
        """Hold `position` (16, rad) with full torque, at once."""
        self.write(JointCommand(position=position, speed=np.zeros(N_JOINTS), torque_limit=np.ones(N_JOINTS)))
        self.profile[:] = self.goal

    def write(self, command: JointCommand) -> None:
        """Take goal, moving speed and torque limit as the registers would hold them."""
        servo = self.config.servo
        self.goal[:] = law.to_counts(servo, command.position)
        if any(command.speed.tolist()):
            ramp = law.quantise_speed_limit(command.speed) * (self.config.period / servo.step_angle)
            self._ramp[:] = np.where(ramp > 0.0, ramp, _NO_RAMP)
        else:
            self._ramp[:] = _NO_RAMP
        asked: list[float] = command.torque_limit.tolist()
        if asked == self._asked_limit and not self._shut_down.any():
            return
        self._asked_limit = asked
        limit = np.minimum(np.maximum(command.torque_limit, 0.0), 1.0)
        self._wanted_limit[:] = np.floor(limit * law.FULL_DUTY) / law.FULL_DUTY
        # A servo works again only when it has cooled and its limit is written anew.
        self._shut_down &= self.temperature >= law.SHUTDOWN_TEMPERATURE
        self._apply_limits()

    def write_servo(self, index: int, drive: ShaftDrive) -> None:
        """Let the registers of one servo act; margin and punch are those of the parameter file."""
        servo, limit = self.config.servo, drive.torque_limit / law.FULL_DUTY
        self.goal[index] = (drive.goal - MIDDLE) * (COUNT / servo.step_angle)
        ramp = drive.speed * (law.SPEED_UNIT * self.config.period / servo.step_angle)
        if drive.is_wheel:
            self.goal[index] = -_FOR_EVER if drive.speed & _CLOCKWISE else _FOR_EVER
            limit, ramp = min(limit, (drive.speed & (_CLOCKWISE - 1)) / law.FULL_DUTY), 0.0
        self._ramp[index] = ramp or _NO_RAMP
        self._slope[index] = self.config.gain[index] * 2.0 / sum(drive.slope)
        limit = limit if drive.enabled else 0.0
        if limit != self._wanted_limit[index] or self._shut_down[index]:
            self._asked_limit = []
            self._wanted_limit[index] = limit
            self._shut_down[index] &= self.temperature[index] >= law.SHUTDOWN_TEMPERATURE
            self._apply_limits()

    def set_open_voltage(self, voltage: float) -> None:
        """Change the voltage (V) of the pack without load, until `reset`."""
        self._open_voltage[0] = voltage

    @property
    def overheated(self) -> tuple[str, ...]:
        """Names of the servos that switched off by heat."""
        return tuple(name for name, off in zip(JOINTS, self._shut_down, strict=True) if off)

    def finish_frame(self, steps: int) -> tuple[float, float]:
        """Close a frame of `steps` physics steps: heat the motors, clear the sums.

        Returns:
            Mean electrical power in W, mean voltage in V.
        """
        if steps != self._frame_steps:
            self._frame_steps, self._frame_buffer = steps, self._connect_frame(steps)
        self._close_frame()
        self._sums.fill(0.0)
        power, voltage, hottest = self._summary.tolist()
        if hottest >= law.SHUTDOWN_TEMPERATURE:
            self._shut_down |= self.temperature >= law.SHUTDOWN_TEMPERATURE
            self._apply_limits()
        return power, voltage

    def _apply_limits(self) -> None:
        """Bring torque limits into force, and with them which servos are live or limp."""
        servo = self.config.servo
        self._limit[:] = np.where(self._shut_down, 0.0, self._wanted_limit)
        live = self._limit > 0.0
        # A servo that is switched on starts its ramp from where it stands.
        woken = live & (self._live == 0.0)
        self.profile[woken] = law.to_counts(servo, self.plant.position)[woken]
        self._live[:] = live
        # An open bridge carries no current, so a limp servo does not brake.
        self.plant.damping[:] = servo.back_emf * self._live + servo.viscous_friction

    def _connect(self) -> tuple[Any, Callable[[], None]]:
        """Bind the function to memory. States are updated in place: see `servo_function`."""
        buffer: Any
        buffer, run = self._function.buffer()
        plant = self.plant
        states = (self.profile, self.play, self.voltage, self._sums)
        inputs = (
            plant.position, plant.speed, self.goal, self._ramp, self._limit, self._live,
            self._slope, self._friction_scale, self._open_voltage, *states,
        )  # fmt: skip
        for index, array in enumerate(inputs):
            buffer.set_arg(index, array.data)
        for index, array in enumerate((plant.drive, plant.friction, self.duty, self.torque, *states)):
            buffer.set_res(index, array.data)
        return buffer, run

    def _connect_frame(self, steps: int) -> Any:
        """Bind the function that closes a frame; temperatures are updated in place."""
        buffer: Any
        config = self.config
        function = made_once(
            lambda: compiled(frame_function(config, steps)), "frame", config.servo, config.period, steps
        )
        buffer, self._close_frame = function.buffer()
        for index, array in enumerate((self._sums, self.temperature)):
            buffer.set_arg(index, array.data)
        for index, array in enumerate((self.temperature, self._summary)):
            buffer.set_res(index, array.data)
        return buffer


def frame_function(config: BankConfig, steps: int) -> ca.Function:
    """From the sums over `steps` physics steps and the temperatures: temperatures anew, and a summary.

    The summary is mean electrical power (W), mean voltage (V), highest
    temperature (°C).
    """
    servo = config.servo
    # The law is written for arrays and holds for symbols.
    temperature: Any = ca.SX.sym("temperature", N_JOINTS)
    sums: Any = ca.SX.sym("sums", N_JOINTS + 2)
    mean = sums / steps
    # Winding loss of a motor torque, W/(N·m)².
    loss = law.winding_resistance(servo) * law.current_per_torque(servo) ** 2 * mean[:N_JOINTS]
    heated = law.heat(servo, temperature, loss, steps * config.period)
    summary = ca.vertcat(mean[N_JOINTS:], ca.mmax(heated))
    return ca.Function("frame", [sums, temperature], [heated, summary])


def servo_function(config: BankConfig) -> Any:
    """`servo_symbols` built, once for all runs that differ by what randomisation draws."""
    laws = (config.servo, config.battery, config.standby_current, config.backlash)
    times = (config.load_friction_speed, config.period)
    return made_once(lambda: compiled(servo_symbols(config)), "servos", laws, times)


def servo_symbols(config: BankConfig) -> ca.Function:
    """One physics step of all servos, in counts, N·m and V.

    Inputs: position, speed, goal, ramp (counts a step), torque limit, live (0 or
    1), slope of the duty (1/count), factor on the friction, open voltage, and the
    states profile, play, voltage, sums. Outputs: drive, friction,
    duty, torque, and the states anew. Every entry of a state depends on its own
    old value, so it is read before it is written and may be updated in place.
    The sums are those of squared torque (16), power and voltage.
    """
    servo, n = config.servo, N_JOINTS
    q, qd, goal, ramp, limit, live, profile, play = (
        ca.SX.sym(name, n) for name in ("q", "qd", "goal", "ramp", "limit", "live", "profile", "play")
    )
    voltage, sums = ca.SX.sym("voltage"), ca.SX.sym("sums", n + 2)
    slope, scale, rest = ca.SX.sym("slope", n), ca.SX.sym("scale", n), ca.SX.sym("rest")
    present = ca.floor(q * (1.0 / servo.step_angle) + 0.5)
    next_profile = ca.fmin(ca.fmax(goal, profile - ramp), profile + ramp)
    duty = _duty(servo, next_profile - present, slope, limit)

    share = voltage / servo.nominal_voltage
    drive = (servo.stall_torque * share) * duty
    back_emf = servo.back_emf * qd
    torque = live * (drive - back_emf)
    next_play = play
    if config.backlash > 0.0:
        next_play, engaged = _backlash(config, play, share * duty, qd)
        # Between the flanks nothing is passed on: what joint damping takes is given back.
        torque = engaged * torque
        drive = torque + live * back_emf
    fading = 1.0 / (1.0 + (qd * (1.0 / config.load_friction_speed)) ** 2)
    friction = servo.coulomb_friction + servo.load_friction * (fading * ca.fabs(torque))
    friction = scale * friction

    # The bridge draws duty times the winding's current, and gives nothing back.
    drawn = law.current_per_torque(servo) * ca.sum1(ca.fmax(duty * torque, 0.0))
    supply = drawn + n * config.standby_current
    next_voltage = rest - config.battery.resistance * supply
    next_sums = sums + ca.vertcat(torque**2, voltage * supply, voltage)
    return ca.Function(
        "servos",
        [q, qd, goal, ramp, limit, live, slope, scale, rest, profile, play, voltage, sums],
        [drive, friction, duty, torque, next_profile, next_play, next_voltage, next_sums],
    )


def _duty(servo: ServoParameters, error: ca.SX, slope: ca.SX, limit: ca.SX) -> ca.SX:
    """Symbolic twin of `bluefoot_mpc.model.servo.duty`, with a slope (1/count) of each joint's own."""
    beyond = ca.fabs(error) - servo.compliance_margin
    ramp = servo.punch / law.FULL_DUTY + slope * beyond
    return (beyond > 0.0) * ca.sign(error) * ca.fmin(ramp, limit)


def _backlash(config: BankConfig, play: ca.SX, drive: ca.SX, qd: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Where the pinion lies between the gear's flanks (rad), and 1 where it pushes one.

    A rotor without load runs at the drive's no-load speed, so it crosses the gap
    at the difference to the output's speed.
    """
    half = 0.5 * config.backlash
    moved = play + config.period * (config.servo.no_load_speed * drive - qd)
    next_play = ca.fmin(ca.fmax(moved, -half), half)
    return next_play, ca.fabs(moved) >= half
