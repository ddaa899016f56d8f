"""Setting servos up: the only code that writes their permanent memory (EEPROM).

What will change is worked out first, shown, and written only then; every value
is read back. Registers and ranges are those of the AX-12A e-manual.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.calibration import HIGHEST
from bluefoot_mpc.io.commissioning.ports import ServoPorts
from bluefoot_mpc.io.commissioning.survey import ServoFacts, Survey, look_at, survey_findings
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import LAST_ID
from bluefoot_mpc.io.dynamixel.errors import CorruptReplyError, NoReplyError
from bluefoot_mpc.io.dynamixel.units import baud_from_register, register_from_baud
from bluefoot_mpc.settings import require_range

_BAUD_TOLERANCE = 0.03


@dataclass(frozen=True, kw_only=True, slots=True)
class SetupConfig:
    """What every servo is set to."""

    return_delay_us: float = 0.0  # µs between request and reply
    temperature_limit: int = 70  # °C at which the servo itself switches off
    min_voltage: float = 6.0  # V, alarm only: the robot has its own thresholds
    max_voltage: float = 14.0  # V
    cw_angle_limit: int = 0  # counts: all of its range, in joint mode; soft limits are the driver's
    ccw_angle_limit: int = HIGHEST  # counts
    max_torque: int = 1023  # 0.1 %, torque limit after power-up
    status_return_level: int = 2  # answers everything
    alarm_led: int = 36  # overheating, overload
    shutdown: int = 36  # overheating, overload; voltage must not drop a walking robot

    def __post_init__(self) -> None:
        require_range(0.0, 508.0, return_delay_us=self.return_delay_us)
        require_range(0, 70, temperature_limit=self.temperature_limit)

    def registers(self) -> dict[str, int]:
        """Values by register."""
        return {
            "return_delay_time": round(self.return_delay_us / 2.0),
            "temperature_limit": self.temperature_limit,
            "min_voltage_limit": round(10.0 * self.min_voltage),
            "max_voltage_limit": round(10.0 * self.max_voltage),
            "cw_angle_limit": self.cw_angle_limit,
            "ccw_angle_limit": self.ccw_angle_limit,
            "max_torque": self.max_torque,
            "status_return_level": self.status_return_level,
            "alarm_led": self.alarm_led,
            "shutdown": self.shutdown,
        }


@dataclass(frozen=True, kw_only=True, slots=True)
class Change:
    """One register of one servo that is to be written."""

    servo: int
    register: str
    old: int
    new: int


def plan(found: Survey, config: SetupConfig) -> tuple[Change, ...]:
    """What has to be written so that every servo is as wanted.

    Raises:
        DeviceError: a servo is missing, garbled or of another model, or locked.
    """
    findings = survey_findings(found)
    if findings:
        raise DeviceError("nothing was written:\n  " + "\n  ".join(map(str, findings)))
    changes = []
    for facts in found.servos.values():
        _refuse_locked(facts)
        wanted = config.registers()
        changes += [
            Change(servo=facts.id, register=name, old=facts[name], new=value)
            for name, value in wanted.items()
            if facts[name] != value
        ]
    return tuple(changes)


def apply(ports: ServoPorts, changes: Sequence[Change], progress: Callable[[], None] = lambda: None) -> None:
    """Write changes, torque off, and read each one back.

    Raises:
        ServoError: a servo refuses, is lost, or holds another value afterwards.
    """
    for servo in sorted({change.servo for change in changes}):
        bus = bus_of(ports, servo)
        bus.write_verified(servo, "torque_enable", 0)
        for change in (change for change in changes if change.servo == servo):
            bus.write_verified(servo, change.register, change.new)
            progress()


def change_id(ports: ServoPorts, old: int, new: int) -> ServoFacts:
    """Give the one servo with ID `old` another ID.

    Returns:
        The servo under its new ID.

    Raises:
        ConfigurationError: no servo can have that ID.
        NoReplyError: nobody has the old ID.
        DeviceError: more than one servo answers at the old ID, or one has the new ID already.
    """
    if not 0 <= new <= LAST_ID:
        raise ConfigurationError(f"--new-id = {new} must lie in 0..{LAST_ID}")
    bus = bus_of(ports, old)
    try:
        _refuse_locked(look_at(bus, old))
    except CorruptReplyError as error:
        raise DeviceError(
            f"more than one servo seems to answer at ID {old} on {bus.name} ({error}). "
            "Connect a single servo, then run the command again; nothing was written"
        ) from error
    if any(_answers(other, new) for other in ports.buses):
        raise DeviceError(
            f"ID {new} is taken: a servo answers there. Give that one another ID first; nothing was written"
        )
    bus.write_verified(old, "torque_enable", 0)
    # From the next packet on it listens to the new ID alone; reading there is the proof.
    with contextlib.suppress(NoReplyError, CorruptReplyError):
        bus.write(old, "id", new)
    facts = look_at(bus, new)
    if _answers(bus, old):
        raise DeviceError(
            f"a servo still answers at ID {old}: there were two, both may have moved to {new}. "
            "Connect a single servo and set it up alone"
        )
    return facts


def change_baud(ports: ServoPorts, ids: Sequence[int], baud: int) -> None:
    """Bring servos to another baud rate, and the ports with them.

    Raises:
        ConfigurationError: an AX-12A does not have that rate.
        DeviceError: a servo does not answer at it.
    """
    check_baud(baud)
    register = register_from_baud(baud)
    for servo in ids:
        bus = bus_of(ports, servo)
        bus.write_verified(servo, "torque_enable", 0)
        with contextlib.suppress(NoReplyError, CorruptReplyError):
            bus.write(servo, "baud_rate", register)
    before = ports.baud
    ports.change_baud(baud)
    lost = [servo for servo in ids if not any(_answers(bus, servo) for bus in ports.buses)]
    if lost:
        raise DeviceError(
            f"servo {', '.join(map(str, lost))} does not answer at {baud} bit/s. "
            f"Look where it is: bluefoot servo scan --baud {before} --all-bauds"
        )


def check_baud(baud: int) -> None:
    """Raise unless an AX-12A can talk at a rate.

    Raises:
        ConfigurationError: it cannot; the message names rates that it has.
    """
    register = register_from_baud(baud) if baud > 0 else -1
    if not 0 <= register <= 254 or abs(baud_from_register(register) / baud - 1.0) > _BAUD_TOLERANCE:
        raise ConfigurationError(
            f"{baud} bit/s is no rate of an AX-12A: take 1000000, 500000, 200000, 115200, 57600 or 9600"
        )


def bus_of(ports: ServoPorts, servo: int) -> ServoBus:
    """The port on which a servo answers.

    Raises:
        NoReplyError: none of them.
    """
    for bus in ports.buses[:-1]:
        with contextlib.suppress(NoReplyError):
            bus.ping(servo)
            return bus
    last = ports.buses[-1]
    with contextlib.suppress(CorruptReplyError):
        last.ping(servo)
    return last


def _answers(bus: ServoBus, servo: int) -> bool:
    try:
        bus.ping(servo)
    except NoReplyError:
        return False
    except CorruptReplyError:
        return True
    return True


def _refuse_locked(facts: ServoFacts) -> None:
    if facts["lock"]:
        raise DeviceError(
            f"{facts.part}: its permanent memory is locked until the next power-up. "
            "Switch the servos' power off and on, then run the command again"
        )
