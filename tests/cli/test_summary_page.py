"""The page at the end of a run."""

from pathlib import Path

import pytest

from bluefoot_mpc.cli import main as entry
from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.cli.summary import summary_page
from bluefoot_mpc.scenarios import Criterion

SUMMARY = {
    "scenario": "walk",
    "seed": 3,
    "controller": "cpg",
    "gait": "trot",
    "duration_s": 20.0,
    "fell": False,
    "stop_reason": "completed",
    "distance_m": 1.234,
    "speed_ref_mps": 0.06,
    "speed_mps": 0.0587,
    "lateral_drift_m": -0.012,
    "yaw_drift_deg": 0.44,
    "roll_rms_deg": 0.321,
    "pitch_rms_deg": float("nan"),
    "roll_peak_deg": 1.5,
    "zmp_inside_fraction": None,
    "swing_clearance_median_m": 0.0123,
    "torque_rms_nm": 0.41,
    "torque_peak_nm": 1.2,
    "servo_temp_max_c": 38.25,
    "tick_us": {"p50": 612.4, "p99": 1033.0, "max": 2000.0},
    "deadline_misses": 0,
    "real_time_factor": 11.3,
    "figures": {
        "lift_off_lag": {"FL": 0.0, "FR": 0.5},
        "pushes": 3,
        "survived": True,
        "missing": None,
        "cycle_s": 0.375,
        "turned_deg": 90.0,
        "window_s": [2.0, 5.0],
    },
}


@pytest.fixture
def page(monkeypatch, capsys):
    def show(summary, criteria=(), folder=Path("runs/x"), width=100, events=()):
        outcome = Outcome(page=summary_page(summary, criteria, folder, events))
        monkeypatch.setenv("COLUMNS", str(width))
        monkeypatch.setattr(entry, "_execute", lambda words, prog: outcome)
        assert entry.main(["run", "walk"]) == 0
        return capsys.readouterr().out

    return show


def test_key_figures_with_units(page):
    text = page(SUMMARY)
    for words in (
        "walk, trot gait, 20.0 s, seed 3",
        "58.7 mm/s",
        "of 60 mm/s commanded",
        "sideways -12 mm, turned 0.4°",
        "0.32° RMS",
        "12.3 mm",
        "0.41 N·m RMS",
        "38.2 °C",
        "612 µs",
        "p99 1033",
        "11.3 x real time",
        "FL 0, FR 0.5",
        "yes",
        "0.375 s",
        "90°",
    ):
        assert words in text, text


def test_what_is_unknown_is_left_out(page):
    text = page(SUMMARY)
    assert "pitch" not in text
    assert "ZMP" not in text
    assert "missing" not in text
    assert "None" not in text
    assert "window" not in text
    assert "deadlines" not in text
    assert "nan" not in text


def test_one_page_even_when_everything_is_there(page):
    criteria = [Criterion(name=f"criterion {n}", holds=True, detail="fine") for n in range(6)]
    assert len(page(SUMMARY, criteria).splitlines()) <= 40


def test_an_empty_summary_is_a_page_too(page):
    assert "OK" in page({})


def test_the_verdict_names_each_criterion(page):
    criteria = [
        Criterion(name="stays on its feet", holds=True, detail="yes"),
        Criterion(name="roll at most 1 °", holds=False, detail="1.70 °"),
    ]
    text = page(SUMMARY, criteria)
    assert "yes  stays on its feet: yes" in text
    assert "NO   roll at most 1 °: 1.70 °" in text
    assert "FAILED" in text
    assert "OK" not in text


def test_an_early_end_says_why(page):
    criteria = [Criterion(name="stays", holds=False, detail="no")]
    text = page({**SUMMARY, "stop_reason": "stopped at 3.20 s: it fell"}, criteria)
    assert "the run ended early: stopped at 3.20 s: it fell" in text


def test_an_interrupted_run_has_not_failed(page):
    criteria = [Criterion(name="stays", holds=False, detail="interrupted")]
    text = page({**SUMMARY, "stop_reason": "interrupted"}, criteria)
    assert "INTERRUPTED" in text
    assert "FAILED" not in text


def test_no_row_wraps_on_a_terminal_of_80_columns(page):
    figures = {"lift_off_lags": [0.0, 0.4942, 0.4942, 0.0], "footfall_order": "FR RL FL RR"}
    text = page({**SUMMARY, "lateral_drift_m": -0.032, "yaw_drift_deg": -0.7, "figures": figures}, width=80)
    rows = text.split("\n\n")[1].splitlines()
    assert any("sideways -32 mm, turned -0.7°" in row for row in rows)
    assert all(row.startswith(" ") and row[1].strip() for row in rows)


def test_what_is_out_of_the_ordinary_is_told_once_a_kind(page):
    events = [
        (1.5, "mode stand -> walk"),
        (3.0, "gait trot -> walk"),
        (4.0, "trunk pose held: FL too far by 1 mm"),
        (5.0, "trunk pose held: FL too far by 2 mm"),
        (6.0, "mode walk -> safe trunk tilted 50 degrees"),
    ]
    text = page(SUMMARY, events=events)
    assert "at 4.00 s: trunk pose held: FL too far by 1 mm (repeated: 1)" in text
    assert "at 6.00 s: mode walk -> safe" in text
    assert "stand -> walk" not in text
    assert "trot -> walk" not in text
    many = page(SUMMARY, events=[(float(n), f"thing {n}") for n in range(9)])
    assert "thing 4" in many
    assert "thing 5" not in many
    assert "4 other things" in many


@pytest.mark.parametrize("name", ["report.html", "log.mcap"])
def test_files_that_exist_are_named_in_full(page, tmp_path, name):
    folder = tmp_path / ("long" * 20)
    folder.mkdir()
    (folder / name).touch()
    assert str(folder / name) in page(SUMMARY, folder=folder, width=60)
    assert "config.toml" not in page(SUMMARY, folder=folder)
