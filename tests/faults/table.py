"""Every fault that driver and supervisor must survive: how it is injected, and what the robot must do.

`CASES` are injected into the whole robot by `test_reactions.py`; `TRIED` are
tried by tests of their own, which are named. ``docs/faults.md`` is made from
both by ``python -m tests.faults.document``.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bluefoot_mpc.control.pipeline import ControlOutput
from bluefoot_mpc.io.emulation.board import BoardFaults
from tests.faults.rig import Rig

AT = 3.5
"""s, when most faults come: in the middle of a trot's step."""
ENDS = 5.0
"""s, when those end that come and go at random."""
OFF_TIME = 0.1
"""s from an emergency to the last joint's torque."""
TICK = math.radians(300.0) / 1023.0
"""rad, of a servo's position."""
Spoil = Callable[[float, ControlOutput], ControlOutput]


class Reaction(enum.StrEnum):
    """What the robot must do; `docs/faults.md` shows the text."""

    WALKS_ON = "walks on"
    PAUSES = "stops walking, then walks on by itself"
    SITS = "ends its gait and sits down, under torque"
    FREEZES = "cannot be reached: servos hold their posture until the power is cut"
    STOPS = "sinks in a controlled way, then torque and power are off"
    DROPS = "has no torque left to sink with: stays limp until it is armed anew"
    CUTS = "torque and power off at once"
    REFUSES = "is not armed: no torque at any time"


@dataclass(frozen=True, kw_only=True)
class Case:
    """One fault, and the reaction that is required.

    Attributes:
        name: the fault, as in the list of faults.
        how: what is injected; for faults of a plan this is its entries.
        faults: entries of a fault plan.
        actions: what is done to the emulated devices, and when (s).
        spoil: what becomes of the controller's commands.
        reaction: what the robot must do.
        within: s after the fault within which it must begin to do so.
        says: words that the supervisor, or the refusal, must use.
        limp: joints (0..15) that must stay without torque once they have lost it.
        excused: violations of the bus protocol that the fault itself makes.
        logs: words that must be logged.
        lidar: the robot has one.
        since: s, from when on it must walk.
        end: s, when the run ends.
    """

    name: str
    reaction: Reaction
    how: str = ""
    faults: tuple[Mapping[str, Any], ...] = ()
    actions: Mapping[float, Callable[[Rig], None]] = field(default_factory=dict)
    spoil: Spoil | None = None
    within: float = 0.3
    says: tuple[str, ...] = ()
    limp: tuple[int, ...] = ()
    excused: tuple[str, ...] = ()
    logs: str = ""
    lidar: bool = False
    since: float = AT
    end: float = 5.5

    @property
    def injected(self) -> str:
        """For the page."""
        plan = "; ".join(_told(fault) for fault in self.faults)
        return " — ".join(part for part in (self.how, plan) if part)


@dataclass(frozen=True, kw_only=True)
class Tried:
    """A fault with tests of its own.

    Attributes:
        name: the fault.
        reaction: what is required.
        tests: where that is checked.
    """

    name: str
    reaction: str
    tests: tuple[str, ...]


def fault(kind: str, **values: Any) -> dict[str, Any]:
    """An entry of a fault plan."""
    return {"kind": kind, **values}


def now_and_then(kind: str, probability: float = 0.1, **values: Any) -> tuple[dict[str, Any], ...]:
    """A fault that comes at random for two seconds of walking."""
    return (fault(kind, probability=probability, start=3.0, end=ENDS, **values),)


def board(**values: Any) -> Callable[[Rig], None]:
    """Faults of the emulated board; without any, it works again."""

    def act(rig: Rig) -> None:
        rig.parts.board.faults = BoardFaults(**values)

    return act


def _told(entry: Mapping[str, Any]) -> str:
    shown = ", ".join(f"{key} = {value}" for key, value in entry.items() if key != "kind")
    return f"`{entry['kind']}`" + (f" ({shown})" if shown else "")


# -- commands of a controller that has gone wrong ---------------------------------------------------------


def spoil_goals(change: Callable[[np.ndarray], np.ndarray], start: float, end: float) -> Spoil:
    """Change the controller's goals, (16,) rad, from `start` to `end` (s)."""

    def spoil(time: float, output: ControlOutput) -> ControlOutput:
        if not start <= time < end:
            return output
        command = replace(output.command, position=change(output.command.position))
        return replace(output, command=command)

    return spoil


def _not_finite(goals: np.ndarray) -> np.ndarray:
    return np.where(np.arange(16) == 6, np.nan, goals)


