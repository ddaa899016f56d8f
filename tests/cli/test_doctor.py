"""``bluefoot doctor``: software without devices; every finding names part and mend."""

import json

import pytest

from bluefoot_mpc.cli import doctor_software
from bluefoot_mpc.cli.main import main
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.commissioning import doctor as examine
from bluefoot_mpc.io.emulation.board import EmulatedBoard
from bluefoot_mpc.io.emulation.lidar import EmulatedLidar
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.findings import Severity
from tests.io.board.bench import MadeUpRobot
from tests.io.commissioning.bench import Bench
from tests.io.lidar.bench import Room

pytestmark = pytest.mark.slow


def run(capfd, *words):
    status = main(["doctor", *words, "--json"])
    return status, json.loads(capfd.readouterr().out)


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


def test_software_alone_is_sound(capfd):
    status, data = run(capfd)
    parts = {finding["part"]: finding for finding in data["findings"]}
    assert status == 0
    assert {"python", "packages", "identification", "compiler", "rendering", "serial ports"} <= set(parts)
    assert parts["packages"]["severity"] == "ok"
    assert parts["servos"]["severity"] == "note"


def test_what_is_missing_is_named_with_its_mend(monkeypatch):
    monkeypatch.setattr(doctor_software, "_is_installed", lambda name: name not in ("mujoco", "tabulate"))
    monkeypatch.setenv("CC", "no-such-compiler")
    findings = {finding.part: finding for finding in doctor_software.check_software()}
    assert findings["packages"].severity is Severity.REFUSAL
    assert "mujoco" in findings["packages"].text
    assert "make setup" in findings["packages"].mend
    assert "tabulate" in findings["identification"].mend
    assert findings["compiler"].severity is Severity.WARNING
    assert "gcc" in findings["compiler"].mend


def test_a_machine_that_cannot_draw_is_noted(monkeypatch):
    monkeypatch.setattr(doctor_software, "_RENDER", "raise SystemExit('no display')")
    findings = {finding.part: finding for finding in doctor_software.check_software()}
    assert findings["rendering"].severity is Severity.NOTE
    assert "no display" in findings["rendering"].text
    assert "libegl1" in findings["rendering"].mend


def test_a_missing_calibration_refuses(capfd):
    with Bench().pty() as port:
        status, data = run(capfd, "--port", port, "--seconds", "0.2")
    assert status == 3
    (finding,) = [f for f in data["findings"] if f["part"] == "calibration"]
    assert "no calibration.toml" in finding["text"]
    assert "bluefoot servo calibrate" in finding["mend"]


def test_ports_that_are_not_there_refuse(capfd):
    words = ["--port", "/dev/ttyNone", "--board", "/dev/ttyNoBoard", "--lidar", "/dev/ttyNoLidar"]
    status, data = run(capfd, *words)
    assert status == 3
    texts = " ".join(f["text"] for f in data["findings"])
    for port in ("/dev/ttyNone", "/dev/ttyNoBoard", "/dev/ttyNoLidar"):
        assert f"no port {port}" in texts


def test_a_damaged_calibration_refuses(capfd, tmp_path):
    file = tmp_path / "c.toml"
    file.write_text("made = 3")
    status, data = run(capfd, "--calibration", str(file))
    assert status == 3
    (finding,) = [f for f in data["findings"] if f["severity"] == "refusal"]
    assert "c.toml" in finding["text"]


def test_timing_is_measured():
    bench = Bench()
    config = examine.DoctorConfig(seconds=0.5)
    findings = examine.check_bus(bench.ports(), tuple(range(1, 17)), None, "bluefoot", config)
    rate, lost = [finding for finding in findings if finding.part == "timing"]
    assert 340 <= int(rate.text.split()[0]) <= 370  # 2.7 ms of bus time without a sync write
    assert lost.text.startswith("0 of")
    assert not [f for f in findings if f.severity is Severity.REFUSAL]
    assert bench.limp


def test_a_slow_bus_is_refused():
    bench = Bench(commissioned=False, baud=115_200)
    config = examine.DoctorConfig(seconds=0.5)
    findings = examine.check_bus(bench.ports(115_200), tuple(range(1, 17)), None, "bluefoot", config)
    (rate,) = [f for f in findings if f.part == "timing" and "readings" in f.text]
    assert rate.severity is Severity.REFUSAL
    assert "latency timer" in rate.mend


def test_sensor_board_is_checked():
    clock = VirtualClock()
    board = EmulatedBoard(MadeUpRobot())
    link = MemoryLink(board, clock, 115_200, "board")
    found = examine.check_board(link, clock, examine.DoctorConfig(seconds=1.0))
    assert [f.severity for f in found] == [Severity.OK]
    assert "battery 11.40 V" in found[0].text


def test_a_silent_board_refuses():
    clock = VirtualClock()
    board = EmulatedBoard(MadeUpRobot())
    board.faults.imu_silent = True
    link = MemoryLink(board, clock, 115_200, "board")
    found = examine.check_board(link, clock, examine.DoctorConfig(seconds=1.0))
    assert any(f.severity is Severity.REFUSAL and f.mend for f in found)


def test_lidar_is_checked():
    clock = VirtualClock()
    lidar = EmulatedLidar(Room())
    assert "measures" in examine.check_lidar(MemoryLink(lidar, clock, 115_200, "lidar"), clock)[0].text
    lidar = EmulatedLidar(Room(), start=clock.now())
    lidar.silent = True
    (finding,) = examine.check_lidar(MemoryLink(lidar, clock, 115_200, "lidar"), clock)
    assert finding.severity is Severity.WARNING


@pytest.mark.parametrize("words", [["--seconds", "0"], ["--seconds", "100"]])
def test_wrong_times_are_wrong_use(capfd, words):
    assert run(capfd, *words)[0] == 2


@pytest.mark.parametrize(("volts", "severity"), [(10.4, Severity.REFUSAL), (10.7, Severity.WARNING)])
def test_a_low_pack_is_named(volts, severity):
    bench = Bench()
    bench.shafts.set_supply(volts)
    config = examine.DoctorConfig(seconds=0.2)
    findings = examine.check_bus(bench.ports(), tuple(range(1, 17)), None, "bluefoot", config)
    low = [finding for finding in findings if finding.part.startswith("servo 7 ")]
    assert [finding.severity for finding in low] == [severity]
    assert f"{volts} V" in low[0].text
    assert "pack" in low[0].mend
