"""``bluefoot servo`` and ``bluefoot doctor`` on an emulator's pseudo-terminal, as a person runs them."""

import dataclasses
import io
import json
import signal
import subprocess
import sys
import time

import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.io.calibration import (
    Calibration,
    load_calibration,
    now_text,
    save_calibration,
)
from bluefoot_mpc.io.commissioning import doctor as examine
from bluefoot_mpc.io.emulation.own_shafts import ShaftConfig, bench_servo
from bluefoot_mpc.types import JOINTS
from tests.io.commissioning.bench import BAUD, ID, RETURN_DELAY, TORQUE, Bench

pytestmark = pytest.mark.slow


def run(capfd, port, *words):
    status = main([*words, "--port", port, "--json"])
    return status, json.loads(capfd.readouterr().out)


@pytest.fixture
def bench():
    made = Bench()
    with made.pty() as port:
        made.port = port
        yield made


@pytest.fixture
def calibration(tmp_path):
    file = tmp_path / "calibration.toml"
    save_calibration(dataclasses.replace(Calibration.nominal(), made=now_text()), file)
    return file


class Hands(io.StringIO):
    """Standard input of a person who turns the joint that was asked for before pressing Enter."""

    def __init__(self, bench, answers):
        super().__init__()
        self.bench, self.answers = bench, list(answers)

    def readline(self, *_):
        answer = self.answers.pop(0)
        if isinstance(answer, str):
            return answer
        joint, degrees = answer
        self.bench.turn(joint, degrees)
        return "\n"

    def isatty(self):
        return False


# scan


def test_scan_shows_every_servo(capfd, bench):
    status, data = run(capfd, bench.port, "servo", "scan")
    assert (status, data["success"], data["missing"]) == (0, True, [])
    assert [servo["id"] for servo in data["servos"]] == list(range(1, 17))
    assert data["servos"][6]["joint"] == "FR_knee"
    assert bench.line.eeprom_writes == 0
    assert set(bench.line.requests) == {1, 2}


def test_scan_is_a_table_for_people(capsys, bench):
    assert main(["servo", "scan", "--port", bench.port, "--ids", "1-3"]) == 0
    page = capsys.readouterr().out
    assert "FL_hip_pitch" in page
    assert "3 of 3 servos answer" in page


def test_scan_names_missing_and_duplicate_servos(capfd, bench):
    bench.line.servos[9].write(ID, 4)
    bench.turn(8, 25.0)
    status, data = run(capfd, bench.port, "servo", "scan")
    assert (status, data["missing"], list(data["garbled"])) == (3, [9], ["4"])
    texts = " ".join(finding["text"] for finding in data["findings"])
    assert "no reply" in texts
    assert "share this ID" in texts
    assert all(finding["mend"] for finding in data["findings"])


def test_scan_finds_the_right_baud_rate(capfd, bench):
    status, data = run(capfd, bench.port, "servo", "scan", "--baud", "115200", "--ids", "1-3")
    assert status == 3
    assert "--baud 1000000" in data["findings"][0]["mend"]
    bench.line.servos[2].write(BAUD, 3)
    status, data = run(capfd, bench.port, "servo", "scan", "--ids", "1-3", "--all-bauds")
    assert data["bauds"] == {"1000000": [1, 3], "500000": [2]}


def test_several_ports_share_the_servos(capfd):
    first, second = Bench(count=8), Bench(count=16)
    for servo in second.line.all[:8]:
        second.line.plug(servo, False, 0.0)
    with first.pty() as one, second.pty() as two:
        status, data = run(capfd, f"{one},{two}", "servo", "scan")
    assert (status, data["missing"]) == (0, [])
    assert [servo["port"] for servo in data["servos"]] == [one] * 8 + [two] * 8


# wrong ports


@pytest.mark.parametrize("command", ["scan", "setup", "calibrate", "test", "identify"])
def test_a_port_that_is_not_there_lists_those_that_are(capfd, tmp_path, command):
    words = ["--out", str(tmp_path / "out")] if command in ("calibrate", "identify") else []
    status, data = run(capfd, "/dev/ttyNone", "servo", command, *words)
    assert status == 3
    assert "no port /dev/ttyNone" in data["error"]
    assert "Ports that exist" in data["error"]


