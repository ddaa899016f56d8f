"""``bluefoot validate`` on made-up runs: what it refuses, prints and writes."""

import json

import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.evaluation import validation
from bluefoot_mpc.evaluation.validation_record import load_record
from tests.evaluation.validated import CODE, kept


@pytest.fixture
def figures(monkeypatch, tmp_path):
    """Changes of the figures that runs give; a value that is an exception is raised."""
    changes = {}

    def measure(case, seed):
        for value in changes.values():
            if isinstance(value, type):
                raise value
        return kept(case, seed) | changes

    monkeypatch.setattr(validation, "measure_validation", measure)
    monkeypatch.setattr(validation, "code_now", lambda: CODE)
    monkeypatch.setenv("BLUEFOOT_RECORDS", str(tmp_path / "records"))
    monkeypatch.chdir(tmp_path)
    return changes


def run(capfd, *words):
    status = main(["validate", "--workers", "1", *map(str, words), "--json"])
    return status, json.loads(capfd.readouterr().out)


def test_a_configuration_that_passes_leaves_a_record(figures, capfd, tmp_path):
    status, data = run(capfd)
    assert status == data["exit_status"] == 0
    assert data["passed"]
    assert data["deployable"]
    assert len(data["cases"]) == 10
    (file,) = (tmp_path / "records").glob("*.json")
    assert data["record"] == str(file)
    assert load_record(file).passed
    assert (tmp_path / "runs/validate/runs.jsonl").is_file()


def test_one_that_fails_leaves_a_record_too(figures, capfd, tmp_path):
    figures["speed_error_percent"] = 11.0
    status, data = run(capfd, "--records", tmp_path / "mine")
    assert status == 1
    assert not data["passed"]
    assert not data["deployable"]
    (file,) = (tmp_path / "mine").glob("*.json")
    assert len(load_record(file).broken) == 2


def test_a_quick_one_is_not_deployable(figures, capfd):
    status, data = run(capfd, "--quick")
    assert status == 0
    assert data["passed"]
    assert not data["deployable"]


def test_the_page_names_every_limit_and_the_record(figures, capfd, tmp_path):
    config = tmp_path / "own.toml"
    config.write_text("[safety]\nvoltage_warn = 10.9\n")
    assert main(["validate", str(config), "--workers", "1"]) == 0
    page = capfd.readouterr().out
    assert "emergency stop, emulator" in page
    assert "protocol_violations" in page
    assert "PASSED" in page
    assert f"bluefoot deploy --config {config}" in page
    figures["rest_s"] = 9.0
    assert main(["validate", str(config), "--workers", "1", "--quick", "--out", str(tmp_path / "o")]) == 1
    page = capfd.readouterr().out
    assert "FAILED: 2 limit(s)" in page
    assert "NO" in page


def test_ctrl_c_leaves_no_record_and_says_how_to_go_on(figures, capfd, tmp_path):
    figures["falls"] = KeyboardInterrupt
    assert main(["validate", "--workers", "1"]) == 130
    assert "the same command goes on" in capfd.readouterr().err
    assert not (tmp_path / "records").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["none.toml"], "cannot read none.toml"),
        (["bad.toml"], "unknown configuration section 'sections'"),
        (["a.toml", "--config", "b.toml"], "two configurations: a.toml and b.toml"),
        (["a.toml", "b.toml"], "two configurations: a.toml and b.toml"),
        (["--seeds", "0"], "seeds = 0"),
        (["--scenario-speed", "3"], "speed = 3.0"),
        (["--gait", "gallop"], "unknown gait 'gallop'"),
        (["--workers", "0"], "--workers = 0"),
        (["--controller", "lqr"], "unknown controller 'lqr'"),
        (["--sceds", "2"], "unknown option '--sceds'"),
        (["--model", "none"], "no parameter file 'none'"),
        (["--out", "bad.toml"], "cannot write to --out"),
    ],
)
def test_wrong_use_is_refused(figures, capfd, tmp_path, words, message):
    (tmp_path / "bad.toml").write_text("[sections]\na = 1\n")
    assert main(["validate", *words]) == 2
    assert message in capfd.readouterr().err


def test_a_user_may_name_the_file_as_elsewhere(figures, capfd, tmp_path):
    (tmp_path / "own.toml").write_text('[run]\ncontroller = "cpg"\n')
    _, data = run(capfd, "--config", "own.toml", "--quick")
    assert data["subject"]["controller"] == "cpg"
    _, other = run(capfd, "--controller", "cpg", "--quick")
    assert other["subject_sha256"] == data["subject_sha256"]
