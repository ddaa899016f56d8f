"""Are the servos those that the robot needs? Everything is looked at, and all findings are given at once."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import ErrorBit, error_words
from bluefoot_mpc.io.dynamixel.errors import CorruptReplyError, NoReplyError, ServoError
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.dynamixel.table import AX12A, Register
from bluefoot_mpc.io.dynamixel.units import baud_from_register, delay_from_register, voltage_from_register
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import N_JOINTS

_SETUP = "Run `bluefoot servo setup` for it"
_CUT = "Check its cable, the servos' power, its ID and the baud rate"
_BLOCK = AX12A["registered"].end
"""Registers 0 to 44 are read at once: set-up, state and measurements."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CheckConfig:
    """What a servo must be like before it gets torque."""

    cw_limit: int = 0  # counts, least that the angle limits may allow
    ccw_limit: int = 1023  # counts
    low_voltage: float = 10.8  # V, 3S pack: below it the finding is a warning
    least_voltage: float = 10.2  # V, below it a robot is not armed: it would sit down at once
    most_voltage: float = 12.8  # V
    most_temperature: int = 60  # °C at which arming is refused
    slow_adapter_ms: float = 1.0  # latency timer beyond which the adapter is worth a warning
    useless_adapter_ms: float = 16.0  # latency timer, or measured answer, at which arming is refused
    patience: float = (
        0.04  # s more than usual that a ping is waited for, so that a slow adapter is told from none
    )

    def __post_init__(self) -> None:
        require_positive(
            low_voltage=self.low_voltage,
            least_voltage=self.least_voltage,
            most_voltage=self.most_voltage,
            slow_adapter_ms=self.slow_adapter_ms,
            useless_adapter_ms=self.useless_adapter_ms,
            patience=self.patience,
        )
        require_range(0, 1023, cw_limit=self.cw_limit, ccw_limit=self.ccw_limit)


def check_servos(
    buses: Sequence[ServoBus],
    layout: ServoLayout,
    config: CheckConfig | None = None,
    joints: Iterable[int] | None = None,
) -> list[Finding]:
    """Look at every servo and port; writes nothing.

    Args:
        buses: the ports, in the order of the layout's indices.
        layout: which servo drives which joint.
        config: what is asked of a servo.
        joints: those to look at; all where not given.

    Returns:
        A finding for each servo and port, several where several things are wrong. Refusals keep torque off.

    Raises:
        LinkLostError: a port is gone.
    """
    config = config or CheckConfig()
    chosen = range(N_JOINTS) if joints is None else tuple(joints)
    used = sorted({layout.ports[joint] for joint in chosen})
    findings: list[Finding] = []
    answers: dict[int, list[float]] = {port: [] for port in used}
    for joint in chosen:
        bus = buses[layout.ports[joint]]
        found, took = _check_servo(bus, layout.ids[joint], layout.part(joint), config)
        findings += found
        if took is not None:
            answers[layout.ports[joint]].append(took)
    for port in used:
        findings += _check_port(buses[port], answers[port], config)
    return findings


def _check_servo(
    bus: ServoBus, servo: int, part: str, config: CheckConfig
) -> tuple[list[Finding], float | None]:
    """Findings of one servo, and how long its answer to a ping took (s, the bytes' own time taken off)."""
    begun = bus.clock.now()
    try:
        bus.ping(servo, tries=1, patience=config.patience)
        took = bus.clock.now() - begun - 12 * bus.wire.byte_time
    except (NoReplyError, CorruptReplyError):
        took = None
    try:
        if took is None:
            bus.ping(servo)
        block = bus.read_block(servo, 0, _BLOCK, patience=config.patience)
    except NoReplyError:
        return [_refusal(part, f"no reply on {bus.name}", _CUT)], took
    except CorruptReplyError as error:
        text = f"only garbled replies on {bus.name} ({bus.wire.detail}): perhaps two servos have ID {servo}"
        return [_refusal(part, text, "Unplug the others one by one; " + _mend_of(error))], took
    except ServoError as error:
        return [_refusal(part, str(error), _SETUP)], took
    bad = [finding for check in _CHECKS for finding in check(bus, part, block, config)]
    bad += _state(part, block, bus.errors[servo], config)
    return bad or [_fine(part, block)], took


def _mend_of(_: CorruptReplyError) -> str:
    return "check the cable and its ground"


def _value(block: bytes, name: str) -> int:
    return AX12A[name].decode(block, 0)


def _refusal(part: str, text: str, mend: str) -> Finding:
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)


def _fine(part: str, block: bytes) -> Finding:
    volts, degrees = (
        voltage_from_register(_value(block, "present_voltage")),
        _value(block, "present_temperature"),
    )
    text = f"{AX12A.model}, firmware {_value(block, 'firmware_version')}, {volts:.1f} V, {degrees} °C"
    return Finding(part=part, text=text)


def _model(_: ServoBus, part: str, block: bytes, __: CheckConfig) -> list[Finding]:
    model = _value(block, "model_number")
    if model == AX12A.model_number:
        return []
    text = f"model {model} is not the {AX12A.model} ({AX12A.model_number})"
    return [_refusal(part, text, f"Put an {AX12A.model} in its place")]


