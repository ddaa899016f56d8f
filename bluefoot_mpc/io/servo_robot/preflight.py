"""What must hold before torque, and what people should know of the sensors."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable

import numpy as np

from bluefoot_mpc.io.board.readings import BoardReadings
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.calibration import findings as calibration_findings
from bluefoot_mpc.io.dynamixel.arming import CheckConfig, check_servos
from bluefoot_mpc.io.dynamixel.errors import ServoError
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.servo_robot.bundle import Devices
from bluefoot_mpc.types import JOINTS, N_LEGS, FloatArray

_NO_BOARD = Finding(
    part="sensor board",
    text="there is none, and a robot without inertial sensor and foot switches cannot stand",
    mend="Name its port: --set devices.board_port=/dev/ttyACM0",
    severity=Severity.REFUSAL,
)
_SAG = math.radians(10.0)
"""rad by which a limp leg may hang outside its soft limits."""


def preflight(devices: Devices, least_voltage: float, beat: Callable[[], None]) -> tuple[Finding, ...]:
    """Look at every device; writes nothing.

    Args:
        devices: their drivers; the servos' supply is on.
        least_voltage: V at rest, with less the robot is not armed.
        beat: called in between, so that board and watchdog do not think that nobody is there.
    """
    found: list[Finding] = []
    found += devices.board.findings() if devices.board is not None else [_NO_BOARD]
    found += devices.lidar.findings() if devices.lidar is not None else ()
    found += devices.camera.findings() if devices.camera is not None else ()
    config = CheckConfig(least_voltage=least_voltage)
    for leg in range(N_LEGS):
        found += check_servos(devices.buses, devices.layout, config, range(4 * leg, 4 * leg + 4))
        beat()
    found += calibration_findings(devices.calibration, devices.model, _identities(devices))
    # Ports are looked at once for each leg.
    return tuple({(finding.part, finding.text): finding for finding in found}.values())


def posture_findings(calibration: Calibration, counts: FloatArray) -> tuple[Finding, ...]:
    """Joints that cannot be where they seem to be: a horn was moved, or the calibration is another robot's.

    Args:
        calibration: signs, offsets and soft limits.
        counts: (16,) present positions; NaN where unknown.
    """
    angles, (lower, upper) = calibration.angles(counts), calibration.soft_limits
    beyond = np.maximum(lower - angles, angles - upper)
    return tuple(
        Finding(
            part=f"servo {calibration.ids[joint]} ({JOINTS[joint]})",
            text=f"its joint reads {math.degrees(angles[joint]):.0f}°, outside its limits "
            f"({math.degrees(lower[joint]):.0f}..{math.degrees(upper[joint]):.0f}°)",
            mend="Move the leg by hand, or calibrate anew: bluefoot servo calibrate",
            severity=Severity.REFUSAL,
        )
        for joint in np.flatnonzero(beyond > _SAG).tolist()
    )


def _identities(devices: Devices) -> dict[int, tuple[int, int]]:
    """Model number and firmware of the servos that answer, by ID."""
    seen: dict[int, tuple[int, int]] = {}
    for servo, port in zip(devices.layout.ids, devices.layout.ports, strict=True):
        # One that is silent has its finding already.
        with contextlib.suppress(ServoError):
            block = devices.buses[port].read_block(servo, 0, 3, tries=1)
            seen[servo] = (block[0] | block[1] << 8, block[2])
    return seen


def switch_findings(board: BoardReadings) -> tuple[Finding, ...]:
    """Foot switches that cannot be trusted: the robot walks on without them, and people should know."""
    faults = (fault.partition(": ") for fault in board.faults if fault.startswith("foot switch"))
    mend = "Check the switch and its cable"
    return tuple(
        Finding(part=part, text=text, mend=mend, severity=Severity.WARNING) for part, _, text in faults
    )
