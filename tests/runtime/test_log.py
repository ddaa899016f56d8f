"""Logs that are whole, cut off, damaged, or none at all."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from bluefoot_mpc.exceptions import ConfigurationError, LogError, UnknownNameError
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.recorder import Recorder
from tests.runtime.made_up_run import CONFIG, PERIOD, frames_of, make_run, record_ticks, same


@pytest.fixture(scope="module")
def log_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    with Recorder(path, CONFIG) as recorder:
        record_ticks(recorder, make_run(60))
    return path


def test_the_folder_of_a_run_will_do(log_file: Path) -> None:
    assert len(read_log(log_file.parent).frames) == 60


def test_period_comes_from_the_frames_where_the_log_does_not_say(log_file: Path) -> None:
    assert read_log(log_file).period == PERIOD


def test_any_cut_leaves_a_readable_beginning(log_file: Path, tmp_path: Path) -> None:
    whole = log_file.read_bytes()
    run = make_run(60)
    part = tmp_path / "log.mcap"
    rng = np.random.default_rng(1)
    ends = [
        *range(200, 1000, 97),
        *rng.integers(1000, len(whole), 25),
        *range(len(whole) - 40, len(whole), 3),
    ]
    seen = set()
    for end in sorted(int(e) for e in ends):
        part.write_bytes(whole[:end])
        log = read_log(part)
        assert log.truncated
        assert all(map(same, frames_of(log), run.frames))
        assert len(log.frames) == len(log.commands) == len(log.telemetry) == len(log.truth)
        seen.add(len(log.frames))
    assert {0, 1, 26, 51, 60} == seen


def test_a_cut_is_a_warning_or_an_error_that_says_what_is_left(
    log_file: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    part = tmp_path / "log.mcap"
    whole = log_file.read_bytes()
    part.write_bytes(whole[: len(whole) * 2 // 3])
    with caplog.at_level(logging.WARNING):
        seconds = len(read_log(part).frames) * PERIOD
    assert 0.0 < seconds < 1.2
    expected = f"{part} is cut off or damaged: {seconds:.2f} s of the run are readable"
    assert expected in caplog.text
    with pytest.raises(LogError) as caught:
        read_log(part, strict=True)
    assert expected in str(caught.value)


def test_damage_is_never_taken_for_data(log_file: Path, tmp_path: Path) -> None:
    whole = log_file.read_bytes()
    run = make_run(60)
    part = tmp_path / "log.mcap"
    rng = np.random.default_rng(2)
    for _ in range(60):
        damaged = bytearray(whole)
        place = int(rng.integers(0, len(whole)))
        damaged[place] ^= 1 << int(rng.integers(0, 8))
        part.write_bytes(damaged)
        try:
            log = read_log(part)
        except LogError:
            continue
        assert all(map(same, frames_of(log), run.frames))
        assert all(map(same, log.truth, run.truth))


@pytest.mark.parametrize("content", [b"", b"\x89", b"time,roll\n0,1\n", bytes(1000)])
def test_a_file_that_is_no_log_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "figures.csv"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"figures\.csv is not a log of this package: a log is the MCAP file"):
        read_log(path)


def test_a_foreign_mcap_file_is_no_log(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(library="someone else")
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(LogError, match=r"other\.mcap is not a log"):
        read_log(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"cannot read the log .*nothing\.mcap: No such file"):
        read_log(tmp_path / "nothing.mcap")
    with pytest.raises(LogError, match=r"log\.mcap: No such file"):
        read_log(tmp_path)


def test_stacked_fields(log_file: Path) -> None:
    log, run = read_log(log_file), make_run(60)
    assert log.stack("/truth", "foot_height").shape == (60, 4)
    expected = np.array([t.estimate.rpy for t in run.telemetry])
    assert np.array_equal(log.stack("telemetry", "estimate.rpy"), expected)
    assert log.stack("telemetry", "phase.swing").dtype == np.bool_
    assert log.tick_us.shape == (60,)


def test_stacking_says_what_is_wrong(log_file: Path) -> None:
    log = read_log(log_file)
    with pytest.raises(UnknownNameError, match="Did you mean 'telemetry'"):
        log.stack("telemetri", "time")
    with pytest.raises(UnknownNameError, match="Did you mean 'foot_height'"):
        log.stack("truth", "foot_heigth")
    with pytest.raises(ConfigurationError, match=r"'imu\.gyro' differs in shape"):
        log.stack("frame", "imu.gyro")