def _stepped(goals: np.ndarray) -> np.ndarray:
    return goals + 500 * TICK


def _outside(goals: np.ndarray) -> np.ndarray:
    return np.where(np.arange(16) % 4 == 1, 3.0, goals)


def _stick(rig: Rig) -> None:
    rig.parts.board.supply.is_stuck = True


_ONE_TICK = AT, AT + 0.02
WALKS, PAUSES, SITS, FREEZES = Reaction.WALKS_ON, Reaction.PAUSES, Reaction.SITS, Reaction.FREEZES
STOPS, DROPS, CUTS, REFUSES = Reaction.STOPS, Reaction.DROPS, Reaction.CUTS, Reaction.REFUSES
_LOST = ("too many lost joint readings",)
_BLIND = ("no usable inertial sample",)

CASES: dict[str, tuple[Case, ...]] = {
    "Replies of servos": (
        Case(name="one lost reply", faults=(fault("drop_reply", servo=7, start=AT, nth=1),), reaction=WALKS),
        Case(name="10 % random loss", faults=now_and_then("drop_reply"), reaction=WALKS),
        Case(name="bad checksum", faults=now_and_then("bad_checksum"), reaction=WALKS),
        Case(name="corrupt byte", faults=now_and_then("corrupt_reply"), reaction=WALKS),
        Case(name="corrupt length", faults=now_and_then("wrong_length"), reaction=WALKS),
        Case(name="truncated reply", faults=now_and_then("truncate_reply"), reaction=WALKS),
        Case(name="reply from the wrong ID", faults=now_and_then("wrong_id"), reaction=WALKS),
        Case(name="duplicate reply", faults=now_and_then("duplicate_reply", 1.0), reaction=WALKS),
        Case(name="reply 60 ms late", faults=now_and_then("late_reply", value=0.06), reaction=WALKS),
        Case(name="garbage around packets", faults=now_and_then("garbage", 1.0), reaction=WALKS),
        Case(name="split reply", faults=now_and_then("split_reply", value=0.002), reaction=WALKS),
        Case(name="short status", faults=now_and_then("short_status"), reaction=WALKS),
        Case(name="range-error status", faults=now_and_then("range_error"), reaction=WALKS),
        Case(
            name="more than 20 % of readings lost",
            faults=tuple(fault("drop_reply", servo=i, start=AT, end=AT + 0.4) for i in (1, 3, 5, 9, 11, 13)),
            reaction=PAUSES, within=0.35, says=_LOST, end=7.5,
        ),
    ),
    "The line, and what is sent": (
        Case(name="lost request", faults=now_and_then("drop_request"), reaction=WALKS),
        Case(
            name="corrupt request", faults=now_and_then("corrupt_request"), reaction=WALKS,
            excused=("checksum", "length", "garbage", "timeout", "collision"),
        ),
        Case(
            name="corrupted sync write", faults=now_and_then("corrupt_sync_write"), reaction=WALKS,
            excused=("checksum", "length", "garbage"),
        ),
        Case(
            name="adapter stall 200 ms", faults=(fault("stall", start=AT, value=0.2),), reaction=PAUSES,
            says=_LOST, end=7.5, excused=("overlap", "collision"),
        ),
        Case(
            name="USB lost for 0.7 s and back", faults=(fault("usb_lost", start=AT, value=0.7),),
            reaction=PAUSES, says=_LOST, end=7.5,
        ),
        Case(
            name="babble for 0.5 s", faults=(fault("babble", start=AT, end=AT + 0.5),), reaction=PAUSES,
            says=_LOST, end=7.5,
        ),
        Case(
            name="continuous babble", faults=(fault("babble", start=AT),), reaction=FREEZES, says=_LOST,
            end=6.0,
        ),
        Case(
            name="USB lost for good", faults=(fault("usb_lost", start=AT, value=60.0),), reaction=FREEZES,
            says=_LOST, end=6.0,
        ),
    ),
    "Servos": (
        Case(
            name="servo unplugged in stance", faults=(fault("unplugged", servo=3, start=AT),), reaction=SITS,
            within=0.6, says=("no reply from FL_knee",), limp=(2,), end=7.0,
        ),
        Case(
            name="servo unplugged and plugged in again", reaction=STOPS, within=2.5,
            faults=(fault("unplugged", servo=3, start=AT, end=AT + 0.3),), limp=(2,),
            says=("FL_knee", "without torque"), end=9.0,
        ),
        Case(
            name="warm servo", faults=(fault("temperature", servo=7, start=AT, value=62.0),), reaction=WALKS,
            says=("servo FR_knee is warm",),
        ),
        Case(
            name="hot servo", faults=(fault("temperature", servo=7, start=AT, value=66.0),), reaction=SITS,
            within=0.4, says=("servo FR_knee is hot",), end=6.0,
        ),
        Case(
            name="servo at 68 °C and more", faults=(fault("temperature", servo=7, start=AT, value=69.0),),
            reaction=STOPS, within=0.4, says=("leg FR is switched off",), limp=(4, 5, 6, 7), end=9.0,
        ),
        Case(
            name="overheated servo (its own alarm)",
            faults=(fault("temperature", servo=7, start=AT, value=75.0),), reaction=STOPS,
            says=("FR_knee", "switched off by itself"), limp=(6,), end=9.0,
        ),
        Case(
            name="overload", faults=(fault("overload", servo=7, start=AT, end=AT + 0.3),), reaction=STOPS,
            says=("FR_knee", "switched off by itself"), limp=(6,), end=9.0,
        ),
    ),
    "Supply": (
        Case(
            name="battery below 10.8 V", faults=(fault("voltage", start=AT, value=10.6),), reaction=WALKS,
            says=("battery getting low",), end=6.5,
        ),
        Case(
            name="voltage ramp", faults=(fault("voltage", start=2.0, end=6.0, value=10.9, to=9.7),),
            reaction=SITS, within=2.0, says=("battery low",), end=7.5,
        ),
        Case(
            name="battery below 9.6 V", faults=(fault("voltage", start=AT, value=9.4),), reaction=STOPS,
            within=3.0, says=("battery empty",), end=9.0,
        ),
        Case(
            name="voltage step below 9.0 V", faults=(fault("voltage", start=AT, value=8.5),), reaction=CUTS,
            within=0.22, says=("the supply broke down",),
        ),
        Case(
            name="voltage step below 9.0 V for 0.1 s", reaction=WALKS,
            faults=(fault("voltage", start=AT, end=AT + 0.1, value=8.5),),
        ),
        Case(
            name="brown-out", faults=(fault("brown_out", start=AT, end=AT + 0.2),), reaction=DROPS,
            within=0.5, says=("without torque",), limp=tuple(range(16)), end=9.0,
        ),
        Case(
            name="power board lost (no heartbeat reaches it)", reaction=CUTS, within=0.9,
            faults=(fault("usb_lost", device="board", start=AT, value=0.7),),
            says=("the power board has switched the servos off",), end=9.0,
        ),
        Case(
            name="power switch stuck", how="the board's switch stays closed", reaction=WALKS, end=5.0,
            actions={AT: _stick}, logs="servos' supply is still on",
        ),
    ),
    "Found at the start": (
        Case(
            name="latency timer 16 ms", faults=(fault("latency_timer", value=0.016),), reaction=REFUSES,
            says=("latency timer of 16 ms",),
        ),
        Case(
            name="wrong baud", faults=(fault("wrong_baud", servo=5, value=57600),), reaction=REFUSES,
            says=("servo 5 (FR_hip_yaw)", "baud rate"),
        ),
        Case(
            name="duplicate ID", faults=(fault("duplicate_id", servo=5, value=6),), reaction=REFUSES,
            says=("servo 6 (FR_hip_pitch)", "two servos have ID 6"), excused=("overlap",),
        ),
        Case(
            name="missing ID", faults=(fault("missing", servo=5),), reaction=REFUSES,
            says=("servo 5 (FR_hip_yaw): no reply",),
        ),
        Case(
            name="wrong model", faults=(fault("wrong_model", servo=5, value=18),), reaction=REFUSES,
            says=("servo 5 (FR_hip_yaw): model 18",),
        ),
        Case(
            name="changed EEPROM: angle limit", faults=(fault("register", servo=5, address=8, value=800),),
            reaction=REFUSES, says=("servo 5 (FR_hip_yaw): angle limits 0..800",),
        ),
        Case(
            name="changed EEPROM: shutdown mask", faults=(fault("register", servo=5, address=18, value=0),),
            reaction=REFUSES, says=("servo 5 (FR_hip_yaw): shutdown mask is 0",),
        ),
        Case(
            name="changed EEPROM: return delay", faults=(fault("register", servo=5, address=5, value=250),),
            reaction=REFUSES, says=("servo 5 (FR_hip_yaw): return delay is 250",),
        ),
        Case(
            name="low battery", faults=(fault("voltage", value=10.2),), reaction=REFUSES, says=("10.2 V",),
        ),
        Case(
            name="hot servo at the start", faults=(fault("temperature", servo=5, value=63.0),),
            reaction=REFUSES, says=("servo 5 (FR_hip_yaw): 63 °C",),
        ),
        Case(
            name="babble at the start", faults=(fault("babble"),), reaction=REFUSES, says=("garbled",),
        ),
        Case(
            name="board silent at the start", faults=(fault("drop_reply", device="board"),), reaction=REFUSES,
            says=("IMU: no sample",),
        ),
        Case(
            name="LIDAR silent at the start", faults=(fault("drop_reply", device="lidar"),), reaction=WALKS,
            says=("LIDAR",), lidar=True, since=6.0, end=7.0,
        ),
    ),
    "The controller": (
        Case(
            name="controller emits NaN", how="goal of one joint NaN in one tick", reaction=STOPS,
            spoil=spoil_goals(_not_finite, *_ONE_TICK), within=0.05,
            says=("command is not finite for FR_knee",), end=9.0,
        ),
        Case(
            name="controller emits nothing but NaN", how="goal of one joint NaN from then on", reaction=STOPS,
            spoil=spoil_goals(_not_finite, AT, math.inf), within=0.05,
            says=("command is not finite for FR_knee",), end=9.0,
        ),
        Case(
            name="500-tick step", how="all goals 500 counts away in one tick", reaction=WALKS,
            spoil=spoil_goals(_stepped, *_ONE_TICK), says=("jumped by 2.5", "moves there slowly"),
        ),
        Case(
            name="out-of-limit goals", how="goals of the hip pitches 3 rad in one tick", reaction=WALKS,
            spoil=spoil_goals(_outside, *_ONE_TICK), says=("Check the controller",),
        ),
    ),
    "Sensors": (
        Case(
            name="IMU silent for 0.3 s", how="board sends no samples", reaction=PAUSES, says=_BLIND, end=7.0,
            actions={AT: board(imu_silent=True), AT + 0.3: board()},
        ),
        Case(
            name="IMU silent", how="board sends no samples", reaction=SITS, within=1.1, says=_BLIND, end=6.0,
            actions={AT: board(imu_silent=True)},
        ),
        Case(
            name="IMU frozen", how="the same sample again and again", reaction=SITS, within=1.1, says=_BLIND,
            actions={AT: board(imu_frozen=True)}, end=6.0,
        ),
        Case(
            name="IMU NaN", how="samples without a measurement", reaction=SITS, within=1.1, says=_BLIND,
            actions={AT: board(imu_nan=True)}, end=6.0,
        ),
        Case(
            name="IMU NaN for 0.08 s", how="samples without a measurement", reaction=WALKS,
            actions={AT: board(imu_nan=True), AT + 0.08: board()},
        ),
        Case(
            name="IMU time jump forwards", how="the board's clock jumps by 3 s", reaction=WALKS,
            actions={AT: board(clock_jump=3.0)},
        ),
        Case(
            name="IMU time jump back", how="the board's clock jumps by −3 s", reaction=WALKS,
            actions={AT: board(clock_jump=-3.0)},
        ),
        Case(
            name="board's bytes stall 200 ms", faults=(fault("stall", device="board", start=AT, value=0.2),),
            reaction=PAUSES, says=_BLIND, end=7.0,
        ),
        Case(
            name="foot switch stuck open", how="FL says open", reaction=WALKS,
            actions={AT: board(stuck_switch={0: False})}, end=6.5, says=("foot switch FL: stuck open",),
        ),
        Case(
            name="foot switch stuck closed", how="FL says closed", reaction=WALKS,
            actions={AT: board(stuck_switch={0: True})}, end=6.5, says=("foot switch FL: stuck closed",),
        ),
        Case(
            name="foot switch chattering", how="FL changes at every look", reaction=WALKS,
            actions={AT: board(chattering={0})}, says=("foot switch FL: chatters",),
        ),
        Case(
            name="all foot switches chattering", how="all change at every look", reaction=WALKS,
            actions={AT: board(chattering={0, 1, 2, 3})}, says=("foot switch RR: chatters",),
        ),
        Case(
            name="LIDAR bad sum", faults=now_and_then("bad_checksum", 0.002, device="lidar"), lidar=True,
            reaction=WALKS, end=7.0,
        ),
        Case(
            name="LIDAR truncated", faults=now_and_then("truncate_reply", 0.002, device="lidar"), lidar=True,
            reaction=WALKS, end=7.0,
        ),
        Case(
            name="LIDAR silent for 2 s", faults=now_and_then("drop_reply", 1.0, device="lidar"), lidar=True,
            reaction=WALKS, end=8.0,
        ),
        Case(
            name="LIDAR hung up", faults=(fault("usb_lost", device="lidar", start=3.0, value=0.7),),
            lidar=True, reaction=WALKS, end=7.0,
        ),
    ),
}  # fmt: skip