def test_a_port_without_permission_says_which_group(capfd, monkeypatch, tmp_path):
    file = tmp_path / "port"
    file.touch()
    file.chmod(0)
    # Root may open anything: the check is what is looked at here.
    monkeypatch.setattr("bluefoot_mpc.io.serial_link.os.access", lambda *_: False)
    status, data = run(capfd, str(file), "servo", "scan")
    assert status == 3
    assert "usermod -aG" in data["error"]


def test_a_busy_port_is_named(capfd, bench):
    import serial

    with serial.Serial(bench.port, 1_000_000, exclusive=True):
        status, data = run(capfd, bench.port, "servo", "scan")
    assert status == 3
    assert "busy" in data["error"]


def test_no_port_and_a_wrong_rate_are_wrong_use(capfd):
    assert main(["servo", "scan", "--json"]) == 2
    assert "--port is missing" in json.loads(capfd.readouterr().out)["error"]
    assert main(["servo", "scan", "--port", "/dev/null", "--baud", "3000000", "--json"]) == 2
    assert "no rate of an AX-12A" in json.loads(capfd.readouterr().out)["error"]
    assert main(["servo", "--json"]) == 2
    assert main(["servo", "reset"]) == 2


# setup


def test_setup_asks_before_it_writes(capfd, monkeypatch):
    bench = Bench(commissioned=False)
    with bench.pty() as port:
        monkeypatch.setattr("sys.stdin", io.StringIO(""))
        status, data = run(capfd, port, "servo", "setup", "--ids", "1-2")
        assert status == 2
        assert "--yes" in data["error"]
        assert bench.line.eeprom_writes == 0
        terminal = io.StringIO("n\n")
        terminal.isatty = lambda: True
        monkeypatch.setattr("sys.stdin", terminal)
        status, data = run(capfd, port, "servo", "setup", "--ids", "1-2")
        assert (status, bench.line.eeprom_writes) == (3, 0)
        assert "nothing was written" in data["error"]
        status, data = run(capfd, port, "servo", "setup", "--ids", "1-2", "--yes")
        assert (status, data["written"], bench.line.eeprom_writes) == (0, True, 2)
        status, data = run(capfd, port, "servo", "setup", "--ids", "1-2", "--yes")
        assert (status, data["written"], bench.line.eeprom_writes) == (0, False, 2)


def test_a_new_id_makes_the_calibration_stale(capfd, bench, calibration):
    time.sleep(1.1)  # dates are whole seconds
    words = ["--ids", "16", "--new-id", "17", "--yes", "--calibration", str(calibration)]
    status, data = run(capfd, bench.port, "servo", "setup", *words)
    assert (status, data["new_id"], data["stale_calibration"]) == (0, 17, str(calibration))
    run(capfd, bench.port, "servo", "setup", "--ids", "17", "--new-id", "16", "--yes")
    status, data = run(capfd, bench.port, "doctor", "--calibration", str(calibration), "--seconds", "0.2")
    assert status == 3
    assert any("stale" in f["text"] and "calibrate" in f["mend"] for f in data["findings"])


def test_two_servos_at_one_id_are_not_renamed(capfd, bench):
    bench.line.servos[9].write(ID, 4)
    bench.turn(8, 25.0)
    status, data = run(capfd, bench.port, "servo", "setup", "--ids", "4", "--new-id", "20", "--yes")
    assert (status, bench.line.eeprom_writes) == (3, 0)
    assert "single servo" in data["error"]


def test_servos_are_brought_to_another_rate(capfd, bench):
    status, data = run(capfd, bench.port, "servo", "setup", "--ids", "1-3", "--new-baud", "500000", "--yes")
    assert (status, data["new_baud"]) == (0, 500000)
    status, data = run(capfd, bench.port, "servo", "scan", "--baud", "500000", "--ids", "1-3")
    assert (status, len(data["servos"])) == (0, 3)


# calibrate


