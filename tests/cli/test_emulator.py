"""The emulator's command: a port that another program opens, until Ctrl-C."""

import json
import os
import select
import signal
import subprocess
import sys

import pytest

from bluefoot_mpc.cli.emulator_arguments import parse_ids
from bluefoot_mpc.cli.main import main
from bluefoot_mpc.exceptions import ConfigurationError

pytestmark = pytest.mark.slow

PING_7 = bytes.fromhex("ffff070201f5")
STATUS_7 = bytes.fromhex("ffff070200f6")


@pytest.mark.parametrize(
    ("text", "ids"),
    [("1-16", tuple(range(1, 17))), ("3", (3,)), ("1,2,7-9", (1, 2, 7, 8, 9)), (" 0 , 253", (0, 253))],
)
def test_ids(text, ids):
    assert parse_ids(text) == ids


@pytest.mark.parametrize("text", ["", "a", "1-", "-3", "5-2", "254", "1,1", "1-3,2", "1.5", "1-9999"])
def test_ids_that_cannot_be(text):
    with pytest.raises(ConfigurationError, match="--ids"):
        parse_ids(text)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--ids", "300"], "0..253"),
        (["--baud", "3000000"], "57600"),
        (["--baud", "-1"], "57600"),
        (["--physics", "mujoco"], "Valid: own"),
        (["--faults", "no-such-file.toml"], "no-such-file.toml"),
        (["--link", "/no/where/port"], "/no/where/port"),
        (["--port", "x"], "--link"),
    ],
)
def test_wrong_use_is_explained(words, named, capsys):
    assert main(["emulator", *words]) == 2
    assert named in " ".join(capsys.readouterr().err.split())


def test_a_fault_of_no_servo_is_wrong_use(tmp_path, capsys):
    path = tmp_path / "faults.toml"
    path.write_text('[[fault]]\nkind = "unplugged"\nservo = 20\n')
    assert main(["emulator", "--ids", "1-4", "--faults", str(path)]) == 2
    assert "no servo 20" in capsys.readouterr().err


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_told_to_stop(stop, tmp_path):
    link = tmp_path / "servos"
    process = subprocess.Popen(
        [sys.executable, "-m", "bluefoot_mpc.cli", "emulator", "--ids", "7", "--link", str(link), "--json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    with process:
        told = json.loads(process.stdout.readline())
        assert told["port"] == str(link)
        assert told["ids"] == [7]
        client = os.open(link, os.O_RDWR | os.O_NOCTTY)
        os.write(client, PING_7)
        ready, _, _ = select.select([client], [], [], 10.0)
        assert ready
        assert os.read(client, 100) == STATUS_7
        os.close(client)
        process.send_signal(stop)
        assert process.wait(10.0) == 0
        assert process.stdout.read() == ""
        assert process.stderr.read() == ""
    assert not link.is_symlink()


@pytest.mark.slow
def test_a_run_on_the_emulated_robots_ports_is_a_run_on_hardware(tmp_path):
    """The ports of one process, the drivers of another: what is between them is what a robot would have."""
    calibration = tmp_path / "calibration.toml"
    words = [sys.executable, "-m", "bluefoot_mpc.cli", "emulator", "--physics", "robot", "--json"]
    with subprocess.Popen(
        [*words, "--calibration", str(calibration)], stdout=subprocess.PIPE, text=True
    ) as emulator:
        ports = json.loads(emulator.stdout.readline())
        command = ["run", "stand", "--robot", "hardware", "--duration", "2", "--no-report", "--json"]
        settings = [f"devices.board_port={ports['board']}", f"devices.calibration={calibration}"]
        for setting in settings:
            command += ["--set", setting]
        run = subprocess.run(
            [sys.executable, "-m", "bluefoot_mpc.cli", *command, "--port", ports["servos"][0]],
            capture_output=True, text=True, timeout=120, check=False, cwd=tmp_path,
        )  # fmt: skip
        emulator.send_signal(signal.SIGINT)
        emulator.wait(timeout=20)
    assert run.returncode == 0, run.stderr
    summary = json.loads(run.stdout)
    assert summary["robot"] == "hardware"
    assert summary["stop_reason"] == "completed"
    assert summary["roll_rms_deg"] is None
