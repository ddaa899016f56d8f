"""Faults of the program itself, in real time: an emulated robot in its own process, on pseudo-terminals.

Nothing here asserts how long something takes: machines that run tests are
busy. What must not happen is that torque stays on.
"""

import contextlib
import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass

import numpy as np
import pytest

from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.io.calibration import Calibration, save_calibration
from bluefoot_mpc.io.safety.guard import GuardState
from bluefoot_mpc.io.safety.states import SafetyState
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.emulated_live import EmulatorProcess, make_emulated_live
from bluefoot_mpc.scenarios.emulator_process import Order
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import simulate, sitting, supervise
from bluefoot_mpc.settings import to_table
from bluefoot_mpc.types import Mode, MotionCommand
from tests.faults.rig import PERIOD

pytestmark = pytest.mark.slow

PATIENCE = 60.0
"""s that a busy machine gets for anything."""
STUCK = '[[fault]]\nkind = "power_stuck"\nstart = {:.1f}\n'
"""Nothing but torque off on the bus can make this robot limp: from then on its supply stays on."""


@dataclass(kw_only=True)
class Live:
    """A supervised robot in real time, with its controller."""

    on: object
    supervisor: object
    pipeline: Pipeline

    def stand(self, seconds):
        """Step the loop."""
        frame = self.supervisor.reset()
        self.pipeline.reset()
        end = frame.time + seconds
        while frame.time < end:
            output = self.pipeline.step(frame, MotionCommand(mode=Mode.STAND), self.supervisor.request)
            frame = self.supervisor.step(output.command)

    def height(self):
        return float(self.on.truth().q[2])


@pytest.fixture
def live(tmp_path):
    resolved = resolve(find_scenario("stand"), RunOptions(robot="emulator", link="pty"))
    model = RobotModel(resolved.parameters)
    pipeline = Pipeline(model, resolved.stages.control, PERIOD)
    on = make_emulated_live(resolved, model, sitting(pipeline, model))
    supervisor = supervise(on.robot, model, resolved)
    supervisor.watch_over(pipeline.sitting_joints)
    try:
        yield Live(on=on, supervisor=supervisor, pipeline=pipeline)
    finally:
        on.robot.close()


def wait_for(condition, patience=PATIENCE):
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it never happened"
        time.sleep(0.01)


def check_report(report):
    assert report["torque_on"] == []
    assert report["eeprom_writes"] == 0
    assert report["goal_writes_while_off"] == 16  # those of arming


def limp(truth):
    return not np.abs(truth.duty).any()


def test_a_control_thread_that_hangs_is_held_then_lowered_then_off(live):
    live.stand(2.0)
    stood = live.height()
    heights = []

    def is_off():
        heights.append(live.height())
        return live.on.robot.health().guard is GuardState.OFF

    wait_for(is_off)  # nobody steps the loop meanwhile
    wait_for(lambda: limp(live.on.truth()))
    assert live.height() < stood - 0.03
    low = next(i for i, height in enumerate(heights) if height < stood - 0.03)
    assert low < len(heights) - 1  # it was down before the torque went
    live.on.robot.close()
    check_report(live.on.devices())


def test_an_emergency_from_another_thread(live):
    live.stand(1.5)
    threading.Thread(target=live.supervisor.emergency, args=("red button",)).start()
    wait_for(lambda: live.supervisor.state is SafetyState.EMERGENCY)
    wait_for(lambda: limp(live.on.truth()))
    for _ in range(10):
        frame = live.on.robot.step(command_up(live))
    assert np.isfinite(frame.time)
    assert limp(live.on.truth())
    live.on.robot.close()
    check_report(live.on.devices())


def command_up(live):
    frame = live.on.robot._newest()
    return live.pipeline.step(frame, MotionCommand(mode=Mode.STAND), live.supervisor.request).command


def test_a_run_survives_a_bad_line_and_a_wall_clock_that_jumps(tmp_path, monkeypatch):
    steps = itertools.cycle((3600.0, -7200.0, 1e6))
    monkeypatch.setattr(time, "time", lambda: 1.8e9 + next(steps))
    plan = tmp_path / "faults.toml"
    kinds = {"drop_reply": 0.05, "corrupt_reply": 0.02, "duplicate_reply": 0.05, "late_reply": 0.02}
    entries = [f'[[fault]]\nkind = "{kind}"\nprobability = {p}\nstart = 4.0\n' for kind, p in kinds.items()]
    plan.write_text("".join(entries))
    options = RunOptions(
        robot="emulator", link="pty", duration=5.0, overrides=(f"devices.faults={str(plan)!r}",)
    )
    result = simulate("stand", options)
    assert result.summary["stop_reason"] == "completed"
    assert not result.summary["fell"]
    check_report(result.summary["figures"]["devices"])


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_is_killed_or_halted_leaves_no_torque_on(number, tmp_path):
    """``bluefoot run --robot hardware`` on an emulator that outlives it."""
    plan = tmp_path / "faults.toml"
    stuck = until_armed()
    plan.write_text(STUCK.format(stuck))
    emulator, options = emulator_and_options(tmp_path, plan)
    stuck += emulator.truth().time  # a plan's times count from when its line began
    command = [sys.executable, "-m", "bluefoot_mpc.cli", "run", "stand", "--robot", "hardware", *options]
    program = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_for(lambda: stands(emulator, program))
        wait_for(lambda: emulator.truth().time > stuck + 0.5)
        assert not limp(emulator.truth())
        os.kill(program.pid, number)
        wait_for(lambda: limp(emulator.truth()))
    finally:
        with contextlib.suppress(ProcessLookupError):
            program.kill()
        program.wait()
        emulator.close()
    check_report(emulator.report)


def until_armed():
    """s that a program certainly needs on this machine until its robot stands, at most."""
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", "import bluefoot_mpc.scenarios.runner"], check=True)
    return 5.0 + 4.0 * (time.monotonic() - began)


def stands(emulator, program):
    assert program.poll() is None, "the program ended"
    return emulator.truth().q[2] > 0.1


def emulator_and_options(tmp_path, plan):
    """An emulator's process of its own, and the options of a program for its ports."""
    resolved = resolve(find_scenario("stand"), RunOptions(robot="emulator"))
    model = RobotModel(resolved.parameters)
    lies = sitting(Pipeline(model, resolved.stages.control, PERIOD), model)
    devices = {**to_table(resolved.stages.devices), "faults": str(plan)}
    order = Order(
        model=to_table(model.parameters), sim=to_table(resolved.stages.sim), devices=devices, seed=0,
        joints=lies.joints.tolist(), height=lies.height, zero=time.monotonic(),
    )  # fmt: skip
    emulator = EmulatorProcess(order)
    calibration = tmp_path / "calibration.toml"
    save_calibration(Calibration.nominal(model.parameters), calibration)
    options = [
        "--port", emulator.ports["servos"][0], "--duration", "120", "--no-report",
        "--out", str(tmp_path / "run"),
        "--set", f"devices.board_port={emulator.ports['board']}",
        "--set", f"devices.calibration={calibration}",
    ]  # fmt: skip
    return emulator, options