def test_calibrate_by_hand_and_then_all_is_well(capfd, monkeypatch, bench, tmp_path):
    file = tmp_path / "calibration.toml"
    for index in range(16):
        bench.turn(index, 3.0 * (index % 5))
    answers = ["\n"]
    for joint in range(16):
        answers += [(joint, -14.0 if joint % 2 else 14.0), "y\n"]
    monkeypatch.setattr("sys.stdin", Hands(bench, answers))
    status, data = run(capfd, bench.port, "servo", "calibrate", "--out", str(file))
    assert (status, data["success"], data["unverified"]) == (0, True, [])
    assert data["signs"] == [-1 if joint % 2 else 1 for joint in range(16)]
    assert data["offsets"][:5] == pytest.approx([0, 10, 20, 31, 41], abs=1)
    made = load_calibration(file)
    assert made.joints[3].firmware == 24
    assert all(joint.verified for joint in made.joints)
    assert bench.limp
    monkeypatch.setattr(examine, "LEAST_RATE", 1.0)  # a machine that is busy is not what is tested
    monkeypatch.setattr(examine, "_LOST_REFUSED", 1.0)
    words = ["--calibration", str(file), "--seconds", "0.3"]
    status, data = run(capfd, bench.port, "doctor", *words)
    assert (status, data["success"]) == (0, True)


def test_one_joint_is_calibrated_anew(capfd, monkeypatch, bench, calibration):
    before = load_calibration(calibration)
    for index in range(16):
        bench.turn(index, 6.0)
    monkeypatch.setattr("sys.stdin", Hands(bench, ["\n", (6, -12.0), "y\n"]))
    words = ["--out", str(calibration), "--joints", "FR_knee"]
    status, _ = run(capfd, bench.port, "servo", "calibrate", *words)
    after = load_calibration(calibration)
    assert status == 0
    assert (after.joints[6].sign, after.joints[6].offset) == (-1, 20)
    assert after.joints[5].offset == before.joints[5].offset


def test_calibrate_ends_when_nobody_answers(capfd, monkeypatch, bench, tmp_path):
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    status, data = run(capfd, bench.port, "servo", "calibrate", "--out", str(tmp_path / "c.toml"))
    assert status == 2
    assert "standard input has ended" in data["error"]
    assert not (tmp_path / "c.toml").exists()


def test_calibrate_with_yes_takes_offsets_and_verifies_nothing_new(capfd, bench, tmp_path):
    file = tmp_path / "c.toml"
    bench.turn(2, 9.0)
    status, data = run(capfd, bench.port, "servo", "calibrate", "--yes", "--out", str(file))
    assert (status, len(data["unverified"]), data["offsets"][2]) == (1, 16, 31)
    nominal = dataclasses.replace(Calibration.nominal(), made=now_text())
    save_calibration(nominal.with_joint(1, sign=-1).sealed(), file)
    status, data = run(capfd, bench.port, "servo", "calibrate", "--yes", "--out", str(file))
    assert (status, data["unverified"], data["signs"][1]) == (0, [], -1)


def test_calibrate_switches_torque_off_first(capfd, bench, tmp_path):
    for servo in bench.line.all:
        servo.write(TORQUE, 1)
    run(capfd, bench.port, "servo", "calibrate", "--yes", "--out", str(tmp_path / "c.toml"))
    assert bench.limp


def test_the_pose_is_drawn_without_a_robot(capfd):
    assert main(["servo", "calibrate", "--draw", "--json"]) == 0
    data = json.loads(capfd.readouterr().out)
    assert "from above" in data["drawing"]
    assert list(data["directions"]) == list(JOINTS)


def test_wrong_joints_and_poses_are_wrong_use(capfd):
    assert main(["servo", "calibrate", "--draw", "--joints", "FL_elbow", "--json"]) == 2
    assert "FL_knee" in json.loads(capfd.readouterr().out)["error"]
    assert main(["servo", "calibrate", "--draw", "--pose", "0,0,200,0", "--json"]) == 2
    assert "knee -90..90" in json.loads(capfd.readouterr().out)["error"]


# test


def test_servos_are_moved_and_left_limp(capfd, bench):
    status, data = run(capfd, bench.port, "servo", "test", "--ids", "1,6", "--yes")
    assert (status, data["success"], data["torque"]) == (0, True, "off")
    assert [abs(servo["asked"]) for servo in data["servos"]] == [34, 34]
    assert bench.limp
    assert bench.line.eeprom_writes == 0


