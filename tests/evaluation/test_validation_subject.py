"""What a validation is of: everything that reaches the robot, nothing of where it was tried."""

import dataclasses

import pytest

from bluefoot_mpc.evaluation import validation_subject as module
from bluefoot_mpc.evaluation.validation_subject import code_now, resolve_for_robot, subject_of
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios import RunOptions, find_scenario
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.settings import dump_toml

SHIPPED = subject_of(RunOptions())


def with_config(folder, text):
    file = folder / "own.toml"
    file.write_text(text)
    return RunOptions(config=file)


@pytest.mark.parametrize(
    "text",
    [
        '[devices]\nports = ["/dev/ttyUSB0"]\nboard_port = "/dev/ttyACM0"\ncalibration = "mine.toml"',
        '[devices]\nlink = "pty"\nlidar_port = "/dev/l"\ncamera = "0"',
        "[sim.world]\nfriction = 0.3",
        "[scenario]\nspeed = 0.5\n[drawn]\nvoltage = 11.0",
        '[run]\nscenario = "walk"\nseed = 7\ncontroller = "mpc"',
        "[safety]\nvoltage_warn = 10.8",
    ],
)
def test_place_bench_and_what_is_so_anyway_change_nothing(tmp_path, text):
    assert subject_of(with_config(tmp_path, text)).sha256 == SHIPPED.sha256


@pytest.mark.parametrize(
    "text",
    [
        "[safety]\nvoltage_warn = 10.9",
        "[devices]\nbaud = 500000",
        "[devices]\nperiod = 0.025",
        "[control.gait]\nmax_acceleration = 0.2",
        "[model.legs]\nfoot_radius = 0.02",
        '[run]\ncontroller = "cpg"',
    ],
)
def test_whatever_reaches_the_robot_counts(tmp_path, text):
    assert subject_of(with_config(tmp_path, text)).sha256 != SHIPPED.sha256


def test_a_scenario_that_changes_the_controller_is_another_configuration():
    assert subject_of(RunOptions(), find_scenario("walk")).sha256 == SHIPPED.sha256
    assert subject_of(RunOptions(), find_scenario("level")).sha256 != SHIPPED.sha256


@pytest.mark.parametrize("controller", ["mpc", "cpg"])
def test_the_written_file_runs_the_same_configuration(tmp_path, controller):
    subject = subject_of(RunOptions(controller=controller))
    subject.write(tmp_path / "c.toml")
    again = subject_of(RunOptions(config=tmp_path / "c.toml"))
    assert again == subject
    assert again.controller == controller
    resolved = resolve(find_scenario("walk"), RunOptions(config=tmp_path / "c.toml", robot="emulator"))
    assert resolved.run.controller == controller


def test_the_configuration_of_any_run_can_be_validated(tmp_path):
    ran = resolve(find_scenario("push"), RunOptions(seed=3, world="rough", randomize="standard"))
    file = tmp_path / "config.toml"
    file.write_text(dump_toml({**ran.table(), "drawn": {"voltage": 11.0}}))
    assert subject_of(RunOptions(config=file)).sha256 == SHIPPED.sha256
    resolved = resolve_for_robot(find_scenario("stand"), RunOptions(config=file))
    assert resolved.scenario.config.duration == 10.0


def test_weights_count_by_what_is_in_them(tmp_path):
    def subject(name, content):
        (tmp_path / name).write_bytes(content)
        text = f'[control.leveling]\nenabled = true\nweights = "{tmp_path / name}"'
        return subject_of(with_config(tmp_path, text))

    first = subject("a.npz", b"one").sha256
    assert subject("b.npz", b"one").sha256 == first
    assert subject("a.npz", b"two").sha256 != first
    (tmp_path / "a.npz").unlink()
    with pytest.raises(ConfigurationError, match=r"a\.npz"):
        subject_of(with_config(tmp_path, (tmp_path / "own.toml").read_text())).identity()


def test_a_wrong_file_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot read"):
        subject_of(RunOptions(config=tmp_path / "none.toml"))
    with pytest.raises(UnknownNameError, match="sections?"):
        subject_of(with_config(tmp_path, "[sections]\na = 1"))
    with pytest.raises(ConfigurationError, match="voltage_cut"):
        subject_of(with_config(tmp_path, "[safety]\nvoltage_cut = -1.0"))


def test_the_code_names_its_files_and_solvers(monkeypatch):
    code = code_now()
    assert "bluefoot_mpc/evaluation/validation.py" in code.files
    assert "models/bluefoot.toml" in code.files
    assert {"numpy", "casadi"} <= set(code.versions)
    monkeypatch.setattr(module, "source_hash", lambda: "other")
    assert code_now() == dataclasses.replace(code, source="other")
