"""Time of the simulated robot against the same physics steps alone.

    python benchmarks/physics_share.py [--frames 1000] [--json]

Both run in one process, frame by frame in turn, through the same states: the
torques and friction of a recorded run are replayed into bare ``mj_step`` calls,
which gives the same trajectory to the bit (checked at the end).
"""

from __future__ import annotations

import argparse
import json
import time

import mujoco
import numpy as np

from bluefoot_mpc import load_robot
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import JointCommand


def marching(stance, frame):
    """Goals that lift diagonal pairs in turn, twice a second."""
    joints, phase = stance.copy(), np.sin(2.0 * np.pi * frame / 25)
    joints[[1, 13]] += 0.3 * max(0.0, phase)
    joints[[5, 9]] += 0.3 * max(0.0, -phase)
    return JointCommand(position=joints, speed=np.zeros(16), torque_limit=np.ones(16))


def record(robot, commands):
    """What the servos wrote in every physics step: (steps, 16) torques and frictions."""
    bank, drive, friction = robot._bank, [], []
    advance = bank.advance

    def spy():
        advance()
        drive.append(bank.plant.drive.copy())
        friction.append(bank.plant.friction.copy())

    bank.advance = spy
    for command in commands:
        robot.step(command)
    return np.array(drive), np.array(friction)


def bare_frame(robot, drive, friction):
    """Time in mj_step alone over one frame, s."""
    plant, model, data, spent = robot._bank.plant, robot.model, robot.data, 0.0
    for torque, loss in zip(drive, friction, strict=True):
        plant.drive[:] = torque
        plant.friction[:] = loss
        start = time.perf_counter()
        mujoco.mj_step(model, data)
        spent += time.perf_counter() - start
    return spent


def measure(frames):
    model, config = load_robot(), SimConfig()
    commands = [marching(model.stance_joints, frame) for frame in range(frames)]
    drive, friction = record(SimRobot(model, config), commands)
    full, bare = SimRobot(model, config), SimRobot(model, config)
    bare.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    per = len(drive) // frames
    times = np.zeros((frames, 3))
    for k, command in enumerate(commands):
        start = time.perf_counter()
        full.step(command)
        times[k, 0] = time.perf_counter() - start
        span = slice(k * per, (k + 1) * per)
        times[k, 1] = bare_frame(bare, drive[span], friction[span])
        start = time.perf_counter()
        full.truth()
        times[k, 2] = time.perf_counter() - start
    if not np.array_equal(full.data.qpos, bare.data.qpos):
        raise SystemExit("the replayed physics went another way: the comparison is void")
    micro = 1e6 * times[frames // 10 :]
    median, p99 = np.median(micro, axis=0), np.percentile(micro, 99, axis=0)
    return {
        "frames": frames,
        "physics_us": {"p50": median[1], "p99": p99[1]},
        "sim_step_us": {"p50": median[0], "p99": p99[0]},
        "truth_us": {"p50": median[2], "p99": p99[2]},
        "share": float(np.median(micro[:, 0] / micro[:, 1])),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=1000, help="command periods of 20 ms")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    result = measure(options.frames)
    if options.json:
        print(json.dumps(result))
        return
    for name in ("physics_us", "sim_step_us", "truth_us"):
        print(f"{name:12s} median {result[name]['p50']:7.1f}   p99 {result[name]['p99']:7.1f}")
    print(f"SimRobot.step is {result['share']:.2f} times the physics alone")


if __name__ == "__main__":
    main()
