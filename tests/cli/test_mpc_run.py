"""Model-based control from the command line: its files, its wrong names, and runs without a compiler."""

import json
import subprocess
import sys

import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.qp import SOLVERS


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mpc")
    words = ["run", "walk", "--controller", "mpc", "--duration", "3", "--no-report", "--out", str(folder)]
    assert main(words) in (0, 1)
    return folder


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def same_run(one, other):
    timing = ("tick_us", "real_time_factor", "deadline_misses")
    return {key: (one[key], other[key]) for key in one if one[key] != other[key] and key not in timing} == {}


def test_the_summary_counts_failures_and_late_ticks(recorded):
    summary = summary_of(recorded)
    assert summary["controller"] == "mpc"
    assert summary["qp_failures"] == 0
    assert isinstance(summary["deadline_misses"], int)


def test_the_configuration_of_a_run_brings_its_controller_along(recorded, tmp_path):
    words = ["run", "walk", "--config", str(recorded / "config.toml"), "--no-report", "--out", str(tmp_path)]
    assert main(words) in (0, 1)
    assert (tmp_path / "config.toml").read_text() == (recorded / "config.toml").read_text()
    assert same_run(summary_of(recorded), summary_of(tmp_path))


def test_another_controller_does_not_take_its_configuration(recorded, capfd):
    config = str(recorded / "config.toml")
    assert main(["run", "walk", "--controller", "cpg", "--config", config]) == 2
    said = capfd.readouterr().err
    assert "holds the configuration of the controller 'mpc'" in said
    assert "leave --controller cpg out" in said
    assert "Traceback" not in said


@pytest.mark.parametrize("key", ["control.preview.solver", "control.whole_body.problem.solver"])
def test_an_unknown_solver_is_refused_with_the_names_of_all(key, capfd, tmp_path):
    words = ["run", "walk", "--controller", "mpc", "--duration", "2", "--no-report", "--set", f"{key}=foo"]
    assert main([*words, "--out", str(tmp_path / "run")]) == 2
    said = capfd.readouterr().err
    line = next(line for line in said.splitlines() if "foo" in line)
    assert f"[{key.removesuffix('.solver')}] unknown solver 'foo'" in line
    assert all(name in line for name in SOLVERS)
    assert "Traceback" not in said
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("control.preview.law=foo", "unknown preview law 'foo'. Valid: constrained, kajita, unconstrained"),
        ("control.sway.walk=foo", "unknown control.sway.walk 'foo'. Valid: preview, static"),
        ("control.whole_body.problem.friction=-1", "friction = -1"),
        ("control.servo.mixing=1.5", "mixing = 1.5"),
    ],
)
def test_an_impossible_value_is_refused_in_a_line(override, message, capfd):
    assert main(["run", "walk", "--controller", "mpc", "--set", override]) == 2
    said = capfd.readouterr().err
    assert message in said
    assert "Traceback" not in said


@pytest.mark.slow
@pytest.mark.parametrize("how", ["BLUEFOOT_CODEGEN=off", "CC=/no/such/compiler"])
def test_without_a_compiler_the_run_is_the_same_bit_for_bit(recorded, tmp_path, how, monkeypatch):
    name, value = how.split("=")
    monkeypatch.setenv(name, value)
    monkeypatch.setenv("BLUEFOOT_CACHE", str(tmp_path / "cache"))
    words = ["-m", "bluefoot_mpc.cli", "run", "walk", "--controller", "mpc", "--duration", "3", "--no-report"]
    done = subprocess.run(
        [sys.executable, *words, "--out", str(tmp_path / "run")], capture_output=True, check=False
    )
    assert done.returncode in (0, 1), done.stderr
    assert same_run(summary_of(recorded), summary_of(tmp_path / "run"))
