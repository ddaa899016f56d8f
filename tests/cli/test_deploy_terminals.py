"""``bluefoot deploy`` from end to end: an emulated robot behind pseudo-terminals, in real time."""

import json
import time

import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.io.calibration import Calibration, save_calibration
from bluefoot_mpc.io.commissioning import doctor
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios import RunOptions, find_scenario
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.emulated_live import EmulatorProcess
from bluefoot_mpc.scenarios.emulator_process import Order
from bluefoot_mpc.scenarios.runner import sitting
from bluefoot_mpc.settings import to_table
from tests.evaluation.validated import made_with_this_code

pytestmark = pytest.mark.slow
CONTROLLER = "cpg"


@pytest.fixture
def robot():
    """The process of an emulated robot that lies on the floor."""
    resolved = resolve(find_scenario("stand"), RunOptions(controller=CONTROLLER))
    model = RobotModel(resolved.parameters)
    posture = sitting(Pipeline(model, resolved.stages.control, 0.02), model)
    order = Order(
        model=to_table(model.parameters), sim=to_table(resolved.stages.sim),
        devices=to_table(resolved.stages.devices), seed=0, joints=posture.joints.tolist(),
        height=posture.height, zero=time.monotonic(),
    )  # fmt: skip
    process = EmulatorProcess(order)
    yield process
    process.close()
    process._process.stdout.close()


@pytest.fixture
def words(robot, tmp_path, monkeypatch):
    """The command line that deploys to it."""
    # A machine that runs tests beside this one may be too slow for any bus.
    monkeypatch.setattr(doctor, "LEAST_RATE", 1.0)
    save_calibration(Calibration.nominal(), tmp_path / "calibration.toml")
    made_with_this_code(tmp_path / "records", options=RunOptions(controller=CONTROLLER))
    (port,) = robot.ports["servos"]
    return [
        "deploy", "--port", port, "--board", robot.ports["board"], "--controller", CONTROLLER,
        "--calibration", str(tmp_path / "calibration.toml"), "--records", str(tmp_path / "records"),
        "--out", str(tmp_path / "out"), "--duration", "1", "--no-report", "--json",
    ]  # fmt: skip


def test_a_dry_run_reads_the_robot_and_moves_nothing(robot, words, capfd):
    assert main([*words, "--dry-run"]) == 0
    gates = {gate["name"]: gate for gate in json.loads(capfd.readouterr().out)["gates"]}
    assert gates["robot"]["open"]
    assert len([f for f in gates["robot"]["findings"] if f["part"].startswith("servo ")]) == 16
    robot.close()
    assert robot.report["eeprom_writes"] == 0
    assert robot.report["goal_writes_while_off"] == 0
    assert robot.report["torque_on"] == []
    assert not robot.report["power_on"]


def test_a_run_begins_behind_open_gates_and_ends_without_power(robot, words, capfd):
    # On a machine that is too busy for a bus in real time the arming refuses, as it should.
    for _ in range(3):
        status = main([*words, "--yes-i-am-at-the-robot"])
        data = json.loads(capfd.readouterr().out)
        if status != 3:
            break
        assert "not armed" in data["error"] or data["shut"] == ["robot"]
    robot.close()
    assert robot.report["eeprom_writes"] == 0
    assert not robot.report["power_on"]
    if status == 3:
        pytest.skip("this machine is too busy for a bus in real time")
    # Whether it stands well is not asked here.
    assert status in (0, 1)
    assert data["robot"] == "hardware"
    assert [gate["open"] for gate in data["gates"]] == [True] * 4
    assert robot.report["goal_writes_while_off"] >= 16


def test_a_robot_that_was_not_set_up_is_refused(robot, words, capfd, tmp_path):
    stranger = Calibration.nominal().with_joint(6, firmware=99)
    save_calibration(stranger, tmp_path / "calibration.toml")
    assert main([*words, "--yes-i-am-at-the-robot"]) == 3
    data = json.loads(capfd.readouterr().out)
    assert data["shut"] == ["robot"]
    (bad,) = [f for f in data["gates"][2]["findings"] if f["severity"] == "refusal"]
    assert bad["part"] == "servo 7 (FR_knee)"
    assert "firmware" in bad["text"]
    robot.close()
    assert robot.report["goal_writes_while_off"] == 0