_HERE, _STATION, _SAFETY = "tests/faults", "tests/io/station", "tests/io/safety"
TRIED: tuple[Tried, ...] = (
    Tried(
        name="emergency stop in every state, twice, at any instant of arming and of a cycle",
        reaction="all torque off within 100 ms, no goal is written afterwards, power off; only an explicit "
        "wish to arm brings torque back",
        tests=(
            f"{_HERE}/test_emergency.py::test_in_every_state",
            f"{_HERE}/test_emergency.py::test_during_arming",
            f"{_HERE}/test_emergency.py::test_at_any_instant_of_a_cycle",
            f"{_HERE}/test_emergency.py::test_only_an_explicit_wish_to_arm_brings_torque_back",
            f"{_HERE}/test_real_time.py::test_an_emergency_from_another_thread",
        ),
    ),
    Tried(
        name="controller emits steps, infinities and goals far outside",
        reaction="goals stay inside the soft limits and move by 12 rad/s at most",
        tests=(f"{_HERE}/test_controller.py::test_goals_stay_within_limits_and_do_not_jump",),
    ),
    Tried(
        name="controller breaks (an exception)",
        reaction="torque fades within 1 s, then off",
        tests=(f"{_HERE}/test_controller.py::test_a_controller_that_breaks_lets_the_robot_sink",),
    ),
    Tried(
        name="control thread hung",
        reaction="the guard holds, lowers the robot, switches it off",
        tests=(
            f"{_HERE}/test_real_time.py::test_a_control_thread_that_hangs_is_held_then_lowered_then_off",
            f"{_SAFETY}/test_guard.py::test_the_stages_in_their_order",
        ),
    ),
    Tried(
        name="process killed or halted",
        reaction="the watchdog process writes torque off, even where the power cannot be cut",
        tests=(
            f"{_HERE}/test_real_time.py::test_a_program_that_is_killed_or_halted_leaves_no_torque_on",
            f"{_SAFETY}/test_watchdog.py::test_a_program_that_is_killed_leaves_no_torque_on",
        ),
    ),
    Tried(
        name="radio silent",
        reaction="no velocity after 0.3 s, stands after 1 s, sits after 5 s, torque off after 30 s",
        tests=(
            f"{_HERE}/test_radio.py::test_commands_that_stop_make_the_robot_stand_then_sit",
            f"{_HERE}/test_radio.py::test_a_radio_that_stays_silent_switches_the_torque_off",
            f"{_STATION}/test_link.py::test_a_silent_radio_stops_the_robot_by_the_ladder",
        ),
    ),
    Tried(
        name="commands stop but heartbeats go on; replayed commands (signed)",
        reaction="as if the radio were silent",
        tests=(
            f"{_HERE}/test_radio.py::test_commands_that_stop_make_the_robot_stand_then_sit",
            f"{_STATION}/test_radio.py::test_with_a_key_a_recorded_session_does_nothing",
            f"{_STATION}/test_radio.py::test_repeated_frames_are_executed_once",
        ),
    ),
    Tried(
        name="radio 10 % corrupt",
        reaction="no wrong command is executed; a tenth of corrupt frames only slows it, a tenth of corrupt "
        "bytes is a silent radio",
        tests=(
            f"{_HERE}/test_radio.py::test_a_tenth_of_corrupt_frames_or_bytes",
            f"{_STATION}/test_radio.py::test_on_a_noisy_line_no_wrong_command_is_executed",
        ),
    ),
    Tried(
        name="blocked radio writer",
        reaction="the oldest telemetry is dropped, the control loop is never delayed",
        tests=(
            f"{_STATION}/test_link.py::test_a_line_that_nobody_reads_delays_nothing",
            f"{_STATION}/test_radio.py::test_a_blocked_line_keeps_only_the_newest",
        ),
    ),
    Tried(
        name="wall clock jump",
        reaction="changes nothing",
        tests=(
            f"{_HERE}/test_radio.py::test_a_wall_clock_that_jumps_changes_nothing",
            f"{_HERE}/test_real_time.py::test_a_run_survives_a_bad_line_and_a_wall_clock_that_jumps",
            f"{_STATION}/test_signing.py::test_stamps_rise_whatever_the_wall_clock_does",
        ),
    ),
)
