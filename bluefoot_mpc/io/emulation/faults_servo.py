"""Faults of servos and their supply: what a plan does to a `ServoLine`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, cast, runtime_checkable

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.dynamixel.table import AX12A
from bluefoot_mpc.io.emulation.ax12a import EmulatedServo
from bluefoot_mpc.io.emulation.faults import KINDS, Fault
from bluefoot_mpc.io.emulation.servo_line import ServoLine, baud_register


@runtime_checkable
class SuppliedShafts(Protocol):
    """Shafts whose supply can be changed."""

    def set_supply(self, voltage: float) -> None:
        """Change the voltage (V) without load."""
        ...


class ServoFaults:
    """The faults of a plan that act on servos; changes those of the start at once.

    Args:
        line: the servos.
        faults: those of kinds that act on a servo, or on its EEPROM at the start; others are left alone.
        start: s on the line's clock.
    """

    def __init__(self, line: ServoLine, faults: Sequence[Fault], start: float) -> None:
        self._line = line
        for fault in faults:
            _check_servo(line, fault)
            if KINDS[fault.kind].acts_on == "start":
                for servo in self._servos(fault):
                    _change(line, servo, fault, start)
        self._lasting = [fault for fault in faults if KINDS[fault.kind].acts_on == "servo"]
        self._on = [False] * len(self._lasting)

    def apply(self, elapsed: float, time: float) -> None:
        """Begin and end what is due.

        Args:
            elapsed: s after the line began.
            time: s on the line's clock.
        """
        for index, fault in enumerate(self._lasting):
            is_on = fault.is_on(elapsed)
            if is_on and fault.kind == "voltage":
                self._feed(fault, _ramp(fault, elapsed))
            if is_on != self._on[index]:
                self._on[index] = is_on
                self._switch(fault, is_on, time)

    def _switch(self, fault: Fault, is_on: bool, time: float) -> None:
        """Begin or end a fault."""
        if fault.kind == "power_stuck":
            self._line.is_switch_stuck = is_on
            return
        if fault.kind == "voltage" and not is_on:
            self._restore()
            return
        act = _ACTS.get(fault.kind)
        for servo in self._servos(fault) if act is not None else ():
            cast("Callable[..., None]", act)(self._line, servo, fault, is_on, time)

    def _feed(self, fault: Fault, voltage: float) -> None:
        for servo in self._servos(fault):
            servo.forced_voltage = voltage
        shafts = self._line.shafts
        if fault.servo is None and isinstance(shafts, SuppliedShafts):
            shafts.set_supply(voltage)

    def _restore(self) -> None:
        """The supply that was there before; joints keep the last one where they cannot tell."""
        for servo in self._line.all:
            servo.forced_voltage = None
        shafts = self._line.shafts
        nominal = getattr(shafts, "nominal_supply", None)
        if nominal is not None and isinstance(shafts, SuppliedShafts):
            shafts.set_supply(nominal)

    def _servos(self, fault: Fault) -> Sequence[EmulatedServo]:
        return self._line.all if fault.servo is None else (self._line.servos[fault.servo],)


def _plug(line: ServoLine, servo: EmulatedServo, _: Fault, is_on: bool, time: float) -> None:
    line.plug(servo, not is_on, time)


def _heat(_: ServoLine, servo: EmulatedServo, fault: Fault, is_on: bool, __: float) -> None:
    servo.forced_temperature = fault.amount if is_on else None


def _overload(_: ServoLine, servo: EmulatedServo, __: Fault, is_on: bool, ___: float) -> None:
    servo.forced_overload = is_on


_ACTS: dict[str, Callable[[ServoLine, EmulatedServo, Fault, bool, float], None]] = {
    "unplugged": _plug,
    "brown_out": _plug,
    "temperature": _heat,
    "overload": _overload,
}


def _ramp(fault: Fault, elapsed: float) -> float:
    """Voltage now, V."""
    if fault.to is None or fault.end is None:
        return fault.amount
    share = (elapsed - fault.start) / (fault.end - fault.start)
    return fault.amount + share * (fault.to - fault.amount)


def _change(line: ServoLine, servo: EmulatedServo, fault: Fault, start: float) -> None:
    """A servo that is not as it should be, from the start."""
    value = int(fault.amount) if fault.kind != "missing" else 0
    match fault.kind:
        case "missing":
            line.plug(servo, False, start)
        case "wrong_baud":
            servo.write(AX12A["baud_rate"].address, baud_register(value))
        case "duplicate_id":
            servo.write(AX12A["id"].address, value)
        case "wrong_model":
            servo.write(AX12A["model_number"].address, value, 2)
        case _:
            _change_register(servo, fault.address or 0, value)


def _change_register(servo: EmulatedServo, address: int, value: int) -> None:
    register = next((entry for entry in AX12A if entry.address == address), None)
    if register is None:
        raise ConfigurationError(f"fault register: the AX-12A has no register at address {address}")
    if value >= 1 << 8 * register.size:
        raise ConfigurationError(f"fault register: {value} does not fit into {register.name}")
    servo.write(address, value, register.size)


def _check_servo(line: ServoLine, fault: Fault) -> None:
    if fault.servo is not None and fault.servo not in line.servos:
        valid = ", ".join(str(identity) for identity in sorted(line.servos))
        raise ConfigurationError(f"fault {fault.kind}: no servo {fault.servo} on this line. Valid: {valid}")
