"""The words of the link: how modes, gaits and states become numbers of MAVLink's ``common`` dialect."""

from __future__ import annotations

import enum

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.types import Guided, GuideTask, Mode

ACCEPTED = int(mavlink.MAV_RESULT_ACCEPTED)
DENIED = int(mavlink.MAV_RESULT_DENIED)
UNSUPPORTED = int(mavlink.MAV_RESULT_UNSUPPORTED)
IN_PROGRESS = int(mavlink.MAV_RESULT_IN_PROGRESS)
FAILED = int(mavlink.MAV_RESULT_FAILED)

MODES: tuple[Mode, ...] = (Mode.OFF, Mode.STAND, Mode.WALK, Mode.SIT, Mode.SAFE)
"""Lowest byte of HEARTBEAT.custom_mode, and param2 of MAV_CMD_DO_SET_MODE."""
GAITS: tuple[str, ...] = ("", "trot", "walk")
"""Third byte of HEARTBEAT.custom_mode, and param3 of MAV_CMD_DO_SET_MODE; 0 leaves the gait as it is."""
STATES: tuple[str, ...] = (
    "", "disarmed", "checking", "arming", "active", "hold", "sitting", "stopping", "stopped", "emergency",
)  # fmt: skip
"""Second byte of HEARTBEAT.custom_mode: state of the safety supervisor; 255 is one that is not in here."""
TASKS: tuple[str, ...] = ("", GuideTask.WANDER, GuideTask.APPROACH, GuideTask.FOLLOW, GuideTask.GOTO)
"""Fourth byte of HEARTBEAT.custom_mode, and param1 of MAV_CMD_USER_1: what the robot finds its way for."""
LEADS: tuple[Guided, ...] = tuple(Guided)
"""First number of the array ``nav``: what leads the robot."""
_UNKNOWN = 255

FORCE = 21196.0
"""Magic number in param2 of MAV_CMD_COMPONENT_ARM_DISARM: disarm at once, whatever the robot does."""
CAN_BE_ASKED = (Mode.OFF, Mode.STAND, Mode.WALK, Mode.SIT)


class Axis(enum.IntFlag):
    """MANUAL_CONTROL.enabled_extensions: which of the axes after the first four carry something."""

    PITCH = 1
    ROLL = 2
    HEIGHT = 4  # aux1
    YAW = 8  # aux2


def pack_mode(mode: Mode, gait: str, state: str, task: str = "") -> int:
    """HEARTBEAT.custom_mode of what the robot does."""
    gait_number = GAITS.index(gait) if gait in GAITS else _UNKNOWN
    state_number = STATES.index(state) if state in STATES else _UNKNOWN
    return MODES.index(mode) | state_number << 8 | gait_number << 16 | TASKS.index(task) << 24


def unpack_mode(custom_mode: int) -> tuple[str, str, str]:
    """(mode, gait, state) of a HEARTBEAT.custom_mode; ``"?"`` for what is not known."""
    numbers = (custom_mode & 0xFF, custom_mode >> 16 & 0xFF, custom_mode >> 8 & 0xFF)
    tables = ([str(mode) for mode in MODES], GAITS, STATES)
    mode, gait, state = (
        table[number] if number < len(table) else "?" for number, table in zip(numbers, tables, strict=True)
    )
    return mode, gait, state


def unpack_task(custom_mode: int) -> str:
    """The task in a HEARTBEAT.custom_mode; empty without one, ``"?"`` for one that is not known."""
    number = custom_mode >> 24 & 0xFF
    return str(TASKS[number]) if number < len(TASKS) else "?"


def mission_result_name(result: int) -> str:
    """What a MISSION_ACK says, as words."""
    entry = mavlink.enums["MAV_MISSION_RESULT"].get(result)
    if entry is None:
        return f"result {result}"
    return str(entry.name).removeprefix("MAV_MISSION_").lower().replace("_", " ")


def result_name(result: int) -> str:
    """What a COMMAND_ACK says, as a word."""
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_").lower().replace("_", " ") if entry else f"result {result}"
