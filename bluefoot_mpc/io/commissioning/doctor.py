"""The check of everything that hangs on ports: refusals where a robot must not be armed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.calibration import findings as calibration_findings
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.commissioning.checks import check_ids, layout_of
from bluefoot_mpc.io.commissioning.ports import ServoPorts
from bluefoot_mpc.io.commissioning.survey import survey
from bluefoot_mpc.io.dynamixel.arming import CheckConfig
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.lidar.driver import Lidar
from bluefoot_mpc.io.lidar.errors import LidarError
from bluefoot_mpc.io.link import Link, LinkError
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.settings import require_range
from bluefoot_mpc.types import N_JOINTS

LEAST_RATE = 45.0
"""Cycles a second below which a robot is not armed."""
GOOD_RATE = 50.0
"""Cycles a second that the controllers are made for."""
_LOST_REFUSED, _LOST_WORTH_A_WARNING = 0.2, 0.01
"""Shares of replies that do not come; at the first a running robot sits down."""
_FASTER = "Set the adapter's latency timer to 1 ms and the return delay to 0, or use a port for each leg pair"
_IMU_RATE = 200.0


@dataclass(frozen=True, kw_only=True, slots=True)
class DoctorConfig:
    """How long to look."""

    seconds: float = 2.0  # s of timing, and of listening to sensors

    def __post_init__(self) -> None:
        require_range(0.2, 60.0, seconds=self.seconds)


def check_bus(
    ports: ServoPorts, ids: Sequence[int], calibration: Calibration | None, model: str, config: DoctorConfig
) -> list[Finding]:
    """Ports, servos, calibration against the servos that are there, and timing; reads only."""
    try:
        found = survey(ports, ids)
        armed = CheckConfig(least_voltage=DevicesConfig().arming_voltage)
        findings = check_ids(ports, ids, armed, found)
        seen = {s: (f["model_number"], f["firmware_version"]) for s, f in found.servos.items()}
        if calibration is not None:
            findings += calibration_findings(calibration, model, seen)
        complete = len(found.servos) == len(ids) == N_JOINTS
        if complete:
            # With the short deadlines of a robot that runs.
            buses = [ServoBus(bus.link, ports.clock) for bus in ports.buses]
            cycle = BusCycle(buses, layout_of(ports, found), ports.clock)
            findings += timing(buses, cycle, ports.clock, config)
        else:
            text = "not measured: it takes all 16 servos"
            findings.append(Finding(part="timing", text=text, severity=Severity.NOTE))
    except LinkError as error:
        return [Finding(part="ports", text=str(error), severity=Severity.REFUSAL)]
    return findings


def timing(buses: Sequence[ServoBus], cycle: BusCycle, clock: Clock, config: DoctorConfig) -> list[Finding]:
    """How often all servos can be read in a second, and replies that do not come; buses are fresh."""
    start = clock.now()
    cycles = 0
    while (now := clock.now()) - start < config.seconds:
        cycle.read(now + 0.1)
        cycles += 1
    rate = cycles / (clock.now() - start)
    totals = [bus.statistics.total for bus in buses]
    asked, lost = sum(t.requests for t in totals), sum(t.lost + t.corrupt for t in totals)
    return [_judge_rate(rate), _judge_losses(lost, asked)]


def check_board(link: Link, clock: Clock, config: DoctorConfig) -> list[Finding]:
    """The sensor board: link, inertial sensor, switches, battery; the supply is left as it is."""
    board = SensorBoard(link, clock)
    try:
        end = clock.now() + config.seconds
        while clock.now() < end:
            board.poll()
            clock.sleep_until(clock.now() + 0.005)
        findings = list(board.findings())
        rate = board.statistics.imu_samples / config.seconds
    finally:
        board.close()
    if rate > 0.0 and not math.isclose(rate, _IMU_RATE, rel_tol=0.15):
        text = f"{rate:.0f} inertial samples a second instead of {_IMU_RATE:.0f}"
        mend = "Look at the board's firmware and baud rate (docs/board-protocol.md)"
        findings.append(Finding(part=f"board {link.name}", text=text, mend=mend, severity=Severity.WARNING))
    return findings


def check_lidar(link: Link, clock: Clock) -> list[Finding]:
    """The LIDAR: a robot walks without it, so nothing about it refuses."""
    lidar = Lidar(link, clock)
    try:
        lidar.start()
        return list(lidar.findings())
    except LidarError as error:
        return [Finding(part=f"LIDAR {link.name}", text=str(error), severity=Severity.WARNING)]
    finally:
        lidar.close()


def _judge_rate(rate: float) -> Finding:
    text = f"{rate:.0f} readings of all servos a second"
    if rate < LEAST_RATE:
        text += f", less than {LEAST_RATE:.0f}"
        return Finding(part="timing", text=text, mend=_FASTER, severity=Severity.REFUSAL)
    if rate < GOOD_RATE:
        return Finding(part="timing", text=text, mend=_FASTER, severity=Severity.WARNING)
    return Finding(part="timing", text=text)


def _judge_losses(lost: int, asked: int) -> Finding:
    share = lost / max(asked, 1)
    text = f"{lost} of {asked} replies were lost or broken"
    mend = "Check cables, plugs and the supply's ground; shorten the bus"
    if share > _LOST_REFUSED:
        return Finding(part="timing", text=text, mend=mend, severity=Severity.REFUSAL)
    if share > _LOST_WORTH_A_WARNING:
        return Finding(part="timing", text=text, mend=mend, severity=Severity.WARNING)
    return Finding(part="timing", text=text)
