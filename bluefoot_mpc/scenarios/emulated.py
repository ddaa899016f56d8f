"""The robot out of emulated devices whose shafts, sensors and supply are the simulator's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.clock import PacedClock, VirtualClock
from bluefoot_mpc.io.dynamixel.table import AX12A
from bluefoot_mpc.io.emulation.board import EmulatedBoard
from bluefoot_mpc.io.emulation.device import Device
from bluefoot_mpc.io.emulation.faults import FaultPlan, LineName
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.lidar import EmulatedLidar
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.lidar.driver import Lidar
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.making import BOARD_BAUD, LIDAR_BAUD, drivers
from bluefoot_mpc.io.servo_robot.robot import ServoRobot
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios.config import Resolved
from bluefoot_mpc.scenarios.emulated_camera import EmulatedCamera
from bluefoot_mpc.scenarios.robots import RunRobot
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.lidar import RaycastLidar
from bluefoot_mpc.sim.plant import SimPlant
from bluefoot_mpc.types import N_JOINTS, BoolArray, ImuBatch

RETURN_DELAY = AX12A["return_delay_time"].address
TORQUE_ENABLE = AX12A["torque_enable"].address


class PlantBoard:
    """What the emulated board senses and switches: the simulated body, and its servos' supply.

    Args:
        plant: the simulated body.
        lines: servos on that supply.
    """

    def __init__(self, plant: SimPlant, lines: Sequence[ServoLine]) -> None:
        self._plant, self._lines = plant, lines
        self._now = 0.0

    def advance(self, time: float) -> None:
        """Let the physics pass until `time` (s)."""
        self._now = max(self._now, time)
        self._plant.advance(time)

    def samples(self, since: float) -> ImuBatch:
        """Inertial samples after `since` (s)."""
        return self._plant.samples(since)

    def switches(self) -> tuple[BoolArray, float]:
        """(4,) foot switches, and when they were so (s)."""
        return self._plant.switches()

    def voltage(self) -> float:
        """V of the battery under load."""
        return self._plant.voltage()

    def current(self) -> float:
        """A out of the battery."""
        return self._plant.current()

    def set_power(self, on: bool) -> None:
        """Switch the servos' supply."""
        for line in self._lines:
            line.power(on, self._now)


class PlantLidar:
    """What the emulated LIDAR sees of the simulated world.

    Args:
        plant: the simulated body.
        lidar: on its trunk.
    """

    def __init__(self, plant: SimPlant, lidar: RaycastLidar) -> None:
        self._plant, self._lidar = plant, lidar

    def scan(self, time: float) -> ArrayLike:
        """(682,) mm of a sweep that ends at `time` (s)."""
        self._plant.face(time)
        return self._lidar.scan(time)


@dataclass(frozen=True, kw_only=True, slots=True)
class EmulatedRobot:
    """Emulated devices with one simulated body behind them.

    Attributes:
        plant: the body.
        lines: servos, one line for each port.
        board: sensor and power board.
        lidar: None without one.
        faults: what is to go wrong.
    """

    plant: SimPlant
    lines: tuple[ServoLine, ...]
    board: EmulatedBoard
    lidar: EmulatedLidar | None
    faults: FaultPlan

    def servo_devices(self, start: float = 0.0) -> list[Device]:
        """Far ends of the servos' ports, with their faults counted from `start` (s)."""
        return [self._faulty(line, "servos", start) for line in self.lines]

    def board_device(self, start: float = 0.0) -> Device:
        """Far end of the board's port."""
        return self._faulty(self.board, "board", start)

    def lidar_device(self, start: float = 0.0) -> Device | None:
        """Far end of the LIDAR's port; None without one."""
        return None if self.lidar is None else self._faulty(self.lidar, "lidar", start)

    def report(self) -> dict[str, Any]:
        """What the devices saw of their driver: plain values."""
        # Without their supply servos are limp, whatever their registers said last.
        servos = [servo for line in self.lines if line.is_powered for servo in line.all]
        kinds: dict[str, int] = {}
        for line in self.lines:
            for kind, count in line.violation_kinds.items():
                kinds[kind] = kinds.get(kind, 0) + count
        return {
            "protocol_violations": kinds,
            "eeprom_writes": sum(line.eeprom_writes for line in self.lines),
            "goal_writes_while_off": sum(line.goal_writes_while_off for line in self.lines),
            "torque_on": [servo.identity for servo in servos if servo.registers[TORQUE_ENABLE]],
            "power_on": any(line.is_powered for line in self.lines),
        }

    def _faulty(self, device: Device, name: LineName, start: float) -> Device:
        plan = self.faults.on(name)
        return FaultyLine(device, plan, start) if plan.faults else device


def emulate(
    model: RobotModel, sim: SimConfig, posture: Posture, seed: int, config: DevicesConfig
) -> EmulatedRobot:
    """A robot that lies in a posture, its supply off, its servos set up as `bluefoot servo setup` does it."""
    plant = SimPlant(model, sim, posture, seed)
    line = ServoLine(plant, tuple(range(1, N_JOINTS + 1)), config.baud)
    for servo in line.all:
        servo.registers[RETURN_DELAY] = 0
    line.power(False, 0.0)
    return EmulatedRobot(
        plant=plant,
        lines=(line,),
        board=EmulatedBoard(PlantBoard(plant, (line,))),
        lidar=_lidar(model, plant, seed) if config.emulate_lidar or sim.lidar.enabled else None,
        faults=FaultPlan.load(Path(config.faults)) if config.faults else FaultPlan(),
    )


def _lidar(model: RobotModel, plant: SimPlant, seed: int) -> EmulatedLidar:
    mounts, errors = model.parameters.sensors, plant.config.lidar
    lidar = RaycastLidar(plant.model, plant.data, plant.trunk, mounts, errors, seed)
    return EmulatedLidar(PlantLidar(plant, lidar))


def make_emulated(resolved: Resolved, model: RobotModel, sitting: Posture, paced: bool) -> RunRobot:
    """An emulated robot in this process, on a virtual clock.

    Args:
        resolved: the run's configuration.
        model: the robot's model.
        sitting: how it lies at the start, and sinks to by itself.
        paced: a second of the run takes a second at least.
    """
    config = resolved.stages.devices
    parts = emulate(model, resolved.stages.sim, sitting, resolved.run.seed, config)
    clock = PacedClock() if paced else VirtualClock()
    servos = [MemoryLink(device, clock, config.baud, "emulated servos") for device in parts.servo_devices()]
    board = SensorBoard(MemoryLink(parts.board_device(), clock, BOARD_BAUD, "emulated board"), clock)
    lidar = parts.lidar_device()
    scanner = None if lidar is None else Lidar(MemoryLink(lidar, clock, LIDAR_BAUD, "emulated LIDAR"), clock)
    camera = EmulatedCamera(parts.plant, clock) if resolved.stages.sim.camera.enabled else None
    devices = drivers(
        servos, clock, Calibration.nominal(model.parameters), board, lidar=scanner, camera=camera
    )
    robot = ServoRobot(devices, clock, config)
    return RunRobot(
        robot=robot, truth=parts.plant.truth, drawn=parts.plant.drawn, devices=parts.report, parts=parts
    )
