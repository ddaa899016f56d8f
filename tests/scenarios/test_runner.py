import errno
from pathlib import Path

import numpy as np
import orjson
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.replay import rethink
from bluefoot_mpc.runtime.summary import SUMMARY_KEYS, summarize
from bluefoot_mpc.scenarios import (
    Presentation,
    RunOptions,
    Scenario,
    pipeline_from_log,
    run,
    run_commanded,
    runner,
)
from bluefoot_mpc.scenarios import folder as folder_module
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import SHIPPED
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import MotionCommand, TrunkPose

pytestmark = pytest.mark.slow

SCRIPTS = Path(__file__).parents[2] / "scripts"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return run("walk", RunOptions(duration=6.0, seed=5, out=tmp_path_factory.mktemp("run")))


def test_a_run_leaves_log_summary_report_and_configuration(result):
    names = {path.name for path in result.folder.iterdir()}
    assert names == {"log.mcap", "summary.json", "report.html", "config.toml"}
    summary = orjson.loads((result.folder / "summary.json").read_bytes())
    assert list(summary) == list(SUMMARY_KEYS)
    assert summary["scenario"] == "walk"
    assert summary["seed"] == 5
    assert result.exit_status == (0 if result.success else 1)


def test_the_log_holds_the_run_bit_for_bit(result):
    log = read_log(result.folder / "log.mcap")
    assert not log.truncated
    assert log.stop_reason == "completed"
    for topic, field in (("frame", "joint_position"), ("telemetry", "estimate.position"), ("truth", "q")):
        np.testing.assert_array_equal(log.stack(topic, field), result.data.stack(topic, field))
    again = summarize(log, window=None)
    for key in SUMMARY_KEYS:
        if key != "success":
            assert again[key] == result.summary[key], key


def test_rethinking_the_log_gives_the_same_commands(result):
    log = read_log(result.folder / "log.mcap")

    def make_step():
        pipeline = pipeline_from_log(log)
        return lambda frame, motion, safety: pipeline.step(frame, motion, safety).command

    report = rethink(log, make_step)
    assert report.equal
    assert report.ticks == 300


def test_rethinking_with_other_gains_differs(result):
    log = read_log(result.folder / "log.mcap")
    log.config["control"]["tracking"]["velocity_gain"] += 0.1

    def make_step():
        pipeline = pipeline_from_log(log)
        return lambda frame, motion, safety: pipeline.step(frame, motion, safety).command

    assert not rethink(log, make_step).equal


def test_the_same_seed_gives_the_same_run_and_another_does_not(result):
    options = RunOptions(duration=6.0, seed=5)
    again = simulate("walk", options)
    np.testing.assert_array_equal(again.data.stack("truth", "q"), result.data.stack("truth", "q"))
    other = simulate("walk", RunOptions(duration=6.0, seed=6))
    assert not np.array_equal(other.data.stack("truth", "q"), result.data.stack("truth", "q"))


def test_a_resolved_configuration_repeats_the_run(result):
    again = simulate("walk", RunOptions(config=result.folder / "config.toml", seed=5))
    np.testing.assert_array_equal(again.data.stack("truth", "q"), result.data.stack("truth", "q"))


def test_a_failed_criterion_is_exit_status_1():
    slow = simulate("walk", RunOptions(duration=6.0, overrides=("control.gait.max_acceleration=0.002",)))
    assert not slow.success
    assert slow.exit_status == 1
    assert any("speed" in criterion.name and not criterion.holds for criterion in slow.criteria)


