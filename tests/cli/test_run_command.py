"""``bluefoot list``, ``run`` and ``replay`` from end to end, with short runs."""

import json
import shlex
import shutil

import pytest

from bluefoot_mpc.cli.main import main

SUMMARY_KEYS = shlex.split("""
    scenario seed robot controller gait duration_s fell success stop_reason distance_m
    speed_ref_mps speed_mps
    lateral_drift_m yaw_drift_deg roll_rms_deg pitch_rms_deg roll_peak_deg pitch_peak_deg
    attitude_error_rms_deg zmp_inside_fraction zmp_margin_min_m zmp_plan_margin_min_m
    swing_clearance_median_m torque_peak_nm torque_rms_nm servo_temp_max_c energy_j cost_of_transport
    qp_failures deadline_misses tick_us real_time_factor config_sha256 versions figures
""")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    words = ["run", "walk", "--speed", "0.05", "--duration", "3", "--no-report", "--out", str(folder)]
    assert main(words) in (0, 1)
    return folder


@pytest.fixture
def command(capfd):
    def run(*words):
        status = main([*map(str, words), "--json"])
        return status, json.loads(capfd.readouterr().out)

    return run


def test_list_names_every_scenario(command):
    status, data = command("list")
    assert status == 0
    assert set(data["scenarios"]) >= {"stand", "pose", "walk", "turn", "transition", "push"}
    assert all(data["scenarios"].values())


def test_a_run_leaves_its_files_and_says_where(recorded):
    assert {file.name for file in recorded.iterdir()} == {"config.toml", "log.mcap", "summary.json"}
    summary = json.loads((recorded / "summary.json").read_text())
    assert set(SUMMARY_KEYS) <= set(summary)
    assert summary["speed_ref_mps"] == 0.05


def test_json_of_a_run_is_its_summary_and_more(command, tmp_path):
    status, data = command(
        "run", "stand", "--duration", "2", "--no-report", "--out", tmp_path / "a", "--seed", "4"
    )
    assert status == data["exit_status"]
    assert (data["scenario"], data["seed"], data["folder"]) == ("stand", 4, str(tmp_path / "a"))
    assert set(SUMMARY_KEYS) <= set(data)
    assert data["criteria"]


def test_the_configuration_of_a_run_can_be_given_back(command, recorded, tmp_path):
    words = ["--config", recorded / "config.toml", "--no-report", "--out", tmp_path / "again"]
    _, data = command("run", "walk", *words)
    first = json.loads((recorded / "summary.json").read_text())
    assert data["config_sha256"] == first["config_sha256"]
    assert data["distance_m"] == first["distance_m"]


def test_a_user_script_is_a_scenario(command, tmp_path):
    script = tmp_path / "sway.py"
    script.write_text(
        "from bluefoot_mpc import Scenario\n"
        "from bluefoot_mpc.types import MotionCommand\n"
        "class Sway(Scenario):\n"
        "    '''Stand about.'''\n"
        "    name = 'sway'\n"
        "    def command(self, time):\n"
        "        return MotionCommand()\n"
    )
    status, data = command("run", script, "--duration", "1", "--no-report", "--out", tmp_path / "out")
    assert (status, data["scenario"]) == (0, "sway")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["wlk"], ["wlk", "walk", "transition"]),
        (["nothing.py"], ["nothing.py"]),
        (["walk", "--duration", "-1"], ["--duration", "-1"]),
        (["walk", "--gait", "canter"], ["canter", "trot", "walk"]),
        (["walk", "--world", "moon"], ["moon", "flat"]),
        (["walk", "--set", "control.frobnicate=1"], ["frobnicate"]),
        (["walk", "--set", "nonsense"], ["nonsense", "section.key=value"]),
        (["walk", "--config", "missing.toml"], ["missing.toml"]),
        (["walk", "--model", "missing.toml"], ["missing.toml", "bluefoot"]),
        (["walk", "--friction", "0"], ["--friction"]),
        (["stand", "--speed", "0.1"], ["stand", "--speed"]),
    ],
)
def test_wrong_use_of_run_is_one_message_and_status_2(command, tmp_path, words, named):
    status, data = command("run", *words, "--out", tmp_path / "out")
    assert status == 2
    assert all(name in data["error"] for name in named), data["error"]
    assert not (tmp_path / "out").exists()


def test_replay_describes_and_rethinks(command, recorded):
    status, data = command("replay", recorded, "--rethink")
    assert status == 0, data
    assert data["scenario"] == "walk"
    assert data["rethink"]["equal"]
    assert data["rethink"]["ticks"] == data["frames"] == 150


def test_rethink_sees_another_controller(command, recorded, monkeypatch):
    from bluefoot_mpc.cli import replay

    original = replay.rethink

    def shifted(log, make_step):
        step = make_step()

        def moved(frame, motion, safety):
            answer = step(frame, motion, safety)
            return type(answer)(
                position=answer.position + 1e-12, speed=answer.speed, torque_limit=answer.torque_limit
            )

        return original(log, lambda: moved)

    monkeypatch.setattr(replay, "rethink", shifted)
    status, data = command("replay", recorded, "--rethink")
    assert status == 1
    assert data["rethink"]["differing"] > 0


def test_replay_writes_a_page_that_opens_offline(command, recorded, tmp_path):
    page = tmp_path / "replay.html"
    status, data = command("replay", recorded / "log.mcap", "--html", page)
    assert (status, data["html"]) == (0, str(page))
    text = page.read_text()
    assert 'src="http' not in text
    assert len(text) > 100_000


def test_a_truncated_log_gives_what_is_readable(command, recorded, tmp_path):
    whole = (recorded / "log.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) * 6 // 10])
    status, data = command("replay", cut, "--rethink")
    assert status == 2, data
    assert data["truncated"]
    assert data["rethink"]["equal"]
    assert 0 < data["frames"] < 150
    page = tmp_path / "cut.html"
    assert command("replay", cut, "--html", page)[0] == 2
    assert page.is_file()


def test_a_log_without_one_frame_is_refused(command, recorded, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes((recorded / "log.mcap").read_bytes()[:1500])
    status, data = command("replay", cut)
    assert status == 2
    assert "nothing to replay" in data["error"]


@pytest.mark.parametrize("content", [b"", b"not a log at all", b"\x89MCAP0\r\n"])
def test_what_is_no_log_is_wrong_use(command, tmp_path, content):
    file = tmp_path / "x.mcap"
    file.write_bytes(content)
    status, data = command("replay", file)
    assert status == 2
    assert str(file) in data["error"]


def test_a_page_that_cannot_be_written_is_wrong_use(command, recorded, tmp_path):
    status, data = command("replay", recorded, "--html", tmp_path / "missing" / "x.html")
    assert status == 2
    assert "cannot write" in data["error"]


def test_a_missing_log_is_wrong_use(command, tmp_path):
    status, data = command("replay", tmp_path / "none.mcap")
    assert status == 2
    assert "none.mcap" in data["error"]


def test_the_out_folder_may_exist(command, recorded, tmp_path):
    shutil.copytree(recorded, tmp_path / "copy")
    (tmp_path / "copy" / "report.html").write_text("of an earlier run")
    (tmp_path / "copy" / "notes.txt").write_text("mine")
    status, _ = command("run", "stand", "--duration", "1", "--no-report", "--out", tmp_path / "copy")
    assert status in (0, 1)
    assert not (tmp_path / "copy" / "report.html").exists()
    assert (tmp_path / "copy" / "notes.txt").exists()
