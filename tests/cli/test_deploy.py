"""``bluefoot deploy``: every gate keeps the torque off, and says how to open it."""

import io
import json
from dataclasses import replace

import pytest

from bluefoot_mpc.cli import deploy as deploy_module
from bluefoot_mpc.cli import deploy_gates
from bluefoot_mpc.cli.main import main
from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.io.calibration import Calibration, save_calibration
from bluefoot_mpc.io.findings import Finding, Severity
from tests.evaluation.validated import CODE, made_up


class Terminal(io.StringIO):
    """Standard input with a person at it."""

    def isatty(self):
        return True


@pytest.fixture
def rig(monkeypatch, tmp_path):
    """A robot that is ready: what its check finds can be changed, its runs are counted."""

    class Rig:
        folder = tmp_path

        def __init__(self):
            self.found = [Finding(part="servo 1 (FL_hip_yaw)", text="AX-12A")]
            self.checked = 0
            self.ran = []

        def words(self, *words):
            ports = ("--port", "/dev/none0", "--board", "/dev/none1")
            return ["deploy", *ports, "--records", str(tmp_path / "records"), *map(str, words)]

        def calibrate(self, calibration):
            save_calibration(calibration, tmp_path / "calibration.toml")

        def answers(self, text):
            monkeypatch.setattr("sys.stdin", Terminal(text))

    rig = Rig()

    def check(config, calibration, model):
        rig.checked += 1
        assert config.ports == ("/dev/none0",)
        assert config.board_port == "/dev/none1"
        return deploy_gates.tried("robot", rig.found)

    def run(source, resolved, options):
        rig.ran.append(resolved)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(deploy_gates, "code_now", lambda: CODE)
    monkeypatch.setattr(deploy_module, "robot_gate", check)
    monkeypatch.setattr(deploy_module, "run_commanded", run)
    monkeypatch.setattr(deploy_module, "outcome_of", lambda result: Outcome(data={"exit_status": 0}))
    monkeypatch.setattr("sys.stdin", io.StringIO("yes\n"))  # a pipe, whatever it says
    rig.calibrate(Calibration.nominal())
    made_up(tmp_path / "records")
    return rig


def look(rig, capfd, *words):
    status = main([*rig.words(*words), "--json"])
    data = json.loads(capfd.readouterr().out)
    return status, {gate["name"]: gate for gate in data["gates"]}, data


def test_a_dry_run_shows_every_gate_and_step_and_moves_nothing(rig, capfd):
    status, gates, data = look(rig, capfd, "--dry-run")
    assert status == data["exit_status"] == 0
    assert {name: gate["open"] for name, gate in gates.items()} == {
        "validation": True, "calibration": True, "robot": True, "person": None,
    }  # fmt: skip
    assert "30 % torque" in data["steps"][2]
    assert rig.ran == []
    assert main(rig.words("--dry-run")) == 0
    page = capfd.readouterr().out
    assert "no gate is shut" in page
    assert "scenario 'stand', 10 s" in page


def test_a_dry_run_needs_no_port(rig, capfd, monkeypatch):
    monkeypatch.setattr(deploy_module, "robot_gate", deploy_gates.robot_gate)
    assert main(["deploy", "--dry-run", "--records", str(rig.folder / "records"), "--json"]) == 0
    gates = {gate["name"]: gate for gate in json.loads(capfd.readouterr().out)["gates"]}
    assert gates["robot"]["open"] is None
    assert "--port" in gates["robot"]["findings"][0]["mend"]


def test_a_person_who_agrees_starts_the_run(rig, capfd):
    for answer in ("yes\n", "bluefoot\n", " BlueFoot \n"):
        rig.answers(answer)
        assert main(rig.words("--scenario", "walk", "--speed", "0.05", "--json")) == 0
        assert "emergency switch" in capfd.readouterr().err
    assert len(rig.ran) == 3
    assert rig.ran[0].run.robot == "hardware"
    assert rig.ran[0].scenario.config.speed == 0.05
    assert rig.ran[0].stages.devices.ports == ("/dev/none0",)


@pytest.mark.parametrize("answer", ["no\n", "y\n", "\n", "", "bluefoot_large\n"])
def test_anything_else_keeps_the_torque_off(rig, capfd, answer):
    rig.answers(answer)
    assert look(rig, capfd)[0] == 3
    assert rig.ran == []


def test_without_a_terminal_nobody_can_agree(rig, capfd, monkeypatch):
    status, gates, _ = look(rig, capfd)
    assert status == 3
    assert "no terminal" in gates["person"]["findings"][0]["text"]
    monkeypatch.setattr("sys.stdin", None)
    assert look(rig, capfd)[0] == 3
    assert rig.ran == []
    assert main(rig.words("--yes-i-am-at-the-robot", "--json")) == 0
    assert len(rig.ran) == 1


