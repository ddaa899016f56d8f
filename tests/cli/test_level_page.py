"""The terminal's table of a run in windows."""

from rich.console import Console

from bluefoot_mpc.cli.level_page import LEVEL_FIGURES, level_table
from bluefoot_mpc.cli.main import main

PART = {
    "roll_rms_deg": 2.5, "pitch_rms_deg": 2.0, "tilt_peak_deg": 7.0, "speed_mps": 0.06, "height_m": 0.12,
}  # fmt: skip
OFF = {**PART, "kind": "off", "start_s": 4.0, "end_s": 14.0, "mse": 1.5, "rate": 0.01}
ON = {**OFF, "kind": "on", "start_s": 14.0, "end_s": 24.0, "roll_rms_deg": 1.0}
BOTH = {
    "leveling": True, "windows": [OFF, ON], "off": PART, "on": {**PART, "roll_rms_deg": 1.0},
    "reduction_percent": {"roll": 60.0, "pitch": 50.0, "tilt": 55.0},
    "peak_reduction_percent": {"tilt": 40.0},
    "speed_change_percent": -1.0, "height_change_m": -0.0012,
}  # fmt: skip


def shown(figures):
    console = Console(width=80, record=True)
    console.print(level_table(figures))
    return console.export_text()


def test_windows_and_what_they_differ_by_fit_a_terminal():
    text = shown(BOTH)
    assert "…" not in text
    lines = [line.split() for line in text.splitlines()]
    assert ["4–14", "s", "off", "2.50", "2.00", "7.0", "60.0", "120.0", "1.500", "0.01000"] in lines
    assert ["change", "-60", "%", "-50", "%", "-40", "%", "-1", "%", "-1.2"] in lines


def test_what_was_not_measured_is_a_dash():
    nothing = {"reduction_percent": dict.fromkeys(("roll", "pitch", "tilt")), "speed_change_percent": None}
    text = shown({**BOTH, **nothing, "height_change_m": None})
    change = next(line for line in text.splitlines() if "change" in line)
    assert change.split()[1:] == ["–", "–", "-40", "%", "–", "–"]
    without = shown({**BOTH, "windows": [OFF], "on": {}})
    assert "change" not in without


def test_other_runs_have_no_table():
    assert level_table({"window_s": [1.0, 2.0]}) is None


def test_a_run_shows_its_windows_once(capfd, tmp_path):
    words = ["run", "level", "--level", "pd", "--duration", "8.5", "--no-report", "--out", str(tmp_path)]
    for key, value in {"start": 4, "off": 2, "on": 2}.items():
        words += ["--set", f"control.leveling.schedule.{key}={value}"]
    assert main(words) in {0, 1}
    text = capfd.readouterr().out
    assert "RMS and peak tilt by window" in text
    assert not [name for name in LEVEL_FIGURES if f"\n {name.replace('_', ' ')} " in text]
