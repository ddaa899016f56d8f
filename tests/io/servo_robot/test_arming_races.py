"""A stop that comes between the checks and the arming, while arming goes on, or right after it."""

import numpy as np
import pytest

from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.io.findings import NotArmedError
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.emulated import make_emulated
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import sitting
from bluefoot_mpc.types import JointCommand


def make(*overrides):
    resolved = resolve(find_scenario("stand"), RunOptions(robot="emulator", overrides=overrides))
    model = RobotModel(resolved.parameters)
    pipeline = Pipeline(model, resolved.stages.control, 0.02)
    return make_emulated(resolved, model, sitting(pipeline, model), False)


@pytest.fixture
def made():
    on = make()
    yield on
    on.robot.close()


def movers(line):
    """Notes every packet that could move a servo from now on."""
    seen = []
    receive = line.receive

    def watched(data, time):
        if len(data) > 6 and data[4] in (3, 4, 0x83) and (data[5] >= 30 or data[6:-1] != b"\0"):
            seen.append(data)
        receive(data, time)

    line.receive = watched
    return seen


def holding(frame):
    return JointCommand(position=frame.joint_position, speed=np.zeros(16), torque_limit=np.full(16, 0.3))


def off(line):
    return not any(servo.registers[24] for servo in line.all)


def test_a_stop_after_the_checks_is_not_forgotten_by_arming(made):
    robot, line = made.robot, made.parts.lines[0]
    frame = robot.reset()
    robot.preflight()
    robot.stop()
    moved = movers(line)
    with pytest.raises(NotArmedError, match="stopped the robot meanwhile"):
        robot.arm(0.3)
    robot.step(holding(frame))
    assert moved == []
    assert off(line)
    assert not line.is_powered


def test_after_it_the_robot_can_be_checked_and_armed_at_once(made):
    robot, line = made.robot, made.parts.lines[0]
    robot.reset()
    robot.preflight()
    robot.stop()
    assert not [finding for finding in robot.preflight() if finding.severity > 1]
    frame = robot.arm(0.3)
    assert frame.joint_valid.all()
    assert not off(line)
    for _ in range(50):
        frame = robot.step(holding(frame))
    # Heartbeats go on: the board has not cut the supply.
    assert line.is_powered
    assert not off(line)


def test_a_failure_of_any_kind_while_arming_leaves_no_torque(made, monkeypatch):
    robot, line = made.robot, made.parts.lines[0]
    frame = robot.reset()
    robot.preflight()
    receive, count = line.receive, [0]

    def breaks(data, time):
        receive(data, time)
        count[0] += 1
        if count[0] == 60:
            raise RuntimeError("a bug")

    line.receive = breaks
    with pytest.raises(RuntimeError):
        robot.arm(0.3)
    assert count[0] > 60
    frame = robot.step(holding(frame))
    assert off(line)
    assert not line.is_powered


@pytest.mark.parametrize("latency", [0.0, 0.0011])
def test_heartbeats_go_on_while_sixteen_servos_are_armed(latency, tmp_path):
    """Longest pause between heartbeats, with replies that an adapter holds back."""
    plan = tmp_path / "faults.toml"
    plan.write_text(f'[[fault]]\nkind = "latency_timer"\nvalue = {latency}\n' if latency else "")
    on = make(f"devices.faults={str(plan)!r}")
    robot, beats = on.robot, []
    board = robot._cycle._devices.board
    beat, clock = board.beat, robot._clock
    board.beat = lambda: (beats.append(clock.now()), beat())
    robot.reset()
    robot.preflight()
    robot.arm(0.3)
    robot.close()
    # The board cuts the supply after half a second; an adapter may be twice as slow as this one.
    assert np.diff(beats).max() < 0.25
