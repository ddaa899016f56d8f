"""The sensor and power board: IMU, foot switches, battery, and the switch of the servos' supply."""

from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.driver import SensorBoard
from bluefoot_mpc.io.board.readings import BoardReadings, BoardStatistics

__all__ = ["BoardConfig", "BoardReadings", "BoardStatistics", "SensorBoard"]