def test_an_unwritable_folder_is_named(tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(ConfigurationError, match="cannot write to --out"):
        run("stand", RunOptions(out=blocker / "run", duration=1.0))


def test_two_runs_of_the_same_second_have_a_folder_each(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(folder_module.time, "strftime", lambda _: "now")
    options = RunOptions(duration=0.1, report=False)
    folders = [run("stand", options).folder for _ in range(2)]
    assert folders == [Path("runs/now-stand"), Path("runs/now-stand-2")]
    assert all((folder / "log.mcap").is_file() for folder in folders)


def test_an_error_in_a_run_tells_where_the_log_lies(tmp_path, monkeypatch):
    def fall_apart(*_):
        raise RuntimeError("gone")

    monkeypatch.setattr(SimRobot, "truth", fall_apart)
    with pytest.raises(RuntimeError, match="gone") as caught:
        run("stand", RunOptions(duration=1.0, report=False, out=tmp_path))
    assert caught.value.__notes__ == [f"the log, as far as it goes, is in {tmp_path / 'log.mcap'}"]


def test_a_report_that_cannot_be_written_is_one_message_and_the_log_stays(tmp_path, monkeypatch):
    def half_a_page(data, summary, model, path, checks):
        path.write_text("<html>")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(runner, "write_report", half_a_page)
    with pytest.raises(ConfigurationError, match="cannot write .*report.html: No space left") as caught:
        run("stand", RunOptions(duration=1.0, out=tmp_path))
    assert "log.mcap" in caught.value.__notes__[0]
    assert {file.name for file in tmp_path.iterdir()} == {"log.mcap", "summary.json", "config.toml"}


def test_ctrl_c_while_the_report_is_written_leaves_no_half_of_it(tmp_path, monkeypatch):
    def interrupted(data, summary, model, path, checks):
        path.write_text("<html>")
        raise KeyboardInterrupt

    monkeypatch.setattr(runner, "write_report", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run("stand", RunOptions(duration=1.0, out=tmp_path))
    assert {file.name for file in tmp_path.iterdir()} == {"log.mcap", "summary.json", "config.toml"}


def test_a_paced_run_takes_its_time_and_an_unpaced_one_does_not(tmp_path):
    resolved = resolve(SHIPPED["stand"], RunOptions(duration=1.0))
    options = RunOptions(report=False, out=tmp_path)
    factors = [
        run_commanded(
            resolved.scenario.source, resolved, options, Presentation(paced=paced)
        ).data.real_time_factor
        for paced in (True, None)
    ]
    assert 0.5 < factors[0] < 1.1
    assert factors[1] > 1.5


def test_every_scenario_has_a_script_and_a_line():
    for name, scenario in SHIPPED.items():
        assert (SCRIPTS / f"{name}.py").is_file()
        assert scenario.describe().endswith(".")


def test_the_example_of_a_users_scenario_runs_and_is_short():
    script = SCRIPTS / "figure_eight.py"
    assert len(script.read_text().splitlines()) < 40
    assert simulate(str(script), RunOptions(duration=4.0)).summary["fell"] is False


class Bow(Scenario):
    """Ask for far more pitch than the legs can hold, then come back."""

    name = "bow"

    def command(self, time):
        pitch = 0.69 if 2.0 <= time < 6.0 else 0.0
        return MotionCommand(
            trunk=TrunkPose(rpy=np.array([0.0, pitch, 0.0]), position=np.array([0.08, 0.0, 0.0]))
        )


def test_a_pose_out_of_reach_is_held_at_the_last_one_in_reach(tmp_path):
    resolved = resolve(Bow, RunOptions(duration=12.0))
    data = run_commanded(resolved.scenario.source, resolved, RunOptions(out=tmp_path, report=False)).data
    events = [event for telemetry in data.telemetry for event in telemetry.events]
    assert sum("trunk pose held" in event for event in events) >= 1
    assert len(events) < 10  # said once, not on every tick
    assert data.stop_reason == "completed"
    pitch = np.degrees(data.stack("telemetry", "reference.trunk_rpy")[:, 1])
    assert 10.0 < pitch.max() < 39.0
    assert abs(pitch[-1]) < 3.0


@pytest.mark.parametrize(
    ("field", "value"), [("roll_deg", 70.0), ("forward", 0.115), ("height", 0.1), ("pitch_deg", 60.0)]
)
def test_the_pose_scenario_refuses_amplitudes_out_of_reach(field, value):
    with pytest.raises(ConfigurationError, match=rf"{field} = {value:g} is out of reach: .*(limit|reach)"):
        simulate("pose", RunOptions(overrides=(f"scenario.{field}={value}",)))


def test_a_stance_out_of_reach_is_refused():
    with pytest.raises(ConfigurationError, match="stance is out of reach: FL"):
        simulate("stand", RunOptions(overrides=("control.posture.stance_x=0.4",)))


def test_every_shipped_scenario_resolves():
    for scenario in SHIPPED.values():
        assert resolve(scenario, RunOptions()).scenario.name == scenario.name
