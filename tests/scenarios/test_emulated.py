"""The robot out of emulated devices: from lying limp to walking, and back."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.dynamixel.codec import Instruction
from bluefoot_mpc.io.findings import NotArmedError
from bluefoot_mpc.io.robot import PoweredRobot
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.replay import rethink
from bluefoot_mpc.scenarios import RunOptions, pipeline_from_log, run, runner
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import SHIPPED
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.types import JointCommand, Mode

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return run("walk", RunOptions(robot="emulator", duration=7.0, seed=1, randomize="standard", out=folder))


def made(**options):
    resolved = resolve(SHIPPED["stand"], RunOptions(robot="emulator", duration=1.0, **options))
    return runner._prepare(resolved).on


def test_it_walks_as_well_as_in_simulation(walk):
    assert walk.exit_status == 0, [c for c in walk.criteria if not c.holds]
    simulated = simulate("walk", RunOptions(duration=7.0, seed=1, randomize="standard")).summary
    for axis in ("roll_rms_deg", "pitch_rms_deg"):
        assert walk.summary[axis] <= simulated[axis] + 0.1
    assert walk.summary["attitude_error_rms_deg"] < 0.1


def test_it_rose_from_the_floor_and_lay_down_again(walk):
    heights = [sample.q[2] for sample in walk.data.truth]
    assert heights[0] < 0.06
    assert max(heights) > 0.11
    assert heights[-1] < 0.06
    assert not walk.summary["fell"]
    assert walk.data.telemetry[-1].mode is Mode.OFF
    assert not walk.data.commands[-1].joints.torque_limit.any()


def test_what_the_devices_saw(walk):
    seen = walk.summary["figures"]["devices"]
    assert seen["protocol_violations"] == {}
    assert seen["eeprom_writes"] == 0
    assert seen["torque_on"] == []
    assert not seen["power_on"]
    # Arming writes each goal once while the torque is off; nothing else does.
    assert seen["goal_writes_while_off"] == 16


def test_frames_hold_what_a_bus_can_know(walk):
    frames = walk.data.frames[5:-30]
    assert all(frame.joint_valid.all() for frame in frames)
    ages = np.concatenate([frame.time - frame.joint_time for frame in frames])
    assert ages.min() > 0.0
    assert ages.max() < 0.0075
    assert {len(frame.imu.time) for frame in frames} == {4}
    assert np.ptp(np.diff([frame.time for frame in frames])) < 1e-9
    # A full reading of one servo a cycle: temperatures are up to 16 cycles old, and there.
    assert all(np.isfinite(frame.joint_temperature).all() for frame in frames[20:])


def test_todays_controller_gives_the_same_commands_on_the_recorded_frames(walk):
    log = read_log(walk.folder)
    report = rethink(log, lambda: _step(pipeline_from_log(log, walk.folder)))
    assert report.differing == 0, str(report)


def _step(pipeline):
    return lambda frame, motion, safety: pipeline.step(frame, motion, safety).command


def test_the_same_seed_is_the_same_run():
    options = RunOptions(robot="emulator", duration=2.5, seed=4)
    first, second = (simulate("walk", options).data for _ in range(2))
    np.testing.assert_array_equal(first.truth[-1].q, second.truth[-1].q)


def test_it_is_limp_until_armed_and_after_a_stop():
    on = made()
    robot, line = on.robot, on.parts.lines[0]
    assert isinstance(robot, PoweredRobot)
    frame = robot.reset()
    assert line.is_powered
    assert not any(servo.registers[24] for servo in line.all)
    command = dataclasses.replace(_command(frame), torque_limit=np.ones(16))
    robot.step(command)
    assert not any(servo.registers[24] for servo in line.all)
    assert not [finding for finding in robot.preflight() if finding.severity > 1]
    frame = robot.arm(0.3)
    assert all(servo.registers[24] for servo in line.all)
    robot.step(command)
    robot.stop()
    assert not any(servo.registers[24] for servo in line.all)
    written = line.requests[Instruction.SYNC_WRITE]
    assert written > 0
    for _ in range(10):
        robot.step(dataclasses.replace(command, position=command.position + 0.3))
    assert line.requests[Instruction.SYNC_WRITE] == written
    assert not line.is_powered
    robot.stop()
    robot.close()
    robot.close()


def _command(frame):
    return JointCommand(position=frame.joint_position, speed=np.zeros(16), torque_limit=np.ones(16))


@pytest.mark.parametrize(
    ("fault", "named"),
    [
        ('kind = "missing"\nservo = 7', "servo 7 .FR_knee.*no reply"),
        ('kind = "wrong_model"\nservo = 3', "servo 3 .FL_knee"),
        ('kind = "register"\nservo = 12\naddress = 5\nvalue = 250', "servo 12 .RL_ankle.*servo setup"),
        ('kind = "temperature"\nvalue = 66', "servo 1 .FL_hip_yaw.*66"),
        ('kind = "voltage"\nvalue = 10.0', "10.0"),
    ],
)
def test_what_is_wrong_at_the_start_is_refused_before_torque(tmp_path, fault, named):
    plan = tmp_path / "faults.toml"
    plan.write_text(f"[[fault]]\n{fault}\n")
    with pytest.raises(NotArmedError, match=f"(?s)no torque is on.*{named}"):
        simulate(
            "stand", RunOptions(robot="emulator", duration=1.0, overrides=(f"devices.faults={str(plan)!r}",))
        )


def test_a_lidar_looks_at_the_simulated_world():
    run = simulate(
        "stand", RunOptions(robot="emulator", duration=1.0, overrides=("devices.emulate_lidar=true",))
    )
    scans = [frame.lidar for frame in run.data.frames if frame.lidar is not None]
    assert len(scans) >= 8
    assert all(scan.valid and scan.distance.shape == (682,) for scan in scans)


def test_hardware_needs_ports():
    with pytest.raises(ConfigurationError, match="--port /dev/ttyUSB0"):
        simulate("stand", RunOptions(robot="hardware"))
    with pytest.raises(ConfigurationError, match=r"devices\.board_port"):
        simulate("stand", RunOptions(robot="hardware", port=("/dev/null",)))


def test_a_port_given_twice_is_wrong_use(tmp_path):
    link = tmp_path / "link"
    link.symlink_to("/dev/null")
    for ports, board in ((("/dev/null", str(link)), "/dev/zero"), (("/dev/null",), str(link))):
        options = RunOptions(robot="hardware", port=ports, overrides=(f"devices.board_port={board!r}",))
        with pytest.raises(ConfigurationError, match=r"are one port"):
            simulate("stand", options)