@pytest.mark.parametrize("words", [[], ["--dry-run"], ["--yes-i-am-at-the-robot"]])
@pytest.mark.parametrize(
    ("spoil", "gate", "text", "mend"),
    [
        ("unvalidated", "validation", "never validated", "bluefoot validate"),
        ("failed", "validation", "falls ≤ 0", "bluefoot validate"),
        ("edited", "validation", "own hash", "bluefoot validate"),
        ("quick", "validation", "quick", "without --quick"),
        ("uncalibrated", "calibration", "no calibration file", "bluefoot servo calibrate"),
        ("nonsense", "calibration", "is not a TOML file", "bluefoot servo calibrate"),
        ("stale", "calibration", "stale", "bluefoot servo calibrate"),
        ("another robot", "calibration", "made for the robot 'other'", "bluefoot servo calibrate"),
        ("unverified", "calibration", "not verified", "bluefoot servo calibrate"),
        ("hot", "robot", "61 °C", "Let it cool"),
    ],
)
def test_a_shut_gate_is_named_with_its_mend(rig, capfd, spoil, gate, text, mend, words):
    rig.answers("yes\n")
    SPOILS[spoil](rig)
    status, gates, data = look(rig, capfd, *words)
    assert status == data["exit_status"] == 3
    assert data["shut"] == [gate]
    told = [f for f in gates[gate]["findings"] if f["severity"] == "refusal"]
    assert any(text in f["text"] and mend in f["mend"] for f in told), told
    assert rig.ran == []
    # The robot is not even looked at where what is on disk refuses already.
    assert rig.checked == (1 if gate == "robot" or "--dry-run" in words else 0)


def edit_record(rig):
    (file,) = (rig.folder / "records").glob("*.json")
    file.write_bytes(file.read_bytes().replace(b'"passed": true', b'"passed": false', 1))


def remake(rig, **changes):
    for file in (rig.folder / "records").glob("*.json"):
        file.unlink()
    if changes:
        made_up(rig.folder / "records", **changes)


def hot(rig):
    rig.found = [
        Finding(part="servo 7 (FR_knee)", text="61 °C", mend="Let it cool", severity=Severity.REFUSAL)
    ]


SPOILS = {
    "unvalidated": remake,
    "failed": lambda rig: remake(rig, falls=1.0),
    "edited": edit_record,
    "quick": lambda rig: remake(rig, plan=Plan(quick=True)),
    "uncalibrated": lambda rig: (rig.folder / "calibration.toml").unlink(),
    "nonsense": lambda rig: (rig.folder / "calibration.toml").write_text("counts: 12"),
    "stale": lambda rig: rig.calibrate(replace(Calibration.nominal(), setup="2026-01-01T00:00:00+00:00")),
    "another robot": lambda rig: rig.calibrate(replace(Calibration.nominal(), model="other")),
    "unverified": lambda rig: rig.calibrate(Calibration.nominal().with_joint(3, verified=False)),
    "hot": hot,
}


def test_a_changed_key_of_the_configuration_is_named(rig, capfd):
    file = rig.folder / "own.toml"
    file.write_text("[safety]\nvoltage_warn = 10.9\n")
    status, gates, _ = look(rig, capfd, "--config", file, "--dry-run")
    assert status == 3
    (finding,) = gates["validation"]["findings"]
    assert "safety.voltage_warn: 10.8 -> 10.9" in finding["text"]
    assert f"bluefoot validate {file}" in finding["mend"]


def test_faster_than_validated_is_refused(rig, capfd):
    status, gates, _ = look(rig, capfd, "--scenario", "walk", "--speed", "0.1", "--dry-run")
    assert status == 3
    assert "--scenario-speed 0.1" in gates["validation"]["findings"][0]["mend"]


def test_a_scenario_that_changes_the_controller_says_so(rig, capfd):
    words = ["--scenario", "level", "--controller", "mpc", "--speed", "0.05", "--dry-run"]
    status, gates, _ = look(rig, capfd, *words)
    assert status == 3
    note = next(f for f in gates["validation"]["findings"] if f["severity"] == "note")
    assert "control.leveling.enabled: False -> True" in note["text"]
    assert "--config" in note["mend"]


def test_another_bus_rate_is_another_configuration(rig, capfd):
    status, gates, _ = look(rig, capfd, "--baud", "500000", "--dry-run")
    assert status == 3
    assert "devices.baud: 1000000 -> 500000" in gates["validation"]["findings"][0]["text"]


def test_a_calibration_that_changes_while_a_person_is_asked_is_refused(rig, capfd, monkeypatch):
    def agree(name, what, agreed):
        rig.calibrate(Calibration.nominal().with_joint(0, sign=-1))
        return deploy_gates.tried("person", [])

    monkeypatch.setattr(deploy_module, "person_gate", agree)
    status, _, data = look(rig, capfd)
    assert status == 3
    assert data["shut"] == ["calibration"]
    assert rig.ran == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["deploy"], "--port is missing"),
        (["deploy", "--port", "/dev/none0"], "--board is missing"),
        (["deploy", "--config", "none.toml"], "cannot read none.toml"),
        (["deploy", "--scenario", "fly", "--dry-run"], "unknown scenario 'fly'"),
        (["deploy", "--baud", "3", "--dry-run"], "--baud = 3"),
        (["deploy", "--speed", "0.1", "--dry-run"], "has no option --speed"),
        (["deploy", "--yes", "--dry-run"], "unknown option '--yes'"),
    ],
)
def test_wrong_use_is_refused(rig, capfd, words, message):
    assert main(words) == 2
    assert message in capfd.readouterr().err
    assert rig.ran == []


def test_a_port_that_is_not_there_shuts_the_gate(rig, capfd, monkeypatch):
    monkeypatch.setattr(deploy_module, "robot_gate", deploy_gates.robot_gate)
    status, gates, _ = look(rig, capfd, "--dry-run")
    assert status == 3
    assert gates["robot"]["open"] is False
    assert "/dev/none0" in gates["robot"]["findings"][0]["text"]


def test_ctrl_c_at_the_question_keeps_the_torque_off(rig, capfd, monkeypatch):
    class Leaving(Terminal):
        def readline(self, size=-1):
            raise KeyboardInterrupt

    monkeypatch.setattr("sys.stdin", Leaving())
    assert main(rig.words()) == 130
    assert rig.ran == []