def test_a_blocked_servo_is_a_failed_test(capfd):
    jammed = dataclasses.replace(bench_servo(), coulomb_friction=5.0)
    bench = Bench(configs=[ShaftConfig(), ShaftConfig(servo=jammed)])
    with bench.pty() as port:
        status, data = run(capfd, port, "servo", "test", "--ids", "1-2", "--yes")
    assert status == 1
    assert [bool(servo["fault"]) for servo in data["servos"]] == [False, True]
    assert bench.limp


@pytest.mark.parametrize("command", ["test", "identify"])
def test_nothing_moves_before_a_person_agrees(capfd, monkeypatch, bench, command):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    status, data = run(capfd, bench.port, "servo", command, "--ids", "1")
    assert status == 2
    assert "add --yes" in data["error"]
    assert set(bench.line.requests) <= {1, 2}


@pytest.mark.parametrize("command", ["test", "identify"])
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (
            lambda b: setattr(b.line.servos[3], "forced_temperature", 66.0),
            ["servo 3 (FL_knee)", "66 °C"],
        ),
        (lambda b: setattr(b.line.servos[3], "forced_voltage", 9.9), ["servo 3", "9.9 V", "Charge"]),
        (lambda b: b.line.plug(b.line.servos[3], False, 0.0), ["servo 3", "no reply", "cable"]),
        (lambda b: b.line.servos[3].write(RETURN_DELAY, 250), ["servo 3", "500 µs", "bluefoot servo setup"]),
        (lambda b: (b.line.servos[4].write(ID, 3), b.turn(3, 9.0)), ["servo 3", "two servos"]),
        (lambda b: b.line.servos[3].write(0, 18, 2), ["servo 3", "model 18"]),
    ],
)
def test_bad_servos_are_refused_before_torque(capfd, bench, tmp_path, command, spoil, words):
    spoil(bench)
    out = ["--out", str(tmp_path)] if command == "identify" else []
    status, data = run(capfd, bench.port, "servo", command, "--ids", "1-3", "--yes", *out)
    assert status == 3
    for word in ("no torque is on", *words):
        assert word in data["error"]
    assert bench.line.goal_writes_while_off == 0
    assert bench.limp


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_test_leaves_no_torque(bench, number):
    command = [sys.executable, "-m", "bluefoot_mpc.cli", "servo", "test", "--port", bench.port, "--yes"]
    with subprocess.Popen(command, stderr=subprocess.STDOUT, stdout=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 60.0
        while bench.limp and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        moved = not bench.limp
        process.send_signal(number)
        told, _ = process.communicate(timeout=60.0)
    assert moved, told
    assert process.returncode == (130 if number == signal.SIGINT else 128 + number), told
    assert bench.limp


# identify


def test_identify_writes_what_the_simulator_loads(capfd, tmp_path):
    bench = Bench(configs=[ShaftConfig(gain=1.1)])
    words = ["--ids", "1", "--yes", "--amplitudes", "6,20", "--out", str(tmp_path)]
    with bench.pty() as port:
        status, data = run(capfd, port, "servo", "identify", *words)
    assert bench.limp
    assert status == 0
    found = data["servos"][0]["fit"]
    assert found["stiffness"] == pytest.approx(1.1 * bench_servo().stiffness, rel=0.15)
    assert found["armature"] == pytest.approx(bench_servo().armature, rel=0.2)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"servo.toml", "steps.json", "servo_1.png"}
    # The same steps again give the same result, without a servo.
    words = ["--steps", str(tmp_path / "steps.json"), "--out", str(tmp_path / "again"), "--json"]
    assert main(["servo", "identify", *words]) == 0
    assert json.loads(capfd.readouterr().out)["servos"][0]["fit"] == found


def test_identify_refuses_wrong_amplitudes(capfd, bench):
    for wrong in ("a", "90", "0.1", ""):
        status, data = run(capfd, bench.port, "servo", "identify", "--yes", "--amplitudes", wrong)
        assert status == 2
        assert "amplitudes" in data["error"]