def _set_up(bus: ServoBus, part: str, block: bytes, config: CheckConfig) -> list[Finding]:
    """Permanent registers that must hold one value."""
    findings = []
    delay = AX12A["return_delay_time"]
    if value := delay.decode(block, 0):
        text = f"return delay is {value} ({1e6 * delay_from_register(value):g} µs) instead of 0"
        findings.append(_refusal(part, text, _SETUP))
    baud = _value(block, "baud_rate")
    if abs(baud_from_register(baud) / bus.link.baud - 1.0) > 0.03:
        text = (
            f"baud register {baud} means {baud_from_register(baud):.0f} bit/s, the port has {bus.link.baud}"
        )
        findings.append(_refusal(part, text, _SETUP))
    shutdown = _value(block, "shutdown")
    wanted = int(ErrorBit.OVERHEATING | ErrorBit.OVERLOAD)
    if shutdown & wanted != wanted or shutdown & ErrorBit.INPUT_VOLTAGE:
        text = f"shutdown mask is {shutdown} instead of {wanted} (too hot, overloaded, not voltage)"
        findings.append(_refusal(part, text, _SETUP))
    for register in (AX12A["status_return_level"], AX12A["temperature_limit"], AX12A["max_torque"]):
        findings += _must_be(part, register, block)
    return findings


def _must_be(part: str, register: Register, block: bytes) -> list[Finding]:
    value = register.decode(block, 0)
    if value == register.default:
        return []
    name = register.name.replace("_", " ")
    return [_refusal(part, f"{name} is {value} instead of {register.default}", _SETUP)]


def _angle_limits(_: ServoBus, part: str, block: bytes, config: CheckConfig) -> list[Finding]:
    low, high = _value(block, "cw_angle_limit"), _value(block, "ccw_angle_limit")
    if low == high == 0:
        return [_refusal(part, "both angle limits are 0: it would turn like a wheel", _SETUP)]
    if low <= config.cw_limit and high >= config.ccw_limit:
        return []
    text = f"angle limits {low}..{high} are narrower than {config.cw_limit}..{config.ccw_limit}"
    return [_refusal(part, text, _SETUP)]


_CHECKS: tuple[Callable[[ServoBus, str, bytes, CheckConfig], list[Finding]], ...] = (
    _model,
    _set_up,
    _angle_limits,
)


def _state(part: str, block: bytes, error: int, config: CheckConfig) -> list[Finding]:
    """What may be wrong today: voltage, heat, errors."""
    findings = []
    volts = voltage_from_register(_value(block, "present_voltage"))
    charge = "Charge or replace the pack"
    if volts < config.least_voltage:
        findings.append(_refusal(part, f"{volts:.1f} V is below {config.least_voltage:g} V", charge))
    elif volts < config.low_voltage:
        text = f"{volts:.1f} V is below {config.low_voltage:g} V: it will not last long"
        findings.append(Finding(part=part, text=text, mend=charge, severity=Severity.WARNING))
    elif volts > config.most_voltage:
        findings.append(
            _refusal(
                part, f"{volts:.1f} V is above {config.most_voltage:g} V", "Use a 3S pack or a 12 V supply"
            )
        )
    degrees = _value(block, "present_temperature")
    if degrees >= config.most_temperature:
        text = f"{degrees} °C is at or above {config.most_temperature} °C"
        findings.append(_refusal(part, text, "Let it cool down"))
    if error:
        mend = "Mend the cause and switch the servos' power off and on"
        findings.append(_refusal(part, f"it reports: {error_words(error)}", mend))
    return findings


def _check_port(bus: ServoBus, answers: Sequence[float], config: CheckConfig) -> list[Finding]:
    """Latency of the adapter: what it says, and what was measured."""
    part = f"port {bus.name}"
    mend = (
        "Set the adapter's latency timer to 1 ms: echo 1 | sudo tee "
        "/sys/class/tty/<name>/device/latency_timer, or by a udev rule"
    )
    timer = getattr(bus.link, "latency_timer_ms", lambda: None)()
    measured = 1e3 * statistics.median(answers) if answers else 0.0
    if timer is not None and timer >= config.useless_adapter_ms:
        return [_refusal(part, f"latency timer is {timer:g} ms: 4 cycles a second at most", mend)]
    if measured >= 0.5 * config.useless_adapter_ms:
        text = f"servos' answers take {measured:.1f} ms (median): a latency timer of 16 ms, or a slow adapter"
        return [_refusal(part, text, mend)]
    if timer is not None and timer > config.slow_adapter_ms:
        text = f"latency timer is {timer:g} ms: slow cycles"
        return [Finding(part=part, text=text, mend=mend, severity=Severity.WARNING)]
    said = (
        "no latency timer (UART, bridge or pseudo-terminal)"
        if timer is None
        else f"latency timer {timer:g} ms"
    )
    severity = Severity.NOTE if timer is None else Severity.OK
    return [Finding(part=part, text=f"{said}; answers take {measured:.2f} ms (median)", severity=severity)]
