"""How much of a 57.6 kbps radio the ground link uses, and what a noisy one does to commands.

    python benchmarks/radio_budget.py [--seconds 60] [--frames 200000] [--noise 0.1] [--json]

Both ends of our link talk over a virtual line at 50 Hz of telemetry. pymavlink alone, as the
independent other end, reads every byte and counts; our own counters take no part. Then frames of
random sticks, heartbeats and orders, each followed by a random share of wrong bytes, go to the robot's
end: a command is wrong when the robot wants something that was never sent.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink
from rich.console import Console
from rich.table import Table

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.io.station.config import BITS_PER_BYTE, StationConfig
from bluefoot_mpc.io.station.ground_end import GroundEnd
from bluefoot_mpc.io.station.robot_end import RobotEnd
from bluefoot_mpc.io.station.signing import Signer
from bluefoot_mpc.io.station.telemetry import Snapshot
from bluefoot_mpc.types import (
    BodyState,
    GaitPhase,
    Guide,
    Guided,
    GuideTask,
    ImuBatch,
    Mode,
    MotionCommand,
    NavigationReport,
    PostureReference,
    SensorFrame,
    Telemetry,
    TrunkPose,
)

LINE_RATE = 57600.0
KEY = bytes(range(32))
WARM_UP = 2.0
"""s before counting: what was saved up at the start leaves first."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--frames", type=int, default=200_000)
    parser.add_argument("--noise", type=float, default=0.1)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    budgets = {
        "plain": budget(arguments.seconds),
        "signed, trunk tilted": budget(arguments.seconds, signed=True, tilted=True),
        "on the way to waypoints": budget(arguments.seconds, guided=True),
        "signed, on the way to waypoints": budget(arguments.seconds, signed=True, guided=True),
    }
    noise = noisy(arguments.frames, arguments.noise)
    if arguments.json:
        print(json.dumps({"budgets": budgets, "noise": noise}, indent=2))
    else:
        show(budgets, noise)


def budget(
    seconds: float, *, signed: bool = False, tilted: bool = False, guided: bool = False
) -> dict[str, Any]:
    """Traffic by message, as pymavlink counts it; a guided robot gets a new list of waypoints every 10 s."""
    config, rng = StationConfig(), np.random.default_rng(0)
    signers = [Signer(KEY, lambda: 1.8e9) if signed else None for _ in range(2)]
    robot, ground = RobotEnd(config, 0.0, signers[0]), GroundEnd(config, 0.0, signers[1])
    trunk = TrunkPose(position=np.array([0.0, 0.0, 0.01]), rpy=np.full(3, 0.1)) if tilted else TrunkPose()
    wish = MotionCommand(mode=Mode.WALK, velocity=np.array([0.06, 0.01]), yaw_rate=0.1, trunk=trunk)
    counted = {"down": Count(), "up": Count()}
    for tick in range(round((seconds + WARM_UP) / 0.02)):
        now = 0.02 * tick
        if guided and tick % 500 == 0:
            way = Guide(task=GuideTask.GOTO, waypoints=rng.uniform(-5.0, 5.0, (10, 2)))
            wish = MotionCommand(mode=Mode.WALK, guide=way)
        robot.offer(snapshot(rng, now, robot.inbox.command(now)[0] if guided else None))
        ground.steer(wish, now)
        for way, end, other in (("down", robot, ground), ("up", ground, robot)):
            while data := end.produce(now):
                other.receive(data, now)
                if now >= WARM_UP:
                    counted[way].take(data)
    return {way: count.table(seconds) for way, count in counted.items()}


class Count:
    """pymavlink reads, and counts messages and bytes."""

    def __init__(self) -> None:
        self.mav = mavlink.MAVLink(None)
        self.messages: dict[str, int] = defaultdict(int)
        self.bytes: dict[str, int] = defaultdict(int)

    def take(self, data: bytes) -> None:
        for message in self.mav.parse_buffer(data) or []:
            self.messages[message.get_type()] += 1
            self.bytes[message.get_type()] += len(message.get_msgbuf())

    def table(self, seconds: float) -> dict[str, Any]:
        rows = {
            kind: {
                "hz": count / seconds,
                "bytes": self.bytes[kind] / count,
                "percent": 100.0 * self.bytes[kind] / seconds * BITS_PER_BYTE / LINE_RATE,
            }
            for kind, count in sorted(self.messages.items(), key=lambda item: -self.bytes[item[0]])
        }
        return {"messages": rows, "percent": sum(row["percent"] for row in rows.values())}


