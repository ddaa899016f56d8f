"""The robot itself: drivers on its serial ports, in real time, under a watchdog process."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.calibration import Calibration, load_calibration
from bluefoot_mpc.io.camera import Camera, CameraConfig
from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.dynamixel.bus import BusConfig
from bluefoot_mpc.io.lidar.driver import Lidar
from bluefoot_mpc.io.serial_link import SerialLink
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.live import LiveRobot
from bluefoot_mpc.io.servo_robot.making import BOARD_BAUD, LIDAR_BAUD, drivers
from bluefoot_mpc.io.servo_robot.port_watchdog import PortWatchdog
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios.config import Resolved
from bluefoot_mpc.scenarios.robots import RunRobot

PATIENT = BusConfig(tries=6)
"""An ordinary machine pauses a program for some milliseconds now and then: no reason not to arm."""


def make_hardware(resolved: Resolved, model: RobotModel) -> RunRobot:
    """The robot on the configured ports.

    Args:
        resolved: the run's configuration.
        model: the robot's model.

    Raises:
        ConfigurationError: a port or the calibration is not given.
        DeviceError: a port cannot be opened.
    """
    config = resolved.stages.devices
    if not config.ports:
        raise ConfigurationError(
            "--robot hardware needs the servos' port: --port /dev/ttyUSB0, once for each port"
        )
    if not config.board_port:
        raise ConfigurationError(
            "--robot hardware needs the sensor board's port: --set devices.board_port=/dev/ttyACM0"
        )
    _require_different((*config.ports, config.board_port, config.lidar_port))
    calibration = load_calibration(config.calibration)
    robot = live_robot(
        config, calibration, MonotonicClock(), config.ports, config.board_port, model=model.parameters.name
    )
    return RunRobot(robot=robot)


def live_robot(
    config: DevicesConfig,
    calibration: Calibration,
    clock: MonotonicClock,
    servos: Sequence[str],
    board: str,
    *,
    model: str,
    on_close: Callable[[], None] | None = None,
) -> LiveRobot:
    """Drivers on serial ports, in real time.

    Args:
        config: rates, timing, and the ports of LIDAR and camera.
        calibration: signs, offsets, IDs.
        clock: for every stamp.
        servos: ports of the servos.
        board: port of the sensor board.
        model: name of the robot's parameter set.
        on_close: called when the ports are given back.

    Raises:
        LinkError: a port cannot be opened.
    """
    opened: list[SerialLink] = []
    try:
        for port in servos:
            opened.append(SerialLink(port, config.baud, clock))
            opened[-1].set_low_latency()
        opened.append(SerialLink(board, BOARD_BAUD, clock))
        lidar = None
        if config.lidar_port:
            opened.append(SerialLink(config.lidar_port, LIDAR_BAUD, clock))
            lidar = Lidar(opened[-1], clock)
        links, board_link = opened[: len(servos)], opened[len(servos)]
        camera = make_camera(config, clock)
        board_driver = SensorBoard(board_link, clock)
        devices = drivers(
            links, clock, calibration, board_driver, lidar=lidar, camera=camera, model=model, bus=PATIENT
        )
        watchdog = PortWatchdog(links, board_link)
        return LiveRobot(devices, clock, config, watchdog=watchdog, on_close=on_close)
    except BaseException:
        for link in opened:
            link.close()
        raise


def make_camera(config: DevicesConfig, clock: Clock) -> Camera | None:
    """The configured camera, not yet opened; None without one.

    Args:
        config: which one, and how old its pictures are when they arrive.
        clock: of the time stamps.
    """
    if not config.camera:
        return None
    return Camera(config.camera, clock, CameraConfig(delay=config.camera_delay))


def _require_different(ports: Sequence[str]) -> None:
    """Refuse a port that is given twice, under whatever names."""
    places: dict[str, str] = {}
    for port in ports:
        place = os.path.realpath(port)
        if port and place in places:
            raise ConfigurationError(
                f"{places[place]} and {port} are one port: servos, sensor board and LIDAR need one each"
            )
        places[place] = port
