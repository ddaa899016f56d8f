"""``bluefoot model``: figures, files and exit status."""

import json

import pytest

from bluefoot_mpc.cli.main import main


def run(capfd, *words):
    status = main(["model", *words, "--json"])
    return status, json.loads(capfd.readouterr().out)


def test_check_compares_the_engines(capfd):
    status, data = run(capfd, "check", "--states", "5")
    assert status == 0
    assert data["agree"]
    assert set(data["errors"]) >= {"com", "mass_matrix", "bias", "gravity", "foot_jacobians"}


def test_check_prints_a_table(capsys):
    assert main(["model", "check", "--states", "2"]) == 0
    assert "the engines agree" in capsys.readouterr().out


def test_urdf_goes_to_standard_output_or_a_file(capsys, tmp_path):
    assert main(["model", "urdf"]) == 0
    text = capsys.readouterr().out
    file = tmp_path / "sub" / "robot.urdf"
    assert main(["model", "urdf", "--out", str(file)]) == 0
    assert file.read_text() == text
    assert str(file) in capsys.readouterr().out


def test_urdf_check_notices_a_stale_file(capfd, tmp_path):
    assert run(capfd, "urdf", "--check")[0] == 0
    stale = tmp_path / "robot.urdf"
    stale.write_text("<robot/>")
    status, data = run(capfd, "urdf", "--check", "--out", str(stale))
    assert (status, data["up_to_date"]) == (1, False)


def test_urdf_that_cannot_be_written_is_wrong_use(capfd, tmp_path):
    (tmp_path / "file").touch()
    status, data = run(capfd, "urdf", "--out", str(tmp_path / "file" / "robot.urdf"))
    assert status == 2
    assert "cannot write" in data["error"]


@pytest.mark.slow
def test_rom_writes_pictures_and_the_numbers_of_the_thesis(capfd, tmp_path):
    status, data = run(capfd, "rom", "--out", str(tmp_path / "rom"))
    assert status == 0
    assert data["shift_fixed_cm"] == pytest.approx(1.4, abs=0.1)
    assert len(list((tmp_path / "rom").glob("*.png"))) == len(data["files"]) == 2


def test_power_gives_the_table_of_the_thesis(capfd):
    status, data = run(capfd, "power")
    assert status == 0
    assert data["nominal"] == pytest.approx(137.825)
    assert int(data["nominal_run_time"]) == 41


@pytest.mark.slow
def test_power_of_a_recorded_run(capfd, tmp_path):
    from bluefoot_mpc.scenarios import RunOptions
    from bluefoot_mpc.scenarios import run as run_scenario

    result = run_scenario("walk", RunOptions(duration=5.0, out=tmp_path, report=False))
    status, data = run(capfd, "power", "--log", str(tmp_path / "log.mcap"))
    assert status == 0
    # The summary integrates its measurement window, the last 1.5 s: the same power.
    assert 10.0 < data["servo_mean_power"] < 40.0
    assert data["servo_energy"] == pytest.approx(data["servo_mean_power"] * data["duration"])
    assert result.summary["energy_j"] < data["servo_energy"] < data["energy"]
    assert 60.0 < data["pooled_run_time"] < 200.0


@pytest.mark.parametrize("command", ["check", "urdf", "rom", "power"])
def test_a_missing_or_impossible_model_is_wrong_use(capfd, tmp_path, command):
    status, data = run(capfd, command, "--model", "nope")
    assert status == 2
    assert "bluefoot_large" in data["error"]
    broken = tmp_path / "broken.toml"
    broken.write_text("name = 'x'\n[legs]\nlink_length = 3\n")
    status, data = run(capfd, command, "--model", str(broken))
    assert status == 2
    assert "link_length" in data["error"]


def test_a_missing_urdf_is_told_with_the_whole_command(capsys, tmp_path):
    file = tmp_path / "mine.urdf"
    words = ["model", "urdf", "--check", "--model", "bluefoot_large", "--out", str(file)]
    assert main(words) == 1
    hint = f"bluefoot model urdf --model bluefoot_large --out {file}"
    assert f"{file} does not exist; write it with: {hint}" in capsys.readouterr().out
    assert main(hint.split()[1:]) == 0
    assert main(words) == 0
    file.write_text("<robot/>")
    assert main(words) == 1
    assert "out of date; write it anew with" in capsys.readouterr().out