def noisy(frames: int, share: float) -> dict[str, Any]:
    """Commands that the robot carried out on a noisy line, and those among them that nobody gave."""
    rng, peer = np.random.default_rng(1), mavlink.MAVLink(None, 255, 190)
    robot = RobotEnd(StationConfig(), 0.0)
    result = {"frames": 0, "accepted": 0, "bad_sums": 0, "wrong": 0, "noise": share}
    for tick in range(frames // 2):
        now = 0.04 * tick
        x, y, r = (int(value) for value in rng.integers(-100, 101, 3))
        order = mavlink.MAVLink_command_long_message(
            1, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, 2, 1, 0, 0, 0, 0
        )
        sticks = mavlink.MAVLink_manual_control_message(1, x, y, 0, r, 0)
        for message in (sticks, order if tick % 2 else heartbeat()):
            data = np.frombuffer(message.pack(peer), np.uint8).copy()
            peer.seq = (peer.seq + 1) % 256
            hit = rng.random(data.size) < share
            data[hit] = rng.integers(0, 256, int(hit.sum()))
            result["accepted"] += robot.receive(data.tobytes(), now)
            result["frames"] += 1
        motion, _ = robot.inbox.command(now)
        wishes = robot.inbox.wishes
        beyond = (
            np.abs(motion.velocity / [1e-4, 4e-5]).max() > 100.001 or abs(motion.yaw_rate / 3e-4) > 100.001
        )
        known = motion.mode in (Mode.WALK, Mode.STAND) and motion.gait == "trot"
        if beyond or not known or wishes.arm or wishes.stop or wishes.emergency or motion.trunk.rpy.any():
            result["wrong"] += 1
            wishes.arm = wishes.stop = wishes.emergency = False
    result["bad_sums"] = robot.reader.bad
    return result


def heartbeat() -> Any:
    return mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, mavlink.MAV_STATE_ACTIVE, 3)


def snapshot(rng: np.random.Generator, time: float, motion: MotionCommand | None = None) -> Snapshot:
    """A tick of a walking robot: numbers with no zeros at their ends, so that nothing is cut short."""
    guide = None if motion is None else motion.guide
    rpy = 0.1 * rng.normal(size=3)
    imu = ImuBatch(
        time=np.array([time]), gyro=np.zeros((1, 3)), accel=np.zeros((1, 3)),
        magnetometer=np.zeros((1, 3)), valid=np.array([True]),
    )  # fmt: skip
    frame = SensorFrame(
        time=time, joint_position=rng.normal(size=16), joint_speed=rng.normal(size=16),
        joint_load=rng.normal(size=16), joint_temperature=30.0 + rng.random(16), joint_time=np.full(16, time),
        joint_valid=np.ones(16, bool), voltage=11.4, voltage_valid=True, imu=imu,
        contact=rng.random(4) > 0.5, contact_time=np.full(4, time), contact_valid=np.ones(4, bool),
    )  # fmt: skip
    estimate = BodyState(
        time=time, position=rng.normal(size=3), quaternion=quaternion_from_rpy(rpy), rpy=rpy,
        linear_velocity=rng.normal(size=3), angular_velocity=rng.normal(size=3),
        joint_position=rng.normal(size=16), joint_velocity=rng.normal(size=16), contact=np.ones(4, bool),
        foot_position_in_base=rng.normal(size=(4, 3)), height=0.1,
    )  # fmt: skip
    phase = GaitPhase(
        swing=np.zeros(4, bool), y1=np.zeros(4), y2=np.zeros(4), phase=np.zeros(4), walking=True
    )
    reference = PostureReference(
        trunk_position=np.zeros(3), trunk_rpy=np.zeros(3), foot_position=np.zeros((4, 3)), swing=phase.swing
    )
    telemetry = Telemetry(
        time=time, mode=Mode.WALK, motion=motion or MotionCommand(mode=Mode.WALK), estimate=estimate,
        phase=phase, reference=reference, zmp=np.zeros(2), tick_us=5000.0,
        navigation=None if guide is None else report(rng, time, guide),
    )  # fmt: skip
    return Snapshot(telemetry=telemetry, frame=frame, state="active")


def report(rng: np.random.Generator, time: float, guide: Guide) -> NavigationReport:
    """A robot that gets stuck every other second, and is told so."""
    stuck = int(time) % 2 == 1
    return NavigationReport(
        guided=Guided.ESCAPE if stuck else Guided.WAYPOINT, velocity=rng.normal(size=2), yaw_rate=0.1,
        pitch=0.0, field=rng.normal(size=2), potential=0.1, mixing=0.0, marker=rng.normal(size=3),
        marker_position=rng.normal(size=3), marker_age=1.3, clearance=rng.random(),
        waypoints_left=len(guide.waypoints), scan_time=time,
        reason="stuck: turning, backing off, stepping aside in turn" if stuck else "",
    )  # fmt: skip


def show(budgets: dict[str, Any], noise: dict[str, Any]) -> None:
    console = Console()
    for name, ways in budgets.items():
        table = Table(title=f"{name}: {ways['down']['percent'] + ways['up']['percent']:.1f} % of 57.6 kbps")
        for head in ("way", "message", "Hz", "bytes", "% of the line"):
            table.add_column(head, justify="left" if head in ("way", "message") else "right")
        for way, traffic in ways.items():
            for kind, row in traffic["messages"].items():
                figures = (f"{row['hz']:.2f}", f"{row['bytes']:.1f}", f"{row['percent']:.2f}")
                table.add_row(way, kind, *figures)
            table.add_row(way, "[bold]together", "", "", f"[bold]{traffic['percent']:.2f}", end_section=True)
        console.print(table)
    console.print(
        f"{100 * noise['noise']:g} % of bytes wrong: {noise['frames']} frames sent, {noise['accepted']} "
        f"accepted, {noise['bad_sums']} failed their sum, wrong commands: {noise['wrong']}"
    )


if __name__ == "__main__":
    main()
